"""Gymnasium's vector environment, against Gymnasium's own vectorisation of one world, and what its API promises."""

import copy
import subprocess
import sys

import gymnasium
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AutoresetMode, SyncVectorEnv
from gymnasium.wrappers.vector import NormalizeObservation, RecordEpisodeStatistics

from envs.gym import TrackingVectorEnv
from envs.task import Task
from mjx_hand.errors import InputError
from mjx_hand.player.features import OBSERVATION_LIMIT
from tests.envs.conftest import SETTINGS

WORLDS = 3
MODES = [AutoresetMode.NEXT_STEP, AutoresetMode.SAME_STEP]


class OneWorld(gymnasium.Env):
    """A world of `TrackingEnv`, stepped directly, as a plain Gymnasium environment."""

    metadata = {"render_modes": []}  # noqa: RUF012

    def __init__(self, env, start, step):
        self._start, self._step, self._key = start, step, jax.random.key(0)
        self.observation_space = gymnasium.spaces.Box(
            -OBSERVATION_LIMIT, OBSERVATION_LIMIT, (env.observation_size,), np.float32
        )
        self.action_space = gymnasium.spaces.Box(-1, 1, (26,), np.float32)

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        if seed is not None:
            self._key = jax.random.key(seed)
        now, self._key = jax.random.split(self._key)
        self._state = self._start(now)
        return np.array(self._state.obs), self._place()

    def step(self, action):
        self._state = self._step(self._state, action)
        truncated = bool(self._state.info["truncation"])
        terms = {name: float(value) for name, value in self._state.metrics.items()}
        ended = bool(self._state.done)
        return (
            np.array(self._state.obs),
            float(self._state.reward),
            ended and not truncated,
            truncated,
            self._place() | terms,
        )

    def _place(self):
        twin = self._state.pipeline_state
        return {"demonstration": int(twin.demonstration), "frame": int(twin.frame)}


@pytest.fixture(scope="module")
def one_world(env):
    start, step = jax.jit(env.reset), jax.jit(env.step)
    return lambda: OneWorld(env, start, step)


@pytest.fixture(scope="module")
def vectors(env):
    """One of each mode, because compiling them is what costs."""
    return {mode: TrackingVectorEnv(env, WORLDS, seed=5, autoreset_mode=mode.value) for mode in MODES}


@pytest.fixture(params=MODES, ids=[mode.value for mode in MODES])
def vector(vectors, request):
    return vectors[request.param]


@pytest.fixture
def same_step(vectors):
    return vectors[AutoresetMode.SAME_STEP]


@pytest.fixture
def next_step(vectors):
    return vectors[AutoresetMode.NEXT_STEP]


def actions(seed, scale=1.0, worlds=WORLDS):
    rng = np.random.default_rng(seed)
    return lambda: rng.uniform(-scale, scale, (worlds, 26)).astype(np.float32)


def last_frames(env, before):
    """Options that start world i `before[i]` frames before the end of a demonstration."""
    which = np.arange(len(before)) % env.num_demonstrations
    return {"demonstration": which, "frame": np.asarray(env.reference.length)[which] - 1 - np.asarray(before)}


def assert_same(ours, theirs, path=""):
    """Infos, which are nested dictionaries of arrays, some of them of objects."""
    assert set(ours) == set(theirs), path
    for name, value in ours.items():
        if isinstance(value, dict):
            assert_same(value, theirs[name], f"{path}/{name}")
        elif value.dtype == object:
            for a, b in zip(value, theirs[name], strict=True):
                assert (a is None) == (b is None), name
                if a is not None:
                    np.testing.assert_allclose(a, b, atol=1e-4, err_msg=name)
        elif not name.startswith("_") and value.dtype == np.float32:
            np.testing.assert_allclose(value, theirs[name], atol=1e-4, err_msg=f"{path}/{name}")
        else:
            np.testing.assert_array_equal(value, theirs[name], err_msg=f"{path}/{name}")


def test_gymnasiums_checker_passes_the_world_that_the_others_are_compared_with(one_world):
    check_env(one_world(), skip_render_check=True)


