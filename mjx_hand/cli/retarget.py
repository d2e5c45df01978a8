"""`mjx-hand retarget`: a recording, or a folder of them, as joint angles, and how well these follow it."""

import contextlib
import time
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
import tyro

from mjx_hand.capture.datasets.dataset_format import dataset_formats
from mjx_hand.capture.load import load_motion
from mjx_hand.cli.output import check_out, print_table, print_warnings, spread
from mjx_hand.cli.terminal.wording import as_options
from mjx_hand.errors import InputError
from mjx_hand.hand.joints import LINKS, ONE_DOF, TWO_DOF
from mjx_hand.motion import Motion, save_joint_motion
from mjx_hand.progress import counter
from mjx_hand.retarget.dataset import SUMMARY, retarget_dataset
from mjx_hand.retarget.hands import KinematicHands
from mjx_hand.retarget.options import RetargetOptions
from mjx_hand.retarget.sequence import RetargetErrors, plausible_angles, retarget_errors, retarget_many
from mjx_hand.retarget.summary import DONE, OUTER_JOINTS, Outcome
from mjx_hand.view.figures.plots import check_figure_path, joint_errors, save_figure

_SHOWN = 10  # failures that are listed one by one
_MEGABYTE = 1_000_000


def retarget(
    recording: Annotated[Path, tyro.conf.Positional],
    out: Path,
    method: str = "exact",
    axes: str = "anatomical",
    carry: bool = False,
    limits: bool = False,
    refine: Literal["none", "tips"] = "none",
    smooth: float | None = None,
    plot: Path | None = None,
    pattern: str | None = None,
    mano: Path | None = None,
    side: str | None = None,
    sequence: str | None = None,
    fps: float | None = None,
) -> int:
    """Retarget a recorded motion, or a folder of them, to the 20 hinges of the rigid hand and report the errors.

    A folder's recordings go to files of the same names below `out`, beside summary.csv. A run that was stopped resumes
    where it was; a file that cannot be used is reported, the rest is done, and the exit status is 1.

    Args:
        recording: a motion: the project's own .npz, or a file or folder of a dataset (docs/datasets.md). Any other
            folder, or one given with --pattern, is a folder of recordings.
        out: the .npz to write (joint angles in rad, wrist poses); for a folder of recordings, a folder.
        method: how rotations become angles: exact, or for comparison paper, bch2, naive.
        axes: hinge axes: anatomical, from the joint centres, or functional, fitted to the recording's own rotations.
        carry: give what a joint's hinges could not follow to the next joint of its finger.
        limits: stay within the hand's limits.
        refine: tips moves the angles until finger tips and joint centres are where the recording has them.
        smooth: cut-off of a low-pass filter, Hz, which takes gaps as unknown.
        plot: picture of the errors of each joint (.png, .svg, .pdf); one recording only.
        pattern: which files below a folder are recordings, "*.npz" if not given.
        mano: a licensed MANO file, for recordings made with one; without it, the open hand.
        side: right or left, where both hands are recorded.
        sequence: the name of one recording, where a file has several.
        fps: frames per second, where the recording does not say.
    """
    options = RetargetOptions(method=method, carry=carry, limits=limits, refine=refine, smooth=smooth)
    if pattern is not None or (recording.is_dir() and not any(f.recognises(recording, {}) for f in dataset_formats())):
        for name, value in (("--plot", plot), ("--sequence", sequence)):
            if value is not None:
                raise InputError(f"{name} is for one recording, and {recording} is a folder of them; leave it out")
        return _folder(recording, out, options, axes, mano, side, fps, pattern or "*.npz")
    check_out(out, recording, mano)
    if plot is not None:
        check_figure_path(plot)
    motion = load_motion(recording, side=side, sequence=sequence, mano=mano, fps=fps)
    rigid = KinematicHands(mano, axes).of(motion)
    began = time.perf_counter()
    retarget_many([motion], [rigid], options)
    first = time.perf_counter()
    (joint_motion,) = retarget_many([motion], [rigid], options)  # the first call also compiled: time one that did not
    took = time.perf_counter() - first
    errors = retarget_errors(motion, joint_motion, rigid)
    joint_motion = plausible_angles(joint_motion, rigid)
    if plot is not None:
        save_figure(joint_errors(LINKS[1:], {_told(options): np.degrees(errors.rotation[errors.valid])}), plot)
    save_joint_motion(joint_motion, out)
    _report(motion, errors, axes)
    print_warnings(joint_motion.warnings)
    ready = first - began - took
    compiled = f"; compiling, or loading what was compiled, took {ready:.1f} s" if ready >= 0.1 else ""
    print(f"{motion.num_frames} frames in {1e3 * took:.0f} ms ({_told(options)}){compiled}")
    if plot is not None:
        print(f"{plot}  error of each joint's rotation")
    print(f"{out}  load it with mjx_hand.motion.load_joint_motion({str(out)!r})")
    return 0


