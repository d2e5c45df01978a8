"""What is known of a file, for people: its kind, its facts, and the commands that take it further."""

import math
import shlex
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mjx_hand.capture.datasets.dataset_format import dataset_formats
from mjx_hand.capture.datasets.keypoints import FORMAT as KEYPOINTS
from mjx_hand.capture.keypoint_files.load_keypoints import keypoint_contents, recognised
from mjx_hand.capture.load import load_motion
from mjx_hand.capture.load_scene import load_scene
from mjx_hand.capture.marker_files.load_markers import marker_format_of
from mjx_hand.capture.markers.marker_recording import SCHEMA as MARKERS
from mjx_hand.capture.unread import described_for_reading
from mjx_hand.cli.facts import facts_of
from mjx_hand.cli.facts.keypoint_facts import keypoint_facts
from mjx_hand.cli.facts.scene_facts import scene_facts
from mjx_hand.cli.facts.yaml_facts import yaml_facts
from mjx_hand.cli.terminal.wording import as_options
from mjx_hand.errors import InputError
from mjx_hand.files.contents import read_contents
from mjx_hand.files.input_file import check_input_file
from mjx_hand.files.npz_archive import schema_of
from mjx_hand.motion import load_demonstration, load_joint_motion
from mjx_hand.motion.demonstration import SCHEMA as DEMONSTRATION
from mjx_hand.motion.joint_motion import SCHEMA as JOINT_MOTION
from mjx_hand.robots.robot_motion import SCHEMA as ROBOT_MOTION
from mjx_hand.robots.robot_motion import load_robot_motion

VIDEOS = (".mp4", ".mov", ".avi", ".webm", ".mkv")
_MANO_KEYS = {"v_template", "J_regressor", "kintree_table"}
_LOOKED_AT = 20  # files of a suffix, to tell whether recordings are in a folder


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
    if not path.is_dir():
        check_input_file(path, "give the path of a recording, a hand or a robot description")
    own = _own(path, units, fps) or _robot(path) or yaml_facts(path)
    if own is not None:
        return own if isinstance(own, FileFacts) else FileFacts(*own)
    contents = read_contents(path)
    return (
        _keypoints(path, contents, side, sequence, fps)
        or _motion(path, contents, side, sequence, mano, fps)
        or _mano(path, contents)
        or _markers(path, units, fps)
        or _video(path)
        or _folder(path)
        or _unknown(path, contents)
    )


def _own(path: Path, units: str | None, fps: float | None) -> FileFacts | None:
    """Joint motions, of robots too, and demonstrations; motions, markers, keypoints are found among the recordings."""
    schema = schema_of(path)
    view = (f"mjx-hand view {_quoted(path)}",)
    if schema == JOINT_MOTION:
        return FileFacts(f"joint motion ({schema})", facts_of.joint_motion(load_joint_motion(path)), view)
    if schema == DEMONSTRATION:
        return FileFacts(f"demonstration ({schema})", facts_of.demonstration(load_demonstration(path)), view)
    if schema == ROBOT_MOTION:
        load = f"in Python: mjx_hand.robots.robot_motion.load_robot_motion({str(path)!r})"
        return FileFacts(f"robot motion ({schema})", facts_of.robot_motion(load_robot_motion(path)), (load,))
    if schema == MARKERS:
        return _marker_facts(path, f"markers ({schema})", units, fps)
    return None


def _robot(path: Path) -> FileFacts | None:
    if path.suffix.lower() not in (".urdf", ".xml"):
        return None
    kind, facts = facts_of.robot(path)
    robot = f"mjx-hand robot RECORDING --urdf {_quoted(path)} --robot DESCRIPTION.yaml --out robot.npz"
    return FileFacts(kind, facts, (robot,) if kind.startswith("URDF") else ())


def _keypoints(
    path: Path, contents: Mapping[str, Any], side: str | None, sequence: str | None, fps: float | None
) -> FileFacts | None:
    if not path.is_file():
        return None
    found = keypoint_contents(path, contents)
    reader = recognised(path, found)
    if reader is None:
        return None
    facts, commands = keypoint_facts(path, reader, found, side, sequence, fps)
    return FileFacts(reader.name, facts, commands)


