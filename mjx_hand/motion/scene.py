"""`RecordedScene`: recorded hands with the objects that they hold, all in one frame and at one rate."""

from dataclasses import replace as dataclass_replace

import numpy as np
from jaxtyping import Bool, Float, Int

from mjx_hand.errors import InputError
from mjx_hand.motion.motion import Motion, check_motion
from mjx_hand.motion.resample import quaternion_matrices
from mjx_hand.objects.description import OBJECT_KINDS
from mjx_hand.pytree import pytree, static

SIDES = ("right", "left")
NO_SURFACE = "none"
KINDS = (*OBJECT_KINDS, NO_SURFACE)  # of a scene's objects
_FARTHEST = 1e4  # m; no object is there
_UNIT = 1e-3  # how far a quaternion or a direction may be from length 1
_ON_HINGE = 2e-3  # m and rad by which a part's pose may be off what its hinge says
_DIMENSIONS = {"box": 3, "sphere": 1, "cylinder": 2, "capsule": 2}  # how many sizes a shape has


@pytree
class Hinge:
    """How a part of an articulated object turns about another part.

    Attributes:
        point, axis: a point (m) and the unit direction of the hinge's line, in the parent's frame.
        angle: rad, a frame; 0 is where the two parts' frames are alike.
        parent: name of the object that carries the hinge.
    """

    point: Float[np.ndarray, "3"]
    axis: Float[np.ndarray, "3"]
    angle: Float[np.ndarray, "t"]
    parent: str = static()


@pytree
class RecordedObject:
    """A rigid object's surface, and its pose in every frame; metres, quaternions wxyz.

    Attributes:
        position: of the object's own origin in the scene's frame. Frames in which it was not seen hold zero, never NaN.
        quaternion: scene from object, wxyz; the identity where it was not seen.
        seen: whether the pose was recorded in the frame (False in gaps).
        size: of a box its half extents; (radius, 0, 0) of a sphere; (radius, half height, 0) of a cylinder along z;
            (radius, half length without the round ends, 0) of a capsule along z; zero of the other kinds.
        vertices, faces: of a mesh, in the object's frame, triangles outward by the right-hand rule; else empty.
        hinge: of a part of an articulated object, how it turns about its parent; else None.
        name: one of its own in the scene.
        kind: "box", "sphere", "cylinder", "capsule", "mesh", or "none" where only the poses are known.
    """

    position: Float[np.ndarray, "t 3"]
    quaternion: Float[np.ndarray, "t 4"]
    seen: Bool[np.ndarray, "t"]
    size: Float[np.ndarray, "3"]
    vertices: Float[np.ndarray, "v 3"]
    faces: Int[np.ndarray, "f 3"]
    hinge: Hinge | None = None
    name: str = static()
    kind: str = static()

    @property
    def num_frames(self) -> int:
        """How many frames there are, gaps included."""
        return self.position.shape[0]

    @property
    def rotation(self) -> Float[np.ndarray, "t 3 3"]:
        """Scene from object, as matrices."""
        return quaternion_matrices(self.quaternion)


@pytree
class RecordedScene:
    """Hands and objects that were recorded together; frame k of all of them is one instant.

    Attributes:
        fps: frames per second of the hands and the objects.
        hands: none, one or both, the right one first. Their wrists are in the scene's frame.
        objects: in no order that matters.
        up: unit vector against gravity in the scene's frame, or None where it is not known.
        source: provenance, one line.
    """

    fps: float
    hands: tuple[Motion, ...]
    objects: tuple[RecordedObject, ...]
    up: Float[np.ndarray, "3"] | None = None
    source: str = static(default="")

    @property
    def num_frames(self) -> int:
        """How many frames there are, gaps included."""
        return (*self.hands, *self.objects)[0].num_frames

    def hand(self, side: str) -> Motion:
        """The hand of that side.

        Raises:
            InputError: there is none.
        """
        for motion in self.hands:
            if motion.side == side:
                return motion
        found = ", ".join(motion.side for motion in self.hands) or "none"
        raise InputError(f"{self.source or 'scene'}: has no {side} hand; it has {found}")

    def object(self, name: str) -> RecordedObject:
        """The object of that name.

        Raises:
            InputError: there is none.
        """
        for found in self.objects:
            if found.name == name:
                return found
        names = ", ".join(found.name for found in self.objects) or "none"
        raise InputError(f"{self.source or 'scene'}: has no object {name!r}; it has {names}")