def _told(options: RetargetOptions) -> str:
    """The options in a few words."""
    parts = [options.method]
    parts += ["carry"] if options.carry else []
    parts += ["limits"] if options.limits else []
    parts += ["refined"] if options.refine != "none" else []
    parts += [f"below {options.smooth:g} Hz"] if options.smooth is not None else []
    return ", ".join(parts)


def _report(motion: Motion, errors: RetargetErrors, axes: str) -> None:
    good = errors.valid
    rotation, joint, tip = errors.rotation[good], errors.joint_position[good], errors.tip_position[good]
    rows = [
        ("rotation, two-hinge joints (degrees)", *spread(rotation[:, TWO_DOF], np.degrees(1.0))),
        ("rotation, one-hinge joints (degrees)", *spread(rotation[:, ONE_DOF], np.degrees(1.0))),
        ("joint position (mm)", *spread(joint[:, OUTER_JOINTS], 1e3)),
        ("finger-tip position (mm)", *spread(tip, 1e3)),
    ]
    seconds = motion.num_frames / motion.fps
    gaps = motion.num_frames - int(good.sum())
    title = (
        f"{motion.source or 'motion'}: {motion.num_frames} frames at {motion.fps:g}/s ({seconds:.1f} s), {gaps} in gaps"
    )
    print_table(title, (f"error of the hinges, {axes} axes", "mean", "95 %", "max"), rows)


def _folder(
    folder: Path,
    out: Path,
    options: RetargetOptions,
    axes: str,
    mano: Path | None,
    side: str | None,
    fps: float | None,
    pattern: str,
) -> int:
    if folder.is_file():
        raise InputError(f"{folder}: is a file; --pattern chooses among a folder's files, so leave it out")
    if out.is_file():
        raise InputError(f"{out}: is a file, and {folder} is a folder of recordings; choose a folder for their outputs")
    started = time.perf_counter()
    with contextlib.ExitStack() as stack:
        bar: list[Callable[[int], None]] = []
        sizes = [0, 0]  # bytes done, megabytes shown

        def began(total: int) -> None:
            bar.append(stack.enter_context(counter(-(-total // _MEGABYTE), "retargeting (MB)")))

        def advance(size: int) -> None:
            sizes[0] += size
            whole = -(-sizes[0] // _MEGABYTE)
            bar[0](whole - sizes[1])
            sizes[1] = whole

        outcomes = retarget_dataset(
            folder,
            out,
            options,
            axes=axes,
            mano=mano,
            side=side,
            fps=fps,
            pattern=pattern,
            began=began,
            advance=advance,
        )
    done = [outcome for outcome in outcomes if outcome.status == DONE]
    failed = [outcome for outcome in outcomes if outcome.status != DONE]
    if done:
        _folder_report(folder, done, time.perf_counter() - started, axes)
    doubtful = [outcome for outcome in done if outcome.warnings]
    for outcome in doubtful[:_SHOWN]:
        print(f"warning: {outcome.file}: {outcome.warnings}")
    if len(doubtful) > _SHOWN:
        print(f"warnings on {len(doubtful) - _SHOWN} more recordings stand in {SUMMARY}")
    for outcome in failed[:_SHOWN]:
        print(f"failed: {as_options(outcome.message)}")
    if failed:
        more = f", {len(failed) - _SHOWN} of them not shown here" if len(failed) > _SHOWN else ""
        print(f"{len(failed)} of {len(outcomes)} recordings could not be used{more}; exit status 1")
    print(f"{out / SUMMARY}  one row per recording")
    return 1 if failed else 0


def _folder_report(folder: Path, done: list[Outcome], seconds: float, axes: str) -> None:
    """Errors over all recordings that are done, each recording counting as its frames."""
    frames = np.array([outcome.frames - outcome.gaps for outcome in done])
    rows = []
    for label, name, unit in (
        ("rotation (degrees)", "rotation", "deg"),
        ("joint position (mm)", "joint", "mm"),
        ("finger-tip position (mm)", "tip", "mm"),
    ):
        mean = np.average([getattr(outcome, f"{name}_mean_{unit}") for outcome in done], weights=frames)
        worst = max(getattr(outcome, f"{name}_max_{unit}") for outcome in done)
        rows.append((label, f"{mean:.2f}", f"{worst:.2f}"))
    title = (
        f"{folder}: {len(done)} recordings, {sum(o.frames for o in done)} frames, {sum(o.gaps for o in done)} in gaps,"
        f" {seconds:.1f} s"
    )
    print_table(title, (f"error of the hinges, {axes} axes", "mean", "max"), rows)
