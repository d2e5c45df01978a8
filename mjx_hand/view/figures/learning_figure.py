"""Learning curves of several seeds in one figure, one line per seed."""

import itertools
from collections.abc import Mapping

import matplotlib as mpl
import numpy as np
from jaxtyping import Float
from matplotlib import ticker
from matplotlib.figure import Figure

from mjx_hand.errors import InputError
from mjx_hand.view.figures.plots import COLOURS, STYLE


@mpl.rc_context(STYLE)
def learning_curves(
    curves: Mapping[str, Float[np.ndarray, "_ 2"]], title: str = "", level: float | None = None
) -> Figure:
    """Success over control steps. Unlike `plots.learning_curve`, seeds may stop early or be evaluated at other steps.

    Args:
        curves: name of a line to its rows of steps and success (0 to 1).
        title: above the figure.
        level: a share to draw as a level.

    Raises:
        InputError: nothing to draw, or a line without rows.
    """
    empty = [name for name, rows in curves.items() if len(rows) == 0]
    if empty or not curves:
        raise InputError(f"no evaluations to draw for {', '.join(empty) or 'any seed'}; give at least one each")
    figure = Figure(figsize=(5.2, 3.3), layout="constrained")
    axes = figure.subplots()
    axes.grid(visible=True)
    axes.tick_params(length=0)
    for (name, rows), colour in zip(curves.items(), itertools.cycle(COLOURS), strict=False):
        steps, success = rows.T
        axes.plot(steps, success, color=colour, marker="o" if len(rows) < 40 else "", markersize=3, label=name)
    if level is not None:
        axes.axhline(level, color=STYLE["text.color"], linestyle=(0, (1, 2)), linewidth=1.2, label=f"{100 * level:g} %")
    axes.set_xlabel("control steps")
    axes.xaxis.set_major_formatter(ticker.EngFormatter(sep=""))
    axes.set_ylim(-0.03, 1.03)
    axes.yaxis.set_major_formatter(ticker.PercentFormatter(1.0))
    axes.set_title(title, loc="left")
    figure.legend(loc="outside lower left", ncols=3, handlelength=1.6)  # curves may be anywhere in the axes
    return figure
