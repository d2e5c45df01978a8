"""Fit a hand to optical markers and compare with the truth, on a simulated capture that needs no data.

    python examples/02_markers_to_motion.py

With a recording of your own: `mjx-hand fit recording.c3d --markers hand22 --out motion.npz --plot fit.png`.
"""

from pathlib import Path

import numpy as np

import mjx_hand
from mjx_hand.capture.marker_fit.predicted_markers import predicted_markers
from mjx_hand.capture.simulation.sample_motion import sample_motion
from mjx_hand.capture.simulation.simulate import simulate_markers
from mjx_hand.motion import save_motion
from mjx_hand.view.figures.fit_figure import fit_figure, fit_snapshots
from mjx_hand.view.figures.plots import save_figure

OUT = Path("outputs/examples/markers")


def main() -> None:
    """Record a person whose shape the fit does not know, fit, and draw."""
    hand = mjx_hand.load_hand()
    truth = sample_motion(hand, shape=[1.5, -1.0, 0.5, 0, 0, 0, 0, 0, 0, 0], seconds=3.0, fps=100.0)
    marker_set = mjx_hand.load_marker_set("hand22", hand)
    recording = simulate_markers(hand, truth, marker_set, seed=1, noise=0.0005, gap_fraction=0.05)
    # A recording from a file: mjx_hand.load_markers("recording.c3d")

    motion, report = mjx_hand.fit_markers(recording, hand, marker_set)
    turn = np.einsum("tjba,tjbc->tjac", truth.rotations, motion.rotations)  # from each true rotation to the fitted one
    angle = np.arccos(np.clip((np.trace(turn, axis1=-2, axis2=-1) - 1) / 2, -1, 1))
    wrist = np.linalg.norm(motion.wrist_position - truth.wrist_position, axis=1)
    print(f"{len(recording.names)} markers, {recording.num_frames} frames, {recording.visible.mean():.0%} visible")
    print(f"markers to fitted hand: {1e3 * report.rms:.2f} mm RMS")
    print(f"rotations off by {np.rad2deg(angle).mean():.1f} degrees, wrist by {1e3 * wrist.mean():.1f} mm on average")

    OUT.mkdir(parents=True, exist_ok=True)
    save_motion(motion, OUT / "motion.npz")
    frames = fit_snapshots(motion, report)
    seen = np.where(recording.visible[..., None], recording.positions, np.nan)
    predicted = predicted_markers(hand, motion, marker_set, report.offsets)
    save_figure(fit_figure(hand, motion, report, frames, seen[frames], predicted[frames]), OUT / "fit.png")
    print(f"{OUT / 'motion.npz'}: mjx-hand view plays it; {OUT / 'fit.png'} shows the fit")


if __name__ == "__main__":
    main()
