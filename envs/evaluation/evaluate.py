"""`evaluate`: all metrics of a set of rollouts, one number per rollout and one row per metric."""

import dataclasses
from collections.abc import Mapping, Sequence

import numpy as np
from jaxtyping import Bool, Int, Shaped

from envs.evaluation import metrics
from envs.evaluation.failure import FAILURES, failure_reasons
from envs.evaluation.rollout import Rollouts
from envs.tracking import TrackingEnv
from mjx_hand.bodies.human_body import HUMAN_PALM
from mjx_hand.errors import InputError
from mjx_hand.hand.joints import FINGERS, LINKS
from mjx_hand.objects.description import ObjectDescription


@dataclasses.dataclass(frozen=True)
class Evaluation:
    """What n rollouts scored.

    Attributes:
        demonstration: which demonstration each rollout followed.
        scores: metric name to its value for each rollout: success as bool, `add_auc` 0 to 1, errors in the unit that
            ends their name. `hold` is there only where the rollouts went on after the demonstration, and where any
            demonstration ends with its object raised; `kept` is `chord`, and `hold` where it is there.
        failure: why each rollout failed `manip_trans_object` (a word of `failure.FAILURES`), "" where it did not.
        lost: the first counted frame in which each rollout's object was 3 cm or 30° from its way, -1 where it never
            was; empty where it was not looked for.
    """

    demonstration: Int[np.ndarray, "n"]
    scores: Mapping[str, Shaped[np.ndarray, "n"]]
    failure: tuple[str, ...]
    lost: tuple[int, ...] = ()

    def rows(self, where: Bool[np.ndarray, "n"] | None = None) -> dict[str, float]:
        """Metric name to its mean over all rollouts, or over those of `where`.

        Raises:
            InputError: `where` selects none.
        """
        chosen = np.ones(len(self.demonstration), bool) if where is None else where
        if not chosen.any():
            raise InputError("no rollout is selected; give a mask with at least one True")
        return {name: float(np.mean(values[chosen])) for name, values in self.scores.items()}

    def failure_shares(self) -> dict[str, float]:
        """Reason to its share of all rollouts."""
        return {reason: self.failure.count(reason) / len(self.failure) for reason in FAILURES}


def evaluate(
    rollouts: Rollouts, objects: Sequence[ObjectDescription], palm: tuple[int, int, int] = HUMAN_PALM
) -> Evaluation:
    """Score rollouts by every metric.

    Args:
        rollouts: n rollouts; `hold` is scored where any has `held` frames and any object is to end raised.
        objects: each demonstration's object, by the numbers in `rollouts.demonstration`.
        palm: three of the joint centres that span the palm (`Body.palm`).

    Raises:
        InputError: no rollouts, a rollout without counted frames or with NaN in one, a demonstration without an object,
            or less than 5 s of `held` frames.
    """
    _check(rollouts, len(objects))
    success = metrics.manip_trans_object(rollouts)
    scores = {
        "manip_trans_object": success,
        "manip_trans_full": metrics.manip_trans_full(rollouts),
        **({"manip_trans_frames": metrics.manip_trans_frames(rollouts)} if _is_human(rollouts) else {}),
        "spider": metrics.spider(rollouts),
        "chord": metrics.chord(rollouts),
        "add_auc": metrics.add_auc(rollouts, objects),
    }
    if rollouts.held.any() and (metrics.final_rise(rollouts) >= metrics.RAISED).any():
        scores["hold"] = metrics.hold(rollouts, palm)
    scores["kept"] = scores["chord"] & scores.get("hold", True)
    turned, moving = np.rad2deg(metrics.rotation_error(rollouts)), metrics.moving(rollouts)
    grip = metrics.over(metrics.grip_force(rollouts), moving)
    scores |= {
        "tracking_error_cm": metrics.tracking_error(rollouts),
        "moving_error_cm": 100 * metrics.over(metrics.position_error(rollouts), moving),
        "object_rotation_error_deg": metrics.over_counted(turned, rollouts),
        "moving_rotation_error_deg": metrics.over(turned, moving),
        "joint_error_cm": 100 * metrics.over_counted(metrics.joint_error(rollouts), rollouts),
        "grip_force_newton": grip,
        "grip_force_ratio": grip / rollouts.least_force,
        "tip_error_cm": 100 * metrics.over_counted(metrics.tip_error(rollouts), rollouts),
    }
    return Evaluation(
        demonstration=rollouts.demonstration,
        scores=scores,
        failure=failure_reasons(rollouts, success),
        lost=metrics.lost(rollouts),
    )


def evaluate_in(env: TrackingEnv, rollouts: Rollouts) -> Evaluation:
    """`evaluate`, of rollouts of an environment's demonstrations and hand."""
    return evaluate(rollouts, [demonstration.object for demonstration in env.demonstrations], env.body.palm)


def _is_human(rollouts: Rollouts) -> bool:
    """Whether joint centres and tips are those of MANO's layout, which some bounds are given for one by one."""
    return (rollouts.joints.shape[2], rollouts.tips.shape[2]) == (len(LINKS), len(FINGERS))


def _check(rollouts: Rollouts, num_objects: int) -> None:
    if len(rollouts.demonstration) == 0:
        raise InputError("there are no rollouts to evaluate; roll out at least one")
    empty = ~rollouts.counted.any(axis=1)
    if empty.any():
        raise InputError(f"rollout {int(np.argmax(empty))} has no counted frames; mark its demonstration's frames")
    lowest, highest = int(rollouts.demonstration.min()), int(rollouts.demonstration.max())
    if lowest < 0 or highest >= num_objects:
        raise InputError(
            f"rollouts follow demonstrations {lowest} to {highest}, but {num_objects} objects are given; "
            "give one object a demonstration"
        )
    used = rollouts.counted | rollouts.held
    for name in ("object_pose", "object_reference", "joints", "joints_reference", "tips", "tips_reference", "contact"):
        values = getattr(rollouts, name)
        frames = rollouts.counted if name.endswith("reference") else used
        finite = np.isfinite(values).reshape(*frames.shape, -1).all(axis=-1)
        bad = (frames & ~finite).any(axis=1)
        if bad.any():
            raise InputError(
                f"{name} of rollout {int(np.argmax(bad))} has NaN or infinity; "
                "the simulation diverged there, so raise the solver's iterations or lower its time step"
            )
