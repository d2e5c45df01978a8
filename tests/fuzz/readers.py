"""How each file is read, and that what comes out is sound: everything else than an `InputError` is a fault."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from envs.demonstrations.scripted.simulated_capture import load_truth
from mjx_hand.capture.keypoint_files.load_keypoints import load_keypoints
from mjx_hand.capture.keypoints.recording import check_keypoints
from mjx_hand.capture.load import load_motion
from mjx_hand.capture.marker_files.load_markers import load_markers
from mjx_hand.capture.markers.marker_recording import check_recording
from mjx_hand.capture.markers.marker_set import load_marker_set
from mjx_hand.cli.file_facts import file_facts
from mjx_hand.hand.load import load_hand
from mjx_hand.hand.mano_file import load_mano_file
from mjx_hand.motion import check_motion, load_demonstration, load_joint_motion
from mjx_hand.retarget.ledger import Ledger
from mjx_hand.robots.robot_hand import load_robot, robot_objective
from mjx_hand.robots.robot_motion import load_robot_motion
from tests.fuzz.valid_files import TEMPLATE
from train.learning.checkpoint import load_checkpoint
from train.learning.curve import load_curve
from train.learning.training_state import load_run
from train.settings.saved import read_settings

Choice = dict[str, Any]


def _finite(*values: Any) -> None:
    for value in values:
        assert np.isfinite(np.asarray(value, float)).all(), "a number that is none"


def _motion(path: Path, choice: Choice) -> None:
    found = check_motion(load_motion(path, **choice))
    _finite(found.rotations, found.wrist_position, found.wrist_quaternion, found.fps, found.shape)


def _keypoints(path: Path, choice: Choice) -> None:
    check_keypoints(load_keypoints(path, **choice))


def _angles(path: Path, choice: Choice) -> None:
    found = load_joint_motion(path)
    _finite(found.angles, found.wrist_position, found.wrist_quaternion, found.fps)


def _demonstration(path: Path, choice: Choice) -> None:
    found = load_demonstration(path)
    _finite(found.motion.angles, found.object_pose, found.object.size, found.object.mass, found.shape)


def _robot_motion(path: Path, choice: Choice) -> None:
    found = load_robot_motion(path)
    _finite(found.values, found.base_position, found.fps)


def _robot(path: Path, choice: Choice) -> None:
    tree, _ = robot_objective(load_robot(path.parent / "robot.yaml"), path)
    _finite(tree.rest_rotation, tree.rest_position)
    assert (tree.lower <= tree.upper).all()  # infinite where a joint turns on and on


def _state(path: Path, choice: Choice) -> None:
    """Two states, of which the newer one may be damaged: what comes out is one of them, whole."""
    state, _ = load_run(path, TEMPLATE) or (None, {})
    assert isinstance(state, dict)
    value = float(state["n"])
    assert value in (1.0, 2.0)
    assert (state["a"] == value).all()
    assert (state["key"] == value).all()


READERS: dict[str, Callable[[Path, Choice], Any]] = {
    "motion": _motion,
    "info": lambda path, choice: file_facts(path, **{k: v for k, v in choice.items() if k != "unit"}),
    "keypoints": _keypoints,
    "angles": _angles,
    "demonstration": _demonstration,
    "robot motion": _robot_motion,
    "truth": lambda path, choice: load_truth(path),
    "markers": lambda path, choice: check_recording(load_markers(path)),
    "marker set": lambda path, choice: load_marker_set(path, load_hand()),
    "mano": lambda path, choice: load_mano_file(path, "right"),
    "robot": _robot,
    "policy": lambda path, choice: load_checkpoint(path),
    "state": _state,
    "settings": lambda path, choice: read_settings(path),
    "curve": lambda path, choice: load_curve(path),
    "ledger": lambda path, choice: Ledger(path).done("a.npz", "k", path / "a.npz"),
}
