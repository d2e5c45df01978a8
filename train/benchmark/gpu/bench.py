"""What the stages of the GPU benchmark share: sizes, time, the engine, and environments that are made once."""

import contextlib
import dataclasses
import sys
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path

from envs.physics import default_engine
from envs.tracking import TrackingEnv
from mjx_hand.progress import clock
from train.benchmark.contestants import Contestant
from train.benchmark.engines import small_env
from train.benchmark.gpu.budget import Budget
from train.benchmark.gpu.record import Record
from train.benchmark.gpu.scale import Scale
from train.reports.machine import accelerator


def measured_engine() -> str:
    """The engine that training picks on a GPU; where there is none, Warp for a rehearsal, or else the C engine."""
    if accelerator():
        return default_engine()
    return "warp" if find_spec("warp") else "native"


@dataclasses.dataclass
class Bench:
    """See the module.

    Attributes:
        scale: sizes.
        budget: time.
        engine: that is measured.
        out: folder for results.
        demonstrations: folder below which demonstration sets are kept, and made where missing.
        contestants: engines that are compiled and will be needed again, by engine, grasp type and number of worlds.
        trained: what trainings run in, by the experiment's name.
    """

    scale: Scale
    budget: Budget
    engine: str
    out: Path
    demonstrations: Path
    contestants: dict[tuple[str, str, int], Contestant] = dataclasses.field(default_factory=dict)
    trained: dict[str, TrackingEnv] = dataclasses.field(default_factory=dict)
    _environments: dict[tuple[str, str], TrackingEnv] = dataclasses.field(default_factory=dict)

    def env(self, engine: str, grasp: str) -> TrackingEnv:
        """The type's small set, which `train.benchmark engines` measures too, on an engine."""
        if (engine, grasp) not in self._environments:
            self._environments[engine, grasp] = small_env(engine, grasp, self.demonstrations)
        return self._environments[engine, grasp]

    def say(self, text: str) -> None:
        """A line of progress with the time that is left."""
        print(f"[{clock(self.budget.left())} left] {text}", file=sys.stderr, flush=True)

    def enough(self, record: Record, what: str, seconds: float) -> bool:
        """Whether time suffices for a point that is to take so many seconds; else it is noted as left out."""
        if self.budget.fits(seconds):
            self.say(f"{record.name}: {what}")
            return True
        record.left_out.append(what)
        return False

    @contextlib.contextmanager
    def timed(self) -> Iterator[list[float]]:
        """A context that appends the seconds which it took."""
        took: list[float] = []
        began = self.budget.clock()
        yield took
        took.append(self.budget.clock() - began)
