"""Making a `RecordedScene` of hands and of objects' poses that come from anywhere."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float
from scipy.spatial.transform import Rotation

from mjx_hand.errors import InputError
from mjx_hand.motion.gaps import fill_lines, fill_turns
from mjx_hand.motion.motion import Motion
from mjx_hand.motion.resample import interpolation_index, matrix_quaternions, resample_motion, slerp
from mjx_hand.motion.scene import NO_SURFACE, RecordedObject, RecordedScene, check_object, check_scene
from mjx_hand.objects.mesh_file import read_object_mesh
from mjx_hand.pytree import replace

Array = np.ndarray
_AXES = {
    f"{sign}{axis}": (1.0 if sign == "+" else -1.0) * np.eye(3)[k] for sign in "+-" for k, axis in enumerate("xyz")
}
_NO_MESH = np.zeros((0, 3)), np.zeros((0, 3), int)
_RIGID = 1e-3  # how far a matrix may be from a rotation
_CLOSE = 1e-6  # share by which two rates may differ and be the same


def recorded_object(
    name: str,
    poses: Float[Array, "t *d"],
    *,
    mesh: str | Path | tuple[Array, Array] | None = None,
    unit: str = "m",
    kind: str = NO_SURFACE,
    size: Sequence[float | int] | Float[Array, "_"] = (),
    seen: Bool[Array, "_"] | None = None,
) -> RecordedObject:
    """An object of a scene, of its poses and its surface.

    Args:
        name: of the object.
        poses: scene from object: position (m) and quaternion wxyz (t, 7), or homogeneous matrices (t, 4, 4). Frames
            with NaN, and rows of zeros, are gaps.
        mesh: a mesh file, or vertices (v, 3) and triangles (f, 3), in the frame of the poses.
        unit: of the mesh's numbers: m, cm, mm or in.
        kind, size: a box, sphere, cylinder or capsule in place of a mesh; sizes (m) as in `RecordedObject.size`.
        seen: frames in which the pose was recorded; all that are finite if None.

    Raises:
        InputError: poses, mesh or size cannot be used, or there are both a mesh and a shape.
    """
    where = f"object {name!r}"
    position, quaternion, finite = _poses(np.asarray(poses, float), where)
    if seen is not None and np.shape(seen) != finite.shape:
        raise InputError(f"{where}: {len(finite)} poses, but seen has shape {np.shape(seen)}; give one a frame")
    known = finite if seen is None else finite & np.asarray(seen, bool)
    if mesh is not None and kind != NO_SURFACE:
        raise InputError(f"{where}: both a mesh and a {kind} are given; give one of them")
    vertices, faces = _NO_MESH
    if isinstance(mesh, str | Path):
        vertices, faces = read_object_mesh(mesh, unit)
    elif mesh is not None:
        vertices, faces = np.asarray(mesh[0], float), np.asarray(mesh[1], int)
    if len(size) > 3:
        raise InputError(f"{where}: {len(size)} sizes; a shape has at most 3")
    found = RecordedObject(
        name=name,
        kind=kind if mesh is None else "mesh",
        position=np.where(known[:, None], position, 0.0),
        quaternion=np.where(known[:, None], quaternion, [1.0, 0, 0, 0]),
        seen=known,
        size=np.array([*size, *[0.0] * (3 - len(size))], float),
        vertices=vertices,
        faces=faces,
    )
    check_object(found, where)
    return found


def make_scene(
    hands: Motion | Sequence[Motion],
    objects: RecordedObject | Sequence[RecordedObject] = (),
    *,
    fps: float | int | None = None,
    up: str | Sequence[float | int] | Float[Array, "3"] | None = None,
    source: str = "",
) -> RecordedScene:
    """A scene of hands and objects that were recorded together, at the rate of the first hand.

    Args:
        hands: one of each side at most; another rate than the first one's is resampled. All begin together.
        objects: one pose per frame, in the frame of the wrists.
        fps: of the objects' poses, where it is not the first hand's: they are resampled to that, and what follows the
            shortest recording's end is left out. Without hands, the scene's rate.
        up: against gravity: an axis such as "+z", or a direction; None where it is not known.
        source: provenance, one line; the first hand's if empty.

    Raises:
        InputError: numbers of frames differ at the same rate, or the scene is not well formed.
    """
    hands = (hands,) if isinstance(hands, Motion) else tuple(hands)
    objects = (objects,) if isinstance(objects, RecordedObject) else tuple(objects)
    if fps is not None and not (np.isfinite(fps) and fps > 0):
        raise InputError(f"fps is {fps}, expected a positive number of poses per second")
    if not hands and fps is None:
        raise InputError("a scene without hands does not say its rate; give fps")
    rate = hands[0].fps if hands else float(fps or 0)
    two = [hand for hand in hands if abs(hand.fps - rate) > _CLOSE * rate]
    other = fps is not None and abs(fps - rate) > _CLOSE * rate
    hands = tuple(resample_motion(hand, rate) if hand in two else hand for hand in hands)
    objects = tuple(resample_object(found, float(fps or rate), rate) if other else found for found in objects)
    if two or other:
        count = min(found.num_frames for found in (*hands, *objects))
        hands = tuple(first_frames(hand, count) for hand in hands)
        objects = tuple(first_poses(found, count) for found in objects)
    name = source or (hands[0].source if hands else "")
    return check_scene(RecordedScene(fps=rate, hands=hands, objects=objects, up=up_vector(up), source=name))


def up_vector(up: str | Sequence[float | int] | Float[Array, "3"] | None) -> Float[Array, "3"] | None:
    """The unit vector of an axis such as "+z" or "-y", or of a direction.

    Raises:
        InputError: it is neither.
    """
    if up is None:
        return None
    if isinstance(up, str):
        if up not in _AXES:
            raise InputError(f"up is {up!r}; valid: {', '.join(_AXES)}, or three numbers")
        return _AXES[up].copy()
    found = np.asarray(up, float)
    length = np.linalg.norm(found)
    if found.shape != (3,) or not np.isfinite(length) or length < 1e-9:
        raise InputError(f"up is {up}; valid: {', '.join(_AXES)}, or three numbers that are not all zero")
    return found / length


def first_frames(motion: Motion, count: int) -> Motion:
    """The motion's first frames."""
    by_frame = ("rotations", "wrist_position", "wrist_quaternion", "valid")
    return replace(motion, **{field: getattr(motion, field)[:count] for field in by_frame})


