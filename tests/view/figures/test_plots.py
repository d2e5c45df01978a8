import re
from xml.etree import ElementTree

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from matplotlib.path import Path
from PIL import Image

from mjx_hand.errors import InputError
from mjx_hand.view.figures import plots

RANDOM = np.random.default_rng(0)


def line(figure: Figure, label: str) -> np.ndarray:
    (found,) = [entry for entry in figure.axes[0].lines if entry.get_label() == label]
    return np.asarray(found.get_xydata())


def corners(path: Path) -> np.ndarray:
    return np.asarray(path.vertices)


def test_learning_curve_shows_the_mean_of_the_seeds_and_the_baseline():
    steps, values = np.array([1e5, 2e5, 3e5]), np.array([[0.1, 0.5, 0.9], [0.3, 0.5, 0.7]])
    figure = plots.learning_curve(steps, values, baseline=0.25)
    shown = line(figure, "policy, mean of 2 seeds")
    np.testing.assert_allclose(shown, [[1e5, 0.2], [2e5, 0.5], [3e5, 0.8]])
    band = corners(figure.axes[0].collections[0].get_paths()[0])
    for corner in ([1e5, 0.1], [1e5, 0.3], [3e5, 0.7], [3e5, 0.9]):
        assert np.isclose(band, corner).all(axis=1).any()
    np.testing.assert_allclose(line(figure, "zero residual")[:, 1], 0.25)


def test_one_seed_is_one_line():
    figure = plots.learning_curve(np.array([1e5, 2e5]), np.array([0.1, 0.5]))
    assert len(figure.axes[0].lines) == 1
    assert not figure.axes[0].collections


def test_error_over_time_leaves_out_what_is_not_counted():
    values = RANDOM.random((30, 20))
    counted = np.arange(20) < np.where(np.arange(30) < 15, 10, 16)[:, None]
    wild = np.where(counted, values, 1e9)
    figure = plots.error_over_time(50.0, {"policy": (wild, counted)}, limit=3.0)
    expected = [np.median(values[counted[:, k], k]) for k in range(16)]
    np.testing.assert_allclose(line(figure, "policy"), np.c_[np.arange(16) / 50, expected])
    lowest, highest = (
        f([corners(c.get_paths()[0])[:, 1] for c in figure.axes[0].collections]) for f in (np.min, np.max)
    )
    assert lowest >= values.min()
    assert highest <= values.max()


def test_joint_errors_are_means_with_whiskers_to_the_95th_percentile():
    errors = {"a": RANDOM.random((100, 3)), "b": RANDOM.random((100, 3))}
    figure = plots.joint_errors(["index1", "index2", "thumb1"], errors)
    heights = [bar.get_height() for bar in figure.axes[0].patches if isinstance(bar, Rectangle)]
    np.testing.assert_allclose(heights, np.r_[errors["a"].mean(axis=0), errors["b"].mean(axis=0)])
    tops = [corners(whisker)[1, 1] for whisker in figure.axes[0].collections[0].get_paths()]
    np.testing.assert_allclose(tops, np.quantile(errors["a"], 0.95, axis=0))


def test_retarget_errors_name_their_medians():
    figure = plots.retarget_errors({"index tip": np.array([1.0, 2.0, 9.0]), "thumb tip": np.array([3.0])})
    assert [label.get_text() for label in figure.axes[0].get_yticklabels()] == ["index tip  2.00", "thumb tip  3.00"]


def test_throughput_shows_medians_in_order_with_the_spread_of_runs():
    rows = np.array([[64, 9e3, 8e3, 1e4], [1, 2e3, 1e3, 3e3]])
    figure = plots.throughput(
        {"pinch": {"native": rows, "mjx": rows[:1] / 10}, "power": {"mjx": rows}}, label="steps/s"
    )
    np.testing.assert_allclose(line(figure, "native"), [[1, 2e3], [64, 9e3]])
    assert [axes.get_title("left") for axes in figure.axes] == ["pinch", "power"]
    mjx = [[one.get_color() for one in axes.lines if one.get_label() == "mjx"] for axes in figure.axes]
    assert mjx[0] == mjx[1]
    spread = [corners(path) for path in figure.axes[0].collections[0].get_paths()]
    np.testing.assert_allclose(spread, [[[1, 1e3], [1, 3e3]], [[64, 8e3], [64, 1e4]]])
    assert figure.axes[0].get_xscale() == figure.axes[0].get_yscale() == "log"


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: plots.learning_curve(np.zeros(0), np.zeros(0)), "0 values for 0 steps"),
        (lambda: plots.learning_curve(np.zeros(2), np.zeros((3, 4))), "4 values for 2 steps"),
        (lambda: plots.error_over_time(50.0, {"p": (np.ones((2, 3)), np.zeros((2, 3), bool))}), "'p' have no counted"),
        (lambda: plots.joint_errors(["a"], {}), "at least one method"),
        (lambda: plots.joint_errors(["a"], {"m": np.ones((4, 2))}), "2 columns for 1 joints"),
        (lambda: plots.retarget_errors({"tip": np.zeros(0)}), "no errors to draw for tip"),
        (lambda: plots.throughput({"p": {"native": np.zeros((0, 4))}}, label="steps/s"), "no rates to draw for native"),
    ],
)
def test_bad_input_is_refused(make, message):
    with pytest.raises(InputError, match=message):
        make()


def test_saved_figures_are_what_their_suffix_says(tmp_path):
    figure = plots.retarget_errors({"index tip": np.arange(9.0)})
    for suffix in ("png", "svg", "pdf"):
        plots.save_figure(figure, tmp_path / f"a.{suffix}")
    with Image.open(tmp_path / "a.png") as picture:
        assert picture.format == "PNG"
        assert picture.getpixel((0, 0)) == (255, 255, 255, 255)
    assert ElementTree.parse(tmp_path / "a.svg").getroot().tag.endswith("svg")
    assert (tmp_path / "a.pdf").read_bytes().startswith(b"%PDF")
    with pytest.raises(InputError, match=r"\.png, \.svg or \.pdf"):
        plots.save_figure(figure, tmp_path / "a.gif")
    assert {path.name for path in tmp_path.iterdir()} == {"a.png", "a.svg", "a.pdf"}


def test_inline_svg_takes_the_pages_colour_and_keeps_its_ids_apart():
    figure = plots.learning_curve(np.array([1e5, 2e5]), np.array([0.1, 0.5]), baseline=0.2)
    one, two = plots.inline_svg(figure, "one"), plots.inline_svg(figure, "two")
    assert one == plots.inline_svg(figure, "one")
    assert "currentColor" in one
    assert "#000000" not in one.upper().replace("STROKE: #000000", "")  # every text and line has a colour of the style
    ids, other = set(re.findall(r'\bid="([^"]+)"', one)), set(re.findall(r'\bid="([^"]+)"', two))
    assert not ids & other
    used = set(re.findall(r"url\(#([^)]+)\)", one)) | set(re.findall(r'href="#([^"]+)"', one))
    assert used
    assert used <= ids
    ElementTree.fromstring(one)
