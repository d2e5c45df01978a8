"""`Timing`: where the time goes, what was dropped, and what went wrong, for the page and as JSON at the end."""

import time
from typing import Any

from envs.live.flow.histogram import Histogram

# What is timed. The first five follow each other: a frame waits to be taken up; its keypoints are read or found; the
# hinges follow; physics comes round to it and steps; its pose is sent. `wire` is all of them together, `picture` until
# the browser has said that it drew it, `behind` by how much physics is later than real time.
STAGES = ("source", "tracking", "retargeting", "physics", "sending", "wire", "picture", "behind")
COUNTS = ("frames", "replaced", "lost", "refused", "pictures_dropped", "physics_resets", "seconds_skipped")
_MOST_NOTICES = 32


class Timing:
    """Times of every stage, counts, and notices. Each stage is told of by one thread."""

    def __init__(self) -> None:
        self.stages = {name: Histogram() for name in STAGES}
        self.counts: dict[str, int | float] = dict.fromkeys(COUNTS, 0)
        self._began = 0.0
        self.begin()
        self._notices: dict[str, int] = {}
        self.notice = ""  # the last

    def begin(self) -> None:
        """Count seconds from now on."""
        self._began = time.monotonic()

    def add(self, stage: str, seconds: float) -> None:
        """A stage took that long."""
        self.stages[stage].add(seconds)

    def count(self, name: str, number: int | float = 1) -> None:
        """That many more."""
        self.counts[name] += number

    def say(self, notice: str) -> None:
        """Something is to be known: shown on the page, and counted. Of many kinds the first are kept."""
        if notice in self._notices or len(self._notices) < _MOST_NOTICES:
            self._notices[notice] = self._notices.get(notice, 0) + 1
        self.notice = notice

    def report(self) -> dict[str, Any]:
        """All of it, as JSON says it: times in milliseconds, p50, p99 and the longest of each stage."""
        stages = {
            name: {
                "p50": _ms(h.quantile(0.5)),
                "p99": _ms(h.quantile(0.99)),
                "max": _ms(h.largest),
                "count": h.count,
            }
            for name, h in self.stages.items()
        }
        seconds = round(time.monotonic() - self._began, 3)
        return {"seconds": seconds, "stages_ms": stages, "counts": dict(self.counts), "notices": dict(self._notices)}


def _ms(seconds: float) -> float:
    return round(1e3 * seconds, 3)
