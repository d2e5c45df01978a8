"""What one browser has been sent of the twin, and what of it it has drawn: newest wins, and nothing piles up."""

import asyncio
import time

import numpy as np

from envs.live.flow.timing import Timing
from envs.live.service.snapshot import Snapshot

WINDOW = 4  # pictures that a browser has been sent and not yet drawn, at most: what is late is not made later
_PATIENCE = 2.0  # s after which one is sent all the same


class Drawn:
    """Which of the pictures that one browser was sent it has drawn.

    Args:
        timing: told how old a picture was when the browser said that it drew it.
    """

    def __init__(self, timing: Timing):
        self._timing = timing
        self._open: dict[int, float | None] = {}  # number, and when the frame arrived that it shows
        self._changed = asyncio.Event()

    async def room(self) -> None:
        """Wait until it may be sent another."""
        while len(self._open) >= WINDOW:
            self._changed.clear()
            try:
                await asyncio.wait_for(self._changed.wait(), _PATIENCE)
            except TimeoutError:
                self._open.clear()

    def sent(self, snapshot: Snapshot) -> None:
        """It is sent that one."""
        self._open[snapshot.number] = snapshot.arrived

    def seen(self, number: int) -> None:
        """It has drawn that one; those before it it will not draw any more."""
        if number in self._open and (arrived := self._open[number]) is not None:
            self._timing.add("picture", time.monotonic() - arrived)
        self._open = {k: arrived for k, arrived in self._open.items() if k > number}
        self._changed.set()


def pose_bytes(snapshot: Snapshot) -> bytes:
    """A snapshot as the page reads it: its number and whether the hand is seen (uint32), then poses (float32)."""
    head = np.array([snapshot.number % 2**32, snapshot.tracked], np.uint32)
    return head.tobytes() + snapshot.poses.astype(np.float32).tobytes()
