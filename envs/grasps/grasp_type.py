"""`GraspType`: everything that makes one kind of grasp, as data.

A grasp type is one file in this folder that assigns a `GraspType` to `GRASP`; nothing else needs an edit.
Lengths metres, angles radians, forces newtons. Hand directions are those of MANO's right hand: fingers along -x, back
of the hand +y, thumb side +z. World: z up, the object's frame parallel to the world at first.
"""

import dataclasses

Vector = tuple[float, float, float]


@dataclasses.dataclass(frozen=True)
class Contact:
    """A place where the hand touches the object.

    Attributes:
        link: the link that touches ("thumb3"), with the last of its capsules.
        along: where on that capsule's axis, 0 its near end, 1 its far end.
        normal: outward unit normal of the touched face, in the object's frame.
        aside: how far from the face's centre the touch should be (m), in the object's frame.
    """

    link: str
    along: float
    normal: Vector
    aside: Vector = (0.0, 0.0, 0.0)


@dataclasses.dataclass(frozen=True)
class GraspType:
    """A kind of grasp: the objects, the posture, and how the hand moves.

    Attributes:
        name: as in `config=NAME`.
        object_kind: one of `motion.demonstration.OBJECT_KINDS`.
        object_size: smallest and largest size (half extents, or as the kind has them); drawn uniformly, one factor
            for all three, so that a cube stays a cube.
        object_mass, object_friction: ranges.
        support: half extents of the block that the object stands on.
        contacts: what touches where; the first opposes the rest.
        posture: seed for the closed posture, hinge angles in the order of `hand.joints.HINGES`.
        opening: how far off its face each contact starts (m).
        wrist_rotation: seed for the hand's orientation, rows of world_from_hand.
        approach: where the wrist comes from, relative to the grasp (world frame).
        squeeze: force of the first contact (N), balanced by the others.
        lift, carry, turn: ranges of height (m), sideways way (m) and rotation (rad).
    """

    name: str
    object_kind: str
    object_size: tuple[Vector, Vector]
    object_mass: tuple[float, float]
    object_friction: tuple[float, float]
    support: Vector
    contacts: tuple[Contact, ...]
    posture: tuple[float, ...]
    opening: float
    wrist_rotation: tuple[Vector, Vector, Vector]
    approach: Vector
    squeeze: float
    lift: tuple[float, float]
    carry: tuple[float, float]
    turn: tuple[float, float]
