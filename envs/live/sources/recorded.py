"""`Recorded`: a recording at its own pace: keypoints, motions, scenes and demonstrations of any kind that is read."""

import threading
import time
from pathlib import Path

import numpy as np
from jaxtyping import Float

from envs.demonstrations.twin_hands import twins
from envs.live.flow.arrival import Arrival
from envs.live.flow.timing import Timing
from envs.live.sources.source import Put
from envs.live.twin.hinge_keypoints import hinge_keypoints
from envs.live.twin.person import KnownHand
from mjx_hand.capture.keypoint_files.load_keypoints import is_keypoint_file, load_keypoints
from mjx_hand.capture.keypoints.side import known_side
from mjx_hand.capture.load_scene import load_scene
from mjx_hand.errors import InputError
from mjx_hand.files.npz_archive import schema_of
from mjx_hand.hand.load import load_hand
from mjx_hand.motion import demonstration
from mjx_hand.motion.demonstration import Demonstration, load_demonstration
from mjx_hand.retarget.sequence import rigid_hand_of
from mjx_hand.rigid.build import build_rigid_hand
from mjx_hand.robots.motion_keypoints import motion_keypoints

_CAMERAS = ("mediapipe", "vision")  # layouts whose frames mostly are a camera's, y down
_LATE = 0.1  # s; a recording that is later than that, since the machine slept, goes on from where it is


class Recorded:
    """Frames of a recording, in time; see `Source`.

    Args:
        keypoints: of all frames (m); NaN where one is missing.
        fps: frames a second.
        name: for people.
        side: "right" or "left".
        up, forward: see `Source`.
        loop: begin again at the end.
        hand: the person's, where it is known.
        demonstration: where it is one, for its object.
    """

    def __init__(
        self,
        keypoints: Float[np.ndarray, "t 21 3"],
        fps: float,
        name: str,
        side: str,
        up: str | None = "+y",
        forward: str = "-z",
        loop: bool = True,
        hand: KnownHand | None = None,
        demonstration: Demonstration | None = None,
    ):
        self.keypoints, self.fps, self.name, self.side = keypoints, fps, name, side
        self.up, self.forward, self.loop, self.hand, self.demonstration = up, forward, loop, hand, demonstration

    def run(self, put: Put, stop: threading.Event, timing: Timing) -> None:
        """See `Source`."""
        begin = time.monotonic()
        while True:
            for k, points in enumerate(self.keypoints):
                late = time.monotonic() - begin - k / self.fps
                if late > _LATE:
                    begin += late
                elif late < 0 and stop.wait(-late):
                    return
                put(Arrival(points, time.monotonic(), again=k == 0))
            begin += len(self.keypoints) / self.fps
            if not self.loop or stop.wait(max(0.0, begin - time.monotonic())):
                return


def open_recording(
    path: Path, side: str | None = None, fps: float | None = None, up: str | None = None, loop: bool = True
) -> Recorded:
    """The recording in a file.

    Args:
        path: keypoints, a motion or a scene of any form that is read, or a demonstration.
        side: which hand, where there are both or the file does not say.
        fps: frames a second, where the file does not say.
        up: its axis against gravity, where the file does not say.
        loop: begin again at the end.

    Raises:
        InputError: it cannot be read, or something was said that does not go with its kind.
    """
    if schema_of(path) == demonstration.SCHEMA:
        if side or fps or up:
            raise InputError(f"{path}: says its side, rate and up itself; leave out --side, --fps and --up")
        return demonstration_source(load_demonstration(path), path.name, loop)
    if path.is_file() and is_keypoint_file(path):
        seen = load_keypoints(path, side=side, fps=fps)
        if seen.fps is None:
            raise InputError(f"{path}: does not say its frame rate; give --fps")
        camera = seen.layout in _CAMERAS
        which, _ = known_side(seen, side)
        up = up or ("-y" if camera else "+y")
        return Recorded(seen.positions, float(seen.fps), path.name, which, up, loop=loop)
    scene = load_scene(path, side=side, fps=fps)
    if not scene.hands:
        raise InputError(f"{path}: has no hand; give a recording of one")
    motion = scene.hands[0]
    found = motion_keypoints(motion, rigid_hand_of(motion, load_hand(side=motion.side))).positions
    hand = None
    if motion.link_offset is None:  # a shape says all of the hand; joint centres alone are measured as a stranger's
        shape = np.asarray(motion.shape, float)
        hand = KnownHand(build_rigid_hand(load_hand(side=motion.side), shape), shape)
    up = up or (_axis(scene.up) if scene.up is not None else "+z")
    return Recorded(found, float(motion.fps), path.name, motion.side, up, forward="+x", loop=loop, hand=hand)


def demonstration_source(shown: Demonstration, name: str, loop: bool = True) -> Recorded:
    """A demonstration's hand as keypoints, in the world of its table.

    Args:
        shown: the demonstration.
        name: for people.
        loop: begin again at the end.
    """
    rigid, motion = twins([shown])[0], shown.motion
    points = hinge_keypoints(motion.angles, motion.wrist_position, motion.wrist_quaternion, rigid)
    return Recorded(
        points,
        float(motion.fps),
        name,
        motion.side,
        up=None,
        forward="+x",
        loop=loop,
        hand=KnownHand(rigid, np.asarray(shown.shape, float)),
        demonstration=shown,
    )


def _axis(up: Float[np.ndarray, "3"]) -> str:
    """The axis that is nearest to a direction."""
    k = int(np.argmax(np.abs(up)))
    return f"{'+' if up[k] > 0 else '-'}{'xyz'[k]}"
