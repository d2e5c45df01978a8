"""Made-up recordings of a flat hand and a box of which everything is known: who moves it when, and where it rests."""

from collections.abc import Sequence

import numpy as np
from scipy.spatial.transform import Rotation

from mjx_hand.motion.make_scene import make_scene, recorded_object
from mjx_hand.motion.motion import Motion
from mjx_hand.motion.scene import RecordedScene

FPS = 50.0
HALF = np.array([0.03, 0.02, 0.05])
BOX = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * HALF
FACES = np.array([
    [0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4],
    [1, 5, 7], [1, 7, 3],
])  # fmt: skip
AWAY, AT = np.array([0.35, 0.0, 0.25]), np.array([0.10, 0.0, 0.045])  # of the wrist from the box: fingers along −x


def smooth(times: np.ndarray, begin: float, end: float) -> np.ndarray:
    """0 before, 1 after, minimum jerk between."""
    x = np.clip((times - begin) / (end - begin), 0, 1)
    return x**3 * (10 - 15 * x + 6 * x**2)


def motion(position: np.ndarray, side: str = "right", shape: int = 10) -> Motion:
    frames = len(position)
    return Motion(
        fps=FPS,
        rotations=np.tile(np.eye(3), (frames, 15, 1, 1)),
        wrist_position=position,
        wrist_quaternion=np.tile([1.0, 0, 0, 0], (frames, 1)),
        shape=np.zeros(shape),
        valid=np.ones(frames, bool),
        side=side,
    )


def way(times: np.ndarray, steps: Sequence[tuple[float, float, Sequence[float]]]) -> np.ndarray:
    """Of points: from the origin on by each step's vector, between its times."""
    return sum((smooth(times, a, b)[:, None] * np.asarray(by, float) for a, b, by in steps), np.zeros((len(times), 3)))


def scene(
    box: np.ndarray,
    hands: list[Motion],
    turn: Rotation | None = None,
    place: np.ndarray | None = None,
    spin: Rotation | None = None,
    up: str | None = "+z",
) -> RecordedScene:
    """The box's centre at `box`, turned by `spin`; all of it seen in axes that are turned and displaced."""
    frames = len(box)
    seen = Rotation.identity() if turn is None else turn
    shift = np.zeros(3) if place is None else place
    own = Rotation.identity(frames) if spin is None else spin
    quaternion = (seen * own).as_quat(scalar_first=True)
    poses = np.concatenate([seen.apply(box) + shift, quaternion], axis=1)
    moved = [
        Motion(
            **{
                **{f: getattr(h, f) for f in ("fps", "rotations", "shape", "valid", "side")},
                "wrist_position": seen.apply(h.wrist_position) + shift,
                "wrist_quaternion": np.tile(seen.as_quat(scalar_first=True), (frames, 1)),
            }
        )
        for h in hands
    ]
    return make_scene(moved, recorded_object("box", poses, mesh=(BOX, FACES)), up=up, source="made up")
