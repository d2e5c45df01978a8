"""A demonstration's hand as the live twin's tracker has it: from noisy, late keypoints, filtered and followed."""

from collections.abc import Iterator

import numpy as np
from jaxtyping import Float

from envs.demonstrations.twin_hands import twins
from envs.live.twin.follower import Follower
from envs.live.twin.hand_solver import HandSolver
from envs.live.twin.hinge_keypoints import hinge_keypoints
from envs.live.twin.pose import HandPose
from envs.live.twin.steady import Steady
from envs.scene import TIMESTEP
from envs.task import check_rate
from mjx_hand.errors import InputError
from mjx_hand.motion.demonstration import Demonstration
from mjx_hand.pytree import replace
from mjx_hand.rigid.rigid_hand import RigidHand

RATE, NOISE, LATE, DROPPED = 30.0, 0.003, 0.05, 0.05  # Hz, m on each coordinate, s, share of frames


def streamed_poses(shown: Demonstration, seed: int) -> tuple[RigidHand, Iterator[HandPose]]:
    """The hand, and where it is to be from one physics step of the live twin to the next, until the last frame came.

    Args:
        shown: the demonstration.
        seed: of noise and dropped frames.

    Raises:
        InputError: a hand that is not tracked in its first frame, when the first pose is asked for.
    """
    rigid, motion = twins([shown])[0], shown.motion
    keypoints = hinge_keypoints(motion.angles, motion.wrist_position, motion.wrist_quaternion, rigid)
    return rigid, _poses(rigid, keypoints, float(motion.fps), seed)


def _poses(rigid: RigidHand, keypoints: Float[np.ndarray, "t 21 3"], fps: float, seed: int) -> Iterator[HandPose]:
    solver, steady, rng = HandSolver(rigid), Steady(), np.random.default_rng(seed)
    pose, follower, steps = None, None, 0
    for k in range(round((len(keypoints) - 1) / fps * RATE) + 1):
        seen = keypoints[min(round(k / RATE * fps), len(keypoints) - 1)]
        noisy = seen + NOISE * rng.normal(size=seen.shape)
        if k == 0 or rng.random() >= DROPPED:
            found = solver.solve(noisy)
            pose = steady.filtered(HandPose(*found), k / RATE) if found is not None else None
            if pose is None:
                steady.forget()
        if follower is None:
            if pose is None:
                raise InputError("a demonstration's hand is not tracked in its first frame; leave it out of the set")
            follower = Follower(pose)
        while steps * TIMESTEP < (k + 1) / RATE + LATE:
            steps += 1
            yield follower.advance(pose, TIMESTEP)


def streamed_demonstration(shown: Demonstration, seed: int) -> Demonstration:
    """A demonstration with what a live tracker made of its hand; hand and object are as late as that.

    Args:
        shown: as it was recorded.
        seed: see `streamed_poses`.

    Raises:
        InputError: a hand that is not tracked in its first frame, or a rate that is no whole number of physics steps.
    """
    every = round(1 / (shown.motion.fps * TIMESTEP))
    check_rate(shown.motion.fps, every * TIMESTEP)
    poses = list(streamed_poses(shown, seed)[1])[::every][: shown.num_frames]
    tracked = np.stack([np.concatenate([pose.position, pose.quaternion, pose.angles]) for pose in poses])
    late = _frames_late(np.asarray(shown.motion.wrist_position), tracked[:, :3])
    frames = np.maximum(np.arange(shown.num_frames) - late, 0)
    moved = ("angles", "wrist_position", "wrist_quaternion", "valid")
    motion = replace(shown.motion, **{name: np.asarray(getattr(shown.motion, name))[frames] for name in moved})
    return replace(shown, motion=motion, object_pose=np.asarray(shown.object_pose)[frames], tracked=tracked)


def _frames_late(shown: Float[np.ndarray, "t 3"], tracked: Float[np.ndarray, "t 3"]) -> int:
    """By how many frames a wrist's path is behind another, to the nearest whole one."""
    most = len(shown) // 2
    off = [np.linalg.norm(tracked[late:] - shown[: len(shown) - late], axis=1).mean() for late in range(most)]
    return int(np.argmin(off))