def test_all_is_as_gymnasium_vectorises_one_world(vector, one_world):
    """Observations, rewards, endings, infos and restarts over 250 steps, in which every world ends at least once."""
    mode = vector.metadata["autoreset_mode"]
    theirs = SyncVectorEnv([one_world] * WORLDS, autoreset_mode=mode)
    for space in ("observation_space", "action_space", "single_observation_space", "single_action_space"):
        assert getattr(vector, space) == getattr(theirs, space)
    (seen, info), (expected, said) = vector.reset(seed=7), theirs.reset(seed=7)
    np.testing.assert_allclose(seen, expected, atol=1e-5)
    assert_same(info, said)
    act, ended = actions(0, 0.3), np.zeros(WORLDS, int)
    for _ in range(250):
        action = act()
        ours, reference = vector.step(action), theirs.step(action)
        for mine, other in zip(ours[:4], reference[:4], strict=True):
            np.testing.assert_allclose(mine, other, atol=1e-4)
        assert_same(ours[4], reference[4])
        ended += ours[2] | ours[3]
    assert (ended > 0).all()


def test_what_goes_out_is_numpy_of_the_spaces_and_the_callers_own(vector):
    observations, _ = vector.reset()
    assert vector.observation_space.contains(observations)
    act = actions(1)
    for _ in range(3):
        observations, rewards, terminated, truncated, _ = vector.step(act())
        assert vector.observation_space.contains(observations)
        assert (rewards.dtype, rewards.shape) == (np.float32, (WORLDS,))
        assert terminated.dtype == truncated.dtype == bool
    before = observations.copy()
    vector.step(act())
    np.testing.assert_array_equal(observations, before)
    observations += 1  # a learner may write to it
    assert vector.render_mode is None


def test_the_demonstrations_end_truncates(env, same_step):
    same_step.reset(options=last_frames(env, [1, 2, 2]))
    _, _, terminated, truncated, infos = same_step.step(np.zeros((WORLDS, 26), np.float32))
    assert truncated.tolist() == [True, False, False]
    assert not terminated.any()
    assert infos["_final_obs"].tolist() == [True, False, False]


def test_a_lost_object_terminates_and_how_far_is_lost_follows_the_training(env):
    strict = copy.copy(env)
    strict.task = Task(termination_distance=1.0, termination_distance_last=1e-9)
    vector = TrackingVectorEnv(strict, 2, autoreset_mode="SameStep")
    for progress in (0.0, 1.0):
        vector.progress = progress
        vector.reset(options={"demonstration": np.array([0, 1]), "frame": 100})
        _, _, terminated, truncated, infos = vector.step(np.zeros((2, 26), np.float32))
        assert terminated.tolist() == [progress == 1] * 2
        assert not truncated.any()
        assert ("final_info" in infos) == (progress == 1)


def test_final_obs_is_the_observation_before_the_restart(env, same_step):
    options = last_frames(env, [1, 5, 1])
    same_step.reset(options=options)
    action = actions(2)()
    observations, rewards, _, _, infos = same_step.step(action)
    for world in (0, 2):
        start = env.start(*(jnp.asarray(options[name][world], jnp.int32) for name in ("demonstration", "frame")))
        directly = jax.jit(env.step)(start, action[world])
        np.testing.assert_allclose(infos["final_obs"][world], directly.obs, atol=1e-4)
        assert rewards[world] == pytest.approx(float(directly.reward), abs=1e-4)
        place = (jnp.asarray(infos[name][world], jnp.int32) for name in ("demonstration", "frame"))
        np.testing.assert_allclose(observations[world], env.start(*place).obs, atol=1e-5)
        assert np.abs(observations[world] - infos["final_obs"][world]).max() > 0.1
    assert infos["final_obs"][1] is None


