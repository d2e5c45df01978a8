"""Files of an object's poses that other programs write: `.csv`, `.npy`, `.npz`, `.json`.

Position (m) and quaternion, scene from object: `.csv` with columns `x`, `y`, `z`, `qw`, `qx`, `qy`, `qz` and, if there
are any, `time` (s); `.npy` of (t, 7), position and quaternion wxyz, or of matrices (t, 4, 4); `.npz` and `.json` with
`poses`, either of these, or `position` and `quaternion`, and `fps` or `times` (s). Empty cells, NaN and rows of zeros
are gaps. Times count from the first row, at which the hand's recording begins too.
"""

import csv
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from mjx_hand.errors import InputError
from mjx_hand.files.checked_arrays import numbers
from mjx_hand.files.input_file import check_input_file
from mjx_hand.files.json_text import read_json
from mjx_hand.files.npz_archive import open_archive
from mjx_hand.files.npz_reader import Arrays
from mjx_hand.files.safe_yaml import read_yaml
from mjx_hand.motion import RecordedObject
from mjx_hand.motion.make_scene import poses_at, resample_object
from mjx_hand.pytree import replace

Array = np.ndarray
_COLUMNS = ("x", "y", "z", "qw", "qx", "qy", "qz")
_TIME = "time"
_SUFFIXES = (".csv", ".npy", ".npz", ".json")
_HOLE = 3.5  # steps: rows further apart have a gap between them


@dataclass(frozen=True)
class PoseTrack:
    """An object's poses.

    Attributes:
        poses: as `mjx_hand.recorded_object` takes them, NaN in gaps.
        times: of each, s, or None.
        fps: of them, or None where nothing is said.
    """

    poses: Float[Array, "t *d"]
    times: Float[Array, "t"] | None = None
    fps: float | None = None


def load_poses(path: str | Path) -> PoseTrack:
    """Read an object's poses.

    Raises:
        InputError: no such file, of another kind, or its contents are not poses.
    """
    path = Path(path)
    suffix = path.suffix.lower()
    give = f"poses of an object are {', '.join(_SUFFIXES)} (docs/scenes.md)"
    check_input_file(path, give)
    if suffix not in _SUFFIXES:
        raise InputError(f"{path}: suffix {suffix or 'none'}; {give}")
    if suffix == ".csv":
        return _table(path)
    arrays = _json(path) if suffix == ".json" else open_archive(path) if suffix == ".npz" else {"poses": _array(path)}
    if "poses" not in arrays and {"position", "quaternion"} <= set(arrays):
        n = numbers(path, arrays, {"position": ("t", 3), "quaternion": ("t", 4)}, finite=False)
        poses = np.concatenate([n["position"], n["quaternion"]], axis=1).astype(float)
    else:
        poses = arrays.get("poses")
    if poses is None or np.asarray(poses).dtype.kind not in "fiu" or np.ndim(poses) not in (2, 3):
        raise InputError(f"{path}: has no 'poses' of (t, 7) or (t, 4, 4), nor 'position' and 'quaternion'")
    times = numbers(path, arrays, {"times": (len(poses),)})["times"].astype(float) if "times" in arrays else None
    fps = float(numbers(path, arrays, {"fps": ()})["fps"]) if "fps" in arrays else None
    return _checked(path, PoseTrack(np.asarray(poses, float), times, fps))


def in_frames(found: RecordedObject, track: PoseTrack, fps: float, frames: int) -> RecordedObject:
    """The object, whose poses are the track's, in the frames of a recording that begins with it.

    Args:
        found: of the track's poses.
        track: says when they were.
        fps, frames: of the recording.

    Raises:
        InputError: the track says no times, and has another number of frames.
    """
    if track.times is not None:
        times = track.times - track.times[0]
        return poses_at(found, times, np.arange(frames) / fps, _HOLE * float(np.median(np.diff(times))))
    if track.fps is not None and abs(track.fps - fps) > 1e-6 * fps:
        found = resample_object(found, track.fps, fps)
    elif found.num_frames != frames:
        raise InputError(
            f"object {found.name!r}: {found.num_frames} poses for {frames} frames of the hand, and no times; give a "
            "column 'time', or 'fps'"
        )
    return _padded(found, frames)


