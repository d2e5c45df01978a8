"""Small commands of each kind that writes for a long time, each with an empty folder for what it reads."""

import sys
from collections.abc import Callable
from pathlib import Path

from mjx_hand.motion import save_motion
from tests.retarget.test_dataset import made
from tests.train.commands import arguments
from tests.train.conftest import TINY
from train.settings.config import Config
from train.settings.options import Checks, Ppo

Command = Callable[[Path], list[str]]  # of the folder that it is to write


def _training(inputs: Path) -> Command:
    """64 updates, with a state and an evaluation after every other one."""
    ppo = Ppo(**{**vars(TINY), "num_timesteps": 64 * TINY.num_envs * TINY.unroll_length})
    config = Config(name="tiny", demonstrations=str(inputs), ppo=ppo, checks=Checks(every=64))
    return lambda out: arguments(config, out)


def _retarget(inputs: Path) -> Command:
    for k in range(40):
        save_motion(made(1000, k), inputs / f"{k:02d}.npz")
    return lambda out: [sys.executable, "-m", "mjx_hand", "retarget", str(inputs), "--out", str(out)]


def _demonstrations(inputs: Path) -> Command:
    few = ("config=pinch", "data.people=1", "data.heldout_people=1", "data.trials=1", "data.heldout_trials=1")
    return lambda out: [sys.executable, "-m", "envs.demonstrations", *few, f"demonstrations={out}"]


KINDS = {"training": _training, "retarget": _retarget, "demonstrations": _demonstrations}