def _motion(
    path: Path,
    contents: Mapping[str, Any],
    side: str | None,
    sequence: str | None,
    mano: Path | None,
    fps: float | None,
) -> FileFacts | None:
    known = next((f for f in dataset_formats() if f is not KEYPOINTS and f.recognises(path, contents)), None)
    if known is None:
        return None
    said = {"side": side, "sequence": sequence, "mano": mano, "fps": fps}
    choice = "".join(f" --{name} {_quoted(value)}" for name, value in said.items() if value is not None)
    try:
        if known.read_scene is not None:
            found = load_scene(path, side=side, sequence=sequence, mano=mano, fps=fps)
            commands = (f"mjx-hand view {_quoted(path)}{choice}", _scene_command(path, choice, len(found.hands)))
            return FileFacts(known.name, scene_facts(found), commands)
        motion = load_motion(path, side=side, sequence=sequence, mano=mano, fps=fps)
    except InputError as error:
        # Of a known format, but it takes a choice to read it, or it is not sound: its own line says which.
        reason = as_options(str(error).removeprefix(f"{path}: "))
        return FileFacts(known.name, (("to read it", reason),), sound=False)
    file = _quoted(path)
    commands = (f"mjx-hand view {file}{choice}", f"mjx-hand retarget {file} --out angles.npz{choice}")
    return FileFacts(known.name, facts_of.motion(motion), commands)


def _scene_command(path: Path, choice: str, hands: int) -> str:
    if hands == 1:
        return f"mjx-hand retarget {_quoted(path)} --out angles.npz{choice}"
    return f"mjx-hand scene {_quoted(path)} --out scene.npz{choice}"


def _mano(path: Path, contents: Mapping[str, Any]) -> FileFacts | None:
    if not set(contents) >= _MANO_KEYS:
        return None
    side, facts = facts_of.mano(path)
    return FileFacts("MANO hand", facts, (f"mjx-hand build --out my_hand --side {side} --mano {_quoted(path)}",))


def _markers(path: Path, units: str | None, fps: float | None) -> FileFacts | None:
    if not path.is_file() or path.suffix.lower() == ".npz":
        return None
    known = marker_format_of(path)
    if known is None:
        return None
    try:
        return _marker_facts(path, known.name, units, fps)
    except InputError as error:
        if path.suffix.lower() != ".csv":
            raise
        # A table may be anybody's: what it holds says more than what it lacks as one of markers.
        reason = str(error).removeprefix(f"{path}: ")
        raise InputError(f"{path}: {described_for_reading(path, {})}; as markers: {reason}"[:600]) from None


def _marker_facts(path: Path, kind: str, units: str | None, fps: float | None) -> FileFacts:
    facts, options = facts_of.markers(path, units, fps)
    out = _quoted(f"{path.with_suffix('').name}.motion.npz")
    return FileFacts(kind, facts, (f"mjx-hand fit {_quoted(path)} {options} --out {out}",))


def _video(path: Path) -> FileFacts | None:
    if path.suffix.lower() not in VIDEOS:
        return None
    fact = ("to read it", "MediaPipe, the extra 'video', finds the hand's keypoints")
    out = _quoted(f"{path.stem}.keypoints.npz")
    return FileFacts("video", (fact,), (f"mjx-hand track {_quoted(path)} --out {out}",))


def _folder(path: Path) -> FileFacts | None:
    """A folder of recordings, as `mjx-hand retarget` takes it: those of one suffix at a time."""
    if not path.is_dir():
        return None
    files = [file for file in sorted(path.rglob("*")) if file.is_file() and not file.name.startswith(".")]
    of_suffix: dict[str, list[Path]] = {}
    for file in files:
        of_suffix.setdefault(file.suffix, []).append(file)
    some = {suffix: sum(map(_is_recording, own[:_LOOKED_AT])) for suffix, own in of_suffix.items()}
    if not any(some.values()):
        return None
    suffix = max(some, key=lambda each: (each == ".npz" and some[each] > 0, some[each]))
    looked = min(_LOOKED_AT, len(of_suffix[suffix]))
    facts = (
        ("files", f"{len(files)}, of them {len(of_suffix[suffix])} {suffix or 'without a suffix'}"),
        ("recordings", f"{some[suffix]} of the first {looked} {suffix}"),
    )
    pattern = "" if suffix == ".npz" else f" --pattern {_quoted(f'*{suffix}')}"
    return FileFacts("folder of recordings", facts, (f"mjx-hand retarget {_quoted(path)} --out angles{pattern}",))


def _is_recording(file: Path) -> bool:
    try:
        contents = read_contents(file)
        return any(known.recognises(file, contents) for known in dataset_formats())
    except InputError:
        return False


def _unknown(path: Path, contents: Mapping[str, Any]) -> FileFacts:
    if schema := schema_of(path):
        raise InputError(f"{path}: schema {schema[:60]}, which this version of mjx-hand does not read; make it again")
    raise InputError(
        f"{path}: nothing that is known here, but {described_for_reading(path, contents)}; "
        "docs/datasets.md lists what else is read"
    )


def _quoted(value: object) -> str:
    return shlex.quote(str(value))
