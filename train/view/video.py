"""Videos of rollouts: the demonstration and the twin side by side."""

from pathlib import Path

import numpy as np

from envs.evaluation.contact_arrows import contact_arrows
from envs.evaluation.rollout import Rollouts
from envs.scene import demonstration_spec
from envs.tracking import TrackingEnv
from mjx_hand.bodies.coordinates import hand_coordinates
from mjx_hand.view.report import Film
from mjx_hand.view.video.renderer import RendererUnavailable
from mjx_hand.view.video.video import beside, render_frames, write_video

_RATE = 25.0  # frames a second


def film(env: TrackingEnv, rollouts: Rollouts, index: int, path: Path, caption: str) -> Film:
    """The video of rollout `index` for a page; where this machine cannot render, the reason."""
    try:
        side_by_side(env, rollouts, index, path)
    except RendererUnavailable as error:
        return Film(None, caption, str(error))
    return Film(path, caption)


def side_by_side(env: TrackingEnv, rollouts: Rollouts, index: int, path: str | Path) -> None:
    """Write an MP4 of rollout `index`: left what was demonstrated, right what the twin did, its
    links' forces on the object as arrows of 5 mm/N.

    Raises:
        RendererUnavailable: this machine cannot render.
    """
    which = int(rollouts.demonstration[index])
    demonstration = env.demonstrations[which]
    model = demonstration_spec(demonstration, env.hands[which], visual=True).compile()
    frames = np.flatnonzero(rollouts.counted[index])[:: max(round(rollouts.fps / _RATE), 1)]
    targets = np.asarray(env.reference.targets)[which]
    wanted = np.concatenate(
        [hand_coordinates(model, targets[frames]), rollouts.object_reference[index, frames]], axis=1
    )
    done = rollouts.qpos[index, frames]
    size = (480, 480)
    left = render_frames(model, wanted, size=size, caption="demonstration")
    pressed = contact_arrows(rollouts, index, frames)
    right = render_frames(model, done, watched=wanted, arrows=pressed, size=size, caption="twin, and how it presses")
    write_video(path, beside(left, right), rollouts.fps / max(round(rollouts.fps / _RATE), 1))
