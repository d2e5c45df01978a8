"""How deep rollouts put fingers into each other, and the hand into table and support, whether or not these touch.

Where the hand meets the object alone (`Task.contacts`), nothing but the policy keeps it out of itself and the ground.
"""

import copy
from collections.abc import Sequence

import mujoco
import numpy as np
from jaxtyping import Bool, Float

from envs.evaluation.rollout import Rollouts
from envs.hand_contacts import below_palm
from envs.scene import OBJECT, SPARE
from mjx_hand.pytree import pytree

DEEP = 0.005  # m, from which on an overlap is worth telling


@pytree
class Overlap:
    """Of n rollouts of t frames, how deep (m) the deepest pair is; 0 where nothing overlaps.

    Attributes:
        counted: frames that were looked at; the depths of others are 0.
        fingers: of two fingers, beyond what their geoms overlap by in the model's own posture.
        ground: of the hand and what stands still.
    """

    counted: Bool[np.ndarray, "n t"]
    fingers: Float[np.ndarray, "n t"]
    ground: Float[np.ndarray, "n t"]


def hand_overlap(rollouts: Rollouts, models: Sequence[mujoco.MjModel]) -> Overlap:
    """The overlaps in the counted frames of rollouts, from their positions alone.

    Args:
        rollouts: n rollouts.
        models: each demonstration's scene, by the numbers in `rollouts.demonstration`.
    """
    fingers, ground = np.zeros(rollouts.counted.shape), np.zeros(rollouts.counted.shape)
    for row, which in enumerate(rollouts.demonstration):
        model, still = _all_meeting(models[which])
        data = mujoco.MjData(model)
        rest = _depths(model, data)
        for frame in np.flatnonzero(rollouts.counted[row]):
            data.qpos[:] = rollouts.qpos[row, frame]
            for pair, depth in _depths(model, data).items():
                if still.isdisjoint(pair):
                    fingers[row, frame] = max(fingers[row, frame], depth - rest.get(pair, 0.0))
                else:
                    ground[row, frame] = max(ground[row, frame], depth)
    return Overlap(counted=rollouts.counted, fingers=fingers, ground=ground)


def _all_meeting(model: mujoco.MjModel) -> tuple[mujoco.MjModel, set[int]]:
    """A copy of the model in which two fingers, and the hand and what stands still, meet, and nothing else does.

    The C engine then finds overlaps many times quicker than pair by pair. Also returns the geoms that stand still.
    """
    root = model.body_rootid[model.jnt_bodyid[model.actuator_trnid[0, 0]]]
    solid = np.flatnonzero(model.geom_contype > 0)
    hand = [int(g) for g in solid if model.body_rootid[model.geom_bodyid[g]] == root]
    fixed = np.flatnonzero((model.body_weldid[model.geom_bodyid] == 0) & (model.geom_conaffinity > 0))
    still = {int(g) for g in fixed if not model.geom(g).name.startswith((SPARE, OBJECT))}
    lines = below_palm(model, hand)
    fingers = list(dict.fromkeys(line[0] for line in lines.values() if line))
    every = 2 * (2 ** len(fingers) - 1)  # a bit for each finger, and bit 0 for the hand on what stands still
    met = copy.copy(model)
    met.geom_contype[:], met.geom_conaffinity[:] = 0, 0
    for g, line in lines.items():
        own = 2 << fingers.index(line[0]) if line else 0
        met.geom_contype[g], met.geom_conaffinity[g] = own | 1, (every & ~own) if line else 0
    met.geom_conaffinity[list(still)] = 1
    for body in range(met.nbody):  # what MuJoCo looks at first
        own = slice(met.body_geomadr[body], met.body_geomadr[body] + met.body_geomnum[body])
        met.body_contype[body] = np.bitwise_or.reduce(met.geom_contype[own])
        met.body_conaffinity[body] = np.bitwise_or.reduce(met.geom_conaffinity[own])
    return met, still


def _depths(model: mujoco.MjModel, data: mujoco.MjData) -> dict[tuple[int, int], float]:
    """How deep (m) pairs of geoms overlap at the data's coordinates, those that do."""
    mujoco.mj_kinematics(model, data)
    mujoco.mj_collision(model, data)
    deepest: dict[tuple[int, int], float] = {}
    for (one, other), distance in zip(data.contact.geom.tolist(), data.contact.dist.tolist(), strict=True):
        pair = (min(one, other), max(one, other))
        deepest[pair] = max(deepest.get(pair, 0.0), -distance)
    return deepest
