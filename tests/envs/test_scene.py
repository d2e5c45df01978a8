import copy

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mujoco import mjx
from scipy.spatial.transform import Rotation

from envs.demonstrations.scripted.trials import support_boxes
from envs.grasps import grasp_names, grasp_type
from envs.scene import NUM_WRIST, OBJECT, SUPPORT, TABLE, TIMESTEP, base_rotation, scene_spec, wrist_coordinates
from mjx_hand.errors import InputError
from mjx_hand.hand.joints import HINGES, NUM_HINGES
from mjx_hand.objects.description import ObjectDescription
from mjx_hand.objects.primitives import half_extents
from mjx_hand.rigid.rigid_hand import forward_kinematics


@pytest.fixture(scope="module")
def model(demonstrations, hands):
    d = demonstrations[0]
    return scene_spec(hands[0], d.object, d.support, d.support_position, base_rotation(d)).compile()


def test_joints_and_actuators_run_in_one_order(model):
    wrist = ["wrist_x", "wrist_y", "wrist_z", "wrist_roll", "wrist_pitch", "wrist_yaw"]
    assert [model.actuator(k).name for k in range(model.nu)] == [*wrist, *HINGES]
    assert [model.joint(k).name for k in range(model.njnt)] == [*wrist, *HINGES, OBJECT]
    assert model.nq == NUM_WRIST + NUM_HINGES + 7
    assert model.opt.timestep == TIMESTEP


def test_only_the_object_is_touched(model):
    """Every pair that MuJoCo would test has the object in it: no finger meets a finger, the block or the table."""
    object_id = model.geom(OBJECT).id
    ground = {model.geom(f"{SUPPORT}0").id, model.geom(TABLE).id}
    partners = set()
    for i in range(model.ngeom):
        for j in range(i + 1, model.ngeom):
            kind, meets = model.geom_contype, model.geom_conaffinity
            if kind[i] & meets[j] or kind[j] & meets[i]:
                assert object_id in (i, j)
                partners |= {i, j} - {object_id}
    hand = set(range(model.ngeom)) - ground - {object_id}
    assert len(hand) == 20
    assert partners == ground | hand


def test_a_hand_pushed_through_table_and_itself_touches_nothing(model):
    data = mujoco.MjData(model)
    data.qpos[NUM_WRIST : NUM_WRIST + NUM_HINGES] = 1.2
    data.qpos[-7:-4] = [1.0, 1.0, 0.5]
    mujoco.mj_forward(model, data)
    assert data.ncon == 0


def test_the_object_has_the_mass_friction_and_size_that_were_asked_for(model, demonstrations):
    description = demonstrations[0].object
    assert model.body(OBJECT).mass[0] == pytest.approx(description.mass)
    np.testing.assert_allclose(model.geom(OBJECT).size, description.size)
    for name in (OBJECT, f"{SUPPORT}0", TABLE):
        assert model.geom(name).friction[0] == pytest.approx(description.friction)


def test_a_cube_rests_on_its_block(model, demonstrations):
    d = demonstrations[0]
    data = mujoco.MjData(model)
    data.qpos[2] = 0.5  # the hand is elsewhere
    data.ctrl[2] = 0.5
    data.qpos[-7:] = d.object_pose[0]
    for _ in range(250):
        mujoco.mj_step(model, data)
    top = d.support_position[0, 2] + d.support[0, 2]
    assert data.qpos[-5] == pytest.approx(top + d.object.size[2], abs=1e-3)


vectors = st.lists(st.floats(-0.7, 0.7), min_size=3, max_size=3)
quaternions = st.lists(st.floats(-1, 1), min_size=4, max_size=4).filter(lambda q: np.linalg.norm(q) > 0.1)


@settings(deadline=None, max_examples=30)
@given(quaternions, vectors, vectors)
def test_wrist_coordinates_put_the_wrist_where_it_was(model, base, turn, position):
    """World pose -> the wrist's joints -> MuJoCo's own kinematics -> the same world pose, whatever the base."""
    base = Rotation.from_quat(base).as_matrix()
    wanted = Rotation.from_matrix(base) * Rotation.from_rotvec(turn)
    found = wrist_coordinates(np.array([position]), wanted.as_quat(scalar_first=True)[None], base)
    other = copy.copy(model)
    other.body("wrist").quat = Rotation.from_matrix(base).as_quat(scalar_first=True)
    data = mujoco.MjData(other)
    data.qpos[:NUM_WRIST] = found[0]
    mujoco.mj_kinematics(other, data)
    np.testing.assert_allclose(data.body("wrist").xmat.reshape(3, 3), wanted.as_matrix(), atol=1e-9)
    np.testing.assert_allclose(data.body("wrist").xpos, position, atol=1e-9)


def test_a_demonstrations_poses_are_reached_by_the_scene(model, demonstrations, hands):
    d = demonstrations[0]
    base = base_rotation(d)
    rows = wrist_coordinates(d.motion.wrist_position, d.motion.wrist_quaternion, base)
    np.testing.assert_allclose(rows[0, 3:], 0, atol=1e-9)
    assert np.abs(np.diff(rows[:, 3:], axis=0)).max() < 0.3  # no jumps
    data = mujoco.MjData(model)
    for k in (0, 100, d.num_frames - 1):
        data.qpos[:26] = np.concatenate([rows[k], d.motion.angles[k]])
        mujoco.mj_kinematics(model, data)
        wrist = Rotation.from_quat(d.motion.wrist_quaternion[k], scalar_first=True).as_matrix()
        _, centres = forward_kinematics(d.motion.angles[k].astype(np.float32), hands[0])
        wanted = np.asarray(centres) @ wrist.T + d.motion.wrist_position[k]
        np.testing.assert_allclose(data.xpos[1:17], wanted, atol=1e-5)


def test_an_unknown_kind_of_object_is_refused(hands):
    cone = ObjectDescription(kind="cone", size=np.ones(3), mass=0.1, friction=1.0)
    with pytest.raises(InputError, match=r"'cone' is not known; valid: box, sphere, cylinder, capsule, mesh"):
        scene_spec(hands[0], cone, np.ones((1, 3)), np.zeros((1, 3)), np.eye(3)).compile()


@pytest.mark.parametrize("name", grasp_names())
def test_every_grasp_type_has_a_scene_that_mjx_can_run(name, hands):
    """MJX lacks some pairs of shapes, a cylinder on a box among them."""
    grasp = grasp_type(name)
    description = ObjectDescription(kind=grasp.object_kind, size=np.array(grasp.object_size[0]), mass=0.1, friction=1.0)
    scene = scene_spec(hands[0], description, *support_boxes(grasp), np.array(grasp.wrist_rotation)).compile()
    mjx.put_model(scene, impl="jax")
    data = mujoco.MjData(scene)
    data.qpos[2], data.ctrl[2] = 0.5, 0.5
    rotation = Rotation.from_matrix(np.array(grasp.object_rotation))
    height = grasp.rest + np.abs(rotation.as_matrix()[2]) @ np.asarray(
        half_extents(grasp.object_kind, description.size)
    )
    data.qpos[-7:] = [0.0, 0.0, height, *rotation.as_quat(scalar_first=True)]
    for _ in range(125):
        mujoco.mj_step(scene, data)
    assert data.qpos[-5] == pytest.approx(height, abs=0.003)  # it is held up where the type says
    assert np.linalg.norm(data.qvel[-6:-3]) < 0.01
