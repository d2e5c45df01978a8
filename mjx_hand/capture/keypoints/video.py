"""Hands in a video, as keypoints, through MediaPipe
(https://ai.google.dev/edge/mediapipe/solutions/vision/hand_landmarker).

MediaPipe is an extra (`.[video]`). Release 0.10.14 is the last whose wheel carries the hand model itself and allows
NumPy 2; later ones fetch a model when they run. Its world landmarks are metres about the middle of the hand in the
camera's axes (x right, y down, z forward): they say how the hand is posed and turned, not where it is.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from mjx_hand.capture.keypoints.layouts import NUM_KEYPOINTS
from mjx_hand.capture.keypoints.recording import SIDES, KeypointRecording, check_keypoints
from mjx_hand.errors import InputError

MAX_HANDS = 2
MIRRORED_SIDE = {"Left": "right", "Right": "left"}  # MediaPipe takes every image for a mirror's


def track_video(path: str | Path, progress: Callable[[int, int], None] | None = None) -> dict[str, KeypointRecording]:
    """The hands in a video, by the side that MediaPipe takes them for; at most one a side.

    The recordings leave their side open: the fingers tell it more surely than the label does (`side.known_side`).

    Args:
        path: a video that OpenCV reads.
        progress: told after each frame how many are done, and how many there are (0 if the file does not say).

    Raises:
        InputError: MediaPipe is not installed, the file is no video, or no frame shows a hand.
    """
    path = Path(path)
    if not path.is_file():
        raise InputError(f"{path}: no such file; give the path of a video")
    try:
        import cv2  # pyright: ignore[reportMissingImports]
        import mediapipe  # pyright: ignore[reportMissingImports]
    except ImportError as error:
        raise InputError(f"reading a video needs MediaPipe ({error}): .venv/bin/pip install -e '.[video]'") from None
    video = cv2.VideoCapture(str(path))
    fps, total = video.get(cv2.CAP_PROP_FPS), max(int(video.get(cv2.CAP_PROP_FRAME_COUNT)), 0)
    frames: list[dict[str, Float[np.ndarray, "21 3"]]] = []
    with mediapipe.solutions.hands.Hands(max_num_hands=MAX_HANDS) as tracker:
        while True:
            there, image = video.read()
            if not there:
                break
            result = tracker.process(cv2.cvtColor(image, cv2.COLOR_BGR2RGB))
            frames.append(_hands(result))
            if progress is not None:
                progress(len(frames), total)
    video.release()
    if not frames or not fps > 0:
        raise InputError(f"{path}: not a video that OpenCV reads; give an .mp4, .mov or .avi")
    found = {}
    for side in SIDES:
        if any(side in hands for hands in frames):
            missing = np.full((NUM_KEYPOINTS, 3), np.nan)
            positions = np.stack([hands.get(side, missing) for hands in frames])
            recording = KeypointRecording(fps=float(fps), positions=positions, source=f"MediaPipe on {path.name}")
            found[side] = check_keypoints(recording)
    if not found:
        raise InputError(f"{path}: MediaPipe sees no hand in any of its {len(frames)} frames")
    return found


def _hands(result: Any) -> dict[str, Float[np.ndarray, "21 3"]]:
    """The hands in one image; of two that are taken for the same side, the surer one."""
    worlds: list[Any] = result.multi_hand_world_landmarks or []  # None where there is no hand
    labels: list[Any] = result.multi_handedness or []
    found: dict[str, tuple[float, Float[np.ndarray, "21 3"]]] = {}
    for world, label in zip(worlds, labels, strict=True):
        kind = label.classification[0]
        points = np.array([[p.x, p.y, p.z] for p in world.landmark], float)
        side = MIRRORED_SIDE[kind.label]
        if side not in found or found[side][0] < kind.score:
            found[side] = (kind.score, points)
    return {side: points for side, (_, points) in found.items()}
