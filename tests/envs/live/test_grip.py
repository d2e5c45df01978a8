"""The grip presses what thumb and fingers touch, with about the force that is asked for, and nothing else."""

import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from envs.grasps import grasp_type
from envs.grasps.grasp_type import Wrap
from envs.live.twin.pose import HandPose
from envs.live.twin.tabletop import Tabletop
from envs.live.twin.world import World
from mjx_hand.hand.joints import FINGERS, HINGES, LINKS
from mjx_hand.hand.load import load_hand
from mjx_hand.objects.description import ObjectDescription
from mjx_hand.rigid.build import build_rigid_hand
from mjx_hand.rigid.gains import Gains
from mjx_hand.rigid.rigid_hand import finger_tips, forward_kinematics

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


def test_fingers_meet_the_object_and_not_the_air_around_it(pinching):
    """They are noticed before they touch, and bear where they do."""
    rigid, pose, table = pinching
    world = World(rigid, table, pose, "grip")
    pressed(world, pose)
    gaps = [contact.dist for contact in world.data.contact if contact.efc_address >= 0]
    assert gaps
    assert min(gaps) > -4e-3
    assert max(gaps) < 1e-4


def test_what_is_only_near_is_no_touch(pinching):
    rigid, pose, table = pinching
    thinner = ObjectDescription(
        size=table.object.size - np.array([0.003, 0, 0]), mass=MASS, friction=FRICTION, kind="box"
    )
    near = World(rigid, Tabletop(thinner, table.pose, table.support, table.support_position, "cube"), pose, "grip")
    near.step(pose)
    assert all(np.linalg.norm(touch.force) > 0 for touch in near.touches())


@pytest.fixture(scope="module")
def fist():
    """A fist around a handle that hangs in the air, and its table."""
    rigid, grasp = build_rigid_hand(load_hand()), grasp_type("power")
    angles, turn = np.array(grasp.posture), Rotation.from_matrix(np.array(grasp.wrist_rotation))
    knuckle = np.asarray(forward_kinematics(jnp.asarray(angles), rigid)[1])[LINKS.index("middle1")]
    assert isinstance(grasp.closing, Wrap)
    centre = turn.apply(knuckle + np.array(grasp.closing.place))
    pose = HandPose(np.array([0.0, 0.0, 0.4]) - centre, turn.as_quat(scalar_first=True), angles)
    handle = ObjectDescription(size=np.array([0.019, 0.1, 0.0]), mass=1.5, friction=0.7, kind="capsule")
    lies = Rotation.from_matrix(np.array(grasp.object_rotation)).as_quat(scalar_first=True)
    return rigid, pose, Tabletop(handle, np.array([0, 0, 0.4, *lies]), np.zeros((0, 3)), np.zeros((0, 3)), "handle")


def told(world: World, pose: HandPose, steps: int) -> np.ndarray:
    """What the hinges are told at the end; the object is held where it is by hand."""
    start = world.data.qpos[-7:].copy()
    for _ in range(steps):
        world.step(pose)
        world.data.qpos[-7:], world.data.qvel[-6:] = start, 0
    return world.data.ctrl[6:].copy()


def test_a_fist_closes_with_every_flexing_joint_and_opens_again(fist):
    rigid, pose, table = fist
    world, gains = World(rigid, table, pose, "grip"), Gains()
    flexes = np.array([name.endswith("_flexion") for name in HINGES])
    asked = np.clip(
        pose.angles + 0.75 * flexes * gains.force_limit / gains.stiffness, *world.model.actuator_ctrlrange[6:26].T
    )
    np.testing.assert_allclose(told(world, pose, 300), asked, atol=0.01)
    opened = HandPose(pose.position, pose.quaternion, np.zeros(20))
    away = [name.startswith(("middle", "ring")) for name in HINGES]  # of a flat hand others are still near the handle
    np.testing.assert_allclose(told(world, opened, 1500)[away], 0.0, atol=0.02)


def test_fingers_that_open_let_go_though_they_touch_still(pinching):
    """While they hold, joints are low-passed: without looking at where fingers are tracked they would hold on."""
    rigid, pose, table = pinching
    world = World(rigid, table, pose, "grip")
    pressed(world, pose, 150)
    assert touching(world) == {"index", "thumb"}
    angles = np.where([name.startswith("thumb") for name in HINGES], pose.angles, 0)
    opened = HandPose(pose.position, pose.quaternion, angles)
    pressed(world, opened, 75)
    assert touching(world) == {"thumb"}


def touching(world: World) -> set[str]:
    return {touch.link[:-1] for touch in world.touches()}


def test_a_holding_hand_does_not_pass_on_the_trackers_trembling(fist):
    rigid, pose, table = fist
    world, rng, heard = World(rigid, table, pose, "grip"), np.random.default_rng(0), []
    told(world, pose, 300)
    for _ in range(60):
        shaken = HandPose(pose.position, pose.quaternion, pose.angles + 0.1 * rng.normal(size=20))
        heard.append(told(world, shaken, 8))  # 31 poses a second
    assert np.std(heard, axis=0).max() < 0.03
