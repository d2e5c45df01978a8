"""`Source`: whatever hands on a person's hand, frame by frame."""

import threading
from collections.abc import Callable
from typing import Protocol, runtime_checkable

from envs.live.flow.arrival import Arrival
from envs.live.flow.timing import Timing

Put = Callable[[Arrival], None]


@runtime_checkable
class Source(Protocol):
    """A source of frames of one hand.

    Attributes:
        name: for people.
        up: its axis against gravity, "+y" or the like; None where its frame is the world's own, z up.
        forward: the axis that points away from the person, by which a hand is turned that points up or down.
    """

    name: str
    up: str | None
    forward: str

    def run(self, put: Put, stop: threading.Event, timing: Timing) -> None:
        """Hand frames on until `stop`, or until there are no more; called in a thread of its own.

        Raises:
            InputError: it cannot be used.
        """
        ...
