"""What is known of a file, for people: its kind, its facts, and the commands that take it further."""

import math
from dataclasses import dataclass
from pathlib import Path

from mjx_hand.capture.datasets.contents import read_contents
from mjx_hand.capture.datasets.dataset_format import dataset_formats
from mjx_hand.capture.datasets.keypoints import FORMAT as KEYPOINTS
from mjx_hand.capture.keypoint_files.load_keypoints import is_keypoint_file
from mjx_hand.capture.load import load_motion
from mjx_hand.capture.marker_files.marker_format import marker_formats
from mjx_hand.capture.markers.marker_recording import SCHEMA as MARKERS
from mjx_hand.cli import facts_of
from mjx_hand.errors import InputError
from mjx_hand.files.npz_archive import schema_of
from mjx_hand.motion import load_demonstration, load_joint_motion
from mjx_hand.motion.demonstration import SCHEMA as DEMONSTRATION
from mjx_hand.motion.joint_motion import SCHEMA as JOINT_MOTION
from mjx_hand.robots.robot_motion import SCHEMA as ROBOT_MOTION
from mjx_hand.robots.robot_motion import load_robot_motion

VIDEOS = (".mp4", ".mov", ".avi", ".webm", ".mkv")
_MANO_KEYS = {"v_template", "J_regressor", "kintree_table"}


@dataclass(frozen=True)
class FileFacts:
    """What is known of a file.

    Attributes:
        kind: what it is, in a few words.
        facts: what and how much is in it, label and text.
        next: commands that take it further.
        sound: whether it could be read; else a fact says why not, or which choice it takes.
    """

    kind: str
    facts: tuple[tuple[str, str], ...]
    next: tuple[str, ...] = ()
    sound: bool = True


def file_facts(
    path: Path,
    side: str | None = None,
    sequence: str | None = None,
    mano: Path | None = None,
    fps: float | None = None,
    units: str | None = None,
) -> FileFacts:
    """What a file or folder is, what is in it and what to do with it.

    Args:
        path: of the file or folder.
        side, sequence, mano, fps: as `load_motion` takes them, where the recording leaves a choice.
        units: as `load_markers` takes them, where a marker file does not say its own.

    Raises:
        InputError: there is no such file, it is damaged, or nothing here reads it.
    """
    if fps is not None and not 0 < fps < math.inf:
        raise InputError(f"fps is {fps}; give frames per second, a number above 0")
    if not path.exists():
        raise InputError(f"{path}: no such file; give the path of a recording, a hand or a robot description")
    if path.is_file() and path.stat().st_size == 0:
        raise InputError(f"{path}: the file is empty; copy or export it again")
    return (
        _own(path, units)
        or _robot(path)
        or _keypoints(path, side, sequence, fps)
        or _motion(path, side, sequence, mano, fps)
        or _mano(path)
        or _markers(path, units)
        or _video(path)
        or _unknown(path)
    )


def _own(path: Path, units: str | None) -> FileFacts | None:
    """Joint motions, of robots too, and demonstrations; motions, markers, keypoints are found among the recordings."""
    schema = schema_of(path)
    out = path.with_suffix("")
    if schema == JOINT_MOTION:
        facts = facts_of.joint_motion(load_joint_motion(path))
        return FileFacts(f"joint motion ({schema})", facts, (f"mjx-hand view {path}",))
    if schema == DEMONSTRATION:
        facts = facts_of.demonstration(load_demonstration(path))
        return FileFacts(f"demonstration ({schema})", facts, (f"mjx-hand view {path}",))
    if schema == ROBOT_MOTION:
        load = f"in Python: mjx_hand.robots.robot_motion.load_robot_motion({str(path)!r})"
        return FileFacts(f"robot motion ({schema})", facts_of.robot_motion(load_robot_motion(path)), (load,))
    if schema == MARKERS:
        return _marker_facts(path, f"markers ({schema})", out, units)
    return None


def _robot(path: Path) -> FileFacts | None:
    if path.suffix.lower() not in (".urdf", ".xml"):
        return None
    kind, facts = facts_of.robot(path)
    load = "yourdfpy.URDF.load" if kind.startswith("URDF") else "mujoco.MjModel.from_xml_path"
    return FileFacts(kind, facts, (f"in Python: {load}({str(path)!r})",))


def _keypoints(path: Path, side: str | None, sequence: str | None, fps: float | None) -> FileFacts | None:
    if not path.is_file() or not is_keypoint_file(path):
        return None
    form, facts, choice = facts_of.keypoints(path, side, sequence, fps)
    out = path.with_suffix("").name
    commands = (f"mjx-hand view {path}{choice}", f"mjx-hand keypoints {path} --out {out}.motion.npz{choice}")
    return FileFacts(form, facts, commands)


def _motion(
    path: Path, side: str | None, sequence: str | None, mano: Path | None, fps: float | None
) -> FileFacts | None:
    contents = read_contents(path)
    known = next((f for f in dataset_formats() if f is not KEYPOINTS and f.recognises(path, contents)), None)
    if known is None:
        return None
    said = {"side": side, "sequence": sequence, "mano": mano, "fps": fps}
    choice = "".join(f" --{name} {value}" for name, value in said.items() if value is not None)
    try:
        motion = load_motion(path, side=side, sequence=sequence, mano=mano, fps=fps)
    except InputError as error:
        # Of a known format, but it takes a choice to read it, or it is not sound: its own line says which.
        return FileFacts(known.name, (("to read it", str(error).removeprefix(f"{path}: ")),), sound=False)
    commands = (f"mjx-hand view {path}{choice}", f"mjx-hand retarget {path} --out angles.npz{choice}")
    return FileFacts(known.name, facts_of.motion(motion), commands)


def _mano(path: Path) -> FileFacts | None:
    values = read_contents(path)
    if not set(values) >= _MANO_KEYS:
        return None
    side, facts = facts_of.mano(path)
    return FileFacts("MANO hand", facts, (f"mjx-hand build --out my_hand --side {side} --mano {path}",))


def _markers(path: Path, units: str | None) -> FileFacts | None:
    known = next((f for f in marker_formats() if path.suffix.lower() in f.suffixes and path.suffix != ".npz"), None)
    return None if known is None or not path.is_file() else _marker_facts(path, known.name, path.with_suffix(""), units)


def _marker_facts(path: Path, kind: str, out: Path, units: str | None) -> FileFacts:
    facts, options = facts_of.markers(path, units)
    return FileFacts(kind, facts, (f"mjx-hand fit {path} {options} --out {out.name}.motion.npz",))


def _video(path: Path) -> FileFacts | None:
    if path.suffix.lower() not in VIDEOS:
        return None
    fact = ("to read it", "MediaPipe, the extra 'video', finds the hand's keypoints")
    return FileFacts("video", (fact,), (f"mjx-hand track {path} --out {path.stem}.keypoints.npz",))


def _unknown(path: Path) -> FileFacts:
    if schema := schema_of(path):
        raise InputError(f"{path}: schema {schema}, which this version of mjx-hand does not read; make it again")
    names = [f.name for f in (*dataset_formats(), *marker_formats())]
    names += ["joint motion", "robot motion", "demonstration", "MANO", "URDF", "MJCF"]
    short = dict.fromkeys(name.split(" (")[0] for name in names)
    raise InputError(f"{path}: nothing that is known here; known are {', '.join(short)}")
