"""Videos of rollouts: the demonstration and the twin side by side."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from envs.evaluation import Evaluation
from envs.rollout import Rollouts
from envs.scene import demonstration_model
from mjx_hand.view.renderer import RendererUnavailable
from mjx_hand.view.report import Film
from mjx_hand.view.video import beside, render_frames, write_video
from train.experiment import World

_RATE = 25.0  # frames a second


def median_and_worst(evaluations: Mapping[int, Evaluation]) -> dict[str, tuple[int, int]]:
    """Seed and number of the "median" and the "worst" rollout of several seeds by tracking error.

    A failure is worse than any success, however small its tracking error.
    """
    places = [(seed, k) for seed, e in evaluations.items() for k in range(len(e.demonstration))]
    errors = np.concatenate([e.scores["tracking_error_cm"] for e in evaluations.values()])
    failed = np.array([bool(reason) for e in evaluations.values() for reason in e.failure])
    median = np.argsort(errors, kind="stable")[len(errors) // 2]
    return {"median": places[median], "worst": places[np.lexsort((errors, failed))[-1]]}


def film(world: World, rollouts: Rollouts, index: int, path: Path, caption: str) -> Film:
    """The video of rollout `index` for a page; where this machine cannot render, the reason."""
    try:
        side_by_side(world, rollouts, index, path)
    except RendererUnavailable as error:
        return Film(None, caption, str(error))
    return Film(path, caption)


def side_by_side(world: World, rollouts: Rollouts, index: int, path: str | Path) -> None:
    """Write an MP4 of rollout `index`: left what was demonstrated, right what the twin did.

    Raises:
        RendererUnavailable: this machine cannot render.
    """
    which = int(rollouts.demonstration[index])
    demonstration = world.demonstrations[which]
    model = demonstration_model(demonstration, world.hands[which], visual=True)
    frames = np.flatnonzero(rollouts.counted[index])[:: max(round(rollouts.fps / _RATE), 1)]
    targets = np.asarray(world.env.reference.targets)[which]
    wanted = np.concatenate([targets[frames], rollouts.object_reference[index, frames]], axis=1)
    done = rollouts.qpos[index, frames]
    size = (480, 480)
    left = render_frames(model, wanted, size=size, caption="demonstration")
    right = render_frames(model, done, watched=wanted, size=size, caption="twin")
    write_video(path, beside(left, right), rollouts.fps / max(round(rollouts.fps / _RATE), 1))
