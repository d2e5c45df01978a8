"""The time that a benchmark may take."""

import dataclasses
import time
from collections.abc import Callable


@dataclasses.dataclass(frozen=True)
class Budget:
    """Seconds that are left of a span that began when it was made.

    Attributes:
        end: when it is over, as `clock` tells time.
        clock: seconds since some moment, never going back.
    """

    end: float
    clock: Callable[[], float] = time.monotonic

    @classmethod
    def of(cls, minutes: float, clock: Callable[[], float] = time.monotonic) -> "Budget":
        """A span of so many minutes from now."""
        return cls(clock() + 60 * minutes, clock)

    def left(self) -> float:
        """Seconds until the end, 0 after it."""
        return max(self.end - self.clock(), 0.0)

    def fits(self, seconds: float) -> bool:
        """Whether that much is left."""
        return seconds <= self.left()
