"""What is in each kind of file, as labels and texts for people."""

import xml.etree.ElementTree as ElementTree
from pathlib import Path

import numpy as np

from mjx_hand.capture.marker_files.load_markers import load_markers
from mjx_hand.capture.markers.labels import label_starts, match_labels
from mjx_hand.capture.markers.marker_recording import MarkerRecording
from mjx_hand.capture.markers.marker_set import INCLUDED, included_marker_set
from mjx_hand.errors import InputError
from mjx_hand.hand.load import load_hand
from mjx_hand.hand.mano_file import load_mano_file
from mjx_hand.motion import Demonstration, JointMotion, Motion
from mjx_hand.robots.robot_motion import RobotMotion

Facts = tuple[tuple[str, str], ...]

MOST_STARTS = 16  # of labels that are tried as a prefix: more are not people, but other words
BIGGEST_ROOM = 30.0  # m; what is bigger is in another unit


def motion(found: Motion) -> Facts:
    """Of a motion."""
    return (
        ("hand", f"{found.side}, {len(found.shape)} shape coefficients{_own_joints(found)}"),
        frames(found.num_frames, found.fps),
        ("gaps", share_missing(~found.valid)),
        ("units", "metres, radians, seconds; quaternions wxyz"),
        ("wrist", _travel(found.wrist_position[found.valid])),
        ("source", found.source or "not said"),
        *_warnings(found.warnings),
    )


def joint_motion(found: JointMotion) -> Facts:
    """Of a joint motion."""
    return (
        ("hand", f"{found.side}, {found.angles.shape[1]} hinges"),
        frames(found.num_frames, found.fps),
        ("gaps", f"{share_missing(~found.valid)}{', interpolated' if not found.valid.all() else ''}"),
        ("units", "radians, metres, seconds; quaternions wxyz"),
        ("wrist", _travel(found.wrist_position)),
        ("source", found.source or "not said"),
        *_warnings(found.warnings),
    )


def robot_motion(found: RobotMotion) -> Facts:
    """Of a robot hand's motion."""
    return (
        ("robot", f"{found.robot or 'not said'}, {len(found.joint_names)} joints: {', '.join(found.joint_names)}"),
        frames(len(found.values), found.fps),
        ("gaps", f"{share_missing(~found.valid)}{', interpolated' if not found.valid.all() else ''}"),
        ("units", "radians, metres, seconds; quaternions wxyz"),
        ("base", _travel(found.base_position)),
        ("source", found.source or "not said"),
        *_warnings(found.warnings),
    )


def demonstration(found: Demonstration) -> Facts:
    """Of a demonstration."""
    description = found.object
    size = " x ".join(f"{1e3 * s:.0f}" for s in description.size if s > 0)
    kind = (
        f"{description.kind} of {len(description.hulls)} convex pieces"
        if description.kind == "mesh"
        else description.kind
    )
    return (
        ("grasp", found.grasp),
        ("object", f"{kind}, {size} mm (half extents or radius), {1e3 * description.mass:.0f} g"),
        *joint_motion(found.motion),
    )


def markers(path: Path, units: str | None = None, fps: float | None = None) -> tuple[Facts, str]:
    """Of a marker recording: what is in it, and the options of `mjx-hand fit` that suit it best."""
    found = load_markers(path, units, fps)
    suits, options = _suitable_set(found)
    missing = 1 - found.visible.mean(axis=0)
    worst = np.argsort(-missing)[:3]
    holes = ", ".join(f"{found.names[m]} {100 * missing[m]:.1f} %" for m in worst if missing[m] > 0)
    at = found.positions[found.visible]
    extent = np.ptp(at, axis=0) if len(at) else np.zeros(3)
    doubt = "; no capture volume is this large, give --units" if extent.max() > BIGGEST_ROOM else ""
    return (
        ("markers", f"{len(found.names)}: {', '.join(found.names)}"),
        frames(found.num_frames, found.fps),
        ("gaps", share_missing(~found.visible) + (f" (most: {holes})" if holes else "")),
        ("units", f"metres, from the file's {units if units else 'own unit'}"),
        ("extent", f"{' x '.join(f'{e:.3g}' for e in extent)} m over all frames{doubt}"),
        ("marker set", suits),
        *_warnings(found.warnings),
    ), options + (f" --units {units}" if units else "") + (f" --fps {fps:g}" if fps else "")


