"""Every example runs as it stands, and leaves and says what it promises."""

import re
import runpy
import sys
from pathlib import Path

import mujoco
import numpy as np
import pytest
from PIL import Image

from mjx_hand.motion import load_joint_motion
from tests.robots.urdfs import urdf_of

ROOT = Path(__file__).resolve().parent.parent
EXAMPLES = sorted((ROOT / "examples").glob("[0-9]*.py"))


def run(name: str, *arguments: str | Path, monkeypatch: pytest.MonkeyPatch, folder: Path) -> None:
    """Run one example as `python examples/NAME` does, in an empty folder."""
    (path,) = (ROOT / "examples").glob(f"{name}_*.py")
    monkeypatch.chdir(folder)
    monkeypatch.setattr(sys, "argv", [str(path), *map(str, arguments)])
    runpy.run_path(str(path), run_name="__main__")


def number(pattern: str, text: str) -> float:
    found = re.search(pattern, text)
    assert found, text
    return float(found[1].replace(",", ""))


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_an_example_is_short_and_says_how_to_run_it(path: Path):
    text = path.read_text()
    most = {"05": 130, "09": 100}.get(path.name[:2], 80)  # a learner of about 100 lines; a player without the library
    assert 20 <= len(text.splitlines()) <= most
    assert f"python examples/{path.name}" in text.split('"""')[1]


def test_numbers_are_given_once():
    numbers = [path.stem.split("_")[0] for path in EXAMPLES]
    assert len(set(numbers)) == len(numbers)


def test_01_writes_a_hand_that_mujoco_reads(tmp_path, monkeypatch, capsys):
    run("01", monkeypatch=monkeypatch, folder=tmp_path)
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "outputs/examples/my_hand/right_hand.xml"))
    assert model.nq == 20
    said = capsys.readouterr().out
    # A person a standard deviation larger: mass and reach printed are those of two different hands.
    assert number(r"mine: (\d+) g", said) > number(r"mean: (\d+) g", said) > 200
    assert number(r"(-?[\d.]+) degrees per hinge", said) == pytest.approx(
        np.rad2deg(model.jnt_range[:, 1]).mean() / 2, rel=0.15
    )


@pytest.mark.slow
def test_02_finds_the_motion_under_the_markers(tmp_path, monkeypatch, capsys):
    run("02", monkeypatch=monkeypatch, folder=tmp_path)
    said = capsys.readouterr().out
    assert number(r"([\d.]+) mm RMS", said) < 1.5
    assert number(r"off by ([\d.]+) degrees", said) < 5
    with Image.open(tmp_path / "outputs/examples/markers/fit.png") as picture:
        assert len(np.unique(np.asarray(picture.convert("L")))) > 50


@pytest.mark.slow
def test_03_functional_axes_follow_more_closely(tmp_path, monkeypatch, capsys):
    run("03", monkeypatch=monkeypatch, folder=tmp_path)
    said = capsys.readouterr().out
    errors = [number(rf"{axes} axes: rotation ([\d.]+)", said) for axes in ("anatomical", "functional")]
    assert 0 < errors[1] < errors[0] < 3
    folder = tmp_path / "outputs/examples/retarget"
    assert load_joint_motion(folder / "functional.npz").angles.shape == (480, 20)
    assert (folder / "errors.png").is_file()


@pytest.mark.slow
def test_04_moves_every_finger_of_a_robot_hand(tmp_path, monkeypatch, capsys):
    run("04", urdf_of("allegro"), monkeypatch=monkeypatch, folder=tmp_path)
    said = capsys.readouterr().out
    spans = [float(span) for span in re.findall(r"moved through +([\d.]+)", said)]
    assert len(spans) == 16
    assert np.median(spans) > 20


def test_04_says_what_to_install(tmp_path, monkeypatch):
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    with pytest.raises(SystemExit, match="pip install dexi-rs"):
        run("04", monkeypatch=monkeypatch, folder=tmp_path)


def test_06_the_object_comes_to_rest_on_the_table(tmp_path, monkeypatch, capsys):
    run("06", monkeypatch=monkeypatch, folder=tmp_path)
    said = capsys.readouterr().out
    assert 1 < number(r"became (\d+) convex", said) <= 16
    assert abs(number(r"bottom is (-?[\d.]+) mm", said)) < 3
    assert number(r", ([\d.]+) degrees tilted", said) < 10


@pytest.mark.slow
def test_07_the_policy_that_comes_along_succeeds(tmp_path, monkeypatch, capsys):
    run("07", monkeypatch=monkeypatch, folder=tmp_path)
    said = capsys.readouterr().out
    assert number(r"manip_trans_object +([\d.]+)", said) == 1
    assert number(r"tracking_error_cm +([\d.]+)", said) < 1
    assert (tmp_path / "outputs/examples/pinch.mp4").stat().st_size > 10_000


def test_08_projection_finds_the_angles(tmp_path, monkeypatch, capsys):
    run("08", "2000", monkeypatch=monkeypatch, folder=tmp_path)
    said = capsys.readouterr().out
    assert "2,000 poses in" in said
    assert number(r"largest error: ([\d.]+) degrees", said) < 0.1
