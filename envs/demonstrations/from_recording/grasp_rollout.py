"""Trying grasps in the engine: each takes the object from where it stands, lifts it and carries it as recorded."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from mujoco import batch
from scipy.spatial.transform import Rotation

from envs.demonstrations.from_recording.grasp_pose import GraspPose, chosen
from envs.demonstrations.from_recording.grasp_trajectory import Act, GraspTrajectory, grasp_trajectory
from envs.grip import grip_offsets
from envs.physics.solver import gauss_seidel
from envs.reference import anticipated
from envs.replay import with_heavy_object
from envs.scene import NUM_WRIST, TIMESTEP, scene_spec, wrist_coordinates
from mjx_hand.hand.joints import NUM_HINGES
from mjx_hand.motion.resample import matrix_quaternions
from mjx_hand.rigid.gains import Gains
from mjx_hand.rigid.rigid_hand import on_device

_SETTLED = 10  # frames after the fingers have closed
_LOST, _TURNED = 0.03, 0.5  # m and rad from its way: lost
_OBJECT = NUM_WRIST + NUM_HINGES


@dataclasses.dataclass(frozen=True)
class RolloutScore:
    """What came of n grasps.

    Attributes:
        held_share: for what share of the time, from when the fingers begin to close, the object was on its way.
        error: how far the object was from its way until then, mean (m).
        moved: how far the wrist is told to be from where it was recorded, mean (m).
        settled: how hand and object lay before the lift.
    """

    held_share: Float[np.ndarray, "n"]
    error: Float[np.ndarray, "n"]
    moved: Float[np.ndarray, "n"]
    settled: GraspPose


class GraspRollout:
    """Worlds in which `count` grasps at a time are tried side by side.

    Args:
        act: what was recorded.
        force: with which the hands press (N).
        count: of grasps.
    """

    def __init__(self, act: Act, force: float, count: int):
        self.act, self.count, self.gains = act, count, Gains()
        observed, description = act.observed, act.object
        self.base = observed.hand_rotation[0]
        self.fps = 1 / (observed.times[1] - observed.times[0])
        self.substeps = round(1 / (self.fps * TIMESTEP))
        boxes = act.support, act.support_position
        model = scene_spec(act.hand, description, *boxes, self.base, gains=self.gains).compile()
        (self.model,) = gauss_seidel([model])
        self.heavy = with_heavy_object(self.model)
        self.worlds = batch.Batch(self.model, nsim=count)
        bare = on_device(act.hand)
        planes = jnp.asarray(act.planes, jnp.float32)

        @jax.jit
        def grips(angles: Array, rotation: Array, position: Array) -> Array:
            # All frames of all grasps as one sequence: a loop of loops can come to a standstill on few CPU cores.
            rows, where = angles.reshape(-1, NUM_HINGES), (rotation.reshape(-1, 3, 3), position.reshape(-1, 3))
            found = grip_offsets(rows, where, bare, description.kind, jnp.zeros(3), force, self.gains, planes)
            return found.reshape(angles.shape)

        self._grips = grips

    def carry(self, grasps: GraspPose, *, fixed: bool) -> RolloutScore:
        """Take the object, lift and carry it; `fixed`: it stays where it is while the fingers close."""
        act, worlds = self.act, self.worlds
        trajectory = grasp_trajectory(act, grasps)
        targets, controls, pose = self._commands(trajectory)
        settled = act.closed + _SETTLED
        begin = max(int(np.argmax(act.arriving_share > 0)) - 1, 0)  # as recorded until then
        worlds.set_models([self.heavy if fixed else self.model] * self.count)
        worlds.state[:] = 0.0
        qpos, qvel, ctrl = (worlds.bind(name) for name in ("qpos", "qvel", "ctrl"))
        qpos[:] = np.concatenate([targets[:, begin], pose[:, begin]], axis=1)
        lay, error, lost = qpos.copy(), [], []
        kept = np.ones(self.count, bool)  # worlds that have the object still: the others stop
        frames = len(act.observed.times)
        for frame in range(begin + 1, frames):
            ctrl[:] = controls[:, frame]
            if kept.any():
                worlds.step(ids=np.flatnonzero(kept), nstep=self.substeps)
            if fixed and frame <= settled:
                qpos[:, _OBJECT:], qvel[:, _OBJECT:] = pose[:, frame], 0.0
            if frame == settled:
                lay = qpos.copy()
                worlds.set_models([self.model] * self.count)
            off, turn = _off(qpos, pose[:, frame])
            gone = (off > _LOST) | (turn > _TURNED) | ~np.isfinite(off)
            if frame > settled:
                kept &= ~gone
            error.append(off)
            lost.append(gone)
        count = np.where(np.any(lost, axis=0), np.argmax(lost, axis=0), len(lost))
        before = np.arange(len(lost))[:, None] < count
        until = begin + 1 + count
        away = trajectory.wrist_position - act.observed.hand_position
        return RolloutScore(
            held_share=np.maximum(until - act.closing, 0) / (frames - act.closing),
            error=np.where(before, error, 0.0).sum(axis=0) / np.maximum(count, 1),
            moved=np.linalg.norm(away, axis=2).mean(axis=1),
            settled=_relative_pose(lay, self.base, grasps),
        )

    def _commands(self, trajectory: GraspTrajectory) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Targets, controls and the object's poses, (n, t, 26), (n, t, 26) and (n, t, 7)."""
        act = self.act
        turns = [
            wrist_coordinates(position, matrix_quaternions(rotation), self.base)
            for position, rotation in zip(trajectory.wrist_position, trajectory.wrist_rotation, strict=True)
        ]
        targets = np.concatenate([np.stack(turns), trajectory.angles], axis=2)
        until = act.closed + 1  # the grasp stays as it is from then on, and so does the grip
        closing = slice(act.closing, until)  # open fingers press on nothing
        rows = (trajectory.angles[:, closing], *(part[:, closing] for part in trajectory.in_hand))
        grip = np.asarray(self._grips(*(jnp.asarray(row, jnp.float32) for row in rows)), float)
        controls = np.array(anticipated(jnp.asarray(targets, jnp.float32), self.gains, self.fps), float)
        controls[:, closing, NUM_WRIST:] += grip
        controls[:, until:, NUM_WRIST:] += grip[:, -1:]
        low, high = self.model.actuator_ctrlrange.T
        place = np.broadcast_to(trajectory.position, (*targets.shape[:2], 3))
        turned = Rotation.from_matrix(trajectory.rotation.reshape(-1, 3, 3)).as_quat(scalar_first=True)
        pose = np.concatenate([place, turned.reshape(*targets.shape[:2], 4)], axis=2)
        return targets, np.clip(controls, low, high), pose


