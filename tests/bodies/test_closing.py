"""Which joints flex follows from their ranges; of the human hand their names tell it, of a robot its drawing."""

import numpy as np

import mjx_hand
from mjx_hand.bodies.closing import closing_directions
from mjx_hand.bodies.human_body import human_body
from mjx_hand.hand.load import load_hand
from mjx_hand.rigid.build import build_rigid_hand
from tests.robots.urdfs import urdf_of


def test_human_fingers_flex_and_spread():
    body = human_body(build_rigid_hand(load_hand(), np.zeros(10)))
    flexes = [1.0 if name.endswith("_flexion") else 0.0 for name in body.joints]
    np.testing.assert_array_equal(closing_directions(body), flexes)


def test_allegros_fingers_do():
    assert urdf_of("allegro").is_file()  # skips without the package that carries it
    body = mjx_hand.robot_body("allegro")
    spreads = {"joint_0.0", "joint_4.0", "joint_8.0"}  # the fingers' own axes, as Wonik draws them; all else flexes
    assert {name for name, way in zip(body.joints, closing_directions(body), strict=True) if way == 0} == spreads
    assert set(closing_directions(body)) == {0.0, 1.0}
