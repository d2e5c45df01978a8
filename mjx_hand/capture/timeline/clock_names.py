"""What columns and keys are called that hold time stamps or frame numbers, and the unit that a name says."""

import re

UNITS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}  # seconds in each
_WORDS = {
    "s": r"s|secs?|seconds?",
    "ms": r"ms|msecs?|millis|milliseconds?",
    "us": r"us|µs|usecs?|micros|microseconds?",
    "ns": r"ns|nsecs?|nanos|nanoseconds?",
}
_TIME = re.compile(rf"(?:t|times?|timestamps?|time_stamps?)(?:_(?P<unit>{'|'.join(_WORDS.values())}))?")
_NUMBER = re.compile(r"frames?(?:_?(?:numbers?|ids?|index|indices|idx|no))?#?")


def _plain(name: str) -> str:
    """`timestampMs` and `Time (Seconds)` as `timestamp_ms` and `time_seconds`."""
    parted = re.sub(r"([a-z])([A-Z])", r"\1_\2", name.strip())
    return re.sub(r"[\s\[\](){}.:-]+", "_", parted).strip("_").lower()


def names_time(name: str) -> bool:
    """Whether a column or key of this name holds time stamps."""
    return _TIME.fullmatch(_plain(name)) is not None


def names_numbers(name: str) -> bool:
    """Whether a column or key of this name holds frame numbers."""
    return _NUMBER.fullmatch(_plain(name)) is not None


def unit_in(name: str) -> str | None:
    """The unit in a name of time stamps, such as ms in `timestamp_ms`; None where it says none."""
    found = _TIME.fullmatch(_plain(name))
    word = found["unit"] if found else None
    return next((unit for unit, words in _WORDS.items() if word and re.fullmatch(words, word)), None)
