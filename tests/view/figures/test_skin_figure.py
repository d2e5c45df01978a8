"""The picture of rigid against blended skin: what is nearer hides what is behind, and colour follows the error."""

import io

import matplotlib.image as mpimg
import numpy as np
import trimesh

from mjx_hand.view.figures.skin_figure import skin_error_figure


def ball(centre: tuple[float, float, float], radius: float) -> tuple[np.ndarray, np.ndarray]:
    made = trimesh.creation.icosphere(subdivisions=2, radius=radius)
    return np.asarray(made.vertices) + centre, np.asarray(made.faces)


def pixels(figure) -> np.ndarray:
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=60)
    buffer.seek(0)
    return mpimg.imread(buffer)[..., :3]


def test_a_row_a_posture_and_views_named():
    mesh = ball((0, 0, 0), 0.05)
    figure = skin_error_figure(["fist", "spread"], [[mesh], [mesh]], [mesh, mesh], [np.zeros(len(mesh[0]))] * 2)
    titles = [axes.get_title() for axes in figure.axes if axes.get_title()]
    assert titles == [f"{view}: {kind}" for view in ("back", "palm", "thumb side") for kind in ("rigid", "error")]
    texts = [text.get_text() for axes in figure.axes for text in axes.texts]
    assert texts == ["fist", "spread"]


def test_colour_follows_the_error():
    mesh = ball((0, 0, 0), 0.05)
    none, large = (
        pixels(skin_error_figure(["p"], [[mesh]], [mesh], [np.full(len(mesh[0]), error)])) for error in (0.0, 9.5e-3)
    )
    changed = np.abs(none - large).max(axis=-1) > 0.1
    assert 0.02 < changed.mean() < 0.4
    assert large[changed][:, 0].mean() > none[changed][:, 0].mean() + 0.2  # red where large


def test_what_is_nearer_hides_what_is_behind():
    """From the back of the hand (+y) a ball in front hides one behind it: the error of the hidden one does not show."""
    near, far = ball((0, 0.2, 0.05), 0.05), ball((0, 0, 0), 0.02)
    vertices = np.concatenate([near[0], far[0]])
    both = (vertices, np.concatenate([near[1], far[1] + len(near[0])]))
    error = np.concatenate([np.zeros(len(near[0])), np.full(len(far[0]), 9.5e-3)])
    figure = skin_error_figure(["p"], [[near, far]], [both], [error])
    back = next(axes for axes in figure.axes if axes.get_title() == "back: error")
    for other in figure.axes:
        if other is not back:
            other.set_visible(False)
    shown = pixels(figure)
    red = (shown[..., 0] > 0.5) & (shown[..., 1] < 0.3) & (shown[..., 2] < 0.3)
    assert not red.any()