def check_scene(scene: RecordedScene, name: str = "") -> RecordedScene:
    """Return `scene` if it is well formed, its right hand first.

    Args:
        scene: what to check.
        name: what messages call it, such as its file; its source if empty.

    Raises:
        InputError: it is empty; numbers of frames or rates differ; a side or a name repeats; up is no unit vector; a
            hand or an object is not well formed.
    """
    name = name or scene.source or "scene"
    if not scene.hands and not scene.objects:
        raise InputError(f"{name}: has neither hand nor object; give at least one of them")
    if not (np.isfinite(scene.fps) and scene.fps > 0):
        raise InputError(f"{name}: fps is {scene.fps}, expected a positive number")
    sides = [motion.side for motion in scene.hands]
    if len(set(sides)) < len(sides):
        raise InputError(f"{name}: has {' and '.join(sides)} hands; a scene has one of each side at most")
    names = [found.name for found in scene.objects]
    if len(set(names)) < len(names) or not all(names):
        raise InputError(f"{name}: its objects are named {', '.join(map(repr, names))}; give each a name of its own")
    counts = {f"{motion.side} hand": motion.num_frames for motion in scene.hands}
    counts |= {found.name: found.num_frames for found in scene.objects}
    if len(set(counts.values())) > 1:
        told = ", ".join(f"{which} {count}" for which, count in counts.items())
        raise InputError(f"{name}: numbers of frames differ ({told}); bring all to the same frames first")
    for motion in scene.hands:
        check_motion(motion, f"{name}: {motion.side} hand")
        if abs(motion.fps - scene.fps) > 1e-6 * scene.fps:
            raise InputError(
                f"{name}: the {motion.side} hand is at {motion.fps:g} frames per second, the scene at {scene.fps:g}; "
                "resample it first (mjx_hand.motion.resample.resample_motion)"
            )
    for found in scene.objects:
        check_object(found, f"{name}: object {found.name!r}")
    _check_hinges(scene, name)
    if scene.up is not None and not (np.shape(scene.up) == (3,) and abs(np.linalg.norm(scene.up) - 1) < _UNIT):
        raise InputError(f"{name}: up is {scene.up}, expected a unit vector of 3 numbers, or nothing where not known")
    ordered = sorted(scene.hands, key=lambda motion: SIDES.index(motion.side))
    return dataclass_replace(scene, hands=tuple(ordered))


def check_object(found: RecordedObject, name: str) -> None:
    """Check one object.

    Raises:
        InputError: shapes, numbers, quaternions, kind, size or mesh are not valid, or it is seen in no frame.
    """
    frames = found.num_frames
    expected = {"position": (frames, 3), "quaternion": (frames, 4), "seen": (frames,), "size": (3,)}
    for field, shape in expected.items():
        if np.shape(getattr(found, field)) != shape:
            raise InputError(f"{name}: {field} has shape {np.shape(getattr(found, field))}, expected {shape}")
    if not found.seen.any():
        raise InputError(f"{name}: it is seen in none of the {frames} frames; leave it out")
    for field in ("position", "quaternion", "size", "vertices"):
        if not np.isfinite(getattr(found, field)).all():
            raise InputError(f"{name}: {field} has NaN or infinity; mark gaps as seen=False and hold zero there")
    if np.abs(found.position).max() > _FARTHEST:
        raise InputError(f"{name}: it is {np.abs(found.position).max():.3g} m away; give positions in metres")
    length = np.linalg.norm(found.quaternion, axis=1)
    if (np.abs(length - 1) > _UNIT).any():
        worst = int(np.argmax(np.abs(length - 1)))
        raise InputError(f"{name}: frame {worst}'s quaternion has length {length[worst]:.3g}, expected 1 (wxyz)")
    if found.kind not in KINDS:
        raise InputError(f"{name}: its kind is {found.kind!r}; valid: {', '.join(KINDS)}")
    if found.kind in _DIMENSIONS and not (found.size[: _DIMENSIONS[found.kind]] > 0).all():
        raise InputError(f"{name}: a {found.kind} of size {found.size}; give {_DIMENSIONS[found.kind]} positive sizes")
    if (found.kind == "mesh") != (len(found.faces) > 0):
        raise InputError(f"{name}: its kind is {found.kind!r}, with {len(found.faces)} triangles; only a mesh has some")
    if len(found.faces) and not 0 <= found.faces.min() <= found.faces.max() < len(found.vertices):
        raise InputError(f"{name}: a triangle names vertex {found.faces.max()} of {len(found.vertices)}")


def _check_hinges(scene: RecordedScene, name: str) -> None:
    for part in scene.objects:
        hinge = part.hinge
        if hinge is None:
            continue
        parent = next((found for found in scene.objects if found.name == hinge.parent and found is not part), None)
        if parent is None:
            raise InputError(f"{name}: object {part.name!r} turns about {hinge.parent!r}, which is not in the scene")
        if np.shape(hinge.angle) != (part.num_frames,) or not np.isfinite(hinge.angle).all():
            raise InputError(f"{name}: object {part.name!r} has hinge angles that are not one finite number a frame")
        if abs(np.linalg.norm(hinge.axis) - 1) > _UNIT or not np.isfinite(hinge.point).all():
            raise InputError(f"{name}: object {part.name!r} has a hinge whose axis is no unit vector")
        both = part.seen & parent.seen
        if not both.any():
            continue
        turn = quaternion_matrices(_about(hinge)[both])
        place = hinge.point - turn @ hinge.point
        off_turn = np.abs(parent.rotation[both] @ turn - part.rotation[both]).max()
        where = np.einsum("tij,tj->ti", parent.rotation[both], place) + parent.position[both]
        off_place = np.linalg.norm(where - part.position[both], axis=1).max()
        if max(off_turn, off_place) > _ON_HINGE:
            raise InputError(
                f"{name}: object {part.name!r} is up to {1e3 * off_place:.1f} mm off where its hinge puts it; give "
                "poses and angles of one account"
            )


def _about(hinge: Hinge) -> Float[np.ndarray, "t 4"]:
    half = hinge.angle[:, None] / 2
    return np.concatenate([np.cos(half), np.sin(half) * hinge.axis], axis=1)
