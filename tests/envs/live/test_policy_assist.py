"""A policy that helps a live hand sees and does what it saw and did in training, and lets go of what people let go."""

import dataclasses

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
import pytest

from envs.commands import EXPERT
from envs.demonstrations.streamed_hand import streamed_demonstration
from envs.live.assistance import assistance
from envs.live.twin.policy_assist import PolicyAssist, check_live
from envs.live.twin.pose import HandPose
from envs.live.twin.tabletop import demonstration_table
from envs.live.twin.world import World
from envs.observation import observed_features, residual_scale
from envs.scene import base_rotation
from envs.task import Task
from envs.tracking import TrackingEnv
from mjx_hand.errors import InputError
from mjx_hand.hand.joints import FINGERS
from mjx_hand.objects.description import OBJECT_KINDS
from mjx_hand.player.contact_force import contact_columns
from mjx_hand.player.exported_policy import ExportedPolicy, Layer, save_exported_policy
from mjx_hand.player.features import offsets_and_scales
from mjx_hand.rotations import matrix_to_quaternion

TASK = Task(live=True, contacts="object", observe_forces=True)


def policy_of(task: Task, bias: float = 0.0, seed: int = 0, live: bool = True, side: str = "right") -> ExportedPolicy:
    """A policy of one layer with random weights."""
    table = observed_features(task)
    offset, scale = (np.asarray(a, np.float32) for a in offsets_and_scales(table))
    starts = np.cumsum([0, *(f.size for f in table)])
    names = [f.name for f in table]
    kernel = (
        0.02 * np.random.default_rng(seed).normal(size=(len(offset), 26)) if bias == 0 else np.zeros((len(offset), 26))
    )
    return ExportedPolicy(
        offset=offset,
        scale=scale,
        limit=5.0,
        layers=(Layer(kernel.astype(np.float32), np.full(26, bias, np.float32)),),
        residual_start=int(starts[names.index("residual.wrist_position")]),
        residual_scale=residual_scale(task).astype(np.float32),
        smoothing=task.smoothing,
        contract={
            "live": live,
            "side": side,
            "object_kinds": list(OBJECT_KINDS),
            "lookahead": list(task.lookahead),
            "rate": {"control_hz": 50.0},
            "inputs": [{"name": f.name, "size": f.size} for f in table],
        },
    )


@pytest.fixture(scope="module")
def live(demonstrations, hands):
    return TrackingEnv([streamed_demonstration(demonstrations[0], 0)], [hands[0]], "native", TASK)


def test_it_sees_and_does_what_it_saw_and_did_in_training(live):
    policy, shown = policy_of(TASK), live.demonstrations[0]
    state = jax.jit(live.start)(jnp.asarray(0), jnp.asarray(180))
    for _ in range(3):
        state = jax.jit(live.step)(state, state.info[EXPERT])
    twin = state.pipeline_state
    qpos, frame = np.asarray(twin.physics.qpos, float), int(twin.frame)
    base = np.asarray(base_rotation(shown), float)
    x, y, z = (_about(k, angle) for k, angle in enumerate(qpos[3:6]))
    wrist = np.asarray(matrix_to_quaternion(jnp.asarray(base @ x @ y @ z)), float)
    pose = HandPose(base @ qpos[:3], wrist, qpos[6:26])
    world = World(live.hands[0], demonstration_table(shown), pose, policy)
    world.data.qpos[26:] = qpos[26:]
    world.data.qvel[6:] = np.asarray(twin.physics.qvel, float)[6:]
    # The wrist's slides go along another base, which lies where the wrist is; its turns' speeds are not seen.
    slides = base @ np.asarray(twin.physics.qvel, float)[:3]
    world.data.qvel[:3] = world._wrist.base.T @ slides
    world.data.sensordata[contact_columns(world.model)] = np.asarray(twin.physics.contact)
    helper = world._helper
    assert isinstance(helper, PolicyAssist)
    helper._residual = np.asarray(twin.residual)
    tracked = np.asarray(live.reference.controls[0, frame : frame + 2, 6:], float)
    helper._commanded, helper._last = np.asarray(twin.commanded[6:], float), tracked[0]
    assert np.abs(helper._commanded - tracked[0]).max() > 1e-3  # it holds, and is steadied
    told = helper.pressing(tracked[1], world.data, world.timestep)
    commanded = helper._commanded

    table = observed_features(TASK)
    offset, scale = offsets_and_scales(table)
    seen = helper._seen(np.asarray(twin.commanded[6:], float), world.data)
    assert np.abs(np.asarray(state.obs)).max() > 1
    seen = dataclasses.replace(seen, residual=np.asarray(twin.residual))
    features = np.concatenate([np.ravel(f.value(seen)) for f in table])
    np.testing.assert_allclose(np.clip((features - offset) * scale, -5, 5), state.obs, atol=2e-3)

    observed = np.asarray(state.obs, np.float32)
    action = np.clip(observed @ policy.layers[0].kernel, -1, 1)
    _, residual, targets, _ = live.command(twin, jnp.asarray(action))
    np.testing.assert_allclose(told - commanded, np.asarray(residual)[6:], atol=1e-3)
    low, high = np.asarray(live.tables.low)[6:], np.asarray(live.tables.high)[6:]
    np.testing.assert_allclose(np.clip(told, low, high), np.asarray(targets)[6:], atol=1e-3)


