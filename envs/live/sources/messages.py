"""Messages of JSON, one a frame, from programs and headsets: what they say of the hand that is followed.

A message is an object with 21 keypoints in metres, or another device's joints by name, in any of the forms that
`mjx_hand.capture.keypoint_frames.json_hands` reads from files:

    {"keypoints": [[x, y, z], …], "side": "right", "time": 12.345}
    {"right": {"wrist": [x, y, z], "thumb-metacarpal": …}, "left": {…}, "time": 12.345}

`side` and `time` may be left out. `{"keypoints": null}`, or a message without the hand that is followed, says that it
is not seen. `time` (s) by the sender's own clock orders messages: what is older than the last is left out, and a clock
that jumps is taken as it is from then on.
"""

import json
from typing import Any

import numpy as np
from jaxtyping import Float

from mjx_hand.capture.keypoint_frames.frame_hand import IMAGE, FrameHand
from mjx_hand.capture.keypoint_frames.json_hands import frame_hands
from mjx_hand.capture.keypoints.layouts import NUM_KEYPOINTS
from mjx_hand.capture.keypoints.names import counted_keypoints, named_keypoints
from mjx_hand.capture.keypoints.side import bend_towards_right
from mjx_hand.capture.keypoints.size import unit_factor
from mjx_hand.errors import InputError

LONGEST = 2**16  # bytes; a hand's 25 joints as matrices take a tenth of it
FARTHEST = 100.0  # m
_LATEST = 1e18  # s, or ns: no clock says more
_JUMP = 1.0  # s by which a clock goes back only if it was set
_PLACES = ("hands", "keypoints", "joints", "right", "left", "landmarks", "worldLandmarks")  # that may be empty


class Messages:
    """Reads the messages of one sender, in the order in which they come.

    Args:
        side: "right" or "left", of the hand to follow.
    """

    def __init__(self, side: str):
        self._side = side
        self._last: float | None = None
        self.jumped = 0  # how often the sender's clock did

    def keypoints(self, message: bytes | str) -> Float[np.ndarray, "21 3"] | None:
        """The hand's keypoints (m), all NaN where it is not seen; None of a message that is older than the last.

        Raises:
            InputError: nothing that can be read, or no hand's places.
        """
        told = _object(message)
        if self._is_late(told.get("time")):
            return None
        try:
            hands = frame_hands(told)
            empty = not hands and any(name in told and not told[name] for name in _PLACES)
            chosen = [hand for hand in hands if hand.form != IMAGE and hand.side in ("", self._side)]
            if chosen:
                return self._own([_places(hand, told.get("unit")) for hand in chosen])
        except InputError:
            raise
        except Exception as error:  # a stranger's message raises anything at all
            raise InputError(f"message: not a hand that can be read ({type(error).__name__})") from None
        if hands and all(hand.form == IMAGE for hand in hands):
            raise InputError("message: landmarks of the image are no places; send the world landmarks, in metres")
        if not hands and not empty:
            raise InputError(f"message: says no hand's keypoints; it has {', '.join(map(repr, list(told)[:5]))}")
        return np.full((NUM_KEYPOINTS, 3), np.nan)

    def _own(self, found: list[Float[np.ndarray, "21 3"]]) -> Float[np.ndarray, "21 3"]:
        """Of several hands whose side nobody says, the one whose fingers bend as the side's do."""
        sign = 1 if self._side == "right" else -1
        return found[0] if len(found) == 1 else max(found, key=lambda hand: sign * bend_towards_right(hand[None]))

    def _is_late(self, stamp: Any) -> bool:
        """Whether a message was overtaken by others, by its sender's clock."""
        if isinstance(stamp, bool) or not isinstance(stamp, int | float) or not abs(stamp) < _LATEST:
            return False
        last, late = self._last, False
        if last is not None and abs(stamp - last) > _JUMP:
            self.jumped += 1
        elif last is not None and stamp <= last:
            late = True
        if not late:
            self._last = float(stamp)
        return late


def _object(message: bytes | str) -> dict[str, Any]:
    if len(message) > LONGEST:
        raise InputError(f"message: {len(message)} bytes; at most {LONGEST} are read")
    try:
        told = json.loads(message)
    except (ValueError, RecursionError):
        raise InputError("message: no JSON; send one object per frame, such as {'keypoints': [[x, y, z], …]}") from None
    if not isinstance(told, dict):
        raise InputError("message: JSON, but no object; send {'keypoints': [[x, y, z], …]}")
    return told


def _places(hand: FrameHand, unit: object) -> Float[np.ndarray, "21 3"]:
    with np.errstate(invalid="ignore"):
        points = unit_factor("message", unit or hand.unit or "m") * np.asarray(hand.points, float)
    points = np.where(np.isfinite(points).all(axis=-1, keepdims=True), points, np.nan)
    if np.nanmax(np.abs(points), initial=0.0) > FARTHEST:
        raise InputError(f"message: keypoints lie more than {FARTHEST:g} m away; send metres")
    return named_keypoints("message", hand.names, points)[0] if hand.names else counted_keypoints("message", points)[0]
