"""A hand whose zero pose is not the flat hand: kinematics, projection and both descriptions mean the same by it."""

import jax.numpy as jnp
import mujoco
import numpy as np
import pytest
import yourdfpy
from scipy.spatial.transform import Rotation

from mjx_hand.capture.keypoints.layouts import hand_keypoints
from mjx_hand.hand.joints import HINGE_LINKS, HINGES, LINKS
from mjx_hand.projection import project
from mjx_hand.pytree import replace
from mjx_hand.rigid.bone_lengths import with_link_offsets
from mjx_hand.rigid.export.mjcf import write_mjcf
from mjx_hand.rigid.export.urdf import write_urdf
from mjx_hand.rigid.rigid_hand import RigidHand, finger_tips, forward_kinematics, joint_rotations
from mjx_hand.robots.human_tree import human_tree
from mjx_hand.robots.solver.kinematic_tree import tree_points


@pytest.fixture(scope="module")
def bent(rigid) -> RigidHand:
    turns = Rotation.from_rotvec(np.random.default_rng(1).normal(0, 0.2, (15, 3)))
    return replace(rigid, rest_rotation=turns.as_matrix())


def test_the_rest_rotation_comes_after_the_hinges(bent, rigid, angles):
    expected = np.asarray(joint_rotations(angles, rigid), float) @ bent.rest_rotation
    np.testing.assert_allclose(joint_rotations(angles, bent), expected, atol=1e-6)
    np.testing.assert_allclose(joint_rotations(np.zeros(20, np.float32), bent), bent.rest_rotation, atol=1e-6)


@pytest.mark.parametrize("carry", [False, True])
def test_projection_inverts_it(bent, angles, carry):
    np.testing.assert_allclose(project(joint_rotations(angles, bent), bent, carry=carry), angles, atol=2e-4)


def test_carried_residuals_leave_each_links_orientation_at_its_best(bent, angles):
    """Turned off its axes at each joint: no other angle of a finger's last hinge brings its last link nearer."""
    off = Rotation.from_rotvec(np.random.default_rng(2).normal(0, 0.15, (60, 3))).as_matrix().reshape(4, 15, 3, 3)
    recorded = np.asarray(joint_rotations(angles, bent), float) @ off
    found = np.asarray(project(recorded, bent, carry=True))

    def finger_errors(candidate):
        made = np.asarray(joint_rotations(candidate, bent), float)
        links = [np.einsum("tfij,tfjk,tfkl->tfil", r[:, ::3], r[:, 1::3], r[:, 2::3]) for r in (recorded, made)]
        return np.linalg.norm(links[0] - links[1], axis=(-2, -1))

    best = finger_errors(found)
    for step in (-0.02, 0.02):
        assert (finger_errors(found + step * (np.arange(20) % 4 == 3)) > best).all()


def test_descriptions_agree(bent, angles, tmp_path):
    write_urdf(bent, tmp_path)
    write_mjcf(bent, tmp_path)
    rotations, positions = (np.asarray(a) for a in forward_kinematics(angles, bent))
    robot = yourdfpy.URDF.load(str(tmp_path / f"{bent.side}_hand.urdf"))
    model = mujoco.MjModel.from_xml_path(str(tmp_path / f"{bent.side}_hand.xml"))
    data = mujoco.MjData(model)
    for row, rotation, position in zip(angles, rotations, positions, strict=True):
        robot.update_cfg(dict(zip(HINGES, row.tolist(), strict=True)))
        found = np.stack([robot.get_transform(name, "wrist") for name in LINKS])
        np.testing.assert_allclose(found[:, :3, :3], rotation, atol=1e-5)
        np.testing.assert_allclose(found[:, :3, 3], position, atol=1e-5)
        data.qpos[[model.joint(name).qposadr[0] for name in HINGES]] = row
        mujoco.mj_kinematics(model, data)
        found = np.stack([data.body(name).xmat.reshape(3, 3) for name in LINKS])
        np.testing.assert_allclose(found, rotation, atol=1e-5)
        places = np.stack([data.body(name).xpos - data.body("wrist").xpos for name in LINKS])
        np.testing.assert_allclose(places, position, atol=1e-5)


def test_the_tree_for_keypoints_agrees(bent, angles):
    expected = hand_keypoints(forward_kinematics(angles, bent)[1], finger_tips(angles, bent))
    np.testing.assert_allclose(tree_points(angles, human_tree(bent)), expected, atol=1e-6)


def test_new_bones_bring_axes_and_the_flat_rest(bent, rigid):
    assert with_link_offsets(bent, rigid.link_offset).rest_rotation is None


def test_it_passes_through_jit(bent, angles):
    found = project(joint_rotations(jnp.asarray(angles), bent), bent)
    assert found.shape == (4, len(HINGE_LINKS))
