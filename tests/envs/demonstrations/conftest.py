"""A person's pinch brought onto an Allegro hand, once."""

import pytest

from envs.demonstrations.on_robot.bring import on_robot
from mjx_hand.bodies.robot_body import robot_body
from tests.robots.urdfs import urdf_of


@pytest.fixture(scope="session")
def allegro():
    assert urdf_of("allegro").is_file()  # skips without the package that carries it
    return robot_body("allegro")


@pytest.fixture(scope="session")
def brought(demonstrations, hands, allegro):
    return on_robot(demonstrations[1], hands[1], allegro)
