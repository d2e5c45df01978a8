"""Why a rollout failed, in a word, by rules over the object's path."""

import numpy as np
from jaxtyping import Bool, Float

from envs.evaluation.metrics import MANIP_TRANS, RAISED, final_rise, last_counted, over_counted, position_error, rises
from envs.evaluation.rollout import Rollouts

FAILURES = ("never lifted", "dropped", "rotated", "late", "strayed")
LONGEST_DELAY = 1.0  # s


def failure_reasons(rollouts: Rollouts, success: Bool[np.ndarray, "n"]) -> tuple[str, ...]:
    """A word of `FAILURES` for each rollout that `success` says has failed, "" for the others.

    The first rule that fits names the failure; frames are the counted ones, heights are above the first of them:
    - never lifted: the demonstration raises the object by 2 cm or more; it never rose by half of the demonstrated most.
    - dropped: it rose, but ends below half the height at which the demonstration ends (2 cm or more).
    - rotated: its mean position error is below 3 cm, so that only its orientation can be at fault.
    - late: against the demonstration delayed by some time of at most 1 s the mean position error is below 3 cm.
    - strayed: none of these; it was held, but elsewhere.
    """
    rows, end = np.arange(len(success)), last_counted(rollouts)
    achieved, final = rises(rollouts, rollouts.object_pose), final_rise(rollouts)
    highest = np.where(rollouts.counted, rises(rollouts, rollouts.object_reference), -np.inf).max(axis=1)
    reached = np.where(rollouts.counted, achieved, -np.inf).max(axis=1)
    never_lifted = (highest >= RAISED) & (reached < highest / 2)
    dropped = (final >= RAISED) & (achieved[rows, end] < final / 2)
    rotated = over_counted(position_error(rollouts), rollouts) < MANIP_TRANS["translation"]
    late = _least_delayed_error(rollouts) < MANIP_TRANS["translation"]
    rules = np.stack([never_lifted, dropped, rotated, late, np.ones_like(late)])
    first = np.argmax(rules, axis=0)
    return tuple("" if good else FAILURES[k] for good, k in zip(success, first, strict=True))


def _least_delayed_error(rollouts: Rollouts) -> Float[np.ndarray, "n"]:
    """Mean position error (m) against the reference delayed by the best time of 1 frame to 1 s."""
    rows, frames = np.arange(len(rollouts.counted))[:, None], np.arange(rollouts.counted.shape[1])
    first = np.argmax(rollouts.counted, axis=1)[:, None]
    errors = []
    for delay in range(1, max(1, round(LONGEST_DELAY * rollouts.fps)) + 1):
        reference = rollouts.object_reference[rows, np.maximum(frames - delay, first), :3]
        distance = np.linalg.norm(rollouts.object_pose[..., :3] - reference, axis=-1)
        errors.append(over_counted(distance, rollouts))
    return np.min(errors, axis=0)
