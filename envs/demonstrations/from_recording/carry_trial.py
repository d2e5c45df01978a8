"""Whether hands carry their objects when demonstrations are replayed in the engine, with nothing learned."""

from collections.abc import Sequence

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Int
from mujoco import batch
from scipy.spatial.transform import Rotation

from envs.grip_force import grip_force_of
from envs.grip_table import grip_table, padded
from envs.physics.solver import gauss_seidel
from envs.reference import anticipated, demonstrated_targets
from envs.scene import NUM_WRIST, TIMESTEP, demonstration_models
from mjx_hand.hand.joints import NUM_HINGES
from mjx_hand.motion.demonstration import Demonstration
from mjx_hand.rigid.gains import Gains
from mjx_hand.rigid.rigid_hand import RigidHand

SHARES = (1.0, 2.0, 4.0, 8.0)  # of `grip_force_of`: presses that are tried
_BESIDE = 0.002  # m that the hand is put off in further trials, along three axes
_LOST, _TURNED = 0.05, 0.7  # m and rad from its way: lost
_TARGETS = NUM_WRIST + NUM_HINGES
_BLOCK = 64  # frames to whose multiples all are padded, so that few lengths are compiled


def carry_trial(
    demonstrations: Sequence[Demonstration], hands: Sequence[RigidHand]
) -> tuple[Float[np.ndarray, "d"], Int[np.ndarray, "d"]]:
    """For what share of its frames each object stays on its way in the best of some trials, and when it is lost then.

    Each is replayed from its first frame on with several presses, and with the hand put off by millimetres: what none
    of these carries, a policy hardly learns to. A frame behind the last one where it is never lost.
    """
    gains = Gains()
    frames = -(-max(d.num_frames for d in demonstrations) // _BLOCK) * _BLOCK
    trials = [(d, hand, share) for d, hand in zip(demonstrations, hands, strict=True) for share in SHARES]
    targets = np.stack([padded(demonstrated_targets(d), frames) for d, _, _ in trials])
    forces = np.array([grip_force_of(d.object.mass, d.object.friction, share) for d, _, share in trials])
    told = jnp.asarray(targets, jnp.float32)
    grip = grip_table([d for d, _, _ in trials], [hand for _, hand, _ in trials], told, forces, gains)
    controls = np.asarray(anticipated(told, gains, demonstrations[0].motion.fps) + grip, float)
    poses = np.stack([padded(d.object_pose, frames) for d, _, _ in trials])
    beside = _BESIDE * np.concatenate([np.zeros((1, 3)), np.eye(3), -np.eye(3)])
    models = gauss_seidel(demonstration_models(demonstrations, hands, gains=gains))
    models = [model for model in models for _ in SHARES]
    lengths = np.array([d.num_frames for d, _, _ in trials])
    lost = np.full((len(trials), len(beside)), -1)
    for k, offset in enumerate(beside):
        lost[:, k] = _first_lost(models, controls, targets, poses, lengths, offset)
    best = lost.reshape(len(demonstrations), -1).max(axis=1)
    whole = lengths[:: len(SHARES)]
    return best / whole, best


def _first_lost(
    models: list, controls: np.ndarray, targets: np.ndarray, poses: np.ndarray, lengths: np.ndarray, offset: np.ndarray
) -> np.ndarray:
    worlds = batch.Batch(models[0], nsim=len(models))
    worlds.set_models(models)
    qpos, ctrl = worlds.bind("qpos"), worlds.bind("ctrl")
    qpos[:] = np.concatenate([targets[:, 0], poses[:, 0]], axis=1)
    low, high = models[0].actuator_ctrlrange[:_TARGETS].T
    lost = lengths.copy()
    gone = np.zeros(len(models), bool)
    substeps = round(0.02 / TIMESTEP)
    for frame in range(1, targets.shape[1]):
        told = controls[:, frame].copy()
        told[:, :3] += offset
        ctrl[:, :_TARGETS] = np.clip(told, low, high)
        worlds.step(nstep=substeps)
        place, turn = np.array(qpos[:, _TARGETS : _TARGETS + 3]), np.array(qpos[:, _TARGETS + 3 :])
        finite = np.isfinite(turn).all(axis=1) & (np.linalg.norm(turn, axis=1) > 0.5)
        turn[~finite] = [1.0, 0, 0, 0]
        there = Rotation.from_quat(poses[:, frame, 3:], scalar_first=True)
        off = (there.inv() * Rotation.from_quat(turn, scalar_first=True)).magnitude()
        far = ~(np.linalg.norm(place - poses[:, frame, :3], axis=1) < _LOST) | (off > _TURNED) | ~finite
        new = far & ~gone & (frame < lengths)
        lost[new] = frame
        gone |= new
        if (gone | (frame >= lengths)).all():
            break
    return lost
