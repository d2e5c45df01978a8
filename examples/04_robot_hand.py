"""Follow a stream of hand keypoints with a robot hand, frame by frame, as in teleoperation.

    python examples/04_robot_hand.py [allegro_hand_right.urdf]

Needs the URDF of an Allegro hand. Without a path it takes the one that comes in the package dexi-rs
(`pip install dexi-rs`). `load_robot` knows further hands; a hand of your own is one YAML file (docs/keypoints.md).
"""

import sys
import time
from importlib.util import find_spec
from pathlib import Path

import numpy as np

import mjx_hand
from mjx_hand.capture.simulation.sample_motion import sample_motion
from mjx_hand.capture.simulation.simulate_keypoints import simulate_keypoints
from mjx_hand.robots.palm_frame import in_palm
from mjx_hand.robots.robot_hand import load_robot, robot_objective
from mjx_hand.robots.solver.keypoint_stream import KeypointStream

IN_DEXI_RS = "resources/assets/robots/hands/allegro_hand/allegro_hand_right.urdf"


def default_urdf() -> Path:
    """The Allegro hand of the package dexi-rs."""
    spec = find_spec("dexi_rs")
    if spec is None or spec.origin is None:
        sys.exit("give the path of a URDF, such as dex-urdf's allegro_hand_right.urdf, or: pip install dexi-rs")
    return Path(spec.origin).parent / IN_DEXI_RS


def main(urdf: str | Path) -> None:
    """Follow three seconds of a moving hand."""
    hand = mjx_hand.load_hand()
    recording = simulate_keypoints(hand, sample_motion(hand, seconds=3.0, fps=30.0), seed=0)  # 21 points, m
    robot = load_robot("allegro")
    tree, objective = robot_objective(robot, urdf, "vector")
    stream = KeypointStream(tree, objective, low_pass=0.5)
    stream.warm_up()  # compiles

    poses, seconds = [], []
    for keypoints in in_palm(recording.positions, "right", robot.fingers, robot.palmar):
        began = time.perf_counter()
        poses.append(stream.step(keypoints).dofs)
        seconds.append(time.perf_counter() - began)
    span = np.ptp(np.stack(poses), axis=0)
    print(
        f"{len(poses)} frames onto {len(tree.dof_names)} joints, {1e3 * np.median(seconds):.2f} ms per frame (median)"
    )
    for name, angle in zip(tree.dof_names, np.rad2deg(span), strict=True):
        print(f"  {name:12} moved through {angle:5.1f} degrees")


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else default_urdf())
