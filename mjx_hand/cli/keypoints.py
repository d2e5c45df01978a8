"""`mjx-hand keypoints`: tracked hand keypoints as a motion, and how far it is from them."""

from pathlib import Path
from typing import Annotated, Literal

import numpy as np
import tyro

from mjx_hand.capture.keypoint_files.load_keypoints import load_keypoints
from mjx_hand.capture.keypoint_fit.fit import KeypointSettings, fit_keypoints
from mjx_hand.capture.keypoint_fit.report import KeypointReport
from mjx_hand.capture.keypoints.layouts import DIGITS
from mjx_hand.capture.keypoints.side import known_side
from mjx_hand.cli.output import check_out, print_table, print_warnings
from mjx_hand.hand.joints import FINGERS
from mjx_hand.hand.load import load_hand
from mjx_hand.motion import Motion, save_motion


def keypoints(
    recording: Annotated[Path, tyro.conf.Positional],
    out: Path,
    side: Literal["right", "left"] | None = None,
    sequence: str | None = None,
    fps: float | None = None,
    unit: Literal["m", "cm", "mm"] | None = None,
    cutoff: float | None = None,
    own_bones: bool = False,
    mano: Path | None = None,
) -> None:
    """Turn hand keypoints into a motion: bone lengths give the shape, bone directions the rotations.

    Args:
        recording: keypoints of MediaPipe, Leap, WebXR, OpenXR, ARKit, MRTK or Quest: .json, .csv, .npz and their like.
        out: the .npz to write: the motion, which `mjx-hand retarget` reads.
        side: which hand, where the file holds both or does not say.
        sequence: the name of one hand in the file, where there are several.
        fps: frames per second, where the file does not say.
        unit: of the positions, where the file does not say and they are not metres.
        cutoff: of a low-pass filter, Hz; 6 is usual for hands. Without it, the recording's noise stays.
        own_bones: keep the recorded joint centres and finger tips beside the shape.
        mano: a licensed MANO file to fit; without it, the open hand.
    """
    check_out(out, recording, mano)
    found = load_keypoints(recording, side=side, sequence=sequence, fps=fps, unit=unit)
    which, how = known_side(found, side)
    settings = KeypointSettings(cutoff=cutoff, own_bones=own_bones)
    motion, report = fit_keypoints(found, load_hand(mano, which), settings)
    save_motion(motion, out)
    gaps = motion.num_frames - int(motion.valid.sum())
    print(
        f"{found.source}: layout {found.layout}, a {which} hand ({how}), {motion.num_frames} frames at {motion.fps:g}/s"
    )
    _report(motion, report, gaps)
    print_warnings(motion.warnings)
    print(f"{out}  turn it into joint angles with: mjx-hand retarget {out} --out angles.npz")


def _report(motion: Motion, report: KeypointReport, gaps: int) -> None:
    rows = []
    for k, digit in enumerate(DIGITS):
        f = FINGERS.index("pinky" if digit == "little" else digit)
        bones = " ".join(f"{1e3 * error:+.1f}" for error in report.bone_error[f])
        joints = report.distance[1 + 4 * k : 5 + 4 * k] * 1e3
        direction = f"{np.rad2deg(report.direction[f].mean()):.2f}"
        rows.append((digit, f"{joints[:3].mean():.1f}", f"{joints[3]:.1f}", direction, bones))
    columns = ("finger", "joints (mm)", "tip (mm)", "bone direction (degrees)", "bones longer by (mm)")
    print_table(f"mean distance of the fitted hand from the keypoints; {gaps} frames in gaps", columns, rows)
    varies = (
        f"bone lengths vary over time by {100 * report.spread_seen:.1f} % as recorded, "
        f"{100 * report.spread_fitted:.1f} % as fitted"
    )
    jitter = (
        f"jitter (second difference) {1e3 * report.jitter_seen:.2f} mm as recorded, "
        f"{1e3 * report.jitter_fitted:.2f} mm as fitted"
    )
    print(f"{varies}; {jitter if np.isfinite(report.jitter_seen) else 'no three frames in a row, which jitter takes'}")
    print(f"shape {np.array2string(motion.shape, precision=2, suppress_small=True, max_line_width=110)}")