def _about(axis: int, angle: float) -> np.ndarray:
    a, b = [k for k in range(3) if k != axis]
    sign = -1.0 if axis == 1 else 1.0
    turn = np.eye(3)
    turn[a, a] = turn[b, b] = np.cos(angle)
    turn[a, b], turn[b, a] = -sign * np.sin(angle), sign * np.sin(angle)
    return turn


@pytest.fixture
def closing(live):
    """A hand beside the object whose policy closes every joint as far as it may."""
    table = demonstration_table(live.demonstrations[0])
    pose = HandPose(table.pose[:3] + np.array([0.1, 0.16, 0]), np.array([1.0, 0, 0, 0]), np.full(20, 0.3))
    return World(live.hands[0], table, pose, policy_of(TASK, bias=1.0)), pose


def residuals(world: World, pose: HandPose, seconds: float) -> np.ndarray:
    """By finger, how far its joints are told beyond where they are tracked, on average, after that time."""
    for _ in range(round(seconds / world.timestep)):
        world.step(pose)
    assert world._helper is not None
    told = world._helper.pressing(pose.angles, world.data, 0.0) - pose.angles
    return told.reshape(5, 4).mean(axis=1)


def test_the_policy_acts_at_its_own_rate_and_its_residual_is_filtered(closing):
    world, pose = closing
    for steps in range(1, 16):
        world.step(pose)
        acted = -(-steps // 5)
        np.testing.assert_allclose(world._helper._residual[6:], 0.7 * (1 - TASK.smoothing**acted), rtol=1e-5)
    assert not np.any(world._helper._residual[:6])


def test_a_finger_that_opens_lets_go_and_one_that_closes_presses_again(closing):
    """A tracked tip that goes away from the object by some centimetres, and comes back."""
    world, pose = closing
    np.testing.assert_allclose(residuals(world, pose, 1.5), 0.7, atol=0.02)
    index = FINGERS.index("index")
    angles = pose.angles.copy().reshape(5, 4)
    angles[index, 1:] = -0.3
    opened = HandPose(pose.position, pose.quaternion, angles.ravel())
    assert distance(world, opened, index) > distance(world, pose, index) + 0.025
    let_go = residuals(world, opened, 1.0)
    assert abs(let_go[index]) < 0.02
    assert np.all(np.delete(let_go, index) > 0.65)
    assert residuals(world, pose, 1.5)[index] > 0.6


def distance(world: World, pose: HandPose, finger: int) -> float:
    """Of a tracked finger's tip from the object (m)."""
    scratch = mujoco.MjData(world.model)
    scratch.qpos[:] = world.data.qpos
    scratch.qpos[6:26] = pose.angles
    mujoco.mj_kinematics(world.model, scratch)
    tip = scratch.site(f"{FINGERS[finger]}_tip").xpos
    return float(np.linalg.norm(tip - world.data.qpos[26:29]))


def test_trembling_opens_nothing(closing):
    world, pose = closing
    rng = np.random.default_rng(0)
    for _ in range(300):
        shaken = HandPose(pose.position, pose.quaternion, pose.angles + 0.015 * rng.normal(size=20))
        world.step(shaken)
    assert np.all(residuals(world, pose, 0.1) > 0.6)


def test_a_hand_put_elsewhere_begins_anew(live, closing):
    world, pose = closing
    residuals(world, pose, 0.5)
    rest = World(live.hands[0], demonstration_table(live.demonstrations[0]), pose, policy_of(TASK, bias=1.0))
    world.reset(pose)
    for _ in range(40):
        world.step(pose)
        rest.step(pose)
        np.testing.assert_array_equal(world.data.ctrl, rest.data.ctrl)


def test_what_cannot_help_is_refused(tmp_path):
    follows = policy_of(dataclasses.replace(TASK, live=False), live=False)
    with pytest.raises(InputError, match=r"task\.live=true"):
        check_live(follows, "it", "right")
    with pytest.raises(InputError, match="trained on right hands, and the hand is a left one"):
        check_live(policy_of(TASK), "it", "left")
    odd = policy_of(TASK)
    for changed in (
        {"object_kinds": [*OBJECT_KINDS[::-1]]},
        {"inputs": [{"name": "smell", "size": 3}, *odd.contract["inputs"][1:]]},
        {"inputs": [{"name": "phase", "size": 1}, *odd.contract["inputs"][1:]]},
    ):
        with pytest.raises(InputError, match="does not know"):
            check_live(dataclasses.replace(odd, contract={**odd.contract, **changed}), "it", "right")
    with pytest.raises(InputError, match="does not list"):
        check_live(
            dataclasses.replace(odd, contract={**odd.contract, "inputs": odd.contract["inputs"][1:]}), "it", "right"
        )
    save_exported_policy(follows, tmp_path / "policy.npz")
    with pytest.raises(InputError, match="config=live"):
        assistance("policy", "right", tmp_path / "policy.npz")
    with pytest.raises(InputError, match="--assist grip"):
        assistance("grip", "right", tmp_path / "policy.npz")
    with pytest.raises(InputError, match="off, grip, policy"):
        assistance("press", "right")
    save_exported_policy(policy_of(TASK), tmp_path / "live.npz")
    assert isinstance(assistance("policy", "right", tmp_path / "live.npz"), ExportedPolicy)
