"""`Mailbox`: messages by websocket, from a program or from the page in a headset; the service hands them in."""

import threading
import time

from envs.live.flow.arrival import Arrival
from envs.live.flow.timing import Timing
from envs.live.sources.source import Put


class Mailbox:
    """What the service's `/hand` is told; see `Source`."""

    def __init__(self, name: str, up: str = "+y", forward: str = "-z"):
        self.name, self.forward = name, forward
        self.up: str | None = up
        self._put: Put | None = None

    def run(self, put: Put, stop: threading.Event, timing: Timing) -> None:
        """See `Source`."""
        self._put = put
        stop.wait()
        self._put = None

    def receive(self, message: bytes | str) -> None:
        """Hand a message on, now."""
        if self._put is not None:
            self._put(Arrival(message, time.monotonic()))
