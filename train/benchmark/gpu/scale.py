"""How large each measurement is: on a GPU, and when it is rehearsed on a CPU."""

import dataclasses
from pathlib import Path
from typing import Any

from train.settings.config import Config, compose


@dataclasses.dataclass(frozen=True)
class Scale:
    """Sizes; the same code runs at each.

    Attributes:
        grasps: types that physics is measured on.
        worlds: numbers of worlds, the most telling first.
        mjx_worlds: the same for MJX, which compiles for a minute for each.
        load_worlds: worlds whose solver is watched.
        runs, seconds: timed runs of each point, and how long one lasts.
        ppo_worlds: worlds that PPO's speed is measured on.
        host_worlds: the same for engines on the host.
        training_engine: what trainings run on; the measured engine if None.
        trainings: experiments that are trained until they are learned.
        ppo: what differs from the GPU's preset of learning.
        checks: control steps between evaluations; the training's own choice if None.
        data: what differs from an experiment's own demonstrations.
        learned: share of the training demonstrations at which a training ends.
        most_steps: control steps after which a training ends in any case.
        long_steps: control steps that the last training goes on to.
        peer_worlds: Allegro hands.
        peer_commands: commands that each of them gets in a run.
        by_name: stages that are run where they are named alone.
        patience: what stages need, as a share of what they need on a GPU.
    """

    grasps: tuple[str, ...] = ("pinch", "power")
    worlds: tuple[int, ...] = (8192, 2048, 32768, 512)
    mjx_worlds: tuple[int, ...] = (8192, 2048)
    load_worlds: int = 2048
    runs: int = 5
    seconds: float = 0.3
    ppo_worlds: int = 8192
    host_worlds: int = 1024
    training_engine: str | None = None
    trainings: tuple[str, ...] = ("pinch", "all")
    ppo: dict[str, Any] = dataclasses.field(default_factory=dict)
    checks: int | None = 655_360  # ten updates: the pinch is learned in about as many
    data: dict[str, Any] = dataclasses.field(default_factory=dict)
    learned: float = 0.95
    most_steps: int = 50_000_000
    long_steps: int = 100_000_000
    peer_worlds: int = 8192
    peer_commands: int = 300
    by_name: tuple[str, ...] = ()
    patience: float = 1.0


FULL = Scale()
REHEARSAL = Scale(
    grasps=("pinch",),
    worlds=(4,),
    mjx_worlds=(2,),
    load_worlds=4,
    runs=2,
    seconds=0.01,
    ppo_worlds=4,
    host_worlds=8,
    training_engine="native",  # an evaluation's 1500 steps, which cannot be made fewer, take Warp a minute on a CPU
    trainings=("pinch", "pinch"),
    ppo={"num_envs": 4, "num_minibatches": 2, "unroll_length": 2, "num_updates_per_batch": 1},
    checks=2 * 4 * 2,
    data={"people": 1, "heldout_people": 1, "trials": 2, "heldout_trials": 1},
    most_steps=3 * 4 * 2,
    long_steps=5 * 4 * 2,
    peer_worlds=4,
    peer_commands=2,
    by_name=("mjx",),  # three functions that compile for a minute each
    patience=0.1,
)


def gpu_config(name: str, scale: Scale, demonstrations: Path, out: Path) -> Config:
    """The experiment called `name` as it is trained on a GPU, at this scale."""
    config = compose([f"config={name}", "device=gpu"])
    return dataclasses.replace(
        config,
        out=str(out),
        demonstrations=str(demonstrations),
        data=dataclasses.replace(config.data, **scale.data),
        ppo=dataclasses.replace(config.ppo, num_timesteps=scale.most_steps, **scale.ppo),
        checks=dataclasses.replace(config.checks, every=scale.checks, stop_at=scale.learned),
    )
