"""`mjx-hand view`: a recording in the browser."""

from pathlib import Path
from typing import Annotated, Literal

import tyro

from mjx_hand.capture.datasets.mano_motion import mano_file
from mjx_hand.capture.keypoint_files.load_keypoints import is_keypoint_file, load_keypoints
from mjx_hand.capture.keypoint_fit.fit import fit_keypoints
from mjx_hand.capture.keypoints.side import known_side
from mjx_hand.capture.load_scene import load_scene
from mjx_hand.capture.marker_files.load_markers import load_markers
from mjx_hand.errors import InputError
from mjx_hand.files.npz_archive import schema_of
from mjx_hand.hand.load import load_hand
from mjx_hand.motion import demonstration, joint_motion, load_demonstration, load_joint_motion
from mjx_hand.view.browser.recording_scene import (
    demonstration_scene,
    joint_motion_scene,
    motion_scene,
    recorded_scene,
    with_keypoints,
    with_markers,
)
from mjx_hand.view.browser.scene import Scene
from mjx_hand.view.browser.viewer import PORT, serving

UP = "+z"
Up = Literal["+x", "-x", "+y", "-y", "+z", "-z"]


def view(
    recording: Annotated[Path, tyro.conf.Positional],
    markers: Path | None = None,
    units: str | None = None,
    side: Literal["right", "left"] | None = None,
    sequence: str | None = None,
    fps: float | None = None,
    up: Up | None = None,
    mano: Path | None = None,
    port: int = PORT,
    host: str = "127.0.0.1",
) -> None:
    """Show a recording in the browser, until Ctrl-C.

    Args:
        recording: a motion or a scene of any format that is read, hand keypoints, a joint motion, or a demonstration.
        markers: the marker recording that the motion was fitted to, to lay over it.
        units: m, cm, mm or in, where the marker file's own unit is wrong or missing.
        side: which hand, where the file holds both or does not say.
        sequence: the name of one recording in the file, where there are several.
        fps: frames per second, where the file does not say.
        up: the recording's upward axis, where it does not say; +z if not given: +y for Leap and XR devices, -y for most
            cameras.
        mano: a licensed MANO file, for recordings made with one; without it, the open hand.
        port: to serve at; 0 chooses a free one.
        host: address to listen on; 0.0.0.0 lets other computers connect too.
    """
    seen = load_markers(markers, units, fps) if markers is not None else None
    scene = recording_scene(recording, side, sequence, fps, up, mano)
    if seen is not None:
        scene = with_markers(scene, seen)
    with serving(scene, port, host) as viewer:
        viewer.play()
        print(f"{recording}: open {viewer.url} in a browser; Ctrl-C here ends it", flush=True)
        if viewer.public:
            print(f"anyone who can reach this computer at {host}:{viewer.server.get_port()} can watch and control it")
        viewer.wait()


def recording_scene(
    path: Path, side: str | None, sequence: str | None, fps: float | None, up: str | None, mano: Path | None
) -> Scene:
    """What a file shows, by its kind.

    Raises:
        InputError: it cannot be read, or something was said that does not go with its kind.
    """
    schema = schema_of(path)
    if schema in (joint_motion.SCHEMA, demonstration.SCHEMA):
        if side or sequence or fps:
            raise InputError(f"{path}: says its side and rate itself; leave out --side, --sequence and --fps")
        if schema == demonstration.SCHEMA:
            shown = load_demonstration(path)
            return demonstration_scene(shown, load_hand(mano, shown.motion.side))
        angles = load_joint_motion(path)
        return joint_motion_scene(angles, load_hand(mano, angles.side), up or UP)
    if is_keypoint_file(path):
        seen = load_keypoints(path, side=side, sequence=sequence, fps=fps)
        hand = load_hand(mano, known_side(seen, side)[0])
        motion, report = fit_keypoints(seen, hand)
        return with_keypoints(motion_scene(motion, hand, up or UP), seen.positions, report.fitted)
    found = load_scene(path, side=side, sequence=sequence, fps=fps, mano=mano)
    if len(found.hands) == 1 and not found.objects:
        motion = found.hands[0]
        return motion_scene(motion, load_hand(mano_file(mano, motion.side), motion.side), up or UP)
    hands = {hand.side: load_hand(mano_file(mano, hand.side), hand.side) for hand in found.hands}
    return recorded_scene(found, hands, up)
