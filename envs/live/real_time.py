"""`Pace`: steps as long as real time, none of them early, and none forgotten unless the machine stood still."""

import time

from envs.live.flow.timing import Timing

_GIVES_UP = 0.25  # s behind, from which on the time is left out: making it up would be a hand that races


class Pace:
    """Waits for each step's time.

    Args:
        seconds: of a step.
        timing: told how late each step is.
    """

    def __init__(self, seconds: float, timing: Timing):
        self._seconds, self._timing = seconds, timing
        self._due = time.monotonic()

    def wait(self) -> None:
        """Return when the next step is due, at once if that is past."""
        self._due += self._seconds
        early = self._due - time.monotonic()
        if early > 0:
            time.sleep(early)
        behind = max(0.0, time.monotonic() - self._due)
        self._timing.add("behind", behind)
        if behind > _GIVES_UP:
            self._timing.count("seconds_skipped", behind)
            self._timing.say("the machine stood still, and physics left that time out")
            self._due += behind
