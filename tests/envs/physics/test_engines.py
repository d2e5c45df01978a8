import copy
import importlib.util

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
import pytest

from envs.agreement import LIMITS, STEPS, c_engine, departure, free_and_gripping, rolled
from envs.physics import make_engine
from envs.physics.engine import check_family, default_engine
from envs.physics.mjx import MjxEngine
from envs.physics.native import NativeEngine
from envs.physics.solver import newton
from envs.scene import NUM_WRIST, OBJECT, demonstration_models, demonstration_spec
from mjx_hand.errors import InputError
from mjx_hand.hand.joints import NUM_HINGES
from mjx_hand.player.contact_force import position_columns, sensed_bodies
from mjx_hand.pytree import replace

SUBSTEPS = 5
THING = slice(NUM_WRIST + NUM_HINGES, NUM_WRIST + NUM_HINGES + 3)


@pytest.fixture(scope="module")
def family(env):
    return newton(env.models)


@pytest.fixture(scope="module")
def rollout_inputs(env):
    """Eight worlds, two hands: half in the air before the grasp, half pinching; replayed with a little noise."""
    return free_and_gripping(env)


@pytest.fixture(scope="module")
def native_roll(family, rollout_inputs):
    demos, qpos, qvel, controls, _ = rollout_inputs
    return rolled(NativeEngine(family, SUBSTEPS))(demos, qpos, qvel, controls)


def by_hand(model, qpos, qvel, controls):
    """A plain loop over MuJoCo's own `mj_step`: positions, velocities, sensors and forces after each control step."""
    data = mujoco.MjData(model)
    data.qpos, data.qvel = qpos, qvel
    rows = []
    for ctrl in controls:
        data.ctrl = ctrl
        for _ in range(SUBSTEPS):
            mujoco.mj_step(model, data)
        lookup = mujoco.MjData(model)
        lookup.qpos = data.qpos
        mujoco.mj_forward(model, lookup)
        sensors = lookup.sensordata[position_columns(model)]
        rows.append((data.qpos.copy(), data.qvel.copy(), sensors, forces_on_object(model, data)))
    return [np.stack(column) for column in zip(*rows, strict=True)]


def forces_on_object(model, data):
    """Each link's net force (N, world) on the object in the last step, contact by contact, and where it acts (m)."""
    links, found = sensed_bodies(model)[:, 0].tolist(), {}
    for k, contact in enumerate(data.contact):
        one, other = model.geom_bodyid[contact.geom].tolist()
        if OBJECT not in (model.body(one).name, model.body(other).name):
            continue
        wrench = np.zeros(6)
        mujoco.mj_contactForce(model, data, k, wrench)
        force = contact.frame.reshape(3, 3).T @ wrench[:3]  # on the second geom's body
        link, force = (one, force) if model.body(other).name == OBJECT else (other, -force)
        found.setdefault(link, []).append((force, np.linalg.norm(force), contact.pos.copy()))
    out = np.zeros((len(links), 6))
    for link, each in found.items():
        if link in links:
            force, size, place = map(np.array, zip(*each, strict=True))
            out[links.index(link)] = np.concatenate([force.sum(axis=0), size @ place / max(size.sum(), 1e-12)])
    return out


def carried(engine, memory, field):
    """A field of the engine's memory, as the doubles that it holds."""
    return np.ascontiguousarray(np.asarray(memory)).view(np.float64)[..., engine._slices[field]]


def test_the_native_engine_is_mujoco_bit_for_bit(family, rollout_inputs, native_roll):
    demos, qpos, qvel, controls, _ = rollout_inputs
    engine = NativeEngine(family, SUBSTEPS)
    for world, variant in enumerate(demos):
        q, v, sensors, forces = by_hand(family[variant], qpos[world], qvel[world], controls[:, world])
        np.testing.assert_array_equal(carried(engine, native_roll.memory, "qpos")[:, world], q)
        np.testing.assert_array_equal(carried(engine, native_roll.memory, "qvel")[:, world], v)
        np.testing.assert_array_equal(native_roll.qpos[:, world], q.astype(np.float32))
        # Sensors belong to this very state, not to the one a substep earlier.
        np.testing.assert_allclose(native_roll.sensordata[:, world], sensors, atol=1e-6)
        np.testing.assert_allclose(native_roll.contact[:, world], forces, atol=1e-4)
    held = np.linalg.norm(native_roll.contact[..., :3], axis=-1).sum(axis=-1) > 0.1
    np.testing.assert_array_equal(held.any(axis=0), rollout_inputs.gripping)


