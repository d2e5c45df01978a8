from functools import partial

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from envs.grip import grip_offsets
from envs.grip_table import grip_table
from envs.scene import NUM_WRIST, OBJECT, demonstration_spec
from mjx_hand.hand.joints import HINGES
from mjx_hand.objects.description import OBJECT_KINDS
from mjx_hand.objects.primitives import hull_planes
from mjx_hand.rigid.gains import Gains
from mjx_hand.rigid.rigid_hand import finger_tips, stack_hands

THUMB = [k for k, name in enumerate(HINGES) if name.startswith("thumb")]


@pytest.fixture(scope="module")
def in_hand(demonstrations, env):
    """The object's pose in the first demonstration's wrist frame, every frame."""
    d = demonstrations[0]
    hand = Rotation.from_quat(d.motion.wrist_quaternion, scalar_first=True)
    object_rotation = Rotation.from_quat(d.object_pose[:, 3:], scalar_first=True)
    position = hand.inv().apply(d.object_pose[:, :3] - d.motion.wrist_position)
    return jnp.asarray((hand.inv() * object_rotation).as_matrix(), jnp.float32), jnp.asarray(position, jnp.float32)


@pytest.fixture(scope="module")
def offsets(demonstrations, hands, in_hand):
    """A jitted function from (position of the object in the hand, force) to the offsets of every frame."""
    d, hand = demonstrations[0], stack_hands(hands[:1])
    hand = jax.tree.map(lambda leaf: leaf[0], hand)
    angles, size = jnp.asarray(d.motion.angles, jnp.float32), jnp.asarray(d.object.size, jnp.float32)

    @jax.jit
    def run(position, force):
        return grip_offsets(angles, (in_hand[0], position), hand, d.object.kind, size, force, Gains())

    return run


def test_fingers_that_touch_nothing_get_no_offset(offsets, in_hand):
    far = in_hand[1] + jnp.array([0.0, -0.5, 0.0])
    assert np.abs(np.asarray(offsets(far, 8.0))).max() < 1e-6


def test_before_the_grasp_and_for_idle_fingers_there_is_none(offsets, in_hand, lifted):
    found = np.asarray(offsets(in_hand[1], 8.0))
    assert np.abs(found[:5]).max() < 1e-3
    idle = [k for k, name in enumerate(HINGES) if name.startswith(("ring", "pinky"))]
    busy = [k for k, name in enumerate(HINGES) if name.startswith(("thumb", "index", "middle"))]
    assert np.abs(found[lifted[0]][:, busy]).max(axis=1).min() > 0.02
    assert np.abs(found[lifted[0]][:, idle]).max() < np.abs(found[lifted[0]][:, busy]).max() / 5


def test_more_force_presses_harder_in_mujoco(demonstrations, hands, offsets, in_hand, env, lifted):
    """The sum of the contact forces that the object feels from the fingers grows with the force asked for."""
    d, frame = demonstrations[0], int(lifted[0][20])
    model = demonstration_spec(d, hands[0]).compile()
    object_id = model.geom(OBJECT).id
    model.body_mass[model.body(OBJECT).id] *= 1000  # it stays where it is
    model.body_inertia[model.body(OBJECT).id] *= 1000
    mujoco.mj_setConst(model, mujoco.MjData(model))
    model.opt.gravity[:] = 0
    pressed = []
    for force in (0.0, 4.0, 8.0):
        extra = np.asarray(offsets(in_hand[1], force))[frame]
        data = mujoco.MjData(model)
        target = np.asarray(env.reference.targets[0, frame], float)
        data.qpos[: len(target)], data.qpos[len(target) :] = target, d.object_pose[frame]
        data.ctrl = np.concatenate([target[:NUM_WRIST], target[NUM_WRIST:] + extra])
        for _ in range(100):
            mujoco.mj_step(model, data)
        wrench, total = np.zeros(6), 0.0
        for k in range(data.ncon):
            assert object_id in data.contact[k].geom
            mujoco.mj_contactForce(model, data, k, wrench)
            total += wrench[0]
        pressed.append(total)
    assert pressed[0] + 3.0 < pressed[1] < pressed[2] - 3.0
    assert 8.0 < pressed[2] < 32.0  # thumb and fingers: twice the force, give or take the pads' geometry


def test_every_kind_of_object_has_finite_offsets(demonstrations, hands, in_hand):
    d = demonstrations[0]
    hand = jax.tree.map(lambda leaf: leaf[0], stack_hands(hands[:1]))
    angles = jnp.asarray(d.motion.angles[-2:], jnp.float32)
    where = tuple(leaf[-2:] for leaf in in_hand)
    corners = 0.017 * np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    planes = jnp.asarray(hull_planes(corners[None]), jnp.float32)
    offsets = jax.jit(partial(grip_offsets, size=jnp.full(3, 0.017), force=8.0, gains=Gains()), static_argnames="kind")
    for kind in OBJECT_KINDS:
        found = offsets(angles, where, hand, kind=kind, planes=planes)
        assert np.isfinite(np.asarray(found)).all()
        assert np.abs(np.asarray(found)[:, THUMB]).max() > 0.01


def test_a_weak_joint_is_not_asked_for_more_than_it_has(demonstrations, hands, in_hand, offsets):
    d = demonstrations[0]
    hand = jax.tree.map(lambda leaf: leaf[0], stack_hands(hands[:1]))
    weak = Gains(force_limit=np.full(20, 0.01))
    angles, where = jnp.asarray(d.motion.angles[-2:], jnp.float32), tuple(leaf[-2:] for leaf in in_hand)
    size = jnp.asarray(d.object.size, jnp.float32)
    with_force = jax.jit(lambda force: grip_offsets(angles, where, hand, d.object.kind, size, force, weak))
    pressing = np.asarray(with_force(8.0)) - np.asarray(with_force(0.0))
    assert (np.abs(pressing) <= 0.01 / weak.stiffness + 1e-6).all()


@pytest.mark.parametrize(("radius", "closes"), [(0.3, True), (0.004, False)], ids=["all touch", "few touch"])
def test_a_hand_that_wraps_closes_with_every_flexing_joint(demonstrations, hands, radius, closes):
    """Inside a ball of 0.3 m every phalanx touches; one of 4 mm at the middle finger's tip meets few."""
    hand = jax.tree.map(lambda leaf: leaf[0], stack_hands(hands[:1]))
    angles, gains = jnp.zeros((1, 20)), Gains()
    tip = finger_tips(angles[0], hand)[1]
    where = jnp.eye(3)[None], (jnp.zeros((1, 3)) if closes else tip[None])
    size = jnp.full(3, radius)
    told = (angles, where, hand, "sphere", size, 8.0, gains)
    found, without = (np.asarray(grip_offsets(*told, wrap_torque=share))[0] for share in (0.5, 0.0))
    flexing = np.array([name.endswith("flexion") for name in HINGES])
    closing = np.where(flexing, 0.5 * gains.force_limit / gains.stiffness, 0.0)
    np.testing.assert_allclose(found, closing if closes else without, atol=1e-4)
    assert np.abs(without).max() > 1e-3


def test_a_pinch_is_no_wrap(demonstrations, hands, env):
    """Two fingers touch with up to three phalanges each, and nothing of what a wrap adds may reach the others."""
    targets, forces = env.reference.targets, np.full(len(demonstrations), 2.0)
    wrapped, plain = (grip_table(demonstrations, hands, targets, forces, Gains(), share) for share in (0.5, 0.0))
    np.testing.assert_allclose(wrapped, plain, atol=1e-4)
