"""Whether a robot's grasp holds, tried in MuJoCo's C engine: standing still, and through the whole demonstration.

Distances do not tell. Of grasps whose fingers are all where they should be, some turn the object as the fingers close,
some push it out of the hand, some meet it otherwise on the way. Candidates of grasp generators are tried in simulation
for the same reason, as by pulling from six sides (DexGraspNet, https://arxiv.org/abs/2210.02697).
"""

from dataclasses import dataclass

import mujoco
import numpy as np
from jaxtyping import Float

from envs.demonstrations.on_robot.robot_scene import RobotScene
from envs.grasps import Pads, grasp_names, grasp_type
from envs.grip_force import grip_force_of
from envs.model_grip import Press
from envs.physics.solver import gauss_seidel
from envs.reference import make_reference
from envs.scene import NUM_WRIST, TIMESTEP, demonstration_spec
from envs.task import Task
from mjx_hand.bodies.body import Body
from mjx_hand.bodies.coordinates import hand_coordinates
from mjx_hand.motion.demonstration import Demonstration

_GRAVITY = 9.81  # m/s^2
_CLOSES, _PULLED = 0.1, 0.4  # s
_LEVER = 0.05  # m by which a turn counts as a way
LOST = 0.1  # m from where it should be, where an object is lost
_FAR, _TURNED = 0.02, 0.5  # m, rad that count alike


@dataclass(frozen=True)
class Rehearsal:
    """How an object went with a robot's demonstration.

    Attributes:
        until: share of the demonstration before it was lost.
        moved, turned: how far it was from its demonstrated pose at most, until then (m, rad).
    """

    until: float
    moved: float
    turned: float

    @property
    def goodness(self) -> tuple[float, float]:
        """Higher is better: held longer, then nearer to the demonstrated pose."""
        return self.until, -self.moved / _FAR - self.turned / _TURNED


def pressing_force(demonstration: Demonstration) -> float:
    """The force (N) with which pads press in a trial: that with which demonstrations of the grasp type are made, or,
    of no type, what the object's weight asks for."""
    if demonstration.grasp not in grasp_names():
        return grip_force_of(demonstration.object.mass, demonstration.object.friction)
    grasp = grasp_type(demonstration.grasp)
    return grasp.closing.force if isinstance(grasp.closing, Pads) else grasp.grip_force


def slip(scene: RobotScene, targets: Float[np.ndarray, "u"]) -> float:
    """How far (m) the object goes, on average, as the hand closes and its weight then pulls from each of six sides.

    Args:
        scene: the robot's.
        targets: of wrist and actuated joints.
    """
    model, data, frame = scene.model, mujoco.MjData(scene.model), scene.pads.grasp
    scene.place(targets, frame)
    press = Press(scene.touch, scene.body, pressing_force(scene.demonstration), scene.body.gains, Task().wrap_torque)
    start = scene.touch.data.qpos.copy()
    told = targets + np.pad(press.offsets(), (NUM_WRIST, 0))
    gravity, way = model.opt.gravity.copy(), 0.0
    for pull in (*np.eye(3), *-np.eye(3)):
        mujoco.mj_resetData(model, data)
        data.qpos[:], data.ctrl[: scene.count] = start, told
        model.opt.gravity[:] = 0.0
        mujoco.mj_step(model, data, nstep=round(_CLOSES / TIMESTEP))
        closed = data.qpos[-7:].copy()
        model.opt.gravity[:] = _GRAVITY * pull
        mujoco.mj_step(model, data, nstep=round(_PULLED / TIMESTEP))
        for before, after in ((start[-7:], closed), (closed, data.qpos[-7:])):
            moved, turned = _apart(before, after)
            way += (moved + _LEVER * turned) / 6
    model.opt.gravity[:] = gravity
    return way


def rehearse(demonstration: Demonstration, body: Body) -> Rehearsal:
    """A robot's demonstration replayed from its beginning, the hand pressing as its reference will, with no policy."""
    task, force = Task(), pressing_force(demonstration)
    reference = make_reference(
        [demonstration], [body], grip_force=force, wrap_torque=task.wrap_torque, gains=body.gains
    )
    (model,) = gauss_seidel([demonstration_spec(demonstration, body, contacts=task.contacts).compile()])
    data, pose = mujoco.MjData(model), demonstration.object_pose
    low, high = model.actuator_ctrlrange.T
    controls = np.clip(np.asarray(reference.controls[0], float), low, high)
    first = hand_coordinates(model, np.asarray(reference.targets[0, 0], float))
    data.qpos[:] = np.concatenate([first, pose[0]])
    steps, worst = round(1 / demonstration.motion.fps / TIMESTEP), np.zeros(2)
    for frame in range(1, len(pose)):
        data.ctrl[:] = controls[frame]
        mujoco.mj_step(model, data, nstep=steps)
        worst = np.maximum(worst, _apart(pose[frame], data.qpos[-7:]))
        if worst[0] > LOST:
            return Rehearsal(frame / len(pose), *worst.tolist())
    return Rehearsal(1.0, *worst.tolist())


def _apart(one: Float[np.ndarray, "7"], other: Float[np.ndarray, "7"]) -> tuple[float, float]:
    """How far two poses are from each other (m, rad)."""
    turned = 2 * np.arccos(min(1.0, abs(float(one[3:] @ other[3:]))))
    return float(np.linalg.norm(other[:3] - one[:3])), float(turned)
