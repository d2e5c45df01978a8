"""A marker fit to look at: the fitted hand with its markers in several frames, and each marker's error."""

import jax.numpy as jnp
import matplotlib as mpl
import numpy as np
from jaxtyping import Float, Int
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d import Axes3D
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

from mjx_hand.capture.marker_fit.fit_report import FitReport
from mjx_hand.errors import InputError
from mjx_hand.hand.model import HandModel
from mjx_hand.hand.skinning import skin
from mjx_hand.motion.motion import Motion
from mjx_hand.motion.resample import quaternion_matrices
from mjx_hand.view.figures.plots import BLUE, ORANGE, STYLE

Array = np.ndarray
SKIN = np.array([0.93, 0.80, 0.70])
LIGHT = np.array([-0.3, 0.75, 0.6])  # hand axes: from the back of the hand, the finger tips and the thumb's side
BINS = 600  # columns of the error over time


def fit_snapshots(motion: Motion, report: FitReport, count: int = 4) -> Int[Array, "k"]:
    """Up to `count` frames to look at, spread over the motion: of each stretch the fitted one of median error."""
    valid = np.flatnonzero(motion.valid)
    error = np.where(report.seen, report.distance, 0.0).sum(axis=1) / np.maximum(report.seen.sum(axis=1), 1)
    stretches = np.array_split(valid, min(count, len(valid)))
    return np.array([part[np.argsort(error[part])[len(part) // 2]] for part in stretches])


@mpl.rc_context(STYLE)
def fit_figure(
    hand: HandModel,
    motion: Motion,
    report: FitReport,
    frames: Int[Array, "k"],
    observed: Float[Array, "k m 3"],
    predicted: Float[Array, "k m 3"],
) -> Figure:
    """The fitted hand with its markers above, each marker's error below.

    Args:
        hand: the hand that was fitted.
        motion: its motion.
        report: of the fit.
        frames: numbers of those in which the hand is drawn.
        observed: the markers in these frames (m, world), NaN where one was not seen.
        predicted: where the fitted hand has them, seen or not.

    Raises:
        InputError: no frame to show.
    """
    if len(frames) == 0:
        raise InputError("no frame of the fit to draw; give at least one")
    figure = Figure(figsize=(12.0, 7.6), layout="constrained")
    above, below = np.ravel(np.array(figure.subfigures(2, 1, height_ratios=(1.0, 1.1))))
    turn = quaternion_matrices(motion.wrist_quaternion[frames])
    shape = jnp.asarray(motion.shape, jnp.float32)
    for k, frame in enumerate(frames):
        axes = above.add_subplot(1, len(frames), k + 1, projection="3d", computed_zorder=False)
        assert isinstance(axes, Axes3D)
        vertices, joints = (np.asarray(a) for a in skin(hand, jnp.asarray(motion.rotations[frame], jnp.float32), shape))
        to_hand = [
            (points - motion.wrist_position[frame]) @ turn[k] + joints[0] for points in (observed[k], predicted[k])
        ]
        _hand(axes, vertices, np.asarray(hand.faces), hand.side)
        _markers(axes, *to_hand)
        _frame(axes, np.concatenate([vertices, to_hand[1]]), hand.side)
        axes.set_title(f"{frame / motion.fps:.1f} s")
    bars, course = below.subplots(1, 2, width_ratios=(1.0, 1.5))
    _bars(bars, report)
    _course(course, report, motion.fps)
    return figure


def _hand(axes: Axes3D, vertices: Array, faces: Array, side: str) -> None:
    triangles = vertices[faces]
    normal = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
    mirror = np.array([-1.0 if side == "left" else 1.0, 1.0, 1.0])
    shade = 0.55 + 0.45 * np.clip(normal @ (LIGHT * mirror / np.linalg.norm(LIGHT)), -0.6, 1.0)
    colours = np.concatenate([np.clip(SKIN * shade[:, None], 0, 1), np.full((len(faces), 1), 0.55)], axis=1)
    axes.add_collection3d(Poly3DCollection(_plot_axes(triangles), facecolors=colours, edgecolors="none"))


def _frame(axes: Axes3D, shown: Array, side: str) -> None:
    """Look at these points. Not at the observed markers: a ghost may be anywhere."""
    points = _plot_axes(shown)
    middle, reach = (points.max(axis=0) + points.min(axis=0)) / 2, 0.62 * np.ptp(points, axis=0).max()
    for set_limits, centre in zip((axes.set_xlim, axes.set_ylim, axes.set_zlim), middle, strict=True):
        set_limits(centre - reach, centre + reach)
    axes.set_box_aspect((1, 1, 1), zoom=2)
    axes.view_init(elev=58, azim=-155 if side == "right" else -25)
    axes.set_axis_off()


def _plot_axes(points: Array) -> Array:
    """Hand axes to the plot's, whose z is up on the page: back of the hand up, fingers away."""
    return np.stack([-points[..., 0], -points[..., 2], points[..., 1]], axis=-1)


def _markers(axes: Axes3D, observed: Array, predicted: Array) -> None:
    seen = np.isfinite(observed).all(axis=1)
    axes.scatter(*_plot_axes(observed[seen]).T, s=14, color=BLUE, depthshade=False)
    axes.scatter(*_plot_axes(predicted[~seen]).T, s=18, facecolors="none", edgecolors=ORANGE, depthshade=False)
    for a, b in zip(_plot_axes(observed[seen]), _plot_axes(predicted[seen]), strict=True):
        axes.plot(*np.stack([a, b]).T, color=ORANGE, linewidth=1.2)


def _bars(axes: Axes, report: FitReport) -> None:
    """Each marker's error; medians, because the RMS of a marker with one ghost speaks of the ghost alone."""
    millimetres = [1000 * report.distance[seen, m] for m, seen in enumerate(report.seen.T)]
    rows = np.arange(len(report.names))
    axes.barh(
        rows, [np.percentile(d, 95) if d.size else 0.0 for d in millimetres], color=BLUE, alpha=0.25, label="95 %"
    )
    axes.barh(rows, [np.median(d) if d.size else 0.0 for d in millimetres], color=BLUE, height=0.5, label="median")
    axes.set_yticks(rows, report.names, fontsize=8)
    axes.invert_yaxis()
    axes.set_xlabel("distance from the fitted hand (mm)")
    axes.grid(visible=True, axis="x")
    axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2, borderaxespad=0.2)


def _course(axes: Axes, report: FitReport, fps: float) -> None:
    """Every marker's error over time as an image: a gap, a swap or a ghost is seen at once."""
    frames, markers = report.distance.shape
    edges = np.unique(np.linspace(0, frames, min(BINS, frames) + 1).round().astype(int))
    worst = np.maximum.reduceat(np.where(report.seen, 1000 * report.distance, -1.0), edges[:-1], axis=0)
    image = axes.imshow(
        np.ma.masked_less(worst.T, 0.0),
        aspect="auto",
        interpolation="nearest",
        extent=(0.0, frames / fps, markers - 0.5, -0.5),
        vmin=0.0,
        vmax=1000 * float(np.percentile(report.distance[report.seen], 99.5)),
    )
    axes.set_facecolor("#d9dde3")
    axes.set_yticks(np.arange(markers), report.names, fontsize=8)
    axes.set_xlabel("time (s); grey where not seen")
    axes.figure.colorbar(image, ax=axes, label="distance (mm)", extend="max")
