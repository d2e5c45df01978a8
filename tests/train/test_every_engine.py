"""A tiny training on every engine that is installed, from the settings to a policy on disk."""

import dataclasses
import importlib.util
from pathlib import Path

import jax
import numpy as np
import pytest

from envs.physics import ENGINES
from train.learning.checkpoint import load_checkpoint
from train.ppo import train
from train.settings.config import Config
from train.settings.options import Checks


@pytest.mark.slow
@pytest.mark.parametrize("engine", ENGINES)
def test_a_training_ends_with_a_policy(tiny: Config, tmp_path: Path, engine: str):
    """MJX and Warp compile for a minute or more on a CPU."""
    if engine == "warp" and importlib.util.find_spec("warp") is None:
        pytest.skip("engine 'warp' is not installed: pip install 'mjx-hand[warp]'")
    once = Checks(every=64)  # evaluations, of hundreds of steps, are what takes Warp long on a CPU
    config = dataclasses.replace(tiny, engine=engine, out=str(tmp_path / "out"), checks=once)
    points = train(config)
    assert [point.steps for point in points] == [0, 64]
    assert all(np.isfinite(point.tracking_error_cm) for point in points)
    last = load_checkpoint(tmp_path / "out" / "last.npz")
    assert (last.steps, last.experiment) == (64, "tiny")
    leaves = jax.tree.leaves(last.policy)
    assert leaves
    assert all(np.isfinite(leaf).all() for leaf in leaves)
