"""How fast training is with learning included, and how much of it the physics takes."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from train.benchmark.contestants import Contestant
from train.benchmark.timing import Rate, enough_steps, rate_once
from train.config import Checks, Config, Ppo
from train.experiment import World
from train.ppo import learn

_COMPILING = 2  # Brax compiles its first run, and again for the second, whose inputs are laid out otherwise


@dataclass(frozen=True)
class Learning:
    """PPO's speed.

    Attributes:
        engine: on which.
        worlds: in parallel.
        compile_seconds: by how much the first runs, which compile, were longer than the median of the others.
        rate: control steps a second of the training loop; evaluations are left out.
        physics_share: the time that the engine alone needs for as many control steps of the script, over the time of
            the loop. An estimate: training visits other states than the script, with other contacts.
    """

    engine: str
    worlds: int
    compile_seconds: float
    rate: Rate
    physics_share: float


def measure_learning(config: Config, world: World, alone: Contestant, runs: int, seconds: float) -> Learning:
    """Train for `runs` runs of one update; between them the engine runs alone, to compare at the same moment.

    Args:
        config: the experiment, for its engine and demonstrations.
        world: its training part.
        alone: the engine alone on as many worlds as PPO is to have.
        runs: timed runs of each.
        seconds: about how long the engine runs alone between two of them.

    Raises:
        InputError: a number of worlds that PPO cannot split into its minibatches.
    """
    each = alone.worlds * Ppo().unroll_length
    ppo = Ppo(num_envs=alone.worlds, num_timesteps=(runs + _COMPILING) * each)
    experiment = Config(name=config.name, engine=config.engine, data=config.data, ppo=ppo, checks=Checks(every=each))
    watch = _Watch(alone, seconds)
    learn(experiment, world, watch)
    first, later = watch.trained[:_COMPILING], watch.trained[_COMPILING:]
    rate = Rate.of(later)
    shares = [t / a for t, a in zip(later, watch.alone[_COMPILING:], strict=True)]
    return Learning(
        engine=world.env.engine.name,
        worlds=alone.worlds,
        compile_seconds=sum(each / r - each / rate.median for r in first),
        rate=rate,
        physics_share=Rate.of(shares).median,
    )


class _Watch:
    """Listens to the training loop: keeps each run's rate, and times the engine alone after it."""

    def __init__(self, alone: Contestant, seconds: float):
        self.contestant = alone
        self.steps = enough_steps(alone, seconds)
        self.trained: list[float] = []
        self.alone: list[float] = []

    def log(self, steps: int, metrics: Mapping[str, Any]) -> None:
        """Brax's own timing of the run that ended."""
        if "training/sps" in metrics:
            self.trained.append(float(metrics["training/sps"]))

    def evaluate(self, steps: int, make_policy: Any, parameters: Any) -> None:
        """Comes after each run, before its timing is logged; and once before the first."""
        if steps:
            self.alone.append(rate_once(self.contestant, self.steps))
