"""A scene that the tests know: a hand or two, and a box that moves."""

import numpy as np
from scipy.spatial.transform import Rotation

from mjx_hand.motion import Motion, RecordedObject, RecordedScene, make_scene, recorded_object

FPS, FRAMES = 30.0, 20
TETRAHEDRON = (
    np.array([[0.0, 0, 0], [0.06, 0, 0], [0, 0.06, 0], [0, 0, 0.06]]),
    np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]),
)


def still_hand(side: str = "right", frames: int = FRAMES, fps: float = FPS) -> Motion:
    """A flat hand whose wrist moves along x at 0.3 m/s."""
    place = np.zeros((frames, 3))
    place[:, 0] = 0.3 * np.arange(frames) / fps
    return Motion(
        fps=fps,
        rotations=np.tile(np.eye(3), (frames, 15, 1, 1)),
        wrist_position=place,
        wrist_quaternion=np.tile([1.0, 0, 0, 0], (frames, 1)),
        shape=np.zeros(10),
        valid=np.ones(frames, bool),
        side=side,
        source="made",
    )


def poses(frames: int = FRAMES, fps: float = FPS) -> np.ndarray:
    """An object that goes along x and y at constant speed and turns about z at 1 rad/s: the same at every rate."""
    time = np.arange(frames) / fps
    turn = Rotation.from_rotvec(np.outer(time, [0.0, 0.0, 1.0])).as_quat(scalar_first=True)
    place = np.array([0.0, 0.1, 0.05]) + np.outer(time, [0.3, 0.1, 0.0])
    return np.concatenate([place, turn], axis=1)


def tetrahedron(name: str = "wedge", frames: int = FRAMES, fps: float = FPS) -> RecordedObject:
    moved = poses(frames, fps)
    moved[3:5] = np.nan
    return recorded_object(name, moved, mesh=TETRAHEDRON)


def scene() -> RecordedScene:
    box = recorded_object("box", poses(), kind="box", size=(0.02, 0.03, 0.04))
    hands = [still_hand("left"), still_hand("right")]
    return make_scene(hands, [box, tetrahedron()], up="+z", source="made up")