def first_poses(found: RecordedObject, count: int) -> RecordedObject:
    """The object's first frames."""
    by_frame = {field: getattr(found, field)[:count] for field in ("position", "quaternion", "seen")}
    hinge = None if found.hinge is None else replace(found.hinge, angle=found.hinge.angle[:count])
    return replace(found, hinge=hinge, **by_frame)


def resample_object(found: RecordedObject, fps: float, rate: float) -> RecordedObject:
    """The object's poses, recorded at `fps`, at `rate` frames per second; seen where both poses around a frame are."""
    times = np.arange(found.num_frames) / fps
    query = np.arange(int(np.floor(times[-1] * rate + 1e-6)) + 1) / rate
    return poses_at(found, times, query)


def poses_at(
    found: RecordedObject, times: Float[Array, "t"], query: Float[Array, "q"], longest: float = np.inf
) -> RecordedObject:
    """The object's poses, recorded at rising `times` (s), at other times; not seen beyond the first and last.

    Args:
        found: a pose for each of `times`.
        times, query: s.
        longest: s between two poses up to which what lies between them was seen.
    """
    before, after, fraction = interpolation_index(times, query)
    inside = (query >= times[0] - 1e-6) & (query <= times[-1] + 1e-6)
    at_first, at_last = fraction < 1e-6, fraction > 1 - 1e-6
    seen = inside & (found.seen[before] | at_last) & (found.seen[after] | at_first)
    seen &= (times[after] - times[before] <= longest) | at_first | at_last
    position = fill_lines(found.position, found.seen)
    turn = Rotation.from_quat(fill_turns(found.quaternion, found.seen), scalar_first=True).as_matrix()
    step = fraction[:, None]
    quaternion = matrix_quaternions(slerp(turn[before], turn[after], fraction))
    hinge = found.hinge
    if hinge is not None:
        hinge = replace(hinge, angle=(1 - fraction) * hinge.angle[before] + fraction * hinge.angle[after])
    return replace(
        found,
        position=np.where(seen[:, None], (1 - step) * position[before] + step * position[after], 0.0),
        quaternion=np.where(seen[:, None], quaternion, [1.0, 0, 0, 0]),
        seen=seen,
        hinge=hinge,
    )


def _poses(poses: Array, where: str) -> tuple[Array, Array, Array]:
    """Positions, quaternions and whether the pose is finite."""
    if poses.ndim == 3 and poses.shape[1:] in ((4, 4), (3, 4)):
        finite = np.asarray(np.isfinite(poses).all(axis=(1, 2)))
        turn = np.where(finite[:, None, None], poses[:, :3, :3], np.eye(3))
        off = np.abs(turn @ np.swapaxes(turn, 1, 2) - np.eye(3)).max(axis=(1, 2))
        if len(turn) and (off.max() > _RIGID or np.linalg.det(turn).min() < 0):
            raise InputError(f"{where}: pose {int(np.argmax(off))} is no rotation (orthonormal, determinant +1)")
        quaternion = matrix_quaternions(turn) if len(turn) else np.zeros((0, 4))
        return np.where(finite[:, None], poses[:, :3, 3], 0.0), quaternion, finite
    if poses.ndim != 2 or poses.shape[1] != 7:
        raise InputError(
            f"{where}: poses have shape {poses.shape}; give (frames, 7), position and quaternion wxyz, or matrices, "
            "(frames, 4, 4)"
        )
    finite = np.asarray(np.isfinite(poses).all(axis=1) & (poses != 0).any(axis=1))
    length = np.linalg.norm(np.where(finite[:, None], poses[:, 3:], [1.0, 0, 0, 0]), axis=1)
    if len(length) and np.abs(length - 1).max() > 0.01:
        worst = int(np.argmax(np.abs(length - 1)))
        raise InputError(f"{where}: pose {worst}'s quaternion has length {length[worst]:.3g}, expected 1 (wxyz)")
    return poses[:, :3], np.where(finite[:, None], poses[:, 3:] / length[:, None], [1.0, 0, 0, 0]), finite
