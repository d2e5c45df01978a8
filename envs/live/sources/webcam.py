"""`Webcam`: a camera of this computer, through MediaPipe (extra `video`)."""

import threading
import time
from typing import Any

import numpy as np
from jaxtyping import Float

from envs.live.flow.arrival import Arrival
from envs.live.flow.timing import Timing
from envs.live.sources.source import Put
from mjx_hand.capture.keypoints.layouts import NUM_KEYPOINTS, PALM
from mjx_hand.capture.keypoints.video import MIRRORED_SIDE
from mjx_hand.errors import InputError

_VIEW = np.deg2rad(60.0)  # horizontal angle of view; most laptops' cameras have 55 to 70 degrees
_PALM = list(PALM)


class Webcam:
    """One hand before a camera; see `Source`.

    MediaPipe says how the hand is posed, in metres about its middle, and where its landmarks are in the image. How far
    it is follows from how large its palm looks, for a camera of a usual angle of view; one of another angle makes all
    distances from it longer or shorter alike.

    Args:
        side: "right" or "left".
        number: of the camera, 0 the first.

    Raises:
        InputError: MediaPipe is not installed, or there is no such camera.
    """

    def __init__(self, side: str, number: int = 0):
        try:
            import cv2  # pyright: ignore[reportMissingImports]
            import mediapipe  # pyright: ignore[reportMissingImports]
        except ImportError as error:
            raise InputError(
                f"a webcam needs MediaPipe ({error}): pip install 'mjx-hand[video]' with Python 3.12 or older; or give "
                "--source udp, ws, webxr or a file"
            ) from None
        self.name, self.forward = f"camera {number}", "-z"
        self.up: str | None = "-y"
        self._side, self._cv2, self._mediapipe = side, cv2, mediapipe
        self._camera = cv2.VideoCapture(number)
        if not self._camera.isOpened():
            raise InputError(
                f"there is no camera {number}; connect one, give another --camera, or give --source udp, ws, webxr or "
                "a file"
            )
        self._camera.set(cv2.CAP_PROP_BUFFERSIZE, 1)

    def run(self, put: Put, stop: threading.Event, timing: Timing) -> None:
        """See `Source`."""
        with self._mediapipe.solutions.hands.Hands(max_num_hands=2) as tracker:
            while not stop.is_set():
                there, image = self._camera.read()
                if not there:
                    raise InputError(f"{self.name} gives no more pictures; is it still connected?")
                at = time.monotonic()
                found = tracker.process(self._cv2.cvtColor(image, self._cv2.COLOR_BGR2RGB))
                height, width = image.shape[:2]
                put(Arrival(seen_keypoints(found, self._side, width, height), at, spent=time.monotonic() - at))
        self._camera.release()


def seen_keypoints(result: Any, side: str, width: int, height: int) -> Float[np.ndarray, "21 3"]:
    """The keypoints (m, camera axes) of the hand of a side in MediaPipe's result; all NaN where it is not there.

    Args:
        result: of `solutions.hands`.
        side: "right" or "left".
        width, height: of the image (pixels).
    """
    missing = np.full((NUM_KEYPOINTS, 3), np.nan)
    worlds, images = result.multi_hand_world_landmarks or [], result.multi_hand_landmarks or []
    for world, image, label in zip(worlds, images, result.multi_handedness or [], strict=True):
        if MIRRORED_SIDE[label.classification[0].label] == side:
            pixels = np.array([[p.x * width, p.y * height] for p in image.landmark], float)
            return placed_before_camera(
                np.array([[p.x, p.y, p.z] for p in world.landmark], float), pixels, width, height
            )
    return missing


def placed_before_camera(
    points: Float[np.ndarray, "21 3"], pixels: Float[np.ndarray, "21 2"], width: int, height: int
) -> Float[np.ndarray, "21 3"]:
    """A hand where a camera of the usual angle of view sees it.

    Args:
        points: of the hand about its middle (m, camera axes).
        pixels: the same in the image.
        width, height: of the image (pixels).
    """
    focal = width / 2 / np.tan(_VIEW / 2)
    flat, spot = points[_PALM, :2], pixels[_PALM]
    size, seen = np.linalg.norm(flat - flat.mean(axis=0)), np.linalg.norm(spot - spot.mean(axis=0))
    distance = focal * size / max(seen, 1e-6)
    middle = (spot.mean(axis=0) - [width / 2, height / 2]) * distance / focal
    return points + np.array([*(middle - flat.mean(axis=0)), distance])
