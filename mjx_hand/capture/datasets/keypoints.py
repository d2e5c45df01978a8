"""Hand keypoints (MediaPipe, Leap, WebXR, OpenXR, ARKit, MRTK, Quest), fitted with a hand as they are read.

The open hand, or the licensed one that is asked for, takes its shape from the bone lengths. `mjx-hand keypoints` makes
the same motion and also filters, and reports how far it is from the keypoints.
"""

from pathlib import Path

from mjx_hand.capture.datasets.dataset_format import Contents, DatasetFormat, Request
from mjx_hand.capture.keypoint_files.load_keypoints import keypoint_contents, load_keypoints, recognised
from mjx_hand.capture.keypoint_fit.fit import fit_keypoints
from mjx_hand.capture.keypoints.side import known_side
from mjx_hand.hand.load import load_hand
from mjx_hand.motion import Motion


def _recognises(path: Path, contents: Contents) -> bool:
    return path.is_file() and recognised(path, keypoint_contents(path, contents)) is not None


def _read(path: Path, contents: Contents, request: Request) -> Motion:
    recording = load_keypoints(path, side=request.side, sequence=request.sequence, fps=request.fps)
    side, _ = known_side(recording, request.side)
    return fit_keypoints(recording, load_hand(request.mano, side))[0]


FORMAT = DatasetFormat(
    name="hand keypoints (.json, .csv, .npz, .npy, .pkl)", recognises=_recognises, read=_read, has_sequences=True
)
