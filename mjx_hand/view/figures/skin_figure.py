"""A picture of where rigid links and blended skin part: the rigid hand, and the skin coloured by the error."""

from collections.abc import Sequence

import matplotlib as mpl
import numpy as np
from jaxtyping import Float, Int
from matplotlib import cm, colors
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure

from mjx_hand.view.figures.plots import STYLE

Mesh = tuple[Float[np.ndarray, "_ 3"], Int[np.ndarray, "_ 3"]]

_SKIN = np.array([0.86, 0.66, 0.55])
# From where one looks, and what is up, in the hand's frame: fingers -x (+x for a left hand), back +y, thumb side +z.
_VIEWS = {
    "back": ((0.0, 1.0, 0.25), (0.0, 0.0, 1.0)),
    "palm": ((0.0, -1.0, 0.25), (0.0, 0.0, 1.0)),
    "thumb side": ((-0.35, 0.25, 1.0), (0.0, 1.0, 0.0)),
}
_LIGHT = np.array([-0.35, 0.55, 0.75])  # to the right-hand side, up and towards the camera: (right, up, near)
_LARGEST = 10.0  # mm: the end of the colour scale


@mpl.rc_context(STYLE)
def skin_error_figure(
    names: Sequence[str],
    rigid: Sequence[Sequence[Mesh]],
    soft: Sequence[Mesh],
    errors: Sequence[Float[np.ndarray, "_"]],
) -> Figure:
    """One row per posture: the rigid hand and the blended skin, coloured by its distance, from three sides.

    Args:
        names: of the postures.
        rigid: each posture's segments (m, hand frame).
        soft: each posture's blended skin (m, hand frame).
        errors: each posture's distance (m) at the vertices of `soft`.
    """
    columns = 2 * len(_VIEWS)
    figure = Figure(figsize=(2.3 * columns, 2.1 * len(names) + 0.5), layout="constrained")
    grid = np.atleast_2d(figure.subplots(len(names), columns, squeeze=False))
    scale = cm.ScalarMappable(colors.Normalize(0, _LARGEST), "turbo")
    for axes, title in zip(grid[0], [f"{view}: {kind}" for view in _VIEWS for kind in ("rigid", "error")], strict=True):
        axes.set_title(title)
    for row, name, segments, mesh, error in zip(grid, names, rigid, soft, errors, strict=True):
        shades = scale.to_rgba(1e3 * error[mesh[1]].mean(axis=1))[:, :3]
        pair = [(segments, [_SKIN] * len(segments)), ([mesh], [shades])]
        for k, (way, up) in enumerate(_VIEWS.values()):
            for axes, (meshes, paints) in zip(row[2 * k : 2 * k + 2], pair, strict=True):
                _draw(axes, meshes, paints, np.array(way), np.array(up))
        row[0].text(-0.02, 0.5, name, rotation=90, transform=row[0].transAxes, ha="right", va="center")
    bar = figure.colorbar(scale, ax=grid, shrink=0.6, extend="max", pad=0.01)
    bar.set_label("distance from the blended skin (mm)")
    return figure


def _draw(axes: Axes, meshes: Sequence[Mesh], paints: Sequence[np.ndarray], way: np.ndarray, up: np.ndarray) -> None:
    """Triangles from the farthest to the nearest, those that face away left out."""
    near = way / np.linalg.norm(way)
    right = np.cross(up, near)
    right /= np.linalg.norm(right)
    view = np.stack([right, np.cross(near, right), near])
    corners = np.concatenate([vertices[faces] for vertices, faces in meshes]) @ view.T
    paint = np.concatenate([np.broadcast_to(p, (len(faces), 3)) for p, (_, faces) in zip(paints, meshes, strict=True)])
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1), 1e-15)[:, None]
    shade = 0.45 + 0.55 * np.clip(normal @ (_LIGHT / np.linalg.norm(_LIGHT)), 0, 1)
    order = np.argsort(corners[..., 2].mean(axis=1))
    order = order[normal[order, 2] > 0]
    seen = np.clip(paint * shade[:, None], 0, 1)[order]
    axes.add_collection(PolyCollection(list(corners[order, :, :2]), facecolors=seen, edgecolors=seen, linewidths=0.3))
    axes.set_aspect("equal", adjustable="datalim")
    axes.autoscale_view()
    axes.set_axis_off()
