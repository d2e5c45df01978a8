"""The policies of several seeds on demonstrations that they have not seen, beside three baselines that do not learn.

The baselines are one constant press for each grasp type, the best on training demonstrations
(`envs.evaluation.constant_press`); the same reference with a residual of zero; and the demonstration replayed as it is.
They do not depend on the seed and are rolled out once; so is everything compiled.
"""

import dataclasses
import os
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from jaxtyping import Float

from envs.evaluation.constant_press import constant_press, search_press
from envs.evaluation.evaluate import Evaluation, evaluate_in
from envs.evaluation.overlap import Overlap, hand_overlap
from envs.evaluation.roll_out import make_roll_out, zero_residual
from envs.evaluation.rollout import Rollouts
from envs.tracking import TrackingEnv
from mjx_hand.errors import InputError
from mjx_hand.progress import counter
from train.experiment.setup import chosen_checkpoint, load_env, without_grip
from train.learning.checkpoint import Checkpoint, load_checkpoint
from train.learning.policy import deterministic_policy
from train.learning.run_folder import BEST
from train.settings.config import Config
from train.settings.saved import differing, policy_settings

HOLD = 5.0  # s after the demonstration, for the hold metric
POLICY, PRESS, ZERO, REPLAY = "policy", "constant press", "zero residual", "demonstration alone"
BASELINES = (PRESS, ZERO, REPLAY)
PART_WORDS = {
    "train": "training demonstrations",
    "heldout": "held-out demonstrations",
    "sealed": "demonstrations of the sealed part",
}


@dataclasses.dataclass(frozen=True)
class Results:
    """Rollouts and their scores, by column title, of one seed's policy and the baselines.

    Attributes:
        env: what they were rolled out in.
        checkpoint: the policy.
        rollouts, evaluations: by column title.
        press: how hard the constant press is, in words, by grasp type.
        overlaps: how deep the hand was in itself and the ground, by column title.
    """

    env: TrackingEnv
    checkpoint: Checkpoint
    rollouts: Mapping[str, Rollouts]
    evaluations: Mapping[str, Evaluation]
    press: Mapping[str, str]
    overlaps: Mapping[str, Overlap]


def evaluate_seeds(configs: Sequence[Config]) -> dict[int, Results]:
    """Roll out each seed's policy and the baselines on the part that the configuration names and score them, by seed.

    Args:
        configs: an experiment with one seed after the other, as `train.settings.config.expand_seeds` makes them.

    Raises:
        InputError: a seed without a checkpoint, or with one of another task.
    """
    for config in configs:
        _check_trained(config)
        if others := differing(policy_settings(configs[0]), policy_settings(config)):
            raise InputError(
                f"seeds {configs[0].seed} and {config.seed} were trained with other {', '.join(others)}; evaluate each "
                "alone"
            )
    part = configs[0].part
    env = load_env(configs[0], part)
    checkpoints = {config.seed: chosen_checkpoint(config, env.observation_size, env.action_size) for config in configs}
    policy = deterministic_policy(configs[0].ppo, env.observation_size, env.action_size)
    rollouts: dict[int | str, Rollouts] = {}
    with counter(len(configs) + len(BASELINES) + 1, "evaluating (sets of rollouts)") as advance:
        strengths = search_press(env if part == "train" else load_env(configs[0], "train"), HOLD)
        advance(1)
        roll_out = make_roll_out(env, policy, HOLD)
        for seed, checkpoint in checkpoints.items():
            rollouts[seed] = roll_out(checkpoint.policy)
            advance(1)
        press, roll_out = constant_press(env), make_roll_out(env, zero_residual, HOLD)
        given = {PRESS: press.tables(strengths), ZERO: env.tables, REPLAY: without_grip(env)}
        for title in BASELINES:
            rollouts[title] = roll_out(None, given[title])
            advance(1)
    scores = {key: evaluate_in(env, each) for key, each in rollouts.items()}
    overlaps = {key: hand_overlap(each, env.models) for key, each in rollouts.items()}
    keys = {seed: {POLICY: seed, **{title: title for title in BASELINES}} for seed in checkpoints}
    return {
        seed: Results(
            env,
            checkpoint,
            {title: rollouts[key] for title, key in keys[seed].items()},
            {title: scores[key] for title, key in keys[seed].items()},
            press.described(strengths),
            {title: overlaps[key] for title, key in keys[seed].items()},
        )
        for seed, checkpoint in checkpoints.items()
    }


def evaluate_checkpoint(config: Config) -> Results:
    """The results of one seed, as `evaluate_seeds`."""
    return evaluate_seeds([config])[config.seed]


def median_and_worst(evaluations: Mapping[int, Evaluation]) -> dict[str, tuple[int, int]]:
    """Seed and number of the "median" and the "worst" rollout of several seeds by tracking error.

    A failure is worse than any success, however small its tracking error.
    """
    places = [(seed, k) for seed, e in evaluations.items() for k in range(len(e.demonstration))]
    errors = np.concatenate([e.scores["tracking_error_cm"] for e in evaluations.values()])
    failed = np.array([bool(reason) for e in evaluations.values() for reason in e.failure])
    median = middle(errors)
    return {"median": places[median], "worst": places[np.lexsort((errors, failed))[-1]]}


def middle(values: Float[np.ndarray, "n"]) -> int:
    """Where the median stands, of an even number the greater of two."""
    return int(np.argsort(values, kind="stable")[len(values) // 2])


def shared_folder(configs: Sequence[Config]) -> Path:
    """Where results of all these seeds go: the seed's own folder, or the one above those of several."""
    return Path(os.path.commonpath([config.out for config in configs]))


def _check_trained(config: Config) -> None:
    """Refuse a missing checkpoint before the environment is built."""
    best = Path(config.out) / BEST
    if config.checkpoint:
        load_checkpoint(config.checkpoint)
    if not config.checkpoint and not best.is_file():
        elsewhere = "" if config.out == f"outputs/{config.name}/seed{config.seed}" else f" out={config.out}"
        experiment = f"data.folder={config.data.folder}" if config.data.folder else f"config={config.name}"
        raise InputError(
            f"seed {config.seed} of {config.name!r}: no such checkpoint: {best}; train it first, with the options "
            f"given here: python -m train.ppo {experiment} seed={config.seed}{elsewhere}"
        )
