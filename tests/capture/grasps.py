"""Made-up grasping motions of which everything is known, and how far a fit is from one."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

from mjx_hand.capture.simulation.off_axis import add_off_axis_rotation
from mjx_hand.hand.model import HandModel
from mjx_hand.hand.skinning import skin
from mjx_hand.motion import Motion
from mjx_hand.rigid.axes import anatomical_axes
from mjx_hand.rigid.limits import anatomical_limits

skin_frames = jax.jit(skin)
SAMPLED = 30  # frames compared


def grasp(hand: HandModel, seed: int, *, off_axis: float = 1.0, frames: int = 300, fps: float = 120.0) -> Motion:
    """An opening and closing hand of a random shape that moves and turns, with the off-axis rotation of real ones."""
    rng = np.random.default_rng(seed)
    lower, upper = (0.5 * limit for limit in anatomical_limits())
    times = np.arange(frames) / fps
    knots = np.arange(0, times[-1] + 1.6, 0.8)
    course = CubicSpline(knots, rng.uniform(0, 1, (len(knots), 20)))(times)
    closing = np.clip((times - 0.8) / 0.8, 0, 1)[:, None]
    angles = lower + (upper - lower) * np.clip(0.3 + 0.4 * closing + 0.4 * (course - 0.5), 0, 1)
    axes = anatomical_axes(hand.joint_regressor @ hand.template, hand.side)
    hinge = Rotation.from_rotvec((angles[..., None] * axes).reshape(-1, 3)).as_matrix().reshape(frames, 5, 4, 3, 3)
    rotations = np.stack([hinge[:, :, 0] @ hinge[:, :, 1], hinge[:, :, 2], hinge[:, :, 3]], axis=2)
    return Motion(
        fps=fps,
        rotations=add_off_axis_rotation(rotations.reshape(frames, 15, 3, 3), seed, off_axis, fps),
        wrist_position=CubicSpline(knots, rng.normal(size=(len(knots), 3)) * 0.08)(times) + np.array([1.0, 2.0, 0.5]),
        wrist_quaternion=Rotation.from_rotvec(
            CubicSpline(knots, rng.normal(size=(len(knots), 3)) * 0.4)(times)
        ).as_quat(scalar_first=True),
        shape=rng.normal(size=10),
        valid=np.ones(frames, bool),
        side=hand.side,
        source=f"grasp {seed}",
    )


@dataclasses.dataclass(frozen=True)
class Error:
    """Distances (m) and angles (rad) between a truth and a fit, by frame."""

    vertex: np.ndarray
    joint: np.ndarray
    tip: np.ndarray
    rotation: np.ndarray


def world_points(hand: HandModel, motion: Motion) -> tuple[np.ndarray, np.ndarray]:
    """Vertices and joints (m) in the world, in frames spread over the motion."""
    at = np.linspace(0, motion.num_frames - 1, SAMPLED).astype(int)
    rotations = jnp.asarray(motion.rotations[at], jnp.float32)
    shape = jnp.broadcast_to(jnp.asarray(motion.shape, jnp.float32), (SAMPLED, len(motion.shape)))
    posed = skin_frames(hand, rotations, shape)
    vertices, joints = (np.asarray(array, np.float64) for array in posed)
    turn = Rotation.from_quat(motion.wrist_quaternion[at], scalar_first=True).as_matrix()

    def place(points: np.ndarray) -> np.ndarray:
        return np.einsum("tab,tvb->tva", turn, points - joints[:, :1]) + motion.wrist_position[at][:, None]

    return place(vertices), place(joints)


def errors(hand: HandModel, truth: Motion, fit: Motion) -> Error:
    """How far a fit is from the truth."""
    (vertices, joints), (fitted, fitted_joints) = world_points(hand, truth), world_points(hand, fit)
    vertex = np.linalg.norm(vertices - fitted, axis=-1)
    relative = np.swapaxes(truth.rotations, -1, -2) @ fit.rotations
    angle = Rotation.from_matrix(relative.reshape(-1, 3, 3)).magnitude().reshape(-1, 15)
    return Error(
        vertex=vertex,
        joint=np.linalg.norm(joints - fitted_joints, axis=-1),
        tip=vertex[:, np.asarray(hand.tip_vertices)],
        rotation=angle,
    )
