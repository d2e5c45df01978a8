"""`Histogram`: times, of which quantiles are wanted after hours, in memory that does not grow."""

import math

_LEAST, _GROWTH, _BINS = 1e-6, 1.05, 480  # s; the last bin begins at four hours


class Histogram:
    """Times (s) in bins that grow by a twentieth: so exact are the quantiles, and they err to the longer side.

    Attributes:
        count: how many times there are.
        largest: the longest of them, itself.
    """

    def __init__(self) -> None:
        self._bins = [0] * _BINS
        self.count, self.largest = 0, 0.0

    def add(self, seconds: float) -> None:
        """Add a time; what is below a microsecond, negative ones too, counts as one."""
        place = math.ceil(math.log(max(seconds, _LEAST) / _LEAST) / math.log(_GROWTH))
        self._bins[min(place, _BINS - 1)] += 1
        self.count += 1
        self.largest = max(self.largest, seconds)

    def quantile(self, share: float) -> float:
        """The time (s) that this share of them do not exceed; 0 where there is none."""
        wanted, seen = share * self.count, 0
        for place, count in enumerate(self._bins):
            seen += count
            if count and seen >= wanted:
                return min(_LEAST * _GROWTH**place, self.largest)
        return 0.0
