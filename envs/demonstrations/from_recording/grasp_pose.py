"""A hand that holds an object: the posture near a recorded one in which it could.

Capture is off by centimetres where a hand and an object hide each other, and an object that looks nearly the same from
all sides is seen turned about its own axis by any angle. What it must have been follows from three facts: fingers that
carry an object touch it, neither gives way, and the thumb is against the fingers.
"""

import dataclasses
import itertools
from collections.abc import Sequence
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from mjx_hand.hand.joints import FINGERS, NUM_HINGES, TIP_LINKS
from mjx_hand.objects.primitives import signed_distance
from mjx_hand.rigid.capsules import capsule_points, last_capsule
from mjx_hand.rigid.rigid_hand import RigidHand, on_device
from mjx_hand.rotations import exp

_ALONG = np.linspace(0.0, 1.0, 7)
# What a residual of 1 is worth: a gap at a finger tip, a depth, and how far capture is off (m, rad).
_TOUCH, _CLEAR, _LIMIT = 0.001, 0.0005, 0.02
_OPPOSED, _NEAR = 0.1, 0.02  # directions that should be opposite; middle phalanges and palm, which need not touch (m)
_OFF_PLACE, _OFF_TURN, _OFF_SPIN, _OFF_ANGLE = 0.015, 0.1, 0.8, 0.25
_STEPS = 60
# Where to start looking, as there are many minima: turns about the object's axis, and ways towards the palm (m).
_SPINS, _INWARDS = np.deg2rad(np.arange(-180, 180, 30)), (0.0, 0.02)
_PALM = np.array([0.0, 1.0, 0.0])  # towards the back of the hand


@dataclasses.dataclass(frozen=True)
class GraspPose:
    """A hand and the object in it, or several.

    Attributes:
        angles: hinge angles (rad).
        rotation, position: the object in the wrist's frame (m).
    """

    angles: Float[np.ndarray, "*n 20"]
    rotation: Float[np.ndarray, "*n 3 3"]
    position: Float[np.ndarray, "*n 3"]

    def __getitem__(self, index: int | np.ndarray | None) -> "GraspPose":
        """One or some of several; `None`: this one as a row of one."""
        return GraspPose(self.angles[index], self.rotation[index], self.position[index])


def joined(grasps: Sequence[GraspPose]) -> GraspPose:
    """Several of several, one after the other."""
    return GraspPose(*map(np.concatenate, zip(*map(_rows, grasps), strict=True)))


def chosen(first: Bool[np.ndarray, "n"], one: GraspPose, other: GraspPose) -> GraspPose:
    """Those of `one` where `first`, else those of `other`."""
    pairs = zip(_rows(one), _rows(other), strict=True)
    return GraspPose(*(np.where(first.reshape(-1, *[1] * (a.ndim - 1)), a, b) for a, b in pairs))


def solve_grasp_poses(
    recorded: GraspPose, hand: RigidHand, planes: Float[np.ndarray, "h f 4"], *, spun: bool = True
) -> GraspPose:
    """n grasps near a recorded one in which the last phalanges touch and no link is inside the object, nearest first.

    An object that looks much the same from all sides can lie in the hand in several ways: one for each way to turn it
    about its axis to begin with.

    Args:
        recorded: as captured.
        hand: the twin's; its capsules stand for its skin.
        planes: of the object's convex pieces (`mjx_hand.objects.primitives.hull_planes`).
        spun: whether it may have been turned about its z axis by any angle, which was not seen; else it was seen.
    """
    bare = on_device(hand)
    residual = jax.jit(partial(_residual, hand=bare, recorded=_rows(recorded), planes=planes))
    slope = jax.jit(jax.jacfwd(residual))
    found = []
    for spin, way in itertools.product(_SPINS if spun else (0.0,), _INWARDS):
        found.append(
            least_squares(
                lambda x: np.asarray(residual(x), float),
                np.concatenate([recorded.angles, way * _PALM, [0.0, 0.0, spin]]),
                jac=lambda x: np.asarray(slope(x), float),  # type: ignore[arg-type]
                max_nfev=_STEPS,
            )
        )
    return joined([_grasp_pose(one.x, recorded, hand)[None] for one in sorted(found, key=lambda one: one.cost)])


