"""`mjx-hand fit`: a marker recording as the motion of a hand, and how far each marker is from it."""

from pathlib import Path
from typing import Annotated, Literal

import numpy as np
import tyro

from mjx_hand.capture.marker_files.load_markers import load_markers
from mjx_hand.capture.marker_fit.fit import FitSettings, fit_many
from mjx_hand.capture.marker_fit.fit_report import FitReport
from mjx_hand.capture.marker_fit.predicted_markers import predicted_markers
from mjx_hand.capture.markers.gap_filling import FILL, fill_short_gaps
from mjx_hand.capture.markers.labels import Labelled, match_labels
from mjx_hand.capture.markers.marker_recording import MarkerRecording, hide_marker
from mjx_hand.capture.markers.marker_set import MarkerSet, load_marker_set
from mjx_hand.cli.output import check_out, print_table, print_warnings
from mjx_hand.errors import InputError
from mjx_hand.hand.joints import HINGES
from mjx_hand.hand.load import load_hand
from mjx_hand.motion import JointMotion, Motion, load_motion_file, save_motion
from mjx_hand.progress import counter
from mjx_hand.pytree import replace
from mjx_hand.retarget.sequence import plausible_angles, retarget_sequence, rigid_hand_of
from mjx_hand.rigid.limits import anatomical_limits
from mjx_hand.view.figures.fit_figure import fit_figure, fit_snapshots
from mjx_hand.view.figures.plots import check_figure_path, save_figure

IMPOSSIBLE = 3.0  # degrees beyond its range of motion from which a joint angle is counted as impossible


def fit(
    recording: Annotated[Path, tyro.conf.Positional],
    markers: str,
    out: Path,
    side: Literal["right", "left"] = "right",
    plot: Path | None = None,
    shape: str = "free",
    leave_out: str | None = None,
    prefix: str = "",
    units: str | None = None,
    fps: float | None = None,
    fill: float = FILL,
    mano: Path | None = None,
) -> None:
    """Fit a hand's pose, wrist, shape and skin offsets to optical markers.

    Args:
        recording: markers in a format of mjx_hand/capture/marker_files: .c3d, .trc, .tsv, .csv or .npz.
        markers: the marker set: a YAML file, or a bundled one, hand22 or glove13.
        out: the .npz to write: a motion, which `mjx-hand retarget` reads.
        side: which hand.
        plot: a picture to write (.png, .svg, .pdf): the fitted hand with its markers, and each marker's error.
        shape: free to find the person's; fixed for the mean hand; or a motion file that has it.
        leave_out: hide this marker from the fit, and say how far it is from where the fit expects it.
        prefix: use only labels that start with this, such as R_, and match what follows.
        units: m, cm, mm or in, where the file's own unit is wrong or missing.
        fps: frames per second, where the file does not say.
        fill: fill gaps of up to so many seconds; longer ones are left to the hand's other markers.
        mano: a licensed MANO file; without it, the open hand.
    """
    check_out(out, recording, mano)
    if plot is not None:
        check_figure_path(plot)
    hand = load_hand(mano, side)
    marker_set = load_marker_set(markers, hand)
    labelled = match_labels(load_markers(recording, units, fps), marker_set, prefix)
    given = fill_short_gaps(labelled.recording, fill)
    filled = int((given.visible & ~labelled.recording.visible).sum())
    if leave_out is not None:
        given = hide_marker(given, leave_out)
    with counter(100, f"fitting {given.num_frames} frames") as advance:
        done = 0

        def progress(share: float) -> None:
            nonlocal done
            advance(int(100 * share) - done)
            done = int(100 * share)

        motion, report = fit_many([given], hand, marker_set, FitSettings(shape=known_shape(shape)), progress)[0]
    predicted = predicted_markers(hand, motion, marker_set, report.offsets)
    rigid = rigid_hand_of(motion, hand)
    joints = retarget_sequence(motion, rigid)
    motion = replace(motion, warnings=plausible_angles(joints, rigid).warnings)
    if plot is not None:
        frames = fit_snapshots(motion, report)
        observed = in_set_order(given, marker_set)
        save_figure(fit_figure(hand, motion, report, frames, observed[frames], predicted[frames]), plot)
    save_motion(motion, out)

    _report(labelled, motion, report, filled)
    print(impossible_angles(joints))
    print_warnings(motion.warnings)
    if leave_out is not None:
        print(held_out(labelled.recording, motion, marker_set, predicted, leave_out))
    if plot is not None:
        print(f"{plot}  the hand with its markers, and their errors")
    print(f"{out}  retarget it: mjx-hand retarget {out} --out angles.npz")