def _suitable_set(found: MarkerRecording) -> tuple[str, str]:
    """The included marker set of which a recording has most, in words and as options."""
    hand = load_hand()
    most, suits, options = 0.0, f"none of {', '.join(INCLUDED)}", "--markers MARKER_SET.yaml"
    for name in INCLUDED:
        marker_set = included_marker_set(hand, name)
        starts = label_starts(found.names, marker_set)
        for start in ("", *starts[:MOST_STARTS]):
            try:
                share = len(match_labels(found, marker_set, start).recording.names) / len(marker_set.names)
            except InputError:  # none of its labels, or two hands
                continue
            if share > most:
                most, suits = share, f"{name}, of whose markers it has {100 * share:.0f} %"
                options = f"--markers {name}"
                if start:
                    suits += f" after {start!r}" + (f"; labels begin with {', '.join(starts)}" if starts[1:] else "")
                    options += f" --prefix {start}"
    return suits, options


def mano(path: Path) -> tuple[str, Facts]:
    """Of a MANO file: its side, and what is in it.

    Raises:
        InputError: it cannot be used for either side.
    """
    side = "right"
    try:
        hand = load_mano_file(path, side)
    except InputError as error:
        if "holds a left hand" not in str(error):
            raise
        side = "left"
        hand = load_mano_file(path, side)
    return side, (
        (
            "hand",
            f"{side}, {hand.num_vertices} vertices, {len(hand.faces)} triangles, {hand.num_shape} shape components",
        ),
        ("units", "metres, flat hand at rest; poses of this file are relative to its hands_mean where so recorded"),
    )


def robot(path: Path) -> tuple[str, Facts]:
    """Of a URDF or MJCF: which it is, and how many links and movable joints it has.

    Raises:
        InputError: it is not XML, or of another kind.
    """
    try:
        root = ElementTree.parse(path).getroot()
    except (ElementTree.ParseError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: not readable XML ({error}); export it again") from None
    if root.tag == "robot":
        movable = [j for j in root.iter("joint") if j.get("type") not in (None, "fixed")]
        facts = ("links", str(len(root.findall("link")))), ("joints", f"{len(movable)} that move")
        return f"URDF of the robot {root.get('name', 'without a name')!r}", facts
    if root.tag == "mujoco":
        bodies, joints = sum(1 for _ in root.iter("body")), sum(1 for _ in root.iter("joint"))
        return f"MJCF of the model {root.get('model', 'without a name')!r}", (
            ("bodies", str(bodies)),
            ("joints", str(joints)),
        )
    raise InputError(f"{path}: XML of {root.tag!r}, neither a URDF (robot) nor an MJCF (mujoco)")


def _warnings(warnings: tuple[str, ...]) -> Facts:
    return tuple(("warning", warning) for warning in warnings)


def frames(count: int, fps: float) -> tuple[str, str]:
    """How many frames there are, and for how long."""
    return "frames", f"{count} at {fps:g}/s ({count / fps:.1f} s)"


def share_missing(missing: np.ndarray) -> str:
    """How much is missing, in per cent."""
    return f"{100 * missing.mean():.1f} %" if missing.any() else "none"


def _travel(positions: np.ndarray) -> str:
    span = np.ptp(positions, axis=0)
    return f"moves within {' x '.join(f'{1e3 * s:.0f}' for s in span)} mm"


def _own_joints(found: Motion) -> str:
    return ", the subject's own joint centres" if found.link_offset is not None else ""
