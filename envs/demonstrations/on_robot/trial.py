"""Whether a robot's grasp holds, tried in MuJoCo's C engine: standing still, and through the whole demonstration.

Distances do not tell. Of grasps whose fingers are all where they should be, some turn the object as the fingers close,
some push it out of the hand, some meet it otherwise on the way. Candidates of grasp generators are tried in simulation
for the same reason, as with gravity along six directions (DexGraspNet, https://arxiv.org/abs/2210.02697).

All grasps are tried with the same settings, whatever the task of the environment that they are for: so what a robot's
reference is does not change with a task's options.
"""

from dataclasses import dataclass

import mujoco
import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from envs.demonstrations.on_robot.robot_scene import RobotScene
from envs.grip_force import RECORDED
from envs.grip_table import default_grip_force
from envs.model_grip import Press, model_grips
from envs.physics.native import diverged
from envs.physics.solver import gauss_seidel
from envs.reference import anticipated, demonstrated_targets
from envs.scene import NUM_WRIST, TIMESTEP, demonstration_spec
from envs.task import Task, check_rate
from mjx_hand.bodies.body import Body
from mjx_hand.bodies.coordinates import hand_coordinates
from mjx_hand.motion.demonstration import Demonstration

_GRAVITY = 9.81  # m/s^2
_CLOSING_TIME, _PULLING_TIME = 0.1, 0.4  # s
_LEVER = 0.05  # m: a turn of 1 rad counts as this distance
_LOST = 0.1  # m from its demonstrated place, where an object is lost: as far as CHORD allows
_TURNED = 0.4  # rad from its demonstrated pose, beyond which little is left of the 0.5 that CHORD allows
_DISTANCE, _ANGLE = 0.02, 0.5  # m, rad that weigh the same
_STATE = mujoco.mjtState.mjSTATE_INTEGRATION


@dataclass(frozen=True)
class Rehearsal:
    """How an object went with a robot's demonstration.

    Attributes:
        until: share of the demonstration before the object was 10 cm off; 1 where it never was.
        moved, turned: how far it was from its demonstrated pose at most, until then (m, rad).
    """

    until: float
    moved: float
    turned: float

    @property
    def held(self) -> bool:
        """Whether the object was neither lost nor turned in the hand."""
        return self.until == 1 and self.turned < _TURNED

    @property
    def score(self) -> tuple[float, float, float]:
        """Higher is better: held longer, then not turned, then nearer to the demonstrated pose."""
        return self.until, float(self.held), -self.moved / _DISTANCE - self.turned / _ANGLE


def trial_task(demonstration: Demonstration) -> Task:
    """The task of a rehearsal; of a recording as its experiments have it, the hand passing through table and itself."""
    force = default_grip_force(demonstration, robot=True)
    if demonstration.grasp == RECORDED:
        return Task(grip_force=force, contacts="object")
    return Task(grip_force=force)


def slip(scene: RobotScene, targets: Float[np.ndarray, "u"]) -> float:
    """How far (m) the object slips, on average, as the hand closes and gravity then acts along each of six directions.

    Args:
        scene: the robot's.
        targets: of wrist and actuated joints (m, rad).

    Returns:
        Infinity where the simulation diverges.
    """
    demonstration, body = scene.demonstration, scene.body
    force = default_grip_force(demonstration, robot=True)
    scene.place(targets, scene.pads.grasp)
    press = Press(scene.touch, body, force, body.gains, trial_task(demonstration).wrap_torque)
    start = scene.touch.data.qpos.copy()
    model = scene.trial_model
    data = mujoco.MjData(model)
    data.qpos[:], data.ctrl[:] = start, targets + np.pad(press.offsets(), (NUM_WRIST, 0))
    model.opt.gravity[:] = 0.0
    mujoco.mj_step(model, data, nstep=round(_CLOSING_TIME / TIMESTEP))
    closed, state = data.qpos[-7:].copy(), np.empty(mujoco.mj_stateSize(model, _STATE))
    mujoco.mj_getState(model, data, state, _STATE)
    slipped = _apart(start[-7:], closed)
    total = slipped[0] + _LEVER * slipped[1]
    for pull in (*np.eye(3), *-np.eye(3)):
        mujoco.mj_setState(model, data, state, _STATE)
        model.opt.gravity[:] = _GRAVITY * pull
        mujoco.mj_step(model, data, nstep=round(_PULLING_TIME / TIMESTEP))
        slipped = _apart(closed, data.qpos[-7:])
        total += (slipped[0] + _LEVER * slipped[1]) / 6
    return float("inf") if diverged(data) else total


def rehearse(demonstration: Demonstration, body: Body) -> Rehearsal:
    """A robot's demonstration replayed from its beginning in `trial_task`, with no policy.

    Raises:
        InputError: its frames do not fit control steps.
    """
    task = trial_task(demonstration)
    check_rate(demonstration.motion.fps, task.substeps * TIMESTEP)
    # As `make_reference`, which JAX would compile anew for each number of frames.
    targets, force = demonstrated_targets(demonstration)[None], np.array([task.grip_force])
    grip = model_grips([demonstration], [body], targets, force, body.gains, task.wrap_torque)
    controls = (anticipated(targets, body.gains, demonstration.motion.fps) + grip)[0]
    (model,) = gauss_seidel([demonstration_spec(demonstration, body, contacts=task.contacts).compile()])
    data, pose = mujoco.MjData(model), demonstration.object_pose
    controls = np.clip(controls, *model.actuator_ctrlrange.T)
    data.qpos[:] = np.concatenate([hand_coordinates(model, targets[0, 0]), pose[0]])
    worst = np.zeros(2)
    for frame in range(1, len(pose)):
        data.ctrl[:] = controls[frame]
        mujoco.mj_step(model, data, nstep=task.substeps)
        worst = np.maximum(worst, _apart(pose[frame], data.qpos[-7:]))
        if worst[0] > _LOST or diverged(data):
            return Rehearsal(frame / len(pose), *worst.tolist())
    return Rehearsal(1.0, *worst.tolist())


def _apart(one: Float[np.ndarray, "7"], other: Float[np.ndarray, "7"]) -> tuple[float, float]:
    """How far two poses are from each other (m, rad)."""
    first, second = (Rotation.from_quat(pose[3:], scalar_first=True) for pose in (one, other))
    return float(np.linalg.norm(other[:3] - one[:3])), float((first.inv() * second).magnitude())