def _off(qpos: Float[np.ndarray, "n q"], pose: Float[np.ndarray, "n 7"]) -> tuple[np.ndarray, np.ndarray]:
    """How far objects are from where they should be (m, rad)."""
    there = Rotation.from_quat(pose[:, 3:], scalar_first=True)
    turn = there.inv() * Rotation.from_quat(np.nan_to_num(qpos[:, _OBJECT + 3 :], nan=1.0), scalar_first=True)
    return np.linalg.norm(qpos[:, _OBJECT : _OBJECT + 3] - pose[:, :3], axis=1), turn.magnitude()


def _relative_pose(qpos: Float[np.ndarray, "n q"], base: Float[np.ndarray, "3 3"], told: GraspPose) -> GraspPose:
    """How hands and objects lie; as they were told to where the engine diverged."""
    sound = np.asarray(np.isfinite(qpos).all(axis=1))
    qpos = np.where(sound[:, None], qpos, qpos[np.argmax(sound)])
    wrist = Rotation.from_matrix(base) * Rotation.from_euler("XYZ", qpos[:, 3:NUM_WRIST])
    object_rotation = Rotation.from_quat(qpos[:, _OBJECT + 3 :], scalar_first=True)
    relative = GraspPose(
        angles=qpos[:, NUM_WRIST:_OBJECT],
        rotation=(wrist.inv() * object_rotation).as_matrix(),
        position=wrist.inv().apply(qpos[:, _OBJECT : _OBJECT + 3] - qpos[:, :3] @ base.T),
    )
    return chosen(sound, relative, told)
