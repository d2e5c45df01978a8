"""How deep rollouts put fingers into each other, and the hand into table and support, whether or not these touch.

Where the hand meets the object alone (`Task.contacts`), nothing but the policy keeps it out of itself and the ground.
"""

import itertools
from collections.abc import Sequence

import mujoco
import numpy as np
from jaxtyping import Bool, Float, Int

from envs.evaluation.rollout import Rollouts
from envs.hand_contacts import finger_pairs
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
        model = models[which]
        data, pairs = mujoco.MjData(model), _pairs(model)
        between = np.concatenate(pairs)
        mujoco.mj_kinematics(model, data)
        rest = _depths(model, data, pairs[0])
        for frame in np.flatnonzero(rollouts.counted[row]):
            data.qpos[:] = rollouts.qpos[row, frame]
            mujoco.mj_kinematics(model, data)
            depths = _depths(model, data, between)
            fingers[row, frame] = max(0.0, (depths[: len(rest)] - rest).max(initial=0.0))
            ground[row, frame] = depths[len(rest) :].max(initial=0.0)
    return Overlap(counted=rollouts.counted, fingers=fingers, ground=ground)


def _pairs(model: mujoco.MjModel) -> tuple[Int[np.ndarray, "f 2"], Int[np.ndarray, "g 2"]]:
    """Geoms of two fingers each, and of the hand and what stands still."""
    hand_root = model.body_rootid[model.jnt_bodyid[model.actuator_trnid[0, 0]]]
    solid = model.geom_contype > 0
    hand = [g for g in np.flatnonzero(solid) if model.body_rootid[model.geom_bodyid[g]] == hand_root]
    fixed = np.flatnonzero((model.body_weldid[model.geom_bodyid] == 0) & (model.geom_conaffinity > 0))
    named = [g for g in fixed if not model.geom(g).name.startswith((SPARE, OBJECT))]
    ground = list(itertools.product(hand, named))
    return np.array(finger_pairs(model, hand), int).reshape(-1, 2), np.array(ground, int).reshape(-1, 2)


def _depths(model: mujoco.MjModel, data: mujoco.MjData, pairs: Int[np.ndarray, "p 2"]) -> Float[np.ndarray, "p"]:
    """How deep (m) each pair of geoms overlaps, 0 where apart."""
    return np.array([max(0.0, -mujoco.mj_geomDistance(model, data, *pair, 0.001, None)) for pair in pairs.tolist()])
