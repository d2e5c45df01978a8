"""Which grasp near the recorded one a hand could have carried an object in: what the engine drops was not it.

Capture is off by centimetres where a hand and an object hide each other; contacts are made or missed by millimetres. So
grasps around those that touch (`solve_grasp_poses`) are tried in the engine (`GraspRollout`). Those that keep the
object longest are changed at random and tried again: an evolution strategy.
"""

from collections.abc import Callable

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from envs.demonstrations.from_recording.grasp_pose import GraspPose, chosen, joined, unlikeliness
from envs.demonstrations.from_recording.grasp_rollout import GraspRollout, RolloutScore
from envs.demonstrations.from_recording.grasp_trajectory import Act
from envs.demonstrations.from_recording.pregrasp import pregrasp
from mjx_hand.errors import InputError
from mjx_hand.hand.joints import NUM_HINGES

_KEPT = 1 / 6  # of a generation
# Generations at most with the object fixed until it is grasped (until all that are kept carry it), and of all; and how
# many without one that is better, by what it costs, end the search that has found one, and one that has not.
_FIXED, _MOST, _SAME, _PATIENT, _BETTER = 8, 40, 3, 8, 0.01
_ANGLE, _TURN, _PLACE = 0.15, 0.1, 0.008  # rad and m by which changes differ, times one of:
_SCALES = (0.05, 0.1, 0.25, 0.5, 1.0)
_FROM_SETTLED = 0.3  # of the changed start from how the hand lay on the object, the others from what it was told
# What 1 m off its way costs, the object's and the hand's alike, and an unlikeliness of 1; losing it at once costs 1.
_OFF_WAY, _UNLIKELY = 10.0, 0.003


def search_grasp(
    act: Act,
    candidates: GraspPose,
    force: float,
    report: Callable[[str, float], None] = lambda what, share: None,
    tried: int = 240,
) -> GraspPose:
    """The grasp near the recorded one that carries the object all the way, nearest to its way and to the recording.

    Args:
        act: what was recorded.
        candidates: n, where to begin.
        force: with which the hand presses (N).
        report: told what is going on and how far it is.
        tried: grasps per generation.

    Raises:
        InputError: none does.
    """
    rollout, rng = GraspRollout(act, force, tried), np.random.default_rng(0)
    rows = np.arange(tried) % len(candidates.angles)
    scale = np.where(np.arange(tried) < len(candidates.angles), 0.0, 1.0)
    now = _changed(candidates[rows], act, scale, rng)
    fixed, best, least, since = True, 0.0, np.inf, 0
    for generation in range(_MOST):
        report("looking for a grasp that holds", min((generation + since) / (_FIXED + 2 * _SAME), 0.99))
        score = rollout.carry(now, fixed=fixed)
        cost = _cost(now, score, act)
        order = np.argsort(cost, kind="stable")[: round(_KEPT * tried)]
        best = float(score.held_share[order[0]])
        if fixed:
            fixed = bool(score.held_share[order].min() < 1.0) and generation + 1 < _FIXED
        else:
            since = 0 if cost[order[0]] < least - _BETTER else since + 1
            least = min(least, float(cost[order[0]]))
            if best == 1.0 and since >= _SAME:
                return now[int(order[0])]
            if since >= _PATIENT:
                break
        parents = rng.choice(order, tried - len(order))
        settled = rng.random(len(parents)) < _FROM_SETTLED
        starts = chosen(settled, score.settled[parents], now[parents])
        now = joined([now[order], _changed(starts, act, rng.choice(_SCALES, len(parents)), rng)])
    raise InputError(
        f"no posture near the recorded one carries the object of {act.object.mass:g} kg and friction "
        f"{act.object.friction:g} with {force:g} N to the end (the best, {100 * best:.0f} % of the way); give "
        "more force (data.recording.force), a lighter object or more friction"
    )


def _cost(grasps: GraspPose, score: RolloutScore, act: Act) -> Float[np.ndarray, "n"]:
    unlikely = unlikeliness(grasps, act.held, act.hand, act.planes, spun=act.spun)
    return 1 - score.held_share + _OFF_WAY * (score.error + score.moved) + _UNLIKELY * unlikely


def _changed(grasps: GraspPose, act: Act, scale: Float[np.ndarray, "n"], rng: np.random.Generator) -> GraspPose:
    """Each changed at random, as far as `scale` says, with no finger inside the object."""
    count, scale = len(scale), scale[:, None]
    angles = grasps.angles + scale * _ANGLE * rng.normal(size=(count, NUM_HINGES))
    turn = Rotation.from_rotvec(scale * _TURN * rng.normal(size=(count, 3)))
    changed = GraspPose(
        angles=np.clip(angles, act.hand.hinge_lower, act.hand.hinge_upper),
        rotation=(Rotation.from_matrix(grasps.rotation) * turn).as_matrix(),
        position=grasps.position + scale * _PLACE * rng.normal(size=(count, 3)),
    )
    return pregrasp(changed, act.hand, act.planes, 0.0)