def test_a_next_step_restart_takes_no_action_and_gives_no_reward(env, next_step):
    next_step.reset(options=last_frames(env, [1, 9, 9]))
    _, rewards, _, truncated, infos = next_step.step(np.zeros((WORLDS, 26), np.float32))
    assert truncated.tolist() == [True, False, False]
    assert rewards[0] != 0
    assert "final_obs" not in infos
    observations, rewards, _, truncated, infos = next_step.step(np.ones((WORLDS, 26), np.float32))
    assert rewards[0] == 0 != rewards[1]
    assert not truncated.any()
    assert infos["_error/position"].tolist() == [False, True, True]
    place = (jnp.asarray(infos[name][0], jnp.int32) for name in ("demonstration", "frame"))
    np.testing.assert_allclose(observations[0], env.start(*place).obs, atol=1e-5)


def test_a_seed_gives_the_same_episodes_and_a_world_its_own_whatever_is_beside_it(env, same_step):
    def run(vector, seed):
        first, _ = vector.reset(seed=seed)
        act = actions(3)
        return np.array([first[:2], *(vector.step(act()[: vector.num_envs])[0][:2] for _ in range(60))])

    once, other, again = (run(same_step, seed) for seed in (4, 40, 4))
    np.testing.assert_array_equal(once, again)
    assert np.abs(once[0] - other[0]).max() > 0.1
    fewer = TrackingVectorEnv(env, 2, seed=4, autoreset_mode="SameStep")
    np.testing.assert_allclose(once, run(fewer, 4), atol=1e-4)
    unseeded = TrackingVectorEnv(env, 2, seed=4)
    (first, _), (second, _) = unseeded.reset(), unseeded.reset()
    np.testing.assert_allclose(first, once[0], atol=1e-5)
    assert np.abs(first - second).max() > 0.1


def test_gymnasiums_wrappers_take_it(env, next_step):
    counted = RecordEpisodeStatistics(NormalizeObservation(next_step))
    counted.reset(options=last_frames(env, [2, 20, 20]))
    act = actions(4)
    _, first, _, _, _ = counted.step(act())
    _, second, _, _, infos = counted.step(act())
    assert infos["episode"]["l"].tolist() == [2, 0, 0]
    assert infos["episode"]["r"][0] == pytest.approx(first[0] + second[0], rel=1e-5)


def test_what_cannot_be_used_is_said(env, same_step):
    with pytest.raises(InputError, match="num_envs is 0"):
        TrackingVectorEnv(env, 0)
    with pytest.raises(InputError, match="autoreset_mode is 'Disabled'; valid: NextStep, SameStep"):
        TrackingVectorEnv(env, 1, autoreset_mode="Disabled")
    with pytest.raises(InputError, match="seed is -1"):
        same_step.reset(seed=-1)
    with pytest.raises(InputError, match="call reset"):
        TrackingVectorEnv(env, 1).step(np.zeros((1, 26), np.float32))
    same_step.reset(seed=0)
    with pytest.raises(InputError, match=r"of shape \(3, 26\); these are of shape \(2, 26\)"):
        same_step.step(np.zeros((2, 26), np.float32))
    with pytest.raises(InputError, match="finite"):
        same_step.step(np.full((WORLDS, 26), np.nan, np.float32))
    with pytest.raises(InputError, match=r"options are .*; valid: demonstration"):
        same_step.reset(options={"low": 0.1})
    with pytest.raises(InputError, match=r"demonstration is 2; .* from 0 to 1"):
        same_step.reset(options={"demonstration": 2})
    with pytest.raises(InputError, match="frame is"):
        same_step.reset(options={"demonstration": 0, "frame": 10_000})


@pytest.mark.slow
def test_make_vec_makes_one_of_a_grasp_type(set_root):
    vector = gymnasium.make_vec(
        "envs.gym:mjx-hand/pinch-v0", 2, data=SETTINGS, part="heldout", demonstrations=set_root, engine="native"
    )
    assert isinstance(vector.unwrapped, TrackingVectorEnv)
    assert vector.unwrapped.env.num_demonstrations == 1
    assert vector.reset(seed=0)[0].shape == vector.observation_space.shape
    vector.close()
    assert vector.unwrapped.closed


def test_without_gymnasium_one_line_says_what_to_install():
    code = "import sys; sys.modules['gymnasium'] = None\nimport envs.gym"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.stderr.strip().splitlines()[-1].endswith("install it: pip install 'mjx-hand[gym]'")
