from types import SimpleNamespace

import jax
import pytest
from hypothesis import given
from hypothesis import strategies as st

from envs.tracking import TrackingEnv
from train.learning.cadence import FULL, SHARE, rollouts_per_demonstration, updates_between
from train.settings.options import Checks, Ppo

AUTOMATIC = Checks()


class Sized(TrackingEnv):
    """An environment that has a size and nothing else."""

    def __init__(self, demonstrations: int, frames: int, engine: str):
        self._size = demonstrations, frames
        self.engine = SimpleNamespace(name=engine)  # type: ignore[assignment]

    @property
    def num_demonstrations(self) -> int:
        return self._size[0]

    @property
    def num_frames(self) -> int:
        return self._size[1]


def env(demonstrations: int, frames: int = 300, engine: str = "warp") -> TrackingEnv:
    return Sized(demonstrations, frames, engine)


@given(
    worlds=st.integers(1, 5000).map(lambda n: 8 * n),
    unroll=st.integers(1, 64),
    demonstrations=st.integers(1, 2000),
    frames=st.integers(10, 1000),
)
def test_evaluations_take_a_tenth_of_the_steps_and_no_less_than_they_may(worlds, unroll, demonstrations, frames):
    ppo = Ppo(num_envs=worlds, unroll_length=unroll)
    updates = updates_between(AUTOMATIC, ppo, env(demonstrations, frames), repeats=1)
    evaluation = demonstrations * frames
    assert evaluation <= 1.01 * SHARE * (evaluation + updates * worlds * unroll)
    if updates > 1:
        assert evaluation > 0.99 * SHARE * (evaluation + (updates - 1) * worlds * unroll)


def test_the_shipped_experiments_are_evaluated_some_times_in_their_budget():
    ppo = Ppo()
    assert updates_between(AUTOMATIC, ppo, env(64), 1) == 43
    assert ppo.budget // 43 >= 3


def test_on_an_accelerator_few_worlds_take_as_long_as_many(monkeypatch):
    monkeypatch.setattr(jax, "default_backend", lambda: "gpu")
    ppo = Ppo(num_envs=8192, unroll_length=8, num_minibatches=32)
    few = env(64)
    repeats = rollouts_per_demonstration(few)
    assert repeats * 64 == FULL
    between = updates_between(AUTOMATIC, ppo, few, repeats)
    assert between == updates_between(AUTOMATIC, ppo, few, 1), "repeats cost nothing"
    assert between * 8192 * 8 >= 9 * 300 * FULL
    assert rollouts_per_demonstration(env(5000)) == 1
    assert rollouts_per_demonstration(env(64, engine="native")) == 1, "the host's cores step each world"


def test_on_a_processor_there_is_one_rollout_of_each():
    assert rollouts_per_demonstration(env(64)) == rollouts_per_demonstration(env(1)) == 1


@pytest.mark.parametrize(("every", "updates"), [(1, 1), (4096, 1), (8192, 2), (100_000, 24)])
def test_steps_that_are_given_are_kept_to(every, updates):
    assert updates_between(Checks(every=every), Ppo(), env(64), 1) == updates
