"""`Demonstration`: a hand and an object in motion, ready for a physics twin to replay."""

from pathlib import Path

import numpy as np
from jaxtyping import Float

from mjx_hand.errors import InputError
from mjx_hand.files.checked_arrays import numbers, text
from mjx_hand.files.npz_archive import load_arrays, save_arrays
from mjx_hand.motion.joint_motion import JointMotion, joint_motion_of
from mjx_hand.objects.description import OBJECT_KINDS, ObjectDescription
from mjx_hand.pytree import pytree, static

SCHEMA = "mjx-hand/demonstration/2"
_LAYOUT: dict[str, tuple[int | str, ...]] = {
    "object_size": (3,),
    "object_mass": (),
    "object_friction": (),
    "object_hulls": ("h", "v", 3),
    "support": ("b", 3),
    "support_position": ("b", 3),
    "shape": ("s",),
}
_HINGES: dict[str, tuple[int | str, ...]] = {"hinge_axis": (20, 3), "rest_rotation": (15, 3, 3)}
_TRACKED = "tracked"


@pytree
class Demonstration:
    """A recorded manipulation in a world frame with z up and the table at z = 0; metres, radians, wxyz.

    Attributes:
        motion: the twin's hinge angles and wrist poses, at the control rate.
        object_pose: position and quaternion of the object's frame, one row per frame.
        object: what is manipulated.
        support: half extents of the boxes that hold the object up at first, if it does not stand on the table.
        support_position: centres of those boxes.
        shape: MANO shape coefficients of the person, from which the twin's hand is built.
        hinge_axis, rest_rotation: of the twin's hinges, as in `RigidHand`, where the angles belong to others than those
            that the shape's hand is built with; else None.
        tracked: where a live tracker had the hand, late and with noise, while it moved as `motion` says: wrist position
            (m), quaternion (wxyz) and hinge angles (rad) in one row; None where there was none.
        grasp: name of the grasp type.
        source: provenance, one line.
    """

    motion: JointMotion
    object_pose: Float[np.ndarray, "t 7"]
    object: ObjectDescription
    support: Float[np.ndarray, "b 3"]
    support_position: Float[np.ndarray, "b 3"]
    shape: Float[np.ndarray, "s"]
    hinge_axis: Float[np.ndarray, "20 3"] | None = None
    rest_rotation: Float[np.ndarray, "15 3 3"] | None = None
    tracked: Float[np.ndarray, "t 27"] | None = None
    grasp: str = static()
    source: str = static(default="")

    @property
    def num_frames(self) -> int:
        """How many frames there are."""
        return self.object_pose.shape[0]


def save_demonstration(demonstration: Demonstration, path: str | Path) -> None:
    """Write as `.npz` (schema mjx-hand/demonstration/2)."""
    d, m = demonstration, demonstration.motion
    optional = {name: value for name in (*_HINGES, _TRACKED) if (value := getattr(d, name)) is not None}
    save_arrays(
        path,
        SCHEMA,
        {
            "fps": m.fps,
            "angles": m.angles,
            "wrist_position": m.wrist_position,
            "wrist_quaternion": m.wrist_quaternion,
            "valid": m.valid,
            "side": m.side,
            "joint_names": np.array(m.joint_names),
            "object_pose": d.object_pose,
            "object_kind": d.object.kind,
            "object_size": d.object.size,
            "object_mass": d.object.mass,
            "object_friction": d.object.friction,
            "object_hulls": d.object.hulls,
            "support": d.support,
            "support_position": d.support_position,
            "shape": d.shape,
            "grasp": d.grasp,
            "source": d.source,
            **optional,
            **({"warnings": np.array(m.warnings)} if m.warnings else {}),
        },
    )


def load_demonstration(path: str | Path) -> Demonstration:
    """Read what `save_demonstration` wrote.

    Raises:
        InputError: not such a file, of another joint order, or with frames that do not match.
    """
    a = load_arrays(path, SCHEMA)
    source = text(path, a, "source")
    motion = joint_motion_of(path, a, source)
    layout = _HINGES | {_TRACKED: (motion.num_frames, 27)}
    optional = {name: shape for name, shape in layout.items() if name in a}
    n = numbers(path, a, _LAYOUT | optional | {"object_pose": (motion.num_frames, 7)})
    kind = text(path, a, "object_kind")
    if kind not in OBJECT_KINDS:
        raise InputError(f"{path}: object_kind is {kind!r}; known: {', '.join(OBJECT_KINDS)}")
    if (kind == "mesh") != (n["object_hulls"].size > 0):
        raise InputError(
            f"{path}: object_kind is {kind!r} with {len(n['object_hulls'])} convex pieces; only a mesh has"
        )
    return Demonstration(
        motion=motion,
        object_pose=n["object_pose"],
        object=ObjectDescription(
            kind=kind,
            size=n["object_size"],
            mass=float(n["object_mass"]),
            friction=float(n["object_friction"]),
            hulls=n["object_hulls"],
        ),
        support=n["support"],
        support_position=n["support_position"],
        shape=n["shape"],
        hinge_axis=n.get("hinge_axis"),
        rest_rotation=n.get("rest_rotation"),
        tracked=n.get(_TRACKED),
        grasp=text(path, a, "grasp"),
        source=source,
    )
