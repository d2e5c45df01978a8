"""A hand that holds an object: the posture near a recorded one in which it could.

Capture is off by centimetres where a hand and an object hide each other, and an object that looks nearly the same from
all sides is seen turned about its own axis by any angle. What it must have been follows from three facts: fingers that
carry an object touch it, neither gives way, and the thumb is against the fingers.

Near is what stays near in the world: the wrist's place beside the object and the hand's orientation, each by itself. An
object's place in the wrist's frame would mix them: half a radian that two cameras disagree about is 7 cm there.
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
_NO_SPIN = 0.001  # in the place of `_OFF_SPIN` where the turn about the object's axis was seen (rad)
_STEPS = 60
# Where to start looking, as there are many minima: turns about the object's axis, and ways towards the palm (m).
_SPINS, _INWARDS = np.deg2rad(np.arange(-180, 180, 30)), (0.0, 0.02)
_PALM = np.array([0.0, 1.0, 0.0])  # towards the back of the hand
_AXIS = np.array([0.0, 0.0, 1.0])  # the object's


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

    def __getitem__(self, index: int | slice | np.ndarray | None) -> "GraspPose":
        """One or some of several; `None`: this one as a row of one."""
        return GraspPose(self.angles[index], self.rotation[index], self.position[index])

    @property
    def wrist(self) -> Float[np.ndarray, "*n 3"]:
        """Where the wrist is in the object's frame (m)."""
        return -np.einsum("...ji,...j->...i", self.rotation, self.position)


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
    worth = _OFF_SPIN if spun else _NO_SPIN
    residual = jax.jit(partial(_residual, hand=bare, recorded=_rows(recorded), planes=planes, off_spin=worth))
    slope = jax.jit(jax.jacfwd(residual))
    found = []
    for spin, way in itertools.product(_SPINS if spun else (0.0,), _INWARDS):
        found.append(
            least_squares(
                lambda x: np.asarray(residual(x), float),
                np.concatenate([recorded.angles, -recorded.rotation.T @ (way * _PALM), np.zeros(3), [spin]]),
                jac=lambda x: np.asarray(slope(x), float),  # type: ignore[arg-type]
                max_nfev=_STEPS,
            )
        )
    return joined([_grasp_pose(one.x, recorded, hand)[None] for one in sorted(found, key=lambda one: one.cost)])


def unlikeliness(
    grasps: GraspPose, recorded: GraspPose, hand: RigidHand, planes: Float[np.ndarray, "h f 4"], *, spun: bool = True
) -> Float[np.ndarray, "n"]:
    """How far n grasps are from touching, from staying outside and from the recorded one.

    It is what `solve_grasp_poses` makes least: about 5 there, and 1 for 1 mm of gap at one finger tip, or 0.25 rad of
    one hinge, alone.
    """
    spin = spins(grasps, recorded) if spun else np.zeros(len(grasps.angles))
    back = Rotation.from_rotvec(spin[:, None] * _AXIS)
    turn = (Rotation.from_matrix(recorded.rotation.T @ grasps.rotation) * back.inv()).inv().as_rotvec()
    rows = np.concatenate([grasps.angles, back.apply(grasps.wrist) - recorded.wrist, turn, spin[:, None]], axis=1)
    bare = on_device(hand)
    return np.asarray(_norms(jnp.asarray(rows, jnp.float32), bare, _rows(recorded), jnp.asarray(planes)), float)


def spins(grasps: GraspPose, recorded: GraspPose) -> Float[np.ndarray, "n"]:
    """How far (rad) the object of each of n grasps is turned about its z axis, of which recordings show little.

    It is the turn that leaves the wrist and the hand's orientation nearest to the recorded ones: the wrist tells more
    the further it is from the axis.
    """
    twist = np.array([_twist(recorded.rotation.T @ rotation) for rotation in grasps.rotation])
    there, before = grasps.wrist[:, :2], recorded.wrist[:2]
    about = np.arctan2(before[1], before[0]) - np.arctan2(there[:, 1], there[:, 0])
    place = np.linalg.norm(there, axis=1) * np.linalg.norm(before) / _OFF_PLACE**2
    turn = 1 / _OFF_TURN**2
    return np.arctan2(place * np.sin(about) + turn * np.sin(twist), place * np.cos(about) + turn * np.cos(twist))


def _grasp_pose(x: Float[np.ndarray, "27"], recorded: GraspPose, hand: RigidHand) -> GraspPose:
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


def linear_gaps(points: Float[Array, "c n 3"], radius: Array, planes: Array) -> Float[Array, "c"]:
    """`capsule_gaps`, whose slopes go through the one plane that decides and not through all of them."""
    beyond = jnp.einsum("cnk,hfk->cnhf", jax.lax.stop_gradient(points), planes[..., :3]) + planes[..., 3]
    outside = beyond.max(axis=-1)
    piece = jnp.argmin(outside, axis=-1)
    which = jnp.argmin(outside.min(axis=-1), axis=-1)
    rows = jnp.arange(len(points))
    piece = piece[rows, which]
    plane = planes[piece, jnp.argmax(beyond[rows, which, piece], axis=-1)]
    return jnp.sum(points[rows, which] * plane[:, :3], axis=-1) + plane[:, 3] - radius


def last_phalanges(hand: RigidHand) -> list[int]:
    """The capsule of each finger's last link."""
    return [last_capsule(hand, tip) for tip in TIP_LINKS]


def _twist(turn: Float[np.ndarray, "3 3"]) -> float:
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
    """Angles; then the wrist put elsewhere beside the object, the hand turned about it, the object about its z axis."""
    _, rotation, position = recorded
    turned = rotation @ exp(-x[NUM_HINGES + 3 : NUM_HINGES + 6])
    wrist = x[NUM_HINGES : NUM_HINGES + 3] - rotation.T @ position
    return x[:NUM_HINGES], turned @ exp(x[NUM_HINGES + 6] * jnp.asarray(_AXIS)), -turned @ wrist


def _residual(
    x: Array, hand: RigidHand, recorded: tuple, planes: Array | np.ndarray, off_spin: float = _OFF_SPIN
) -> Float[Array, "r"]:
    angles, rotation, position = _placed(x, recorded)
    axes = capsule_axes(angles, rotation, position, hand)
    radius, planes = jnp.asarray(hand.capsule_radius), jnp.asarray(planes)
    gaps = linear_gaps(axes, radius, planes)
    tips = jnp.array(last_phalanges(hand))
    places = axes[tips].mean(axis=1)[:, :2]  # about the object's axis
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
            x[NUM_HINGES + 3 : NUM_HINGES + 6] / _OFF_TURN,
            x[NUM_HINGES + 6 :] / off_spin,
            outside / _LIMIT,
        ]
    )


@jax.jit
def _norms(rows: Array, hand: RigidHand, recorded: tuple, planes: Array) -> Float[Array, "n"]:
    return jax.lax.map(lambda x: jnp.linalg.norm(_residual(x, hand, recorded, planes)), rows, batch_size=8)


def _unit(v: Array) -> Array:
    return v / jnp.sqrt(jnp.sum(v * v) + 1e-8)
