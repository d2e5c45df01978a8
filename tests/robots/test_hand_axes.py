"""Which way hands point and which side they are, told by their links; descriptions that do not go with them."""

import numpy as np
import pytest

from mjx_hand.errors import InputError
from mjx_hand.robots.hand_axes import check_goes_with, hand_axes
from mjx_hand.robots.robot_hand import load_robot
from tests.robots import little_hand
from tests.robots.urdfs import FOLDERS, urdf_of

OTHER = {"right": "left", "left": "right"}


@pytest.mark.parametrize("side", ["right", "left"])
@pytest.mark.parametrize("robot", FOLDERS)
def test_every_known_hand_goes_with_its_own_side_alone(robot, side):
    description = load_robot("allegro_left" if (robot, side) == ("allegro", "left") else robot)
    check_goes_with(description, urdf_of(robot, side), side)
    with pytest.raises(InputError, match=f"is a {side} hand; give a {OTHER[side]} hand's URDF"):
        check_goes_with(description, urdf_of(robot, side), OTHER[side])


@pytest.mark.parametrize("side", ["right", "left"])
def test_directions_are_measured(tmp_path, side):
    urdf, description = little_hand.write(tmp_path, side=side, arm=True)
    found = hand_axes(load_robot(description), urdf)
    assert found.fingers is not None
    assert found.palmar is not None
    assert np.degrees(np.arccos(found.fingers @ [0, 0, 1])) < 25
    assert np.degrees(np.arccos(found.palmar @ [1, 0, 0])) < 25
    assert found.side == side


@pytest.mark.parametrize(
    ("directions", "name"),
    [
        ({"palmar": (-1, 0, 0)}, "palmar"),
        ({"palmar": (0, 1, 0)}, "palmar"),
        ({"fingers": (0, 0, -1)}, "fingers"),
        ({"fingers": (1, 0, 0), "palmar": (0, 0, 1)}, "fingers"),
    ],
)
def test_directions_that_are_not_the_links_are_refused(tmp_path, directions, name):
    urdf, description = little_hand.write(tmp_path, **directions)
    with pytest.raises(InputError, match=f"little: {name} is .* degrees from what the links of") as caught:
        check_goes_with(load_robot(description), urdf, "right")
    assert "\n" not in str(caught.value)


def test_the_mia_hand(recordings, tmp_path):
    """Three fingers that count, along y, palm to z: a right one (https://github.com/Prensilia-srl/mia_hand_ros_pkgs)."""
    urdf, path = recordings / "robots/mia_hand.urdf", tmp_path / "mia.yaml"
    if not urdf.is_file():
        pytest.skip(f"no {urdf}")
    tips = "".join(f"  {digit}_sensor: {digit}_tip\n" for digit in ("thumb", "index", "middle"))
    path.write_text(f"palm: palm\nscaling: 1.0\nfingers: [0, 1, 0]\npalmar: [0, 0, 1]\ntips:\n{tips}")
    check_goes_with(load_robot(path), urdf, "right")
    with pytest.raises(InputError, match="is a right hand"):
        check_goes_with(load_robot(path), urdf, "left")
    path.write_text(path.read_text().replace("[0, 1, 0]", "[0, 0, -1]").replace("[0, 0, 1]", "[1, 0, 0]"))
    with pytest.raises(InputError, match="fingers is"):
        check_goes_with(load_robot(path), urdf, "right")
