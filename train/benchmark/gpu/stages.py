"""Stages one after the other within a span of time, each one's results written as they come."""

import dataclasses
import traceback
from collections.abc import Callable, Sequence
from typing import Protocol, runtime_checkable

from mjx_hand.errors import InputError
from mjx_hand.progress import clock
from train.benchmark.gpu.budget import Budget
from train.benchmark.gpu.record import DONE, FAILED, INTERRUPTED, SHORTENED, SKIPPED, UNDER_WAY, Record

_LONGEST = 300  # letters of an error that are shown in its one line


@runtime_checkable
class Keep(Protocol):
    """Writes all records; `trace` is the whole story of an error in the stage of that name."""

    def __call__(self, records: Sequence[Record], trace: tuple[str, str] | None = None) -> None: ...


@dataclasses.dataclass(frozen=True)
class Stage:
    """One of the things to measure.

    Attributes:
        name: a word to choose it by.
        title: what it tells.
        needs: seconds without which it is not begun.
        run: measures, and puts results into the record as they come, calling the other argument after each.
    """

    name: str
    title: str
    needs: float
    run: Callable[[Record, Callable[[], None]], None]


def run_stages(stages: Sequence[Stage], budget: Budget, keep: Keep, say: Callable[[str], None]) -> list[Record]:
    """Run all that fit, in order; whatever happens, what was measured until then is kept.

    Args:
        stages: the most valuable first.
        budget: the time for all of them together.
        keep: called at the beginning and end of each stage, and after each of its points.
        say: told what begins and what is left out.

    Raises:
        KeyboardInterrupt, SystemExit: as they come, after the stage under way is kept as interrupted.
    """
    records = [Record(stage.name, stage.title) for stage in stages]
    for stage, record in zip(stages, records, strict=True):
        if not budget.fits(stage.needs):
            record.status = SKIPPED
            record.reason = f"needs about {clock(stage.needs)}, {clock(budget.left())} were left"
            say(f"{stage.name}: skipped, {record.reason}")
            keep(records)
            continue
        say(f"{stage.name}: {stage.title}")
        began, trace = budget.clock(), None
        record.status = UNDER_WAY
        keep(records)

        def point(record: Record = record, began: float = began) -> None:
            record.seconds = budget.clock() - began
            keep(records)

        try:
            stage.run(record, point)
            record.status = SHORTENED if record.left_out else DONE
        except (KeyboardInterrupt, SystemExit):
            record.status = INTERRUPTED
            raise
        except Exception as error:  # one stage's trouble must not cost the others
            record.status, record.reason = FAILED, one_line(error)
            trace = (stage.name, traceback.format_exc())
            say(f"{stage.name}: failed, {record.reason}")
        finally:
            record.seconds = budget.clock() - began
            keep(records, trace)
    return records


def one_line(error: Exception) -> str:
    """What went wrong, its kind in front where it is no user's mistake."""
    text = " ".join(str(error).split())
    text = text if isinstance(error, InputError) else f"{type(error).__name__}: {text}"
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]} …"