@pytest.mark.parametrize("threads", [1, 2])
def test_native_rollouts_repeat_bit_for_bit(family, rollout_inputs, native_roll, threads):
    demos, qpos, qvel, controls, _ = rollout_inputs
    again = rolled(NativeEngine(family, SUBSTEPS, threads=threads))(demos, qpos, qvel, controls)
    jax.tree.map(np.testing.assert_array_equal, again, native_roll)


def test_native_worlds_do_not_depend_on_how_they_are_mapped(family, rollout_inputs, native_roll):
    demos, qpos, qvel, controls, _ = rollout_inputs
    engine = NativeEngine(family, SUBSTEPS)
    for world in (0, 7):  # alone, not jitted, not scanned
        state = engine.reset(demos[world], qpos[world], qvel[world], controls[0, world])
        for k in range(2):
            state = engine.step(state, controls[k, world])
        np.testing.assert_array_equal(state.memory, native_roll.memory[1, world])
    variant, q, qd, ctrl = (leaf.reshape(2, 4, *leaf.shape[1:]) for leaf in (demos, qpos, qvel, controls[0]))
    nested = jax.vmap(jax.vmap(engine.reset))(variant, q, qd, ctrl)
    nested = jax.vmap(jax.vmap(engine.step))(nested, ctrl)
    np.testing.assert_array_equal(nested.memory.reshape(8, -1), native_roll.memory[0])


def test_the_start_of_a_native_world_is_what_was_asked_for(family, rollout_inputs):
    demos, qpos, qvel, controls, _ = rollout_inputs
    state = jax.vmap(NativeEngine(family, SUBSTEPS).reset)(demos, qpos, qvel, controls[0])
    np.testing.assert_array_equal(state.qpos, qpos)
    np.testing.assert_array_equal(state.qvel, qvel)
    assert not np.asarray(state.unstable).any()


@pytest.fixture(scope="module")
def mjx_engine(demonstrations, hands):
    """Without contacts of the hand with itself: MJX finds one where capsules lie side by side, MuJoCo two."""
    engine = make_engine("mjx", demonstration_models(demonstrations, hands, contacts="ground"), SUBSTEPS)
    assert isinstance(engine, MjxEngine)
    return engine


@pytest.fixture(scope="module")
def mjx_roll(mjx_engine):
    return rolled(mjx_engine)


def test_mjx_agrees_with_mujoco_in_the_air_and_in_a_grip(mjx_engine, mjx_roll, rollout_inputs):
    demos, qpos, qvel, controls, pinching = rollout_inputs
    wanted = rolled(c_engine(mjx_engine))(demos, qpos, qvel, controls)
    found = mjx_roll(demos, qpos, qvel, controls)
    assert departure(found, wanted, pinching).complaints(LIMITS["mjx"]) == []


def test_mjx_counts_the_forces_that_the_c_engine_senses(mjx_engine, mjx_roll, rollout_inputs):
    demos, qpos, qvel, controls, pinching = rollout_inputs
    wanted = np.asarray(rolled(c_engine(mjx_engine))(demos, qpos, qvel, controls).contact)[0]
    found = np.asarray(mjx_roll(demos, qpos, qvel, controls).contact)[0]
    force, place = np.abs(found - wanted)[..., :3], np.abs(found - wanted)[..., 3:]
    assert np.linalg.norm(wanted[pinching][..., :3], axis=-1).max() > 1.0
    assert force.max() < 1.0
    assert force[force > 0].mean() < 0.1
    assert place[np.linalg.norm(wanted[..., :3], axis=-1) > 0.1].max() < 2e-3


