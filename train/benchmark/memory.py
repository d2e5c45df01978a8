"""How much memory a contestant takes, and whether it fits."""

import dataclasses
from collections.abc import Callable
from pathlib import Path

import jax

from train.benchmark.contestants import Contestant, Memory

_STATUS, _FORGET = Path("/proc/self/status"), Path("/proc/self/clear_refs")  # Linux alone
_FULL = ("resource_exhausted", "out of memory", "failed to allocate")


def with_memory(make: Callable[[], Contestant]) -> Contestant:
    """The contestant, made and run once, with the memory that it took."""
    before = resident("VmRSS")
    if before is not None:
        _FORGET.write_text("5")  # the peak begins anew (proc_pid_clear_refs(5))
    contestant = make()
    contestant.advance(contestant.unit)
    peak = resident("VmHWM")
    host = None if before is None or peak is None else max(peak - before, 0)
    known = jax.devices()[0].memory_stats() or {}
    return dataclasses.replace(contestant, memory=Memory(host, known.get("peak_bytes_in_use")))


def fitting(make: Callable[[], Contestant]) -> Contestant | None:
    """The same, or None where memory does not suffice."""
    try:
        return with_memory(make)
    except (MemoryError, RuntimeError) as error:  # JAX and Warp have no type of their own for it
        if isinstance(error, RuntimeError) and not any(sign in str(error).lower() for sign in _FULL):
            raise
        return None


def resident(field: str) -> int | None:
    """What the system says of this process's memory (bytes), such as VmRSS; None where it says nothing."""
    if not _STATUS.is_file():
        return None
    (line,) = (line for line in _STATUS.read_text().splitlines() if line.startswith(f"{field}:"))
    return 1024 * int(line.split()[1])
