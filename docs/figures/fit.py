"""Draws the figure of docs/capture.md from a simulated capture: `python docs/figures/fit.py`."""

from pathlib import Path

import numpy as np
from PIL import Image
from scipy.spatial.transform import Rotation

from mjx_hand.capture.marker_fit.fit import fit_markers
from mjx_hand.capture.marker_fit.predicted_markers import predicted_markers
from mjx_hand.capture.markers.marker_set import included_marker_set
from mjx_hand.capture.simulation.disturbances import add_ghosts, swap_labels
from mjx_hand.capture.simulation.off_axis import add_off_axis_rotation
from mjx_hand.capture.simulation.simulate import simulate_markers
from mjx_hand.hand.load import load_hand
from mjx_hand.motion import Motion
from mjx_hand.rigid.axes import anatomical_axes
from mjx_hand.rigid.limits import anatomical_limits
from mjx_hand.view.figures.fit_figure import fit_figure, fit_snapshots
from mjx_hand.view.figures.plots import save_figure

FRAMES, FPS, SEED = 600, 120.0, 4


def closing_hand() -> Motion:
    """An open hand that closes, opens and turns, of a person's shape, with rotations that hinges cannot follow."""
    hand, rng = load_hand(), np.random.default_rng(SEED)
    times = np.arange(FRAMES) / FPS
    closed = 0.5 - 0.5 * np.cos(2 * np.pi * times[:, None] / 2.5 + rng.uniform(-0.4, 0.4, 20))
    lower, upper = anatomical_limits()
    angles = 0.1 * lower + closed * (0.55 * upper - 0.1 * lower)
    axes = anatomical_axes(hand.joint_regressor @ hand.template, hand.side)
    hinges = Rotation.from_rotvec((angles[..., None] * axes).reshape(-1, 3)).as_matrix().reshape(FRAMES, 5, 4, 3, 3)
    joints = np.stack([hinges[:, :, 0] @ hinges[:, :, 1], hinges[:, :, 2], hinges[:, :, 3]], axis=2)
    turn = Rotation.from_rotvec(0.5 * np.sin(times)[:, None] * np.array([1.0, 0.5, 0.2]))
    return Motion(
        fps=FPS,
        rotations=add_off_axis_rotation(joints.reshape(FRAMES, 15, 3, 3), SEED, 0.5, FPS),
        wrist_position=0.2 * np.sin(times[:, None] * np.array([1.0, 1.3, 0.7])),
        wrist_quaternion=turn.as_quat(scalar_first=True),
        shape=rng.normal(size=10),
        valid=np.ones(FRAMES, bool),
        source="closing hand",
    )


def main() -> None:
    """Record, swap and add ghosts, fit, draw."""
    hand = load_hand()
    marker_set = included_marker_set(hand)
    recording = simulate_markers(hand, closing_hand(), marker_set, SEED)
    recording = add_ghosts(swap_labels(recording, SEED, fraction=0.03), SEED, fraction=0.002)
    motion, report = fit_markers(recording, hand, marker_set)
    frames = fit_snapshots(motion, report)
    observed = np.where(recording.visible[..., None], recording.positions, np.nan)
    predicted = predicted_markers(hand, motion, marker_set, report.offsets)
    figure = fit_figure(hand, motion, report, frames, observed[frames], predicted[frames])
    picture = Path(__file__).parent / "fit.png"
    save_figure(figure, picture)
    with Image.open(picture) as image:
        image.convert("RGB").quantize(256, Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE).save(
            picture, optimize=True
        )


if __name__ == "__main__":
    main()
