"""The figures of reports and documentation: arrays in, matplotlib figures out. Text takes the page's colour in HTML."""

import io
import itertools
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from jaxtyping import Bool, Float
from matplotlib import colors, ticker
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mjx_hand.errors import InputError
from mjx_hand.files.npz_archive import replacing

Array = np.ndarray

BLUE, ORANGE, GREEN, VIOLET = "#3b82f6", "#f08c2e", "#17a07a", "#9a6bf0"  # legible on white and on near-black
COLOURS = (BLUE, ORANGE, GREEN, VIOLET)
_INK = "#5a6372"  # inline_svg() turns it into the page's own text colour
STYLE: dict[Any, Any] = {
    "font.size": 10,
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans"],
    "text.color": _INK,
    "axes.labelcolor": _INK,
    "axes.edgecolor": _INK,
    "axes.linewidth": 0.8,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.axisbelow": True,
    "axes.titlesize": 10,
    "xtick.color": _INK,
    "ytick.color": _INK,
    "grid.color": _INK,
    "grid.alpha": 0.2,
    "grid.linewidth": 0.7,
    "legend.frameon": False,
    "lines.linewidth": 1.8,
}


@mpl.rc_context(STYLE)
def learning_curve(
    steps: Float[Array, "_"],
    values: Float[Array, "*s k"],
    *,
    baseline: float | None = None,
    label: str = "success rate",
    share: bool = True,
) -> Figure:
    """A score over training steps; where there are several seeds, their mean and the band from least to greatest.

    Args:
        steps: control steps at each evaluation.
        values: the score at each evaluation, or one row per seed.
        baseline: the same score of the zero residual, drawn as a level.
        label: of the vertical axis.
        share: the score is a share of rollouts: 0 to 1, shown in percent.

    Raises:
        InputError: no evaluations, or a number of values that is not that of steps.
    """
    runs = np.atleast_2d(values)
    if steps.size == 0 or runs.shape[-1] != steps.size:
        raise InputError(f"{runs.shape[-1]} values for {steps.size} steps; give one value an evaluation, at least one")
    figure, axes = _figure()
    if len(runs) > 1:
        axes.fill_between(steps, runs.min(axis=0), runs.max(axis=0), color=BLUE, alpha=0.2, linewidth=0)
    marker = "o" if steps.size < 40 else ""
    name = "policy" if len(runs) == 1 else f"policy, mean of {len(runs)} seeds"
    axes.plot(steps, runs.mean(axis=0), color=BLUE, marker=marker, markersize=3.5, label=name)
    if baseline is not None:
        axes.axhline(baseline, color=ORANGE, linestyle=(0, (4, 3)), linewidth=1.5, label="zero residual")
    axes.set_xlabel("control steps")
    axes.xaxis.set_major_formatter(ticker.EngFormatter(sep=""))
    axes.set_ylabel(label)
    if share:
        axes.set_ylim(-0.03, 1.03)
        axes.yaxis.set_major_formatter(ticker.PercentFormatter(1.0))
    else:
        axes.set_ylim(bottom=0)
    _legend_above(axes)
    return figure


@mpl.rc_context(STYLE)
def error_over_time(
    fps: float,
    errors: Mapping[str, tuple[Float[Array, "n t"], Bool[Array, "n t"]]],
    *,
    label: str = "object position error (cm)",
    limit: float | None = None,
    limit_label: str = "{:g} cm",
) -> Figure:
    """Errors over the demonstration's time: each method's median, with bands of 50 % and 80 % of its rollouts.

    Args:
        fps: frames per second.
        errors: method name to its errors and the mask of frames that count; frames of no rollout are not drawn.
        label: of the vertical axis.
        limit: a threshold to draw as a level.
        limit_label: what it is called, with its value in place of {:g}.

    Raises:
        InputError: a method without a counted frame.
    """
    figure, axes = _figure()
    for (name, (values, counted)), colour in zip(errors.items(), itertools.cycle(COLOURS), strict=False):
        frames = np.flatnonzero(counted.any(axis=0))
        if frames.size == 0:
            raise InputError(f"errors of {name!r} have no counted frame; mark the demonstration's frames")
        chosen = np.where(counted, values, np.nan)[:, frames]
        low, lower, middle, upper, high = np.nanquantile(chosen, [0.1, 0.25, 0.5, 0.75, 0.9], axis=0)
        time = frames / fps
        axes.fill_between(time, low, high, color=colour, alpha=0.13, linewidth=0)
        axes.fill_between(time, lower, upper, color=colour, alpha=0.22, linewidth=0)
        axes.plot(time, middle, color=colour, label=name)
    if limit is not None:
        axes.axhline(limit, color=_INK, linestyle=(0, (1, 2)), linewidth=1.2, label=limit_label.format(limit))
    axes.set_ylim(bottom=0)
    axes.margins(x=0.01)
    axes.set_xlabel("time (s)")
    axes.set_ylabel(label)
    _legend_above(axes)
    return figure


