"""Mirror images: exact, their own inverse, and the same act in kinematics and in the engine."""

import dataclasses

import jax
import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from envs.physics.solver import gauss_seidel
from envs.scene import demonstration_spec
from mjx_hand.hand.load import load_hand
from mjx_hand.motion.demonstration import Demonstration
from mjx_hand.motion.joint_motion import JointMotion
from mjx_hand.motion.mirror import mirrored_demonstration, mirrored_motion
from mjx_hand.motion.motion import Motion
from mjx_hand.objects.description import ObjectDescription
from mjx_hand.rigid.build import build_rigid_hand
from mjx_hand.rigid.rigid_hand import finger_tips

FRAMES = 30
MIRROR = np.diag([-1.0, 1, 1])


@pytest.fixture(scope="module")
def falling() -> Demonstration:
    """A hand below a wedge, which falls into it."""
    rng = np.random.default_rng(0)
    wedge = np.array([[0, 0, 0], [0.05, 0, 0], [0, 0.06, 0], [0, 0, 0.04], [0.05, 0.01, 0.03]]) - 0.02
    turn = Rotation.from_rotvec([-1.5, 0.1, -0.1])
    return Demonstration(
        motion=JointMotion(
            fps=50.0,
            angles=np.tile(rng.uniform(0.0, 0.4, 20), (FRAMES, 1)),
            wrist_position=np.tile([0.09, 0.0, 0.1], (FRAMES, 1)),
            wrist_quaternion=np.tile(turn.as_quat(scalar_first=True), (FRAMES, 1)),
            valid=np.ones(FRAMES, bool),
        ),
        object_pose=np.tile([0.02, 0.0, 0.17, 0.8, 0.6, 0, 0], (FRAMES, 1)),
        object=ObjectDescription(kind="mesh", size=np.full(3, 0.05), mass=0.2, friction=0.8, hulls=wedge[None]),
        support=np.array([[0.02, 0.03, 0.01]]),
        support_position=np.array([[0.2, 0.1, 0.01]]),
        shape=rng.normal(size=10),
        grasp="recorded",
    )


def test_a_mirror_image_is_its_own_inverse_and_exact(falling):
    again = mirrored_demonstration(mirrored_demonstration(falling))
    jax.tree.map(np.testing.assert_array_equal, again, falling)
    assert mirrored_demonstration(falling).motion.side == "left"
    motion = Motion(
        fps=30.0,
        rotations=Rotation.random(60, rng=np.random.default_rng(1)).as_matrix().reshape(4, 15, 3, 3),
        wrist_position=np.arange(12.0).reshape(4, 3),
        wrist_quaternion=Rotation.random(4, rng=np.random.default_rng(2)).as_quat(scalar_first=True),
        shape=np.zeros(10),
        valid=np.ones(4, bool),
        link_offset=np.arange(48.0).reshape(16, 3),
    )
    other = mirrored_motion(motion)
    turned = Rotation.from_quat(motion.wrist_quaternion, scalar_first=True).as_matrix()
    seen = Rotation.from_quat(other.wrist_quaternion, scalar_first=True).as_matrix()
    np.testing.assert_allclose(seen, MIRROR @ turned @ MIRROR, atol=1e-12)
    np.testing.assert_allclose(other.rotations, MIRROR @ motion.rotations @ MIRROR, atol=1e-12)
    jax.tree.map(np.testing.assert_array_equal, mirrored_motion(other), motion)


def test_the_left_hand_does_in_the_engine_what_the_right_one_does(falling):
    ends = {}
    for d in (falling, mirrored_demonstration(falling)):
        hand = build_rigid_hand(load_hand(side=d.motion.side), d.shape)
        tips = np.asarray(finger_tips(d.motion.angles[0], hand), float)
        (model,) = gauss_seidel([demonstration_spec(d, hand).compile()])
        data = mujoco.MjData(model)
        data.qpos[-7:] = d.object_pose[0]
        data.qpos[6:26] = data.ctrl[6:26] = d.motion.angles[0]
        base = Rotation.from_quat(d.motion.wrist_quaternion[0], scalar_first=True)
        data.qpos[:3] = data.ctrl[:3] = base.inv().apply(d.motion.wrist_position[0])
        touched = 0
        for _ in range(40):
            mujoco.mj_step(model, data)
            touched += data.ncon
        ends[d.motion.side] = tips, data.qpos[-7:-4].copy(), data.qpos[6:26].copy(), touched
    np.testing.assert_allclose(ends["left"][0], ends["right"][0] * [-1, 1, 1], atol=1e-4)
    assert ends["right"][3] > 0
    assert ends["right"][1][2] < 0.16  # it fell
    np.testing.assert_allclose(ends["left"][1], ends["right"][1] * [-1, 1, 1], atol=2e-3)
    np.testing.assert_allclose(ends["left"][2], ends["right"][2], atol=0.02)


def test_hinges_of_the_person_are_mirrored_too(falling):
    rng = np.random.default_rng(3)
    axes = rng.normal(size=(20, 3))
    rest = Rotation.from_rotvec(rng.normal(scale=0.1, size=(15, 3))).as_matrix()
    own = dataclasses.replace(falling, hinge_axis=axes / np.linalg.norm(axes, axis=1)[:, None], rest_rotation=rest)
    other = mirrored_demonstration(own)
    assert own.hinge_axis is not None
    assert other.hinge_axis is not None
    assert other.rest_rotation is not None
    for k in (0, 7, 19):
        turn = Rotation.from_rotvec(0.3 * own.hinge_axis[k]).as_matrix()
        mirrored = Rotation.from_rotvec(0.3 * other.hinge_axis[k]).as_matrix()
        np.testing.assert_allclose(mirrored, MIRROR @ turn @ MIRROR, atol=1e-12)
    np.testing.assert_allclose(other.rest_rotation, MIRROR @ rest @ MIRROR, atol=1e-12)
