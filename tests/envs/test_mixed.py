"""Grasp types side by side in one environment: kinds of object and supports differ from world to world."""

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
import pytest

from envs.demonstrations.scripted.trials import support_boxes
from envs.grasps import grasp_type
from envs.physics import make_engine
from envs.scene import SPARE, TABLE, demonstration_models, demonstration_spec
from envs.tracking import TrackingEnv
from envs.twin import twin_of
from mjx_hand.errors import InputError
from mjx_hand.objects.description import ObjectDescription
from mjx_hand.pytree import replace

BALL = ObjectDescription(kind="sphere", size=np.array([0.017, 0.0, 0.0]), mass=0.1, friction=1.0)


@pytest.fixture(scope="module")
def mixed(demonstrations):
    """A cube on a block, and a ball on a frame of four slats where another cube was."""
    halves, centres = support_boxes(grasp_type("spherical"))
    ball = replace(demonstrations[1], object=BALL, support=halves, support_position=centres, grasp="spherical")
    return [demonstrations[0], ball]


@pytest.fixture(scope="module")
def mixed_env(mixed, hands):
    return TrackingEnv(mixed, hands, "native")


def test_scenes_with_fewer_boxes_get_spare_ones_that_touch_nothing(mixed, hands):
    models = demonstration_models(mixed, hands)
    assert [sum(model.geom(k).name.startswith(SPARE) for k in range(model.ngeom)) for model in models] == [3, 0]
    (spare,) = {int(m) for m in models[0].geom_contype[[models[0].geom(f"{SPARE}{k}").id for k in range(3)]]}
    for meets in models[0].geom_conaffinity:
        assert not spare & meets
    assert not models[0].geom_conaffinity[models[0].geom(f"{SPARE}0").id]
    assert models[0].geom(f"{SPARE}0").pos[2] < models[0].geom(TABLE).pos[2] - 0.05  # no picture shows it


def test_spare_boxes_change_nothing(mixed, hands, env, lifted):
    """The same path to the last bit, from a state in which the hand holds the cube."""
    paths = []
    frame = lifted[0][10]
    for spare in (0, 3):
        model = demonstration_spec(mixed[0], hands[0], spare=spare, contacts=env.task.contacts).compile()
        data = mujoco.MjData(model)
        data.qpos[:] = np.asarray(env.tables.starts.qpos[0, frame])
        for k in range(10):
            data.ctrl[:] = np.asarray(env.reference.controls[0, frame + k])
            mujoco.mj_step(model, data, nstep=5)
            paths.append(data.qpos.copy())
        assert data.ncon > 1
    np.testing.assert_array_equal(paths[:10], paths[10:])


def test_alone_no_type_has_spare_boxes(demonstrations, hands, env):
    given = {"contacts": env.task.contacts}
    first = demonstration_models(demonstrations, hands, **given)[0]
    alone = demonstration_spec(demonstrations[0], hands[0], forces=True, **given).compile()
    for model in (first, env.models[0]):
        np.testing.assert_array_equal(model.geom_pos, alone.geom_pos)
        assert model.names == alone.names


def test_a_cube_among_balls_moves_as_it_does_among_cubes(env, mixed_env, lifted):
    frame = jnp.asarray(lifted[0][10], jnp.int32)
    states = []
    for each in (env, mixed_env):
        start, step = jax.jit(jax.vmap(each.start, in_axes=(0, None))), jax.jit(jax.vmap(each.step))
        state = start(jnp.arange(2), frame)
        for _ in range(10):
            state = step(state, jnp.zeros((2, 26)))
        states.append(state)
    alone, among = (np.asarray(twin_of(state).physics.qpos) for state in states)
    np.testing.assert_allclose(among[0], alone[0], atol=1e-4)
    assert np.abs(among[1] - alone[1]).max() > 1e-3  # the other is a ball now
    np.testing.assert_allclose(states[1].obs[0], states[0].obs[0], atol=0.02)
    assert np.isfinite(states[1].obs).all()
    assert not np.asarray(twin_of(states[1]).physics.unstable).any()


@pytest.mark.parametrize("engine", ["mjx", "warp"])
def test_engines_that_compile_kinds_in_name_the_one_that_does_not(mixed, hands, engine):
    if engine == "warp":
        pytest.importorskip("warp")
    with pytest.raises(InputError, match=r"model 1 differs from model 0.* engine 'native'$"):
        make_engine(engine, demonstration_models(mixed, hands), 5)


def test_a_mesh_among_simple_shapes_is_refused(mixed, hands):
    """MuJoCo's batch would, with a message about the layout of its data."""
    corners = 0.017 * np.array([[[x, y, z] for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)]])
    description = ObjectDescription(kind="mesh", size=np.full(3, 0.017), mass=0.1, friction=1.0, hulls=corners)
    models = demonstration_models([mixed[0], replace(mixed[1], object=description)], hands)
    with pytest.raises(InputError, match=r"model 1 has .*simple shapes, or all of one mesh"):
        make_engine("native", models, 5)
