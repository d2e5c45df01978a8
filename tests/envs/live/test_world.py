"""The world: objects rest where they are put, touches add up to what they hold, recordings are scenes of what was."""

import jax.numpy as jnp
import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from envs.grasps import grasp_names
from envs.live.twin.person import measured_hand
from envs.live.twin.placement import HEIGHT, place_hand
from envs.live.twin.pose import HandPose
from envs.live.twin.recorder import Recorder, save_recording
from envs.live.twin.tabletop import Tabletop, tabletop
from envs.live.twin.world import World
from mjx_hand.capture.keypoints.layouts import hand_keypoints
from mjx_hand.capture.load_scene import load_scene
from mjx_hand.errors import InputError
from mjx_hand.hand.joints import LINKS
from mjx_hand.hand.load import load_hand
from mjx_hand.motion.resample import quaternion_matrices
from mjx_hand.objects.description import ObjectDescription
from mjx_hand.rigid.build import build_rigid_hand
from mjx_hand.rigid.rigid_hand import chain, forward_kinematics, tip_positions

AWAY = HandPose(np.array([0.0, 0.0, 1.0]), np.array([1.0, 0, 0, 0]), np.zeros(20))


@pytest.fixture(scope="module")
def hand():
    return build_rigid_hand(load_hand())


@pytest.mark.parametrize("name", grasp_names())
def test_the_object_of_every_grasp_type_stands_where_it_is_put(hand, name):
    table = tabletop(name)
    world = World(hand, table, AWAY)
    for _ in range(250):
        assert world.step(AWAY)
    moved = world.poses()[-1, :3] - table.pose[:3]
    assert np.linalg.norm(moved) < 2e-3
    world.data.qpos[-7:-4] += 0.5
    world.put_object_back()
    np.testing.assert_array_equal(world.data.qpos[-7:], table.pose)


def test_a_mesh_stands_on_the_table_as_it_is_in_its_file(tmp_path, hand):
    trimesh.creation.box(extents=(0.04, 0.05, 0.06)).export(tmp_path / "block.stl")
    table = tabletop(str(tmp_path / "block.stl"), mass=0.2)
    assert table.pose[2] == pytest.approx(0.03)
    assert (table.name, float(table.object.mass)) == ("block", 0.2)
    world = World(hand, table, AWAY)
    for _ in range(100):
        world.step(AWAY)
    assert world.poses()[-1, 2] == pytest.approx(0.03, abs=1e-3)


@pytest.mark.parametrize(("what", "mass", "said"), [("teapot", None, "pinch"), ("no.stl", None, "no such file")])
def test_what_is_no_object_is_refused(what, mass, said):
    with pytest.raises(InputError, match=said):
        tabletop(what, mass)


def test_forces_of_touches_carry_what_lies_on_the_hand(hand):
    ball = ObjectDescription(size=np.array([0.03, 0.03, 0.008]), mass=0.15, friction=0.9, kind="box")
    palm_up = Rotation.from_euler("x", -90, degrees=True)  # the back of the hand, +y, is below
    palm = HandPose(np.array([0.0, 0.0, 0.4]), palm_up.as_quat(scalar_first=True), np.zeros(20))
    middle = np.asarray(hand.link_offset)[LINKS.index("middle1")]
    above = palm.position + Rotation.from_quat(palm.quaternion, scalar_first=True).apply(0.7 * middle) + [0, 0, 0.06]
    table = Tabletop(ball, np.array([*above, 1.0, 0, 0, 0]), np.zeros((0, 3)), np.zeros((0, 3)), "plate")
    world = World(hand, table, palm)
    for _ in range(500):
        assert world.step(palm)
    touches = world.touches()
    assert touches
    assert {touch.link for touch in touches} <= set(LINKS)
    total = np.sum([touch.force for touch in touches], axis=0)
    np.testing.assert_allclose(total, [0, 0, 0.15 * 9.81], atol=0.05)
    place = world.poses()[-1, :3]
    assert all(np.linalg.norm(touch.position - place) < 0.05 for touch in touches)