def test_mjx_keeps_fingers_apart_about_as_mujoco_does(env, mjx_engine, rollout_inputs):
    """Where hands meet themselves, tips are nearer to the C engine's than without that."""
    demos, qpos, qvel, controls, _ = rollout_inputs
    meeting = make_engine("mjx", env.models, SUBSTEPS)
    engines = (meeting, c_engine(meeting), c_engine(mjx_engine))
    found, wanted, through = (np.asarray(rolled(e)(demos, qpos, qvel, controls).sensordata) for e in engines)
    assert np.abs(through - wanted).max() > 1e-3
    assert np.sqrt(np.mean((found - wanted) ** 2)) < 0.5 * np.sqrt(np.mean((through - wanted) ** 2))


def test_mjx_worlds_each_run_their_own_model(mjx_engine, mjx_roll, rollout_inputs):
    demos, qpos, qvel, controls, _ = rollout_inputs
    swapped = mjx_roll(1 - demos, qpos, qvel, controls)
    right = rolled(c_engine(mjx_engine))(1 - demos, qpos, qvel, controls)
    wrong = rolled(c_engine(mjx_engine))(demos, qpos, qvel, controls)
    tips = [np.abs(np.asarray(swapped.sensordata - other.sensordata)).max() for other in (right, wrong)]
    assert tips[0] < 0.2 * tips[1]


def assert_resets_only(roll, rollout_inputs):
    """World 3 is told a bad number in its second step, is flagged for it, and the others never notice."""
    demos, qpos, qvel, controls, _ = rollout_inputs
    usual = roll(demos, qpos, qvel, controls)
    found = roll(demos, qpos, qvel, controls.at[1, 3, 7].set(jnp.nan))
    flags = np.zeros((STEPS, 8))
    flags[1, 3] = 1
    np.testing.assert_array_equal(found.unstable, flags)
    others = np.arange(8) != 3
    np.testing.assert_array_equal(found.qpos[:, others], usual.qpos[:, others])
    assert np.isfinite(np.asarray(found.qpos)).all()
    assert np.isfinite(np.asarray(found.sensordata)).all()


def assert_refuses_bad_starts(engine, rollout_inputs):
    demos, qpos, qvel, controls, _ = rollout_inputs
    reset = jax.jit(jax.vmap(engine.reset))
    for bad in (jnp.nan, 1e12):
        state = reset(demos, qpos, qvel.at[3, 28].set(bad), controls[0])
        np.testing.assert_array_equal(state.unstable, np.arange(8) == 3)
        assert np.isfinite(np.asarray(state.sensordata)).all()
        np.testing.assert_array_equal(state.qvel[3], 0.0)


def test_native_divergence_is_flagged_in_that_world_alone(family, rollout_inputs):
    engine = NativeEngine(family, SUBSTEPS)
    assert_resets_only(rolled(engine), rollout_inputs)
    assert_refuses_bad_starts(engine, rollout_inputs)


def test_mjx_divergence_is_flagged_in_that_world_alone(mjx_engine, mjx_roll, rollout_inputs):
    assert_resets_only(mjx_roll, rollout_inputs)
    assert_refuses_bad_starts(mjx_engine, rollout_inputs)


@pytest.mark.slow
def test_warp_agrees_with_mujoco_world_by_world(env, family, rollout_inputs, native_roll):
    pytest.importorskip("warp", reason="the extra mjx-hand[warp] is not installed")
    engine = make_engine("warp", env.models, SUBSTEPS)
    roll = rolled(engine)
    demos, qpos, qvel, controls, pinching = rollout_inputs
    found = roll(demos, qpos, qvel, controls)
    assert departure(found, native_roll, pinching).complaints(LIMITS["warp"]) == []
    forces, wanted = (np.asarray(roll.contact)[0, ..., :3] for roll in (found, native_roll))
    assert np.linalg.norm(wanted[pinching], axis=-1).max() > 1.0
    np.testing.assert_allclose(forces, wanted, atol=0.1)
    assert_resets_only(roll, rollout_inputs)
    assert_refuses_bad_starts(engine, rollout_inputs)
    # Other hands and objects: as the C engine has them, and not as the first model.
    swapped, right = (r(1 - demos, qpos, qvel, controls) for r in (roll, rolled(c_engine(engine))))
    tips = [np.abs(np.asarray(swapped.sensordata - other.sensordata)).max() for other in (right, native_roll)]
    assert tips[0] < 2e-3 < tips[1]
    # Nested maps are one call over all worlds.
    variant, q, qd, ctrl = (leaf.reshape(2, 4, *leaf.shape[1:]) for leaf in (demos, qpos, qvel, controls[0]))
    state = jax.jit(jax.vmap(jax.vmap(engine.step)))(jax.vmap(jax.vmap(engine.reset))(variant, q, qd, ctrl), ctrl)
    np.testing.assert_allclose(state.qpos.reshape(8, -1), found.qpos[0], atol=1e-5)


