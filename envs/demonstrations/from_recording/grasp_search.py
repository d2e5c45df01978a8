"""Which holding near the recorded one a hand could have carried an object in: what the engine drops was not it.

Capture is off by centimetres where a hand and an object hide each other; contacts are made or missed by millimetres. So
holdings around those that touch (`holding.solve_holdings`) are tried in the engine (`carrying.Carrying`). Those that
keep the object longest are changed at random and tried again: an evolution strategy.
"""

from collections.abc import Callable

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from envs.demonstrations.from_recording.grasp_pose import Holding, chosen, joined, unlikeliness
from envs.demonstrations.from_recording.grasp_rollout import Carried, Carrying
from envs.demonstrations.from_recording.grasp_trajectory import Act
from envs.demonstrations.from_recording.pregrasp import opened
from mjx_hand.errors import InputError
from mjx_hand.hand.joints import NUM_HINGES

_KEPT = 1 / 6  # of a generation
_FIXED, _FEWEST, _MOST = 8, 16, 40  # generations: object fixed until it is grasped, and of all
_ANGLE, _TURN, _PLACE = 0.15, 0.1, 0.008  # rad and m by which changes differ, times one of:
_SCALES = (0.05, 0.1, 0.25, 0.5, 1.0)
_FROM_SETTLED = 0.3  # of the changed start from how the hand lay on the object, the others from what it was told
_OFF_WAY, _UNLIKELY = 10.0, 0.003  # what 1 m off the way and an unlikeliness of 1 cost; losing it at once costs 1


def firmest(
    act: Act,
    candidates: Holding,
    force: float,
    report: Callable[[str, float], None] = lambda what, share: None,
    tried: int = 240,
) -> Holding:
    """The holding near the recorded one that carries the object all the way, nearest to its way and to the recording.

    Args:
        act: what was recorded.
        candidates: n, where to begin.
        force: with which the hand presses (N).
        report: told what is going on and how far it is.
        tried: holdings a generation.

    Raises:
        InputError: none does.
    """
    carrying, rng = Carrying(act, force, tried), np.random.default_rng(0)
    rows = np.arange(tried) % len(candidates.angles)
    scale = np.where(np.arange(tried) < len(candidates.angles), 0.0, 1.0)
    now, best = _changed(candidates[rows], act, scale, rng), 0.0
    for generation in range(_MOST):
        report("looking for a grasp that holds", min(generation / (_FEWEST + 1), 0.99))
        carried = carrying.carry(now, fixed=generation < _FIXED)
        order = np.argsort(_cost(now, carried, act), kind="stable")[: round(_KEPT * tried)]
        best = float(carried.kept[order[0]])
        if generation >= _FEWEST and best == 1.0:
            return now[int(order[0])]
        parents = rng.choice(order, tried - len(order))
        settled = rng.random(len(parents)) < _FROM_SETTLED
        starts = chosen(settled, carried.settled[parents], now[parents])
        now = joined([now[order], _changed(starts, act, rng.choice(_SCALES, len(parents)), rng)])
    raise InputError(
        f"no posture near the recorded one carries the object of {act.thing.mass:g} kg and friction "
        f"{act.thing.friction:g} with {force:g} N to the end (the best, {100 * best:.0f} % of the way); give "
        "more force (data.recording.force), a lighter object or more friction"
    )


def _cost(holdings: Holding, carried: Carried, act: Act) -> Float[np.ndarray, "n"]:
    unlikely = unlikeliness(holdings, act.held, act.hand, act.planes)
    return 1 - carried.kept + _OFF_WAY * carried.error + _UNLIKELY * unlikely


def _changed(holdings: Holding, act: Act, scale: Float[np.ndarray, "n"], rng: np.random.Generator) -> Holding:
    """Each changed at random, as far as `scale` says, with no finger inside the object."""
    count, scale = len(scale), scale[:, None]
    angles = holdings.angles + scale * _ANGLE * rng.normal(size=(count, NUM_HINGES))
    turn = Rotation.from_rotvec(scale * _TURN * rng.normal(size=(count, 3)))
    changed = Holding(
        angles=np.clip(angles, act.hand.hinge_lower, act.hand.hinge_upper),
        rotation=(Rotation.from_matrix(holdings.rotation) * turn).as_matrix(),
        position=holdings.position + scale * _PLACE * rng.normal(size=(count, 3)),
    )
    return opened(changed, act.hand, act.planes, 0.0)
