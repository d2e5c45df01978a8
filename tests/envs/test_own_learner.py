"""The example of a learner of one's own: a PyTorch PPO on the Gymnasium environment learns."""

import importlib.util
from pathlib import Path

import numpy as np
import pytest

from envs.gym import TrackingVectorEnv

EXAMPLE = Path(__file__).resolve().parents[2] / "examples" / "05_environment_in_your_own_learner.py"
UPDATES, WORLDS = 20, 64  # 20,000 steps; two demonstrations are learned within 15,000


@pytest.fixture(scope="module")
def example():
    pytest.importorskip("torch", reason="PyTorch is not installed; this example alone needs it: pip install torch")
    spec = importlib.util.spec_from_file_location("own_learner", EXAMPLE)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.slow
def test_the_return_rises_within_a_short_budget(env, example):
    import torch  # pyright: ignore[reportMissingImports]  no dependency of the project

    vector = TrackingVectorEnv(env, WORLDS, autoreset_mode="SameStep")
    torch.manual_seed(0)
    untrained = example.Policy(env.observation_size, env.action_size)
    policy, scores = example.train(vector, UPDATES, seed=0)
    moved = [float((a - b).abs().max()) for a, b in zip(policy.parameters(), untrained.parameters(), strict=True)]
    assert min(moved) > 1e-4  # every layer's
    success, returns = np.array(scores).T
    assert returns[-1] > 1.3 * returns[0]
    assert success[-1] > success[0]
