"""The grip presses what thumb and fingers touch, with about the force that is asked for, and nothing else."""

import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from envs.grasps import grasp_type
from envs.live.twin.pose import HandPose
from envs.live.twin.tabletop import Tabletop
from envs.live.twin.world import World
from mjx_hand.hand.joints import FINGERS
from mjx_hand.hand.load import load_hand
from mjx_hand.objects.description import ObjectDescription
from mjx_hand.rigid.build import build_rigid_hand
from mjx_hand.rigid.rigid_hand import finger_tips

MASS, FRICTION = 0.4, 0.9


@pytest.fixture(scope="module")
def pinching():
    """A hand whose thumb and index finger are a cube apart, the cube between them; the cube hangs in the air."""
    rigid, grasp = build_rigid_hand(load_hand()), grasp_type("pinch")
    angles, turn = np.array(grasp.posture), Rotation.from_matrix(np.array(grasp.wrist_rotation))
    tips = turn.apply(np.asarray(finger_tips(jnp.asarray(angles), rigid)))
    thumb, index = tips[FINGERS.index("thumb")], tips[FINGERS.index("index")]
    along = (index - thumb) / np.linalg.norm(index - thumb)
    pose = HandPose(np.array([0.0, 0.0, 0.4]) - (thumb + index) / 2, turn.as_quat(scalar_first=True), angles)
    half = np.linalg.norm(index - thumb) / 2
    axes = Rotation.align_vectors([along], [[1.0, 0, 0]])[0].as_quat(scalar_first=True)
    cube = ObjectDescription(size=np.array([half, 0.02, 0.02]), mass=MASS, friction=FRICTION, kind="box")
    return rigid, pose, Tabletop(cube, np.array([0, 0, 0.4, *axes]), np.zeros((0, 3)), np.zeros((0, 3)), "cube")


def pressed(world: World, pose: HandPose, steps: int = 75) -> np.ndarray:
    """The strength of all touches together (N), step by step; the cube is held where it is by hand."""
    start, found = world.data.qpos[-7:].copy(), []
    for _ in range(steps):
        assert world.step(pose)
        found.append(sum(np.linalg.norm(touch.force) for touch in world.touches()))
        world.data.qpos[-7:], world.data.qvel[-6:] = start, 0
    return np.array(found)


def test_touching_fingers_press_and_without_the_grip_they_hardly_do(pinching):
    rigid, pose, table = pinching
    off, grip = (pressed(World(rigid, table, pose, assist), pose) for assist in ("off", "grip"))
    just_holds = MASS * 9.81 / (2 * FRICTION)  # of thumb and of fingers
    assert grip[-1] - off[-1] > 2 * just_holds


def test_fingers_that_touch_do_not_snap_shut(pinching):
    rigid, pose, table = pinching
    world, start = World(rigid, table, pose, "grip"), table.pose
    told = []
    for _ in range(75):
        world.step(pose)
        told.append(world.data.ctrl[6:].copy())
        world.data.qpos[-7:], world.data.qvel[-6:] = start, 0
    far = np.abs(told[-1] - told[0]).max()
    assert far > 0.02
    assert np.abs(np.diff(told, axis=0)).max() < 0.2 * far


def test_a_hand_away_from_the_object_is_as_it_is_tracked(pinching):
    rigid, pose, table = pinching
    away = HandPose(pose.position + np.array([0.0, 0.0, 0.3]), pose.quaternion, pose.angles)
    world = World(rigid, table, away, "grip")
    for _ in range(5):
        world.step(away)
    np.testing.assert_allclose(
        world.data.ctrl[6:], np.clip(away.angles, rigid.hinge_lower, rigid.hinge_upper), atol=1e-9
    )
    assert world.touches() == []


def test_what_is_only_near_is_no_touch(pinching):
    rigid, pose, table = pinching
    thinner = ObjectDescription(
        size=table.object.size - np.array([0.003, 0, 0]), mass=MASS, friction=FRICTION, kind="box"
    )
    near = World(rigid, Tabletop(thinner, table.pose, table.support, table.support_position, "cube"), pose, "grip")
    near.step(pose)
    assert all(np.linalg.norm(touch.force) > 0 for touch in near.touches())
