"""`mjx-hand retarget`: a recording as joint angles, and how well they follow it."""

import time
from pathlib import Path
from typing import Annotated

import numpy as np
import tyro

from mjx_hand.capture.load import load_motion
from mjx_hand.cli.output import print_table, spread
from mjx_hand.hand.joints import ONE_DOF, TWO_DOF
from mjx_hand.hand.load import load_hand
from mjx_hand.motion import Motion, save_joint_motion
from mjx_hand.retarget.sequence import RetargetErrors, retarget_errors, retarget_sequence, rigid_hand_of


def retarget(
    recording: Annotated[Path, tyro.conf.Positional],
    out: Path,
    method: str = "exact",
    mano: Path | None = None,
    side: str | None = None,
    sequence: str | None = None,
    fps: float | None = None,
) -> None:
    """Project a recorded motion onto the 20 hinges of the rigid hand and report the errors.

    Args:
        recording: a motion: the project's own .npz, or a file or folder of a dataset (docs/datasets.md).
        out: the .npz to write: joint angles (rad) and wrist poses.
        method: how rotations become angles: exact, or for comparison paper, bch2, naive.
        mano: a licensed MANO file, for recordings made with one; without it, the open hand.
        side: right or left, where both hands are recorded.
        sequence: the name of one recording, where a file has several.
        fps: frames a second, where the recording does not say.
    """
    motion = load_motion(recording, side=side, sequence=sequence, mano=mano, fps=fps)
    rigid = rigid_hand_of(motion, load_hand(mano, motion.side))
    began = time.perf_counter()
    joint_motion = retarget_sequence(motion, rigid, method)
    compiled = time.perf_counter()
    joint_motion = retarget_sequence(motion, rigid, method)  # the first call also compiled: time one that did not
    done = time.perf_counter()
    errors = retarget_errors(motion, joint_motion, rigid)
    save_joint_motion(joint_motion, out)
    _report(motion, errors)
    rate = motion.num_frames / (done - compiled)
    print(f"projected at {rate:,.0f} frames/s ({method}); the first call took {compiled - began:.1f} s with compiling")
    print(f"{out}  load it with mjx_hand.motion.load_joint_motion({str(out)!r})")


def _report(motion: Motion, errors: RetargetErrors) -> None:
    good = errors.valid
    rotation, joint, tip = errors.rotation[good], errors.joint_position[good], errors.tip_position[good]
    # A finger's first joint sits on the palm: its centre cannot be wrong, and would only dilute the mean.
    outer = [1 + k for k in ONE_DOF]
    rows = [
        ("rotation, two-hinge joints (degrees)", *spread(rotation[:, TWO_DOF], np.degrees(1.0))),
        ("rotation, one-hinge joints (degrees)", *spread(rotation[:, ONE_DOF], np.degrees(1.0))),
        ("joint position (mm)", *spread(joint[:, outer], 1e3)),
        ("finger-tip position (mm)", *spread(tip, 1e3)),
    ]
    seconds = motion.num_frames / motion.fps
    gaps = motion.num_frames - int(good.sum())
    title = (
        f"{motion.source or 'motion'}: {motion.num_frames} frames at {motion.fps:g}/s ({seconds:.1f} s), {gaps} in gaps"
    )
    print_table(title, ("error of the hinges", "mean", "95 %", "max"), rows)
