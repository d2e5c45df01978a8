"""`Datagrams`: messages by UDP, one a datagram."""

import socket
import threading
import time

from envs.live.flow.arrival import Arrival
from envs.live.flow.timing import Timing
from envs.live.sources.messages import LONGEST
from envs.live.sources.source import Put
from mjx_hand.errors import InputError

_SILENT = 2.0  # s after which another sender may drive


class Datagrams:
    """A UDP port that one sender at a time drives the hand through; another may when the first has been silent.

    Args:
        host, port: to listen at; port 0 chooses a free one.
        up, forward: see `Source`.

    Raises:
        InputError: the port is taken, or is none.
    """

    def __init__(self, host: str, port: int, up: str = "+y", forward: str = "-z"):
        self.up: str | None = up
        self.forward = forward
        if not 0 <= port <= 65535:
            raise InputError(f"cannot listen at {host}:{port}: ports are 0 to 65535; choose another --udp-port")
        self._socket = socket.socket(socket.AF_INET6 if ":" in host else socket.AF_INET, socket.SOCK_DGRAM)
        try:
            self._socket.bind((host, port))
        except OSError as error:
            self._socket.close()
            raise InputError(f"cannot listen at {host}:{port}: {error.strerror}; choose another --udp-port") from None
        self._socket.settimeout(0.1)
        self.port: int = self._socket.getsockname()[1]
        self.name = f"udp {host}:{self.port}"

    def run(self, put: Put, stop: threading.Event, timing: Timing) -> None:
        """See `Source`."""
        driver, heard = None, 0.0
        with self._socket:
            while not stop.is_set():
                try:
                    message, sender = self._socket.recvfrom(LONGEST + 1)
                except TimeoutError:
                    continue
                except OSError:  # a system tells a socket of datagrams that could not be delivered
                    continue
                now = time.monotonic()
                if driver is not None and sender != driver and now - heard < _SILENT:
                    timing.count("refused")
                    timing.say("a second sender was refused: one drives already")
                    continue
                driver, heard = sender, now
                put(Arrival(message, now))