def unlikeliness(
    grasps: GraspPose, recorded: GraspPose, hand: RigidHand, planes: Float[np.ndarray, "h f 4"]
) -> Float[np.ndarray, "n"]:
    """How far n grasps are from touching, from staying outside and from the recorded one.

    It is what `solve_grasp_poses` makes least: about 5 there, and 1 for 1 mm of gap at one finger tip, or 0.25 rad of
    one hinge, alone.
    """
    turn = Rotation.from_matrix(recorded.rotation.T @ grasps.rotation).as_rotvec()
    rows = np.concatenate([grasps.angles, grasps.position - recorded.position, turn], axis=1)
    bare = on_device(hand)
    return np.asarray(_norms(jnp.asarray(rows, jnp.float32), bare, _rows(recorded), jnp.asarray(planes)), float)


def _grasp_pose(x: Float[np.ndarray, "26"], recorded: GraspPose, hand: RigidHand) -> GraspPose:
    angles, rotation, position = (np.asarray(a, float) for a in _placed(jnp.asarray(x), _rows(recorded)))
    angles = np.clip(angles, hand.hinge_lower, hand.hinge_upper)
    return GraspPose(angles=angles, rotation=Rotation.from_matrix(rotation).as_matrix(), position=position)


def capsule_gaps(
    angles: Float[Array | np.ndarray, "20"],
    rotation: Float[Array | np.ndarray, "3 3"],
    position: Float[Array | np.ndarray, "3"],
    hand: RigidHand,
    planes: Float[Array | np.ndarray, "h f 4"],
) -> Float[Array, "c"]:
    """Distance (m) of each of the hand's capsules from an object in its wrist's frame; negative inside."""
    distance = signed_distance("mesh", jnp.zeros(3), capsule_axes(angles, rotation, position, hand), planes)
    return distance.min(axis=1) - jnp.asarray(hand.capsule_radius)


def last_phalanges(hand: RigidHand) -> list[int]:
    """The capsule of each finger's last link."""
    return [last_capsule(hand, tip) for tip in TIP_LINKS]


def spin_of(turn: Float[np.ndarray, "3 3"]) -> float:
    """The share of a rotation that turns about z (rad)."""
    _, _, z, w = Rotation.from_matrix(turn).as_quat()
    return float(2 * np.arctan2(z, w))


def capsule_axes(
    angles: Array | np.ndarray, rotation: Array | np.ndarray, position: Array | np.ndarray, hand: RigidHand
) -> Float[Array, "c n 3"]:
    """Points on the capsules' axes in the object's frame (m)."""
    return (capsule_points(angles, hand, _ALONG) - position) @ jnp.asarray(rotation)


def _rows(grasp: GraspPose) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    return grasp.angles, grasp.rotation, grasp.position


def _placed(x: Array, recorded: tuple) -> tuple[Array, Array, Array]:
    """Angles, and the object in the wrist's frame, turned in its own axes."""
    return x[:NUM_HINGES], recorded[1] @ exp(x[NUM_HINGES + 3 :]), recorded[2] + x[NUM_HINGES : NUM_HINGES + 3]


def _residual(x: Array, hand: RigidHand, recorded: tuple, planes: Array | np.ndarray) -> Float[Array, "r"]:
    angles, rotation, position = _placed(x, recorded)
    gaps = capsule_gaps(angles, rotation, position, hand, planes)
    tips = jnp.array(last_phalanges(hand))
    places = capsule_axes(angles, rotation, position, hand)[tips].mean(axis=1)[:, :2]  # about the object's axis
    thumb = FINGERS.index("thumb")
    opposite = _unit(places[thumb]) + _unit(jnp.delete(places, thumb, axis=0).mean(axis=0))
    outside = jnp.maximum(angles - hand.hinge_upper, 0) + jnp.maximum(hand.hinge_lower - angles, 0)
    return jnp.concatenate(
        [
            gaps[tips] / _TOUCH,
            jnp.minimum(gaps, 0.0) / _CLEAR,
            gaps / _NEAR,
            opposite / _OPPOSED,
            (angles - recorded[0]) / _OFF_ANGLE,
            x[NUM_HINGES : NUM_HINGES + 3] / _OFF_PLACE,
            x[NUM_HINGES + 3 :] / jnp.array([_OFF_TURN, _OFF_TURN, _OFF_SPIN]),
            outside / _LIMIT,
        ]
    )


@jax.jit
def _norms(rows: Array, hand: RigidHand, recorded: tuple, planes: Array) -> Float[Array, "n"]:
    return jax.lax.map(lambda x: jnp.linalg.norm(_residual(x, hand, recorded, planes)), rows, batch_size=8)


def _unit(v: Array) -> Array:
    return v / jnp.sqrt(jnp.sum(v * v) + 1e-8)
