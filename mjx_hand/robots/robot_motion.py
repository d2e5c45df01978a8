"""`RobotMotion`: a robot hand's joints over time, its file, and how well it follows."""

from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from mjx_hand.errors import InputError
from mjx_hand.files.checked_arrays import Lines, numbers, text, texts
from mjx_hand.files.npz_archive import load_arrays, save_arrays
from mjx_hand.motion.resample import quaternion_matrices
from mjx_hand.pytree import pytree, static
from mjx_hand.robots.solver.kinematic_tree import KinematicTree, tree_points
from mjx_hand.robots.solver.objectives import Objective, human_vectors
from mjx_hand.robots.solver.retarget_keypoints import Followed

SCHEMA = "mjx-hand/robot-motion/1"


@pytree
class RobotMotion:
    """A robot hand over time; radians (metres for sliding joints), quaternions wxyz.

    Attributes:
        fps: frames per second.
        values: every joint's value, tied (mimic) joints included.
        base_position, base_quaternion: the URDF's root link in the recording's frame; zero and the identity where the
            hand was retargeted without its base.
        valid: False where the recording has a gap; the values there are interpolated.
        joint_names: the URDF's names, in the order of `values`.
        robot: the description's name.
        source: provenance, one line.
        warnings: what is doubtful about it, one line each.
    """

    fps: float
    values: Float[np.ndarray, "t j"]
    base_position: Float[np.ndarray, "t 3"]
    base_quaternion: Float[np.ndarray, "t 4"]
    valid: Bool[np.ndarray, "t"]
    joint_names: tuple[str, ...] = static()
    robot: str = static(default="")
    source: str = static(default="")
    warnings: Lines = static(default=())


def save_robot_motion(motion: RobotMotion, path: str | Path) -> None:
    """Write as `.npz` (schema mjx-hand/robot-motion/1).

    Raises:
        InputError: the file cannot be written.
    """
    names = ("fps", "base_position", "base_quaternion", "valid", "robot", "source")
    arrays = {name: getattr(motion, name) for name in names}
    if motion.warnings:
        arrays["warnings"] = np.array(motion.warnings)
    save_arrays(path, SCHEMA, {**arrays, "angles": motion.values, "joint_names": np.array(motion.joint_names)})


def load_robot_motion(path: str | Path) -> RobotMotion:
    """Read what `save_robot_motion` wrote.

    Raises:
        InputError: not such a file, or its arrays are not sound.
    """
    arrays = load_arrays(path, SCHEMA)
    names = texts(path, arrays, "joint_names")
    layout = {"fps": (), "angles": ("t", len(names)), "base_position": ("t", 3), "base_quaternion": ("t", 4)}
    n = numbers(path, arrays, {**layout, "valid": ("t",)})
    if not names or n["fps"] <= 0:
        raise InputError(f"{path}: {len(names)} joints at {float(n['fps'])} frames per second; make it again")
    return RobotMotion(
        fps=float(n["fps"]),
        values=n["angles"].astype(float),
        base_position=n["base_position"].astype(float),
        base_quaternion=n["base_quaternion"].astype(float),
        valid=n["valid"].astype(bool),
        joint_names=names,
        robot=text(path, arrays, "robot"),
        source=text(path, arrays, "source"),
        warnings=texts(path, arrays, "warnings", needed=False),
    )


def vector_errors(
    keypoints: Float[np.ndarray | Array, "t 21 3"], followed: Followed, tree: KinematicTree, objective: Objective
) -> Float[np.ndarray, "t k"]:
    """How far (m) each of the objective's vectors is from the person's, scaled; zero where a keypoint is missing."""
    points = np.asarray(tree_points(jnp.asarray(followed.dofs, jnp.float32), tree), float)
    turned = np.einsum("tij,tkj->tki", quaternion_matrices(followed.base_quaternion), points)
    world = turned + followed.base_position[:, None]
    origins = np.array(objective.origins)
    begin = np.where((origins >= 0)[:, None], world[:, origins], 0.0)
    human = np.moveaxis(np.asarray(jax.jit(human_vectors)(jnp.asarray(keypoints, jnp.float32), objective)), -1, 0)
    error = world[:, list(objective.tasks)] - begin - np.asarray(objective.scaling) * human
    return np.nan_to_num(np.linalg.norm(error, axis=-1))