def test_a_diverged_world_begins_again(hand):
    world = World(hand, tabletop("pinch"), AWAY)
    world.data.qvel[0] = np.nan
    assert not world.step(AWAY)
    assert world.step(AWAY)
    np.testing.assert_allclose(world.poses()[0, :3], AWAY.position, atol=1e-3)


def test_a_recording_is_a_scene_of_what_the_twin_did(tmp_path, hand):
    table, shape = tabletop("pinch"), np.zeros(10)
    world, recorder = World(hand, table, AWAY), Recorder(table, shape, "right", 50.0)
    recorder.begin()
    links, things = [], []
    for k in range(30):
        bent = HandPose(AWAY.position + 0.002 * k, AWAY.quaternion, np.full(20, 0.02 * k))
        for _ in range(5):
            world.step(bent)
        recorder.add(world, world.poses())
        links.append(world.poses()[:-1, :3])
        things.append(world.poses()[-1])
    recorded = recorder.end()
    assert recorded is not None
    assert recorder.end() is None
    path = save_recording(recorded, tmp_path / "live")
    assert save_recording(recorded, tmp_path / "live").name == "live-002.npz"
    assert path.name == "live-001.npz"
    scene = load_scene(path)
    motion, (cube,) = scene.hands[0], scene.objects
    assert scene.up is not None
    np.testing.assert_allclose(scene.up, [0, 0, 1])
    np.testing.assert_allclose(np.concatenate([cube.position, cube.quaternion], axis=1), things, atol=1e-9)
    # The twin's joints are where the recorded motion puts those of a hand of this shape.
    _, places = chain(jnp.asarray(motion.rotations), jnp.asarray(hand.link_offset))
    turned = np.einsum("tij,tkj->tki", quaternion_matrices(motion.wrist_quaternion), np.asarray(places))
    np.testing.assert_allclose(turned + motion.wrist_position[:, None], links, atol=1e-5)


def test_a_hand_is_measured_by_its_bones():
    shape = np.array([1.5, -0.8, 0.5])
    truth = build_rigid_hand(load_hand(), shape)
    links = forward_kinematics(np.full(20, 0.2, np.float32), truth)
    points = np.asarray(hand_keypoints(links[1], tip_positions(*links, truth)), float)
    found = measured_hand(np.tile(points, (5, 1, 1)), "right")
    longest = np.linalg.norm(np.asarray(found.rigid.link_offset) - np.asarray(truth.link_offset), axis=1).max()
    assert longest < 2e-3
    with pytest.raises(InputError, match="times too big"):
        measured_hand(np.tile(3 * points, (5, 1, 1)), "right")


@pytest.mark.parametrize("side", ["right", "left"])
@pytest.mark.parametrize(("up", "forward"), [("+y", "-z"), ("-y", "-z"), ("+z", "+x"), ("-x", "+y")])
def test_a_hand_begins_above_the_table_with_its_fingers_towards_the_object(side, up, forward):
    rigid, rng = build_rigid_hand(load_hand(side=side)), np.random.default_rng(3)
    axis = np.zeros(3)
    axis["xyz".index(up[1])] = 1.0 if up[0] == "+" else -1.0
    fingers = np.asarray(rigid.link_offset)[LINKS.index("middle1")]
    for _ in range(10):
        position, turn = rng.normal(size=3), Rotation.from_quat(rng.normal(size=4))
        placement = place_hand(position, turn.as_quat(scalar_first=True), rigid, up, forward)
        np.testing.assert_allclose(placement.rotation @ axis, [0, 0, 1], atol=1e-12)
        assert np.linalg.det(placement.rotation) == pytest.approx(1.0)
        assert placement.position(position)[2] == pytest.approx(HEIGHT)
        placed = Rotation.from_quat(placement.quaternion(turn.as_quat(scalar_first=True)), scalar_first=True)
        ahead = placed.apply(fingers / np.linalg.norm(fingers))
        if np.linalg.norm(ahead[:2]) > 0.31:
            assert ahead[0] > 0.3
            assert ahead[1] == pytest.approx(0.0, abs=1e-9)