@pytest.mark.slow
def test_warp_drops_objects_of_other_masses_and_sizes_as_mujoco_does(env, demonstrations, hands):
    pytest.importorskip("warp", reason="the extra mjx-hand[warp] is not installed")
    d = demonstrations[0]
    big = replace(d, object=replace(d.object, size=d.object.size * 1.5, mass=d.object.mass * 4))
    models = [demonstration_spec(d, hands[0]).compile(), demonstration_spec(big, hands[0]).compile()]
    engine = make_engine("warp", models, SUBSTEPS)
    q = np.stack([np.asarray(env.tables.starts.qpos[0, 0])] * 2)
    q[:, THING.stop - 1] += 0.03
    controls = np.broadcast_to(q[:, : THING.start], (25, 2, THING.start)).astype(np.float32)
    worlds = (jnp.array([0, 1], jnp.int32), jnp.asarray(q), jnp.zeros((2, models[0].nv)), jnp.asarray(controls))
    found, wanted = (rolled(e)(*worlds) for e in (engine, c_engine(engine)))
    height = np.asarray(wanted.qpos)[-1, :, THING.stop - 1]
    assert height[1] - height[0] > 0.005  # the larger box rests higher
    np.testing.assert_allclose(found.qpos, wanted.qpos, atol=2e-4)


def test_warp_refuses_what_it_cannot_vary_by_world(env):
    pytest.importorskip("warp", reason="the extra mjx-hand[warp] is not installed")
    odd = copy.copy(env.models[0])
    odd.sensor_type[0] = mujoco.mjtSensor.mjSENS_FRAMEQUAT
    with pytest.raises(InputError, match=r"positions of sites.*native"):
        make_engine("warp", [odd], SUBSTEPS)
    other = copy.copy(env.models[0])
    other.geom_priority[0] = 1
    with pytest.raises(InputError, match=r"model 1 differs|cannot give each world its own geom_priority"):
        make_engine("warp", [env.models[0], other], SUBSTEPS)


def test_an_unknown_engine_is_named_with_the_valid_ones(family):
    with pytest.raises(InputError, match=r"'bullet' is not known; valid: auto, native, mjx, warp"):
        make_engine("bullet", family, SUBSTEPS)


def test_an_engine_that_is_not_installed_says_how_to_install_it(family, monkeypatch):
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    with pytest.raises(InputError, match=r"not installed.*pip install 'mjx-hand\[warp\]'"):
        make_engine("warp", family, SUBSTEPS)


@pytest.mark.parametrize(
    ("backend", "warp", "engine"),
    [("cpu", True, "native"), ("gpu", True, "warp"), ("gpu", False, "mjx"), ("tpu", True, "mjx")],
)
def test_the_default_engine_follows_the_machine(monkeypatch, backend, warp, engine):
    monkeypatch.setattr(jax, "default_backend", lambda: backend)
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: object() if warp else None)
    assert default_engine() == engine


def test_a_family_is_of_one_structure(family):
    with pytest.raises(InputError, match="at least one model"):
        check_family([])
    stranger = mujoco.MjModel.from_xml_string("<mujoco><worldbody><geom size='1'/></worldbody></mujoco>")
    with pytest.raises(InputError, match="model 1 has nq = 0, model 0 has 33"):
        make_engine("native", [family[0], stranger], SUBSTEPS)


def test_mjx_refuses_models_that_it_would_compile_differently(env):
    other = copy.copy(env.models[0])
    other.geom_condim[:] = 1
    with pytest.raises(InputError, match="model 1 differs from model 0 in structure"):
        make_engine("mjx", [env.models[0], other], SUBSTEPS)
