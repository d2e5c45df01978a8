"""The same act by the other hand: motions and demonstrations reflected in x, exactly, and back.

A reflection S = diag(-1, 1, 1) takes a rotation R to S R S, a quaternion (w, x, y, z) to (w, x, -y, -z). Hinge angles
and shape coefficients stay as they are, because the other hand's axes and shapes are mirrored (`mjx_hand.rigid.axes`).
"""

import numpy as np
from jaxtyping import Float

from mjx_hand.motion.demonstration import Demonstration
from mjx_hand.motion.motion import Motion
from mjx_hand.pytree import replace

_PLACE, _TURN, _AXIS = np.array([-1.0, 1, 1]), np.array([1.0, 1, -1, -1]), np.array([1.0, -1, -1])
_MATRIX = np.outer(_PLACE, _PLACE)
_OTHER = {"right": "left", "left": "right"}


def mirrored_pose(pose: Float[np.ndarray, "*t 7"]) -> Float[np.ndarray, "*t 7"]:
    """Positions (m) and quaternions wxyz reflected in x."""
    return pose * np.concatenate([_PLACE, _TURN])


def mirrored_motion(motion: Motion) -> Motion:
    """The motion of the other hand that is its mirror image in x."""
    offsets = {
        name: None if value is None else value * _PLACE
        for name, value in (("link_offset", motion.link_offset), ("tip_offset", motion.tip_offset))
    }
    return replace(
        motion,
        rotations=motion.rotations * _MATRIX,
        wrist_position=motion.wrist_position * _PLACE,
        wrist_quaternion=motion.wrist_quaternion * _TURN,
        side=_OTHER[motion.side],
        **offsets,
    )


def mirrored_demonstration(demonstration: Demonstration) -> Demonstration:
    """The demonstration's mirror image in x: the other hand with the mirrored object on mirrored supports."""
    d = demonstration
    own = {} if d.hinge_axis is None else {"hinge_axis": d.hinge_axis * _AXIS}
    own |= {} if d.rest_rotation is None else {"rest_rotation": d.rest_rotation * _MATRIX}
    if d.tracked is not None:
        own["tracked"] = np.concatenate([mirrored_pose(d.tracked[:, :7]), d.tracked[:, 7:]], axis=1)
    motion = replace(
        d.motion,
        wrist_position=d.motion.wrist_position * _PLACE,
        wrist_quaternion=d.motion.wrist_quaternion * _TURN,
        side=_OTHER[d.motion.side],
    )
    return replace(
        d,
        motion=motion,
        object_pose=mirrored_pose(d.object_pose),
        object=replace(d.object, hulls=d.object.hulls * _PLACE),
        support_position=d.support_position * _PLACE,
        **own,
    )
