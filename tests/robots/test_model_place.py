"""Where a description says that a robot's file is: beside it, in a package, or in a folder of the environment."""

import shutil

import pytest

from mjx_hand.bodies.robot_body import robot_body
from mjx_hand.errors import InputError
from mjx_hand.robots.model_place import model_place
from mjx_hand.robots.robot_hand import known_robots, load_robot
from mjx_hand.robots.robot_hand import urdf_of as file_of
from tests.robots.urdfs import urdf_of


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A folder `HANDS` with hand.urdf, and another hand.urdf beside the description."""
    (tmp_path / "hands").mkdir()
    for place in (tmp_path / "hands", tmp_path):
        (place / "hand.urdf").write_text("<robot/>")
    monkeypatch.delenv("HANDS", raising=False)
    return tmp_path


def test_the_first_place_that_counts_is_taken(folder, monkeypatch):
    given = {"urdf": ["$HANDS/hand.urdf", "hand.urdf"]}
    place = model_place(folder / "robot.yaml", given)
    assert place is not None
    assert place.found("robot") == folder / "hand.urdf"
    assert place.unset == ("HANDS",)
    monkeypatch.setenv("HANDS", str(folder / "hands"))
    place = model_place(folder / "robot.yaml", given)
    assert place is not None
    assert place.found("robot") == folder / "hands/hand.urdf"
    assert place.unset == ()
    assert model_place(folder / "robot.yaml", {}) is None


def test_a_folder_that_has_no_such_file_is_said_and_not_passed_over(folder, monkeypatch):
    """Whoever sets a variable means it: another file in its place would be a different robot, silently."""
    monkeypatch.setenv("HANDS", str(folder / "elsewhere"))
    place = model_place(folder / "robot.yaml", {"urdf": ["$HANDS/hand.urdf", "hand.urdf"]})
    assert place is not None
    with pytest.raises(InputError, match=r"robot: HANDS is '.*, which has no hand\.urdf; give the folder"):
        place.found("robot")


def test_a_variable_is_nothing_to_who_gives_the_file(folder, monkeypatch):
    monkeypatch.setenv("DEX_URDF", str(folder))
    assert file_of(load_robot("allegro"), folder / "hand.urdf") == folder / "hand.urdf"
    with pytest.raises(InputError, match="allegro: DEX_URDF is"):
        file_of(load_robot("allegro"))


def test_a_single_variable_that_is_not_set_is_named(folder):
    place = model_place(folder / "robot.yaml", {"urdf": "$HANDS/hand.urdf"})
    assert place is not None
    with pytest.raises(InputError, match=r"HANDS would name, which is not set; or set HANDS to a folder"):
        place.found("robot")


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"urdf": "$HANDS"}, r"give a path from this file on, PACKAGE:PATH, \$VARIABLE/PATH"),
        ({"urdf": "${HANDS}/hand.urdf"}, r"give a path from this file on, PACKAGE:PATH, \$VARIABLE/PATH"),
        ({"urdf": []}, "give a path from this file on, PACKAGE:PATH"),
        ({"urdf": ["hand.urdf", 3]}, "give a path from this file on, PACKAGE:PATH"),
        ({"urdf": ["hand.urdf", "other.urdf"]}, r"only its last place may be without a \$VARIABLE"),
        ({"urdf": "hand.urdf", "mjcf": "hand.xml"}, "has urdf and mjcf; give one of them"),
        ({"mjcf": "hand.urdf"}, "not an MJCF"),
    ],
)
def test_what_is_no_place_is_refused(folder, given, said):
    with pytest.raises(InputError, match=said):
        model_place(folder / "robot.yaml", given)


def test_a_package_that_is_not_installed_is_named_with_what_else_would_do(folder):
    place = model_place(folder / "robot.yaml", {"urdf": ["$HANDS/hand.urdf", "no_such_package:hand.urdf"]})
    assert place is not None
    with pytest.raises(InputError, match=r"pip install no-such-package, .*; or set HANDS to a folder that has it"):
        place.found("robot")


def test_descriptions_are_found_in_a_folder_of_dex_urdf(monkeypatch, tmp_path):
    """Its layout, with files of the wheel that carries the same URDFs; without the meshes the folder is asked for."""
    monkeypatch.delenv("DEX_URDF", raising=False)
    for robot in known_robots():
        side = "left" if robot.endswith("_left") else "right"
        source = urdf_of(robot.removesuffix("_left"), side)
        copy = tmp_path / "robots/hands" / source.parent.name / source.name
        copy.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(source, copy)
    with pytest.raises(InputError, match=r"'meshes/.*' of link .* is not there; .*; or set DEX_URDF to a folder"):
        robot_body("leap")
    monkeypatch.setenv("DEX_URDF", str(tmp_path))
    for robot in known_robots():
        place = load_robot(robot).place
        assert place is not None
        assert place.found(robot).is_relative_to(tmp_path)
    with pytest.raises(InputError, match=r"is not there; put it where the URDF says, beside the file$"):
        robot_body("leap")
