"""HOT3D (Banerjee et al., CVPR 2025, https://facebookresearch.github.io/hot3d): the folder of a sequence.

Layout: https://github.com/facebookresearch/hot3d (hot3d/data_loaders). Metres and seconds, one world frame with y up:

- `umetrack_hand_pose_trajectory.jsonl`, an object a line: `timestamp_ns`; `hand_poses` by hand, "0" left and "1" right,
  each with `wrist_xform` (`t_xyz`, `q_wxyz`), `joint_angles` (20 or 22, rad) and `hand_confidence`. A hand that was not
  seen is left out. `umetrack_hand_user_profile.json`: the user's `hand_model` (`keypoints.umetrack`).
- `dynamic_objects.csv` (or `dynamic_objects_v2.csv`): `object_uid`, `timestamp[ns]`, `t_wo_x[m]`, …, `q_wo_w`, …: world
  from object. `instance.json` names the objects, `UID.glb` are their meshes: beside these files, or in a folder
  `object_library`, `object_models` or `assets` beside the sequence's folder or the one above it.

The hands' UmeTrack parameters need no licensed file, and are what is read; MANO's in the same folder are not.
"""

import csv
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from mjx_hand.capture.datasets.dataset_format import Contents, DatasetFormat, Request
from mjx_hand.capture.datasets.mano_motion import LONGEST, chosen_side, hands_of, refuse_wild, some
from mjx_hand.capture.keypoint_fit.fit import KeypointSettings, fit_keypoints
from mjx_hand.capture.keypoints.recording import KeypointRecording
from mjx_hand.capture.keypoints.umetrack import NUM_ANGLES, umetrack_hand, umetrack_keypoints
from mjx_hand.capture.object_poses.with_mesh import object_with_mesh
from mjx_hand.errors import InputError
from mjx_hand.files.input_file import check_input_file
from mjx_hand.files.json_text import read_json
from mjx_hand.hand.load import load_hand
from mjx_hand.motion import Motion, RecordedObject, RecordedScene, make_scene
from mjx_hand.motion.resample import quaternion_matrices
from mjx_hand.pytree import replace

HANDS = "umetrack_hand_pose_trajectory.jsonl"
PROFILE = "umetrack_hand_user_profile.json"
OBJECTS = ("dynamic_objects.csv", "dynamic_objects_v2.csv")
LIBRARIES = ("object_library", "object_models", "assets")
UP = "+y"
_NUMBERS = {"left": "0", "right": "1"}
_POSE = ("t_wo_x[m]", "t_wo_y[m]", "t_wo_z[m]", "q_wo_w", "q_wo_x", "q_wo_y", "q_wo_z")
_SAME_RATE = 5e-3  # share by which a measured rate may be off a whole number
Array = np.ndarray


def _folder(path: Path) -> Path:
    return path if path.is_dir() else path.parent


def _recognises(path: Path, contents: Contents) -> bool:
    return (path / HANDS).is_file() or (path.name == HANDS and path.is_file())


def _lines(folder: Path) -> list[dict[str, Any]]:
    """The frames of the hands' file, by rising time."""
    path = folder / HANDS
    found = read_json(path)
    try:
        rows = sorted(found if isinstance(found, list) else [found], key=lambda row: int(row["timestamp_ns"]))
        sound = all(isinstance(row["hand_poses"], dict) for row in rows)
    except (ValueError, KeyError, TypeError, OverflowError) as error:
        raise InputError(f"{path}: not HOT3D's lines of hand poses ({type(error).__name__}); get it again") from None
    if not rows or not sound:
        raise InputError(f"{path}: {len(rows)} lines of hand poses; get the file again")
    return rows


def _clock(path: Path, stamps: list[int]) -> tuple[Array, float]:
    """The frame of each time stamp, counted from the first one's, and the rate."""
    steps = np.diff(stamps)
    if len(stamps) < 2 or (steps <= 0).any():
        raise InputError(f"{path}: has {len(stamps)} time stamps, some of them twice or only one; get the file again")
    rate = 1e9 / float(np.median(steps))
    whole = float(round(rate))
    rate = whole if whole > 0 and abs(rate / whole - 1) < _SAME_RATE else rate
    frames = np.round((np.array(stamps) - stamps[0]) * (rate / 1e9)).astype(int)
    if frames[-1] >= LONGEST:
        raise InputError(f"{path}: its time stamps span {frames[-1]} frames, over {LONGEST}; get the file again")
    return frames, rate


