"""A demonstration's reference, stepped in plain MuJoCo from its first frame: an oracle for what must hold."""

import mujoco
import numpy as np

from envs.physics.solver import gauss_seidel
from envs.reference import make_reference
from envs.scene import demonstration_spec
from mjx_hand.motion.demonstration import Demonstration
from mjx_hand.rigid.gains import Gains
from mjx_hand.rigid.rigid_hand import RigidHand


def unaided(demonstration: Demonstration, hand: RigidHand, force: float) -> np.ndarray:
    """The object's pose in every frame, with a grip of `force` newtons."""
    reference = make_reference([demonstration], [hand], grip_force=force, gains=Gains())
    (model,) = gauss_seidel([demonstration_spec(demonstration, hand).compile()])
    data = mujoco.MjData(model)
    data.qpos[:] = np.concatenate([reference.targets[0, 0], demonstration.object_pose[0]])
    poses = [demonstration.object_pose[0]]
    for controls in np.asarray(reference.controls)[0, 1:]:
        data.ctrl[:] = np.clip(controls, *model.actuator_ctrlrange.T)
        mujoco.mj_step(model, data, 5)
        poses.append(data.qpos[-7:].copy())
    return np.stack(poses)