def known_shape(shape: str) -> tuple[float, ...] | None:
    """The shape coefficients that an option names; None to find them.

    Raises:
        InputError: it is neither free nor fixed nor a motion file.
    """
    if shape == "free":
        return None
    if shape == "fixed":
        return ()
    if not Path(shape).is_file():
        raise InputError(f"--shape {shape}: no such file; valid are free, fixed, or the path of a motion file")
    return tuple(float(value) for value in load_motion_file(shape).shape)


def in_set_order(recording: MarkerRecording, marker_set: MarkerSet) -> np.ndarray:
    """Positions (t, m, 3) in the set's order, NaN where a marker was not seen."""
    positions = np.full((recording.num_frames, len(marker_set.names), 3), np.nan)
    at = [marker_set.names.index(name) for name in recording.names]
    positions[:, at] = np.where(recording.visible[..., None], recording.positions, np.nan)
    return positions


def impossible_angles(joints: JointMotion) -> str:
    """A line on frames whose joint angles, as the hinges have them, are outside the joints' ranges."""
    angles = joints.angles[joints.valid]
    lower, upper = anatomical_limits()
    beyond = np.degrees(np.maximum(np.maximum(angles - upper, lower - angles), 0.0))
    frames = int((beyond > IMPOSSIBLE).any(axis=1).sum())
    worst = HINGES[int(beyond.max(axis=0).argmax())]
    most = f", most {beyond.max():.1f}° ({worst})" if beyond.max() > 0 else ""
    return f"{frames} of {len(angles)} frames have a joint more than {IMPOSSIBLE:g}° beyond its range{most}"


def held_out(
    recording: MarkerRecording, motion: Motion, marker_set: MarkerSet, predicted: np.ndarray, name: str
) -> str:
    """A line on how far the marker that the fit did not see is from where it expects it."""
    observed = in_set_order(recording, marker_set)[:, marker_set.names.index(name)]
    distance = np.linalg.norm(observed - predicted[:, marker_set.names.index(name)], axis=1)
    distance = 1000 * distance[np.isfinite(distance) & motion.valid]
    if distance.size == 0:
        return f"{name}, left out of the fit, is never seen where there is a fit"
    rms, middle, high = np.sqrt((distance**2).mean()), np.median(distance), np.percentile(distance, 95)
    return f"{name}, left out of the fit, is {rms:.1f} mm from it (RMS; median {middle:.1f}, 95 % {high:.1f})"


def _report(labelled: Labelled, motion: Motion, report: FitReport, filled: int) -> None:
    seconds = motion.num_frames / motion.fps
    gaps = motion.num_frames - int(motion.valid.sum())
    title = f"{labelled.recording.source}: {motion.num_frames} frames at {motion.fps:g}/s ({seconds:.1f} s), "
    title += f"{gaps} in gaps; {filled} of {motion.num_frames * len(labelled.recording.names)} sights filled in"
    rows = []
    for m, name in enumerate(report.names):
        seen = report.seen[:, m]
        if not seen.any():
            rows.append((name, "never seen", "", "", "", ""))
            continue
        distance = 1000 * report.distance[seen, m]
        offset = 1000 * float(np.linalg.norm(report.offsets[m]))
        figures = (report.marker_rms[m] * 1000, np.percentile(distance, 95), offset)
        rows.append(
            (name, f"{100 * seen.mean():.1f}", *(f"{f:.2f}" for f in figures), f"{100 * report.rejected[m]:.1f}")
        )
    columns = ("marker", "seen %", "RMS mm", "95 % mm", "off its place mm", "rejected %")
    print_table(title, columns, rows)
    print(f"all markers: {1000 * report.rms:.2f} mm RMS")
    if labelled.missing:
        print(f"of the marker set, the recording lacks: {', '.join(labelled.missing)}")
    if labelled.others:
        print(f"labels that are no marker of the set, left out: {', '.join(labelled.others)}")