def _read(path: Path, contents: Contents, request: Request) -> Motion:
    folder = _folder(path)
    rows = _lines(folder)
    side = chosen_side(path, _sides(rows), request)
    frames, rate = _clock(folder / HANDS, [int(row["timestamp_ns"]) for row in rows])
    values = np.full((frames[-1] + 1, 7 + NUM_ANGLES), np.nan)
    for frame, row in zip(frames, rows, strict=True):
        if _NUMBERS[side] in row["hand_poses"]:
            values[frame] = _hand(folder / HANDS, row["hand_poses"][_NUMBERS[side]], int(frame))
    refuse_wild(path, values)
    length = np.linalg.norm(values[:, 3:7], axis=1)
    valid = some(path, np.asarray(np.isfinite(values).all(axis=1) & (np.abs(length - 1) < 0.01)))
    known = values[valid]
    positions = np.full((len(values), 21, 3), np.nan)
    positions[valid] = umetrack_keypoints(
        umetrack_hand(folder / PROFILE, _profile(folder)),
        known[:, 7:],
        quaternion_matrices(known[:, 3:7]),
        known[:, :3],
        side,
    )
    source = f"HOT3D {folder.absolute().name}, {side} hand"
    recording = KeypointRecording(fps=rate, positions=positions, side=side, layout="umetrack", source=source)
    settings = KeypointSettings(longest_gap=0.0, own_bones=True)
    return replace(fit_keypoints(recording, load_hand(request.mano, side), settings)[0], source=source)


def _sides(rows: list[dict[str, Any]]) -> list[str]:
    return [side for side in ("right", "left") if any(_NUMBERS[side] in row["hand_poses"] for row in rows)]


def _hand(path: Path, hand: Any, frame: int) -> Float[Array, "27"]:
    """Place, quaternion and angles in a row; NaN where the hand is there without confidence."""
    try:
        row = [*hand["wrist_xform"]["t_xyz"], *hand["wrist_xform"]["q_wxyz"], *hand["joint_angles"][:NUM_ANGLES]]
        found = np.array(row, float)
        seen = float(hand.get("hand_confidence", 1.0)) > 0
    except (KeyError, TypeError, ValueError):
        found, seen = np.zeros(0), True
    if found.shape != (7 + NUM_ANGLES,):
        raise InputError(f"{path}: frame {frame} has a hand without wrist_xform or joint_angles; get the file again")
    return found if seen else np.full(len(found), np.nan)


def _profile(folder: Path) -> dict[str, Any]:
    path = folder / PROFILE
    check_input_file(path, f"the user's profile stands beside {HANDS}")
    found = read_json(path)
    model = found.get("hand_model") if isinstance(found, dict) else None
    if not isinstance(model, dict):
        raise InputError(f"{path}: has no 'hand_model'; get HOT3D's own profile of the user")
    return model


def _objects(folder: Path, first: int, count: int, rate: float) -> tuple[RecordedObject, ...]:
    """The objects that are posed in the hands' time, in the order in which they come."""
    path = next((folder / name for name in OBJECTS if (folder / name).is_file()), None)
    if path is None:
        return ()
    poses: dict[str, Array] = {}
    try:
        with path.open(newline="", encoding="utf-8") as file:
            for row in csv.DictReader(file):
                frame = round((int(row["timestamp[ns]"]) - first) * (rate / 1e9))
                if 0 <= frame < count:
                    own = poses.setdefault(row["object_uid"].strip(), np.full((count, 7), np.nan))
                    own[frame] = [float(row[name] or "nan") for name in _POSE]
    except (OSError, KeyError, TypeError, ValueError, AttributeError, OverflowError, csv.Error) as error:
        raise InputError(f"{path}: not HOT3D's table of object poses ({type(error).__name__}); get it again") from None
    names = _instances(folder)
    seen = {uid: own for uid, own in poses.items() if np.isfinite(own).all(axis=1).any()}
    called = [names.get(uid, uid) for uid in seen]
    return tuple(
        object_with_mesh(name if called.count(name) == 1 else uid, own, _library_file(folder, f"{uid}.glb"))
        for name, (uid, own) in zip(called, seen.items(), strict=True)
    )


def _instances(folder: Path) -> dict[str, str]:
    path = _library_file(folder, "instance.json")
    if path is None:
        return {}
    found = read_json(path)
    try:
        return {uid: str(about["instance_name"]) for uid, about in found.items()}
    except (KeyError, TypeError, AttributeError) as error:
        raise InputError(f"{path}: not HOT3D's list of objects ({type(error).__name__}); get it again") from None


def _library_file(folder: Path, name: str) -> Path | None:
    parents = list(folder.absolute().parents)[:2]
    places = [folder, *(parent / library for parent in parents for library in LIBRARIES), *parents[:1]]
    return next((place / name for place in places if (place / name).is_file()), None)


def _read_scene(path: Path, contents: Contents, request: Request) -> RecordedScene:
    folder = _folder(path)
    rows = _lines(folder)
    hands = hands_of(_read, path, contents, request, _sides(rows))
    first, count = int(rows[0]["timestamp_ns"]), hands[0].num_frames
    objects = _objects(folder, first, count, hands[0].fps)
    return make_scene(hands, objects, up=UP, source=f"HOT3D {folder.absolute().name}")


FORMAT = DatasetFormat(
    name=f"HOT3D (a sequence's folder with {HANDS})", recognises=_recognises, read=_read, read_scene=_read_scene
)