@mpl.rc_context(STYLE)
def joint_errors(
    joints: Sequence[str],
    errors: Mapping[str, Float[Array, "t j"]],
    *,
    label: str = "projection error (degrees)",
) -> Figure:
    """Bars of the mean error of each joint, a colour a method, with whiskers up to the 95th percentile.

    Args:
        joints: names, along the horizontal axis.
        errors: method name to its errors, one column per joint.
        label: of the vertical axis.

    Raises:
        InputError: no methods, or columns that are not one a joint.
    """
    if not errors:
        raise InputError("no errors to draw; give at least one method")
    figure, axes = _figure(width=8.0)
    places, width = np.arange(len(joints)), 0.8 / len(errors)
    for k, ((name, values), colour) in enumerate(zip(errors.items(), itertools.cycle(COLOURS), strict=False)):
        if values.shape[1] != len(joints):
            raise InputError(f"errors of {name!r} have {values.shape[1]} columns for {len(joints)} joints")
        mean, high = values.mean(axis=0), np.quantile(values, 0.95, axis=0)
        x = places + (k - (len(errors) - 1) / 2) * width
        axes.bar(x, mean, width=0.9 * width, color=colour, label=f"{name}: {values.mean():.2f} mean")
        axes.vlines(x, mean, np.maximum(mean, high), color=colour, linewidth=1.2, alpha=0.7)
    axes.set_xticks(
        places, [name.replace("_", " ") for name in joints], rotation=45, ha="right", rotation_mode="anchor"
    )
    axes.set_xlim(-0.6, len(joints) - 0.4)
    axes.grid(visible=False, axis="x")
    axes.set_ylabel(label)
    _legend_above(axes)
    return figure


@mpl.rc_context(STYLE)
def retarget_errors(errors: Mapping[str, Float[Array, "_"]], *, label: str = "error (mm)") -> Figure:
    """Boxes (quartiles, whiskers at the 5th and 95th percentile) of each stage's or part's errors.

    Args:
        errors: name to its errors over all frames.
        label: of the horizontal axis.

    Raises:
        InputError: nothing to draw, or a name without errors.
    """
    empty = [name for name, values in errors.items() if values.size == 0]
    if empty or not errors:
        raise InputError(f"no errors to draw for {', '.join(empty) or 'any name'}; give at least one value each")
    names = list(errors)
    figure, axes = _figure(height=1.1 + 0.36 * len(names))
    boxes = axes.boxplot(
        [errors[name] for name in names],
        orientation="horizontal",
        whis=(5, 95),
        showfliers=False,
        patch_artist=True,
        widths=0.55,
        medianprops={"color": _INK, "linewidth": 1.6},
        whiskerprops={"color": BLUE},
        capprops={"color": BLUE},
    )
    for box in boxes["boxes"]:
        box.set(facecolor=colors.to_rgba(BLUE, 0.3), edgecolor=BLUE)
    axes.set_yticks(np.arange(1, len(names) + 1), [f"{name}  {np.median(errors[name]):.2f}" for name in names])
    axes.invert_yaxis()
    axes.set_xlim(left=0)
    axes.grid(visible=False, axis="y")
    axes.set_xlabel(label + ", medians beside the names")
    return figure


