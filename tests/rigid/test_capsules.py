"""Distances of capsules against MuJoCo's own."""

import itertools

import jax
import jax.numpy as jnp
import mujoco
import numpy as np

from mjx_hand.hand.joints import FINGERS, LINKS
from mjx_hand.rigid.capsules import axis_distance, capsule_points, finger_pairs
from mjx_hand.rigid.export.mjcf import capsule_names, hand_spec


def test_axes_are_as_far_apart_as_the_nearest_of_many_points():
    rng = np.random.default_rng(0)
    one, other = rng.normal(size=(2, 300, 2, 3))
    along = np.linspace(0, 1, 201)[:, None]
    points = [ends[:, None, 0] + along * (ends[:, None, 1] - ends[:, None, 0]) for ends in (one, other)]
    nearest = np.linalg.norm(points[0][:, :, None] - points[1][:, None], axis=-1).min(axis=(1, 2))
    found = np.asarray(axis_distance(jnp.asarray(one), jnp.asarray(other)))
    assert (found <= nearest + 1e-5).all()
    np.testing.assert_allclose(found, nearest, atol=2e-2)


def test_parallel_and_crossing_axes_have_a_distance_and_a_derivative():
    one = jnp.array([[0.0, 0, 0], [1, 0, 0]])
    pairs = {
        "side by side": ([[0.2, 0.5, 0], [0.7, 0.5, 0]], 0.5),
        "one after the other": ([[3.0, 0, 0], [2, 0, 0]], 1.0),
        "crossing": ([[0.5, -1, 0], [0.5, 1, 0]], 0.0),
    }
    for name, (ends, distance) in pairs.items():
        value, slope = jax.value_and_grad(axis_distance)(one, jnp.array(ends))
        np.testing.assert_allclose(value, distance, atol=2e-6, err_msg=name)
        assert np.isfinite(np.asarray(slope)).all(), name


def test_fingers_are_as_far_apart_as_mujoco_has_them(rigid, angles):
    pairs = finger_pairs(rigid)
    assert len(pairs) == 10 * 3 * 3
    names = capsule_names(rigid)
    finger = {name: next((f for f in FINGERS if name.startswith(f)), None) for name in names}
    every = itertools.combinations(range(len(names)), 2)
    wanted = [p for p in every if None not in (a := [finger[names[k]] for k in p]) and len(set(a)) == 2]
    assert sorted(pairs) == wanted
    assert {LINKS[rigid.capsule_links[k]][:-1] for pair in pairs for k in pair} == set(FINGERS)
    model = hand_spec(rigid).compile()
    data = mujoco.MjData(model)
    radius = np.asarray(rigid.capsule_radius)
    one, other = np.array(pairs).T
    for row in np.asarray(angles)[:5]:
        data.qpos[:] = row
        mujoco.mj_kinematics(model, data)
        ends = np.asarray(capsule_points(row, rigid, np.array([0.0, 1.0])))
        apart = (
            np.asarray(axis_distance(jnp.asarray(ends[one]), jnp.asarray(ends[other]))) - radius[one] - radius[other]
        )
        for k, (a, b) in enumerate(pairs):
            exact = mujoco.mj_geomDistance(model, data, model.geom(names[a]).id, model.geom(names[b]).id, 1.0, None)
            if exact > 0:  # deeper in, MuJoCo measures the way out
                np.testing.assert_allclose(apart[k], exact, atol=1e-5)
            else:
                assert apart[k] < 1e-5
