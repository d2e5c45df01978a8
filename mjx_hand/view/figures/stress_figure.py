"""The figure of a stress test: what is kept, over how large a disturbance is."""

import itertools
from collections.abc import Mapping

import matplotlib as mpl
import numpy as np
from jaxtyping import Float
from matplotlib.figure import Figure

from mjx_hand.errors import InputError
from mjx_hand.view.figures.plots import COLOURS, STYLE

Array = np.ndarray


@mpl.rc_context(STYLE)
def shares_over(panels: Mapping[str, Mapping[str, Float[Array, "k 4"]]], *, label: str = "share kept (%)") -> Figure:
    """Shares of rollouts over the size of a disturbance: a panel each, with intervals.

    Args:
        panels: what is varied, with its unit, to name to rows of its value and the share, its lower and upper bound.
        label: of the vertical axis.

    Raises:
        InputError: nothing to draw.
    """
    if not panels or not all(len(rows) for curves in panels.values() for rows in curves.values()):
        raise InputError("no shares to draw; give each panel at least one curve with a row")
    columns = min(len(panels), 2)
    lines = -(-len(panels) // columns)
    figure = Figure(figsize=(3.4 * columns, 0.6 + 2.3 * lines), layout="constrained")
    grid = figure.subplots(lines, columns, sharey=True, squeeze=False).ravel()
    known = {}
    for axes, (varied, curves) in zip(grid, panels.items(), strict=False):
        for (name, rows), colour in zip(curves.items(), itertools.cycle(COLOURS), strict=False):
            value, share, low, high = rows[np.argsort(rows[:, 0])].T
            axes.fill_between(value, 100 * low, 100 * high, color=colour, alpha=0.15, linewidth=0)
            (known[name],) = axes.plot(value, 100 * share, color=colour, marker="o", markersize=3.5, label=name)
        axes.set_ylim(0, 102)
        axes.set_xlabel(varied)
        axes.grid(visible=True)
        axes.tick_params(length=0)
    for axes in grid[len(panels) :]:
        axes.set_visible(False)
    figure.supylabel(label, fontsize=10)
    figure.legend(known.values(), known, loc="outside upper left", ncols=len(known), handlelength=1.6)
    return figure
