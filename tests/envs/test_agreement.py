import jax
import numpy as np
import pytest

from envs.agreement import LIMITS, STEPS, Departure, Limits, departure, free_and_gripping, rolled
from mjx_hand.pytree import replace


@pytest.fixture(scope="module")
def worlds(env):
    return free_and_gripping(env)


def test_worlds_grip_where_they_are_said_to(env, worlds, lifted):
    assert worlds.controls.shape == (STEPS, 8, 26)
    height = np.asarray(worlds.qpos)[:, 28]
    at_rest = np.asarray(env.reference.object_pose)[np.asarray(worlds.variant), 0, 2]
    np.testing.assert_array_equal(height - at_rest > 0.01, worlds.gripping)


def test_departure_is_the_furthest_of_object_and_tips_over_all_steps(env, worlds):
    wanted = rolled(env.engine)(worlds.variant, worlds.qpos, worlds.qvel, worlds.controls)
    same = departure(wanted, wanted, worlds.gripping)
    assert (same.free, same.gripped.max(), same.unstable) == (0.0, 0.0, 0)
    moved = replace(wanted, qpos=wanted.qpos.at[2, 3, 26:29].add(np.array([0.003, 0.0, 0.004])))
    off = departure(moved, wanted, worlds.gripping)
    np.testing.assert_allclose(sorted(off.gripped), [0, 0, 0, 0.005], atol=1e-6)
    assert off.free == 0.0
    tip = jax.numpy.asarray(wanted.sensordata).at[4, 0, 5].add(0.002)
    bent = replace(wanted, sensordata=tip, unstable=wanted.unstable.at[1, 7].set(1.0))
    off = departure(bent, wanted, worlds.gripping)
    assert off.free == pytest.approx(0.002, abs=1e-6)
    assert off.unstable == 1


def test_each_limit_that_is_passed_is_complained_of():
    limits = Limits(free=1e-5, gripped={0.5: 1e-4, 1.0: 1e-3})
    gripped = np.array([0.0, 1e-5, 5e-5, 9e-4])
    assert Departure(9e-6, gripped, 0).complaints(limits) == []
    assert len(Departure(2e-5, gripped, 0).complaints(limits)) == 1
    assert len(Departure(9e-6, 10 * gripped, 3).complaints(limits)) == 3
    assert len(Departure(float("nan"), gripped * np.nan, 0).complaints(limits)) == 3
    assert set(LIMITS) == {"mjx", "warp"}
