"""A hand's coordinates in a scene from what its actuators are told."""

import mujoco
import numpy as np
from jaxtyping import Float


def hand_coordinates(model: mujoco.MjModel, targets: Float[np.ndarray, "*b u"]) -> Float[np.ndarray, "*b m"]:
    """The hand's coordinates (m, rad) with all targets reached, and joints that are tied to others where those say.

    Args:
        model: a scene, whose last joint is the object's free one, or a hand alone.
        targets: of its first actuators, the hand's.
    """
    hand = np.zeros((*targets.shape[:-1], _size(model)), targets.dtype)
    joints = model.actuator_trnid[: targets.shape[-1], 0]
    hand[..., model.jnt_qposadr[joints]] = targets
    for tied, leader, law in _ties(model):
        hand[..., tied] = law[0] + law[1] * hand[..., leader]
    return hand


def coordinates_per_target(model: mujoco.MjModel, count: int) -> Float[np.ndarray, "m u"]:
    """How the hand's coordinates change with each of its `count` targets; arguments as of `hand_coordinates`."""
    zero, unit = np.zeros((1, count)), np.eye(count)
    return (hand_coordinates(model, unit) - hand_coordinates(model, zero)).T


def _size(model: mujoco.MjModel) -> int:
    free = int((model.jnt_type == mujoco.mjtJoint.mjJNT_FREE).sum())
    return model.nq - 7 * free


def _ties(model: mujoco.MjModel) -> list[tuple[int, int, np.ndarray]]:
    """Coordinates that follow others: theirs, the leader's, and the coefficients."""
    pairs = zip(model.eq_obj1id, model.eq_obj2id, model.eq_data, strict=True)
    return [(int(model.jnt_qposadr[a]), int(model.jnt_qposadr[b]), law) for a, b, law in pairs]