@mpl.rc_context(STYLE)
def throughput(panels: Mapping[str, Mapping[str, Float[Array, "k 4"]]], *, label: str) -> Figure:
    """How fast each contestant is over its number of worlds: a panel a scene, on the same logarithmic axes.

    Args:
        panels: scene to name to rows of the number of worlds and the median, least and greatest rate.
        label: of the vertical axes.

    Raises:
        InputError: nothing to draw, or a name without rows.
    """
    empty = [name for rates in panels.values() for name, rows in rates.items() if len(rows) == 0]
    if empty or not any(panels.values()):
        raise InputError(f"no rates to draw for {', '.join(empty) or 'any name'}; give at least one row each")
    names = list(dict.fromkeys(name for rates in panels.values() for name in rates))
    looks = itertools.product(("solid", (0, (4, 2))), COLOURS)
    look = dict(zip(names, itertools.cycle(looks), strict=False))
    columns = min(len(panels), 3)
    lines = -(-len(panels) // columns)
    figure = Figure(figsize=(2.6 + 2.3 * columns, 0.9 + 2.5 * lines), layout="constrained")
    grid = figure.subplots(lines, columns, sharex=True, sharey=True, squeeze=False).ravel()
    known = {}
    for axes, (scene, rates) in zip(grid, panels.items(), strict=False):
        for name, rows in rates.items():
            worlds, median, least, greatest = rows[np.argsort(rows[:, 0])].T
            line, colour = look[name]
            (known[name],) = axes.plot(
                worlds, median, color=colour, linestyle=line, marker="o", markersize=3.5, label=name
            )
            axes.vlines(worlds, least, greatest, color=colour, linewidth=1.2, alpha=0.7)
        axes.set_xscale("log", base=2)
        axes.set_yscale("log")
        axes.set_title(scene, loc="left")
        axes.xaxis.set_major_formatter(ticker.StrMethodFormatter("{x:,.0f}"))
        axes.yaxis.set_major_formatter(ticker.EngFormatter(sep=""))
        axes.grid(visible=True)
        axes.tick_params(length=0, which="both", labelbottom=True, labelleft=True)
    for axes in grid[len(panels) :]:
        axes.set_visible(False)
    figure.supxlabel("worlds", fontsize=10)
    figure.supylabel(label, fontsize=10)
    figure.legend(known.values(), known, loc="outside upper left", ncols=min(len(known), 4), handlelength=1.6)
    return figure


def check_figure_path(path: str | Path) -> None:
    """Refuse a path that `save_figure` cannot write, before the work that leads there.

    Raises:
        InputError: its suffix is another than .png, .svg or .pdf.
    """
    if Path(path).suffix not in (".png", ".svg", ".pdf"):
        raise InputError(f"{path}: figures are written as .png, .svg or .pdf")


def save_figure(figure: Figure, path: str | Path) -> None:
    """Write as the suffix says (PNG on white at 150 dpi; SVG or PDF transparent); whole or not at all.

    Raises:
        InputError: another suffix, or a folder that cannot be written.
    """
    check_figure_path(path)
    suffix = Path(path).suffix
    with replacing(path) as temporary, mpl.rc_context(STYLE):
        figure.savefig(temporary, dpi=150, facecolor="white" if suffix == ".png" else "none")


def inline_svg(figure: Figure, name: str) -> str:
    """The figure as an SVG element for an HTML page, the same every time; `name` keeps its ids apart from others'."""
    buffer = io.StringIO()
    with mpl.rc_context({**STYLE, "svg.fonttype": "none", "svg.hashsalt": name}):
        figure.savefig(buffer, format="svg", transparent=True, metadata={"Date": None})
    text = buffer.getvalue()
    element = text[text.index("<svg") :]
    for reference in ('id="', "url(#", 'href="#'):  # matplotlib names groups alike in every figure
        element = element.replace(reference, f"{reference}{name}-")
    return element.replace(_INK, "currentColor").replace("'DejaVu Sans'", "inherit")


def _figure(width: float = 6.4, height: float = 3.2) -> tuple[Figure, Axes]:
    figure = Figure(figsize=(width, height), layout="constrained")
    axes = figure.subplots()
    axes.grid(visible=True)
    axes.tick_params(length=0)
    return figure, axes


def _legend_above(axes: Axes, columns: int = 4) -> None:
    axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=columns, borderaxespad=0.2, handlelength=1.6)
