"""`mjx-hand robot`: a recording of a person's hand onto a robot hand, or the robot hand as a model for simulation."""

from pathlib import Path
from typing import Annotated, Literal

import numpy as np
import tyro

from mjx_hand.capture.keypoint_files.load_keypoints import is_keypoint_file, load_keypoints
from mjx_hand.capture.keypoints.plausible import plausible_keypoints
from mjx_hand.capture.keypoints.recording import KeypointRecording
from mjx_hand.capture.keypoints.side import known_side
from mjx_hand.capture.load import load_motion
from mjx_hand.cli.output import check_out, print_table, print_warnings, spread
from mjx_hand.errors import InputError
from mjx_hand.hand.load import load_hand
from mjx_hand.retarget.sequence import rigid_hand_of
from mjx_hand.robots.hand_axes import check_goes_with
from mjx_hand.robots.motion_keypoints import motion_keypoints
from mjx_hand.robots.palm_frame import in_palm
from mjx_hand.robots.robot_file import check_mjcf
from mjx_hand.robots.robot_hand import load_robot, robot_objective, urdf_of
from mjx_hand.robots.robot_motion import RobotMotion, save_robot_motion, vector_errors
from mjx_hand.robots.solver.kinematic_tree import KinematicTree, joint_values
from mjx_hand.robots.solver.objectives import Objective
from mjx_hand.robots.solver.retarget_keypoints import retarget_keypoints


def robot(
    recording: Annotated[Path | None, tyro.conf.Positional] = None,
    *,
    robot: str,
    urdf: Path | None = None,
    mjcf: Path | None = None,
    out: Path | None = None,
    build: Path | None = None,
    objective: Literal["vector", "dexpilot", "position"] = "vector",
    side: Literal["right", "left"] | None = None,
    sequence: str | None = None,
    fps: float | None = None,
    collision: Literal["hulls", "capsules"] = "hulls",
    absent_meshes: Literal["refuse", "bones"] = "refuse",
    self_collision: bool = False,
) -> None:
    """Retarget a recording to a robot hand; or, with --build, write the robot hand as a model for simulation.

    Args:
        recording: keypoints (.json, .npz or .csv) or a motion of any format that mjx-hand retarget reads.
        urdf: the robot hand's URDF; without it the one that the description names. Its meshes are needed by --build
            only.
        mjcf: an MJCF in the place of the URDF.
        robot: its description: a name in mjx_hand/robots/descriptions, or the path of a file like those.
        out: the .npz to write: the values of all joints.
        build: the folder to write the hand to, as MJCF with meshes, in place of moving it: on a wrist that six joints
            move, with actuators, sites at the finger tips, and mimic joints as equality constraints.
        objective: what follows what: vector (wrist to finger tips), dexpilot (those, and tips brought together), or
            position (links where the keypoints are, with a base that moves).
        side: which hand, where the recording holds both or does not say.
        sequence: the name of one hand or recording in the file, where there are several.
        fps: frames per second, where the recording does not say.
        collision: collision geometry of the model of --build: the URDF's collision shapes, its meshes by their convex
            hulls, or a capsule for each.
        absent_meshes: refuse a URDF whose collision meshes are not there, or build without them, with a capsule along
            the bone of each link that has no other shape.
        self_collision: let the links of the model of --build collide with each other, except neighbours.
    """
    if mjcf is not None:
        if urdf is not None:
            raise InputError("--urdf and --mjcf are given; give one of them")
        check_mjcf(mjcf)
        urdf = mjcf
    if build is not None:
        if recording is not None or out is not None:
            raise InputError("--build writes the robot hand itself; give no recording and no --out with it")
        from mjx_hand.cli.build_robot import build_robot

        return build_robot(
            robot, urdf, build, side=side, collision=collision, absent=absent_meshes, self_collision=self_collision
        )
    if recording is None or out is None:
        raise InputError("give a recording and --out FILE.npz to move the robot hand, or --build FOLDER to write it")
    check_out(out, recording)
    description = load_robot(robot)
    urdf = urdf_of(description, urdf)
    tree, wanted = robot_objective(description, urdf, objective)
    found, which = _recorded(recording, side, sequence, fps)
    found = plausible_keypoints(found, load_hand(side=which))
    if found.fps is None:
        raise InputError(f"{recording}: does not say its frame rate; give --fps")
    check_goes_with(description, urdf, which)
    keypoints = found.positions
    if not wanted.free_base:
        keypoints = in_palm(keypoints, which, description.fingers, description.palmar)
    followed = retarget_keypoints(keypoints, tree, wanted, fps=float(found.fps))
    if tree.overruled:
        names = ", ".join(name[:40] for name in tree.overruled)
        print(f"warning: {urdf}: the limits of {names} leave the joint that it mimics one position; they do not count")
    motion = RobotMotion(
        fps=float(found.fps),
        values=joint_values(followed.dofs, tree),
        base_position=followed.base_position,
        base_quaternion=followed.base_quaternion,
        valid=followed.valid,
        joint_names=tree.joint_names,
        robot=description.name,
        source=found.source,
        warnings=found.warnings,
    )
    save_robot_motion(motion, out)
    gaps = len(motion.valid) - int(motion.valid.sum())
    print(
        f"{found.source or recording}: a {which} hand, {len(motion.valid)} frames at {motion.fps:g}/s, {gaps} in gaps"
    )
    print_warnings(motion.warnings)
    _report(tree, wanted, vector_errors(keypoints, followed, tree, wanted)[followed.valid])
    print(f"{out}  load it with mjx_hand.robots.robot_motion.load_robot_motion({str(out)!r})")


def _recorded(path: Path, side: str | None, sequence: str | None, fps: float | None) -> tuple[KeypointRecording, str]:
    """The keypoints of a recording of any kind, and which hand it is."""
    if path.is_file() and is_keypoint_file(path):
        found = load_keypoints(path, side=side, sequence=sequence, fps=fps)
        if np.isfinite(found.positions[:, 0]).any():
            return found, known_side(found, side)[0]
    # Of any other kind, or without a wrist, as Leap Motion's: then the hand that is fitted to the keypoints has one.
    motion = load_motion(path, side=side, sequence=sequence, fps=fps)
    return motion_keypoints(motion, rigid_hand_of(motion, load_hand(side=motion.side))), motion.side


def _report(tree: KinematicTree, objective: Objective, errors: np.ndarray) -> None:
    names = [tree.point_names[k] for k in objective.tasks]
    ends = [f"{tree.point_names[k]} to " if k >= 0 else "" for k in objective.origins]
    rows = [(f"{a}{b}", *spread(errors[:, k], 1e3)) for k, (a, b) in enumerate(zip(ends, names, strict=True))]
    print_table("how far the robot's links stay from what they follow", ("mm", "mean", "95 %", "max"), rows)
