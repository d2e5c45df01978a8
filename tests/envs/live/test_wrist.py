"""A hand may turn any way: the wrist's base is laid anew without anything moving."""

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from envs.live.twin.pose import HandPose
from envs.live.twin.tabletop import tabletop
from envs.live.twin.world import World
from envs.live.twin.wrist import Wrist
from mjx_hand.hand.load import load_hand
from mjx_hand.rigid.build import build_rigid_hand


@pytest.fixture(scope="module")
def hand():
    return build_rigid_hand(load_hand())


def make(hand, position=(0.0, 0.0, 0.5), rotation: Rotation | None = None) -> World:
    quaternion = (rotation or Rotation.identity()).as_quat(scalar_first=True)
    return World(hand, tabletop("pinch"), HandPose(np.array(position), quaternion, np.zeros(20)))


def twin_velocity(world: World) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Every link's place, orientation and velocity in the world, by MuJoCo's own forward pass."""
    mujoco.mj_forward(world.model, world.data)
    velocity = np.zeros((world.model.nbody, 6))
    for body in range(world.model.nbody):
        mujoco.mj_objectVelocity(world.model, world.data, mujoco.mjtObj.mjOBJ_BODY, body, velocity[body], 0)
    return world.data.xpos.copy(), world.data.xmat.copy(), velocity


@pytest.mark.parametrize("turns", [(0.3, 1.2, -0.4), (2.6, -0.9, 2.0), (-2.7, 1.5, -2.9)])
def test_a_base_laid_anew_changes_nothing_in_the_world(hand, turns):
    world, rng = make(hand, rotation=Rotation.from_rotvec([0.2, -0.5, 0.9])), np.random.default_rng(0)
    world.data.qpos[:3], world.data.qpos[3:6] = (0.2, -0.1, 0.4), turns
    world.data.qvel[:] = rng.normal(size=world.model.nv)
    before = twin_velocity(world)
    assert Wrist(world.model, world.data).keep_regular()
    for was, now in zip(before, twin_velocity(world), strict=True):
        np.testing.assert_allclose(now, was, atol=1e-9)
    np.testing.assert_array_equal(world.data.qpos[3:6], 0)
    assert not Wrist(world.model, world.data).keep_regular()


def test_coordinates_say_the_pose_and_are_the_nearest_that_do(hand):
    world, rng = make(hand), np.random.default_rng(1)
    wrist, body = Wrist(world.model, world.data), world.model.body("wrist").id
    for _ in range(50):
        world.data.qpos[3:6] = rng.uniform(-3, 3, 3)
        now = world.data.qpos[3:6].copy()
        position = rng.normal(size=3)
        target = Rotation.from_rotvec(0.2 * rng.normal(size=3)) * Rotation.from_euler("XYZ", now)
        found = wrist.coordinates(position, target.as_quat(scalar_first=True))
        world.data.qpos[:6] = found
        mujoco.mj_kinematics(world.model, world.data)
        np.testing.assert_allclose(world.data.xpos[body], position, atol=1e-9)
        np.testing.assert_allclose(world.data.xmat[body].reshape(3, 3), target.as_matrix(), atol=1e-9)
        assert (np.abs(found[3:] - now) <= 2 * np.pi).all()


@pytest.mark.parametrize("axis", np.eye(3).tolist())
def test_a_hand_that_turns_twice_around_is_followed_all_the_way(hand, axis):
    world, body = make(hand), 1
    places, lag = [], []
    for k in range(1000):  # two turns in four seconds
        target = Rotation.from_rotvec(4 * np.pi * k / 1000 * np.array(axis))
        assert world.step(HandPose(np.array([0.0, 0.0, 0.5]), target.as_quat(scalar_first=True), np.zeros(20)))
        mujoco.mj_kinematics(world.model, world.data)
        turned = Rotation.from_matrix(world.data.xmat[body].reshape(3, 3))
        lag.append((target * turned.inv()).magnitude())
        places.append(world.data.xpos[body].copy())
    assert max(lag) < 0.2  # rad: what the controller is late by at that speed
    assert np.abs(np.array(places) - [0, 0, 0.5]).max() < 0.01
