"""Our forward kinematics against yourdfpy and MuJoCo (both descriptions); `test_dynamics` has more engines."""

import jax.numpy as jnp
import mujoco
import numpy as np
import pytest
import yourdfpy
from scipy.spatial.transform import Rotation

from mjx_hand.hand.joints import FINGERS, HINGE_LINKS, HINGES, LINKS
from mjx_hand.hand.skinning import link_transforms
from mjx_hand.rigid.export.mjcf import hand_spec
from mjx_hand.rigid.rigid_hand import finger_tips, forward_kinematics, joint_rotations

TOLERANCE = 1e-5


@pytest.fixture(scope="module")
def poses(rigid, angles):
    rotations, positions = forward_kinematics(angles, rigid)
    return np.asarray(rotations), np.asarray(positions), np.asarray(finger_tips(angles, rigid))


def test_joint_rotations_compose_abduction_then_flexion(rigid, angles):
    found = np.asarray(joint_rotations(angles, rigid))
    for link in range(1, 16):
        expected = Rotation.identity(len(angles))
        for hinge in (h for h in range(20) if HINGE_LINKS[h] == link):
            expected = expected * Rotation.from_rotvec(angles[:, [hinge]] * rigid.hinge_axis[hinge])
        np.testing.assert_allclose(found[:, link - 1], expected.as_matrix(), atol=1e-6)


def test_rigid_chain_is_the_skinned_hands_chain(rigid, angles, poses):
    centres = np.zeros((16, 3))
    for link, parent in enumerate((-1, 0, 1, 2, 0, 4, 5, 0, 7, 8, 0, 10, 11, 0, 13, 14)):
        if link:
            centres[link] = centres[parent] + rigid.link_offset[link]
    rotations, positions = link_transforms(
        joint_rotations(angles, rigid), jnp.broadcast_to(jnp.asarray(centres), (len(angles), 16, 3))
    )
    np.testing.assert_allclose(rotations, poses[0], atol=1e-6)
    np.testing.assert_allclose(positions, poses[1], atol=1e-6)


def mujoco_poses(model, angles, wrist="wrist"):
    data = mujoco.MjData(model)
    address = [model.joint(name).qposadr[0] for name in HINGES]
    rotations, positions = [], []
    for row in angles:
        data.qpos[address] = row
        mujoco.mj_kinematics(model, data)
        rotations.append([data.body(name).xmat.reshape(3, 3).copy() for name in LINKS])
        positions.append([data.body(name).xpos - data.body(wrist).xpos for name in LINKS])
    return np.array(rotations), np.array(positions)


@pytest.mark.parametrize("suffix", ["xml", "urdf"])
def test_mujoco_agrees(rigid, folder, angles, poses, suffix):
    model = mujoco.MjModel.from_xml_path(str(folder / f"{rigid.side}_hand.{suffix}"))
    rotations, positions = mujoco_poses(model, angles)
    np.testing.assert_allclose(rotations, poses[0], atol=TOLERANCE)
    np.testing.assert_allclose(positions, poses[1], atol=TOLERANCE)


def test_tip_sensors_agree(rigid, angles, poses):
    model = hand_spec(rigid, visual=False).compile()
    data = mujoco.MjData(model)
    for row, tips in zip(angles, poses[2], strict=True):
        data.qpos[:] = row
        mujoco.mj_forward(model, data)
        found = [data.sensor(f"{finger}_tip").data for finger in FINGERS]
        np.testing.assert_allclose(found, tips, atol=TOLERANCE)


def test_yourdfpy_agrees(rigid, folder, angles, poses):
    robot = yourdfpy.URDF.load(str(folder / f"{rigid.side}_hand.urdf"))
    assert sorted(robot.actuated_joint_names) == sorted(HINGES)
    for row, rotations, positions, tips in zip(angles, *poses, strict=True):
        robot.update_cfg(dict(zip(HINGES, row.tolist(), strict=True)))
        found = np.stack([robot.get_transform(name, "wrist") for name in LINKS])
        np.testing.assert_allclose(found[:, :3, :3], rotations, atol=TOLERANCE)
        np.testing.assert_allclose(found[:, :3, 3], positions, atol=TOLERANCE)
        found_tips = [robot.get_transform(f"{finger}_tip", "wrist")[:3, 3] for finger in FINGERS]
        np.testing.assert_allclose(found_tips, tips, atol=TOLERANCE)