def _padded(found: RecordedObject, frames: int) -> RecordedObject:
    """As many frames; those beyond the last pose are gaps."""
    short = max(frames - found.num_frames, 0)
    rest = np.tile([1.0, 0, 0, 0], (short, 1))
    return replace(
        found,
        position=np.concatenate([found.position, np.zeros((short, 3))])[:frames],
        quaternion=np.concatenate([found.quaternion, rest])[:frames],
        seen=np.concatenate([found.seen, np.zeros(short, bool)])[:frames],
    )


def marker_places(path: str | Path, labels: Sequence[str]) -> Float[Array, "m 3"]:
    """Where markers are on an object (m, its own frame): a YAML or JSON file of `marker: [x, y, z]`.

    Raises:
        InputError: it is not readable, or lacks one of the markers.
    """
    path = Path(path)
    check_input_file(path, "give the markers' places, 'marker: [x, y, z]' in metres")
    found = read_yaml(path)
    missing = [label for label in labels if not isinstance(found, dict) or label not in found]
    if missing:
        raise InputError(f"{path}: has no place of marker {missing[0]!r}; write '{missing[0]}: [x, y, z]', in metres")
    try:
        places = np.array([found[label] for label in labels], float)
    except (TypeError, ValueError):
        places = np.zeros(0)
    return numbers(path, {"places": places}, {"places": (len(labels), 3)})["places"]


def _table(path: Path) -> PoseTrack:
    try:
        with path.open(newline="", encoding="utf-8-sig") as file:
            lines = (line for line in file if line.strip() and not line.startswith("#"))
            rows = [{str(k).strip().lower(): v for k, v in row.items()} for row in csv.DictReader(lines)]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise InputError(f"{path}: not a readable table ({type(error).__name__}); export it again as UTF-8") from None
    columns = [name for name in (*_COLUMNS, _TIME) if rows and name in rows[0]]
    if not rows or not set(_COLUMNS) <= set(columns):
        found = ", ".join(rows[0])[:100] if rows else "no rows"
        raise InputError(f"{path}: has {found}; a table of poses has columns {', '.join(_COLUMNS)} and maybe {_TIME}")
    try:
        values = np.array([[float(row[name] or "nan") for name in columns] for row in rows])
    except (TypeError, ValueError):
        raise InputError(f"{path}: a cell of {', '.join(columns)} is no number; leave cells empty in gaps") from None
    times = values[:, columns.index(_TIME)] if _TIME in columns else None
    return _checked(path, PoseTrack(values[:, :7], times))


def _checked(path: Path, track: PoseTrack) -> PoseTrack:
    if len(track.poses) == 0:
        raise InputError(f"{path}: has no poses")
    if track.fps is not None and not (np.isfinite(track.fps) and track.fps > 0):
        raise InputError(f"{path}: fps is {track.fps}, expected a positive number")
    times = track.times
    if times is not None and (len(times) < 2 or not np.isfinite(times).all() or (np.diff(times) <= 0).any()):
        raise InputError(f"{path}: its times do not rise from row to row; sort the rows, in seconds")
    return track


def _json(path: Path) -> Arrays:
    found = read_json(path)
    if not isinstance(found, dict):
        raise InputError(f"{path}: is no object of named arrays, 'poses' among them")
    try:
        return {name: np.asarray(_missing(value)) for name, value in found.items()}
    except ValueError:
        raise InputError(f"{path}: an array has rows of different lengths; write it again") from None


def _missing(value: Any) -> Any:
    """`null` as NaN."""
    if isinstance(value, list):
        return [_missing(each) for each in value]
    return float("nan") if value is None else value


def _array(path: Path) -> Array:
    try:
        with path.open("rb") as file:
            return np.lib.format.read_array(file, allow_pickle=False)
    except Exception as error:  # damaged bytes raise anything at all
        raise InputError(f"{path}: not a readable .npy array ({type(error).__name__}); write it again") from None
