"""Gains of a robot hand's joints, by rule from its description.

A joint is as strong as its URDF's effort says, but no stronger than what presses a finger tip with 15 N (efforts of
1000 N m are common): 15 N times the distance of the tip from the joint's axis. A person's fingers have as much. Its
stiffness reaches that torque half a radian (a sliding joint 1 cm) from the target, and it is damped to 0.7 of the
critical with the inertia that it moves. The wrist is as many times as stiff as the hand is heavier than a person's.
A description's `force_limits` and `stiffness` go before the rule.
"""

from collections.abc import Mapping, Sequence

import mujoco
import numpy as np
from jaxtyping import Float

from mjx_hand.rigid.gains import Gains

TIP_FORCE = 15.0  # N
_TRAVEL = (0.2, 0.004)  # rad or m from the target, at which the limit is reached
_LEAST_LEVER = 0.02  # m
_DAMPING = 0.7  # of the critical
_HUMAN = (0.5, 0.007)  # kg, and kg m2 about the wrist


def ruled_gains(
    model: mujoco.MjModel,
    joints: Sequence[str],
    efforts: Sequence[float | None],
    force_limits: Mapping[str, float],
    stiffness: Mapping[str, float],
) -> Gains:
    """The gains of a hand's actuated joints.

    Args:
        model: the hand without actuators on its wrist, sites `..._tip` at the finger tips.
        joints: names of those that are actuated.
        efforts: what the URDF says of each (N m or N).
        force_limits, stiffness: of single joints, by name, in the rule's place.
    """
    data = mujoco.MjData(model)
    middle = model.jnt_range.mean(axis=1)
    data.qpos[:] = np.where(model.jnt_limited, np.clip(0.0, *model.jnt_range.T), middle)
    mujoco.mj_forward(model, data)
    moved = inertias(model, data)
    limits, kp, kv = [], [], []
    for name, effort in zip(joints, efforts, strict=True):
        joint = model.joint(name).id
        slides = model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_SLIDE
        most = TIP_FORCE * (1.0 if slides else _lever(model, data, joint))
        limits.append(force_limits.get(name, most if effort is None else min(effort, most)))
        kp.append(stiffness.get(name, limits[-1] / _TRAVEL[int(slides)]))
        kv.append(2 * _DAMPING * np.sqrt(moved[model.jnt_dofadr[joint]]))
    mass = float(model.body_subtreemass[model.body("wrist").id])
    heavier = max(1.0, mass / _HUMAN[0])
    harder = max(1.0, float(moved[3:6].max()) / _HUMAN[1])
    usual = Gains()
    return Gains(
        stiffness=np.array(kp, float),
        force_limit=np.array(limits, float),
        damping_ratio=np.array(kv, float),
        armature=usual.armature,
        wrist_slide=(usual.wrist_slide[0] * heavier, usual.wrist_slide[1] * heavier),
        wrist_turn=(usual.wrist_turn[0] * harder, usual.wrist_turn[1] * harder),
        wrist_armature=usual.wrist_armature,
    )


def inertias(model: mujoco.MjModel, data: mujoco.MjData) -> Float[np.ndarray, "v"]:
    """The inertia (kg, kg m2) that each degree of freedom moves where the hand is now."""
    full = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, full)
    return np.diag(full)


def _lever(model: mujoco.MjModel, data: mujoco.MjData, joint: int) -> float:
    """How far (m) the finger tip that a joint moves is from its axis, at most; from its origin, where fingers bend."""
    tips = [k for k in range(model.nsite) if model.site(k).name.endswith("_tip") and _carries(model, joint, k)]
    away = [float(np.linalg.norm(data.site_xpos[k] - data.xanchor[joint])) for k in tips]
    return max([_LEAST_LEVER, *away])


def _carries(model: mujoco.MjModel, joint: int, site: int) -> bool:
    body = int(model.site_bodyid[site])
    while body:
        if body == model.jnt_bodyid[joint]:
            return True
        body = int(model.body_parentid[body])
    return False
