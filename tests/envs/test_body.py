"""An environment reads of its hand what `Body` says: the human one as any other body is the same environment."""

import dataclasses

import jax
import numpy as np
import pytest

from envs.grip_force import closing_ramp
from envs.model_grip import model_grips
from envs.reference import demonstrated_targets, make_reference
from envs.scene import NUM_WRIST, scene_spec
from envs.tracking import TrackingEnv
from envs.twin import twin_of
from mjx_hand.bodies.body_places import model_places
from mjx_hand.bodies.human_body import body_of, check_one_kind, human_body
from mjx_hand.errors import InputError
from mjx_hand.hand.joints import FINGERS, HINGES, LINKS
from mjx_hand.rigid.rigid_hand import forward_kinematics, tip_positions


@pytest.fixture(scope="module")
def bodies(hands):
    """The hands without what JAX knows of them, as a robot is."""
    return [dataclasses.replace(human_body(hand), rigid=None) for hand in hands]


def test_the_human_body_is_the_rigid_hand(hands):
    body = human_body(hands[0])
    assert (body.fingers, body.joints, body.links) == (FINGERS, HINGES, LINKS)
    model = body.spec().compile()
    assert [model.actuator(k).name for k in range(model.nu)] == [*body.names.targets]
    assert {model.geom(k).name for k in range(model.ngeom)} == {c.name for c in body.contacts}
    for contact in body.contacts:
        assert model.body(model.geom(contact.name).bodyid[0]).name == contact.link
        assert contact.link.startswith(contact.finger or "wrist")
    assert body_of(hands[0]).rigid is body.rigid is hands[0]


def test_mujocos_kinematics_are_the_rigid_hands(hands, bodies):
    angles = np.random.default_rng(0).uniform(hands[0].hinge_lower, hands[0].hinge_upper, (5, len(HINGES)))
    links, tips = model_places(bodies[0], np.concatenate([np.zeros((5, NUM_WRIST)), angles], axis=1))
    turn, place = forward_kinematics(angles, hands[0])
    np.testing.assert_allclose(links, place, atol=1e-6)
    np.testing.assert_allclose(tips, tip_positions(turn, place, hands[0]), atol=1e-6)


def test_a_reference_by_mujoco_is_that_of_the_capsules(demonstrations, hands, bodies, lifted):
    """Targets to the last bit, tips to a rounding; grips apart by what five points of an axis miss of it."""
    by_jax, by_mujoco = (
        make_reference(demonstrations, given, grip_force=2.0, gains=human_body(hands[0]).gains)
        for given in (hands, bodies)
    )
    np.testing.assert_array_equal(by_jax.targets, by_mujoco.targets)
    np.testing.assert_allclose(by_jax.tips, by_mujoco.tips, atol=2e-6)
    for k, frames in enumerate(lifted):
        one, other = np.asarray(by_jax.grip)[k, frames], np.asarray(by_mujoco.grip)[k, frames]
        assert np.abs(one - other).mean() < 0.25 * np.abs(one).mean()


def test_a_body_that_wraps_closes_with_what_its_joints_can(demonstrations, bodies):
    """The hand in the object: every link touches, and closes when the object is about to move. Far from it none does,
    and nothing is asked for."""
    d, gains = demonstrations[0], bodies[0].gains
    around = dataclasses.replace(d.object, kind="sphere", size=np.full(3, 0.3))
    inside = np.concatenate([d.motion.wrist_position, d.object_pose[:, 3:]], axis=1)
    targets = np.asarray(demonstrated_targets(d), float)[None]
    for pose, closes in ((inside, True), (inside + 5.0 * np.eye(7)[0], False)):
        told = dataclasses.replace(d, object=around, object_pose=pose)
        found = model_grips([told], bodies[:1], targets, np.array([8.0]), gains, wrap_torque=0.5)[0, :, NUM_WRIST:]
        flexes = np.array([name.endswith("_flexion") for name in HINGES])
        closed = 0.5 * flexes * gains.force_limit / gains.stiffness
        sets_in = closing_ramp(told, len(found), 0.3)[:, None]
        np.testing.assert_allclose(found, closes * sets_in * closed, atol=2e-4)
    assert (sets_in == 1).any()


def test_no_grip_where_none_is_asked_for(demonstrations, bodies):
    targets = np.zeros((1, demonstrations[0].num_frames, bodies[0].num_targets))
    assert not model_grips(demonstrations[:1], bodies[:1], targets, np.array([np.nan]), bodies[0].gains).any()


def test_the_environment_steps_a_body_as_the_hand_that_it_is(env, demonstrations, bodies):
    """The same physics and the same observation, the grip's rows apart, which are worked out otherwise."""
    task = dataclasses.replace(env.task, grip_force=0.0)
    steps = []
    for given in (env.hands, bodies):
        made = TrackingEnv(demonstrations, given, "native", task)
        state = jax.jit(made.start)(0, 0)
        state = jax.jit(made.step)(state, np.full(made.action_size, 0.1, np.float32))
        steps.append((np.asarray(twin_of(state).physics.qpos), np.asarray(state.obs), float(state.reward)))
    for one, other in zip(*steps, strict=True):
        np.testing.assert_allclose(one, other, atol=1e-6)


def test_hands_of_two_kinds_are_refused(hands, bodies):
    other = dataclasses.replace(bodies[0], name="other")
    with pytest.raises(InputError, match=r"hand 1 is 'other' with 20 actuated joints, hand 0 'human' with 20"):
        check_one_kind([hands[0], other])


def test_a_scene_takes_a_body_or_a_rigid_hand(demonstrations, hands):
    d = demonstrations[0]
    given = d.object, d.support, d.support_position, np.eye(3)
    one, other = (scene_spec(hand, *given).compile() for hand in (hands[0], human_body(hands[0])))
    np.testing.assert_array_equal(one.body_inertia, other.body_inertia)
    assert one.nq == other.nq == NUM_WRIST + len(HINGES) + 7
