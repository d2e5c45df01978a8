"""`GraspType`: everything that makes one kind of grasp, as data.

A grasp type is one file in this folder that assigns a `GraspType` to `GRASP`; nothing else needs an edit.
Lengths metres, angles radians, forces newtons. Hand directions are those of MANO's right hand: fingers along -x, back
of the hand +y, thumb side +z. World: z up. Hinge angles are in the order of `hand.joints.HINGES`: index, middle, pinky,
ring, thumb; of each abduction (negative is towards the thumb; the thumb's own is negative towards the index), flexion
at the base, and the two hinges outwards.
"""

import dataclasses

import numpy as np
from jaxtyping import Float

from mjx_hand.errors import InputError
from mjx_hand.hand.joints import FINGERS
from mjx_hand.objects.description import OBJECT_KINDS

Vector = tuple[float, float, float]
Rows = tuple[Vector, Vector, Vector]

SCRIPTED_KINDS = tuple(kind for kind in OBJECT_KINDS if kind != "mesh")  # whose size alone says their shape
UNTURNED: Rows = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


@dataclasses.dataclass(frozen=True)
class Contact:
    """A place where the hand touches the object.

    Attributes:
        link: the link that touches ("thumb3"), with the last of its capsules.
        along: where on that capsule's axis, 0 its near end, 1 its far end.
        normal: outward unit normal of the touched face, in the object's frame; None to touch wherever the surface is
            nearest.
        aside: how far from the face's centre the touch should be (m), in the object's frame.
    """

    link: str
    along: float
    normal: Vector | None = None
    aside: Vector = (0.0, 0.0, 0.0)


@dataclasses.dataclass(frozen=True)
class Pads:
    """Pads meet faces: fingers open straight off them and press with balanced forces. Every contact has a normal.

    Attributes:
        opening: how far off its face each contact starts (m).
        force: of the first contact, which opposes the rest (N); the others share the answer.
    """

    opening: float
    force: float


@dataclasses.dataclass(frozen=True)
class Wrap:
    """Fingers and thumb close around the object and press it against each other and the palm.

    Attributes:
        opened: hinge angles before.
        finger_torque: of each finger's base flexion and the two hinges outwards, past contact (N m).
        thumb_torque: of the thumb's.
        place: where the object's centre is, from the middle finger's knuckle, along the hand's axes (m).
    """

    opened: tuple[float, ...]
    finger_torque: Vector
    thumb_torque: Vector
    place: Vector


@dataclasses.dataclass(frozen=True)
class Box:
    """A box that holds the object up, axes parallel to the world's: half extents and centre (m)."""

    half: Vector
    centre: Vector


@dataclasses.dataclass(frozen=True)
class GraspType:
    """A kind of grasp: the objects, the posture, and how the hand moves.

    Attributes:
        name: as in `config=NAME`.
        object_kind: one of `SCRIPTED_KINDS`.
        object_size: smallest and largest size (half extents, or as the kind has them); drawn uniformly, one factor
            for all three, so that a cube stays a cube.
        object_mass, object_friction: ranges.
        object_rotation: how the object stands or lies at first, rows of world_from_object.
        support: what holds the object up; its centre is above the origin.
        rest: height of the surface that carries the object (m).
        contacts: what touches where.
        posture: seed for the closed posture, hinge angles.
        wrist_rotation: seed for the hand's orientation, rows of world_from_hand.
        approach: where the wrist comes from, relative to the grasp (world frame).
        closing: how the hand opens and presses.
        lift, carry, turn: ranges of height (m), sideways way (m) and rotation (rad).
        grip_force: with which the reference of a person's twin presses (N), see `envs.grip`; demonstrations are made
            without.

    Raises:
        InputError: objects of another kind.
    """

    name: str
    object_kind: str
    object_size: tuple[Vector, Vector]
    object_mass: tuple[float, float]
    object_friction: tuple[float, float]
    contacts: tuple[Contact, ...]
    posture: tuple[float, ...]
    wrist_rotation: Rows
    approach: Vector
    closing: Pads | Wrap
    lift: tuple[float, float]
    carry: tuple[float, float]
    turn: tuple[float, float]
    object_rotation: Rows = UNTURNED
    grip_force: float = 2.0
    support: tuple[Box, ...] = ()
    rest: float = 0.0

    def __post_init__(self):
        if self.object_kind not in SCRIPTED_KINDS:
            raise InputError(
                f"grasp type {self.name!r}: object_kind is {self.object_kind!r}, but scripted grasps draw objects by "
                f"their size; valid: {', '.join(SCRIPTED_KINDS)} (a mesh takes their place by data.object=FILE)"
            )


def closing_torque(closing: Wrap) -> Float[np.ndarray, "j"]:
    """The torques (N m) of all hinges with which a wrap closes, in the order of `hand.joints.HINGES`."""
    each = [closing.thumb_torque if finger == "thumb" else closing.finger_torque for finger in FINGERS]
    return np.concatenate([[0.0, *torque] for torque in each])
