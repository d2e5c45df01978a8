"""A tiny demonstration set, made once, and what is built on it: hands, an environment, a robot's pinch, mid-grasp."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from envs.demonstrations.dataset import make_set
from envs.demonstrations.load_set import load_part
from envs.demonstrations.on_robot.bring import on_robot
from envs.demonstrations.set_settings import SetSettings
from envs.demonstrations.twin_hands import twins
from envs.tracking import TrackingEnv
from mjx_hand.bodies.robot_body import robot_body
from mjx_hand.motion.demonstration import Demonstration
from mjx_hand.rigid.rigid_hand import RigidHand
from tests.robots.urdfs import urdf_of

SETTINGS = SetSettings("pinch", people=2, heldout_people=1, trials=1, heldout_trials=1, seed=3)


@pytest.fixture(scope="session")
def set_root(tmp_path_factory) -> Path:
    return tmp_path_factory.mktemp("sets")


@pytest.fixture(scope="session")
def set_path(set_root) -> Path:
    return make_set(SETTINGS, set_root)


@pytest.fixture(scope="session")
def demonstrations(set_path) -> list[Demonstration]:
    return load_part(set_path, "train")


@pytest.fixture(scope="session")
def hands(demonstrations) -> Sequence[RigidHand]:
    return twins(demonstrations)


@pytest.fixture(scope="session")
def env(demonstrations, hands) -> TrackingEnv:
    return TrackingEnv(demonstrations, hands, "native")


@pytest.fixture(scope="session")
def lifted(env) -> list[np.ndarray]:
    """For each demonstration, the frames in which the object is at least 2 cm above its start."""
    pose, length = np.asarray(env.reference.object_pose), np.asarray(env.reference.length)
    return [np.flatnonzero(p[:n, 2] - p[0, 2] > 0.02) for p, n in zip(pose, length, strict=True)]


@pytest.fixture(scope="session")
def allegro():
    assert urdf_of("allegro").is_file()  # skips without the package that carries it
    return robot_body("allegro")


@pytest.fixture(scope="session")
def brought(demonstrations, hands, allegro):
    return on_robot(demonstrations[1], hands[1], allegro)
