"""Assisted replay: each demonstration rolled out once while the object is carried along its reference.

Its states are where training episodes may start (reference-state initialisation): consistent in the physics, because
the hand really moved there under its controller and really presses on the object.
"""

import copy
from collections.abc import Sequence

import mujoco
import numpy as np
from jaxtyping import Float
from mujoco import batch
from scipy.spatial.transform import Rotation

from envs.physics.solver import gauss_seidel
from envs.reference import Reference
from envs.scene import OBJECT
from mjx_hand.bodies.coordinates import hand_coordinates
from mjx_hand.files.array_cache import cached, model_bytes
from mjx_hand.pytree import replace

_HEAVIER = 300.0
_STATE = ("qpos", "qvel", "ctrl")


def assisted_replay(
    models: Sequence[mujoco.MjModel], reference: Reference, substeps: int
) -> tuple[Float[np.ndarray, "d t nq"], Float[np.ndarray, "d t nv"], Float[np.ndarray, "d t nu"]]:
    """qpos, qvel and controls at every frame. Frame 0 is the demonstration's own start, at rest, without offsets.

    Args:
        models: the scene of each demonstration.
        reference: the demonstrations.
        substeps: physics steps a control step.

    Runs on MuJoCo's C engine whatever engine trains: it is quick, and done once.
    """
    targets = np.asarray(reference.targets, float)
    pose = np.asarray(reference.object_pose, float)
    count, frames, told = targets.shape
    low, high = models[0].actuator_ctrlrange[:told].T
    controls = np.clip(np.asarray(reference.controls, float), low, high)
    speed = _object_speed(pose, models[0].opt.timestep * substeps)

    heavy = gauss_seidel([with_heavy_object(model) for model in models])  # the friction that episodes will have
    worlds = batch.Batch(heavy[0], nsim=count)
    worlds.set_models(heavy)
    qpos = np.zeros((count, frames, models[0].nq))
    qvel = np.zeros((count, frames, models[0].nv))
    now, moving = worlds.bind("qpos"), worlds.bind("qvel")
    first = hand_coordinates(models[0], targets[:, 0])
    hand = first.shape[1]
    now[:, :hand], now[:, hand:] = first, pose[:, 0]
    qpos[:, 0] = now
    for t in range(1, frames):
        worlds.bind("ctrl")[:, :told] = controls[:, t]
        worlds.step(nstep=substeps)
        now[:, hand:], moving[:, hand:] = pose[:, t], speed[:, t]
        qpos[:, t], qvel[:, t] = now, moving
    return qpos, qvel, controls


def cached_replay(
    models: Sequence[mujoco.MjModel], reference: Reference, substeps: int
) -> tuple[Float[np.ndarray, "d t nq"], Float[np.ndarray, "d t nv"], Float[np.ndarray, "d t nu"]]:
    """`assisted_replay` in single precision, kept on disk; of teleoperated hands with the press that they lack."""
    if reference.lacking is not None:
        reference = replace(reference, controls=reference.controls + reference.lacking)

    def compute() -> dict[str, np.ndarray]:
        states = assisted_replay(models, reference, substeps)
        return {name: np.asarray(a, np.float32) for name, a in zip(_STATE, states, strict=True)}

    replayed = cached(compute, *(model_bytes(m) for m in models), reference, substeps)
    qpos, qvel, ctrl = (replayed[name] for name in _STATE)
    return qpos, qvel, ctrl


def with_heavy_object(model: mujoco.MjModel) -> mujoco.MjModel:
    """A copy in which fingers cannot push the object away or sink into it while it is carried."""
    heavy = copy.copy(model)
    object_id = heavy.body(OBJECT).id
    heavy.body_mass[object_id] *= _HEAVIER
    heavy.body_inertia[object_id] *= _HEAVIER
    heavy.body_gravcomp[object_id] = 1.0
    mujoco.mj_setConst(heavy, mujoco.MjData(heavy))
    return heavy


def _object_speed(pose: Float[np.ndarray, "d t 7"], dt: float) -> Float[np.ndarray, "d t 6"]:
    """Free-joint velocities by central differences: linear m/s in the world, angular rad/s in the object's axes."""
    count, frames = pose.shape[:2]
    before, after = np.maximum(np.arange(frames) - 1, 0), np.minimum(np.arange(frames) + 1, frames - 1)
    seconds = ((after - before) * dt)[:, None]
    linear = (pose[:, after, :3] - pose[:, before, :3]) / seconds
    first = Rotation.from_quat(pose[:, before, 3:].reshape(-1, 4), scalar_first=True)
    last = Rotation.from_quat(pose[:, after, 3:].reshape(-1, 4), scalar_first=True)
    angular = (first.inv() * last).as_rotvec().reshape(count, frames, 3) / seconds
    return np.concatenate([linear, angular], axis=-1)
