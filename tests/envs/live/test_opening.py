"""Fingers that their owner opens, and what is none: trembling, and an object that slips."""

import numpy as np
import pytest

from envs.live.twin.opening import Opening
from envs.live.twin.pose import HandPose
from envs.live.twin.tabletop import demonstration_table
from envs.live.twin.world import World
from mjx_hand.hand.joints import FINGERS

SECONDS = 0.02


@pytest.fixture
def watched(demonstrations, hands):
    """A world with the object beside the hand, its fingers half closed, and who watches them."""
    table = demonstration_table(demonstrations[0])
    pose = HandPose(table.pose[:3] + np.array([0.1, 0.16, 0]), np.array([1.0, 0, 0, 0]), np.full(20, 0.3))
    world = World(hands[0], table, pose)
    return world, Opening(world.model), pose.angles


def watch(watched, angles, holds: bool, seconds: float) -> None:
    world, opening, _ = watched
    for _ in range(round(seconds / SECONDS)):
        opening.watch(angles, world.data, holds, SECONDS)


def index_opened(angles: np.ndarray) -> np.ndarray:
    opened = angles.copy().reshape(5, 4)
    opened[FINGERS.index("index"), 1:] = -0.3
    return opened.ravel()


@pytest.mark.parametrize("holds", [False, True])
def test_a_finger_that_opens_loses_its_help_and_gets_it_back(watched, holds):
    _, opening, angles = watched
    watch(watched, angles, holds=False, seconds=0.5)
    watch(watched, angles, holds, 0.5)
    assert not opening.open.any()
    watch(watched, index_opened(angles), holds, 1.0)
    of_index = np.repeat(np.array(FINGERS) == "index", 4)
    np.testing.assert_array_equal(opening.open, of_index)
    np.testing.assert_allclose(opening.share, np.where(of_index, 0, 1), atol=0.02)
    watch(watched, angles, holds, 1.0)
    assert not opening.open.any()
    np.testing.assert_allclose(opening.share, 1, atol=0.02)


def test_an_object_that_slips_in_a_hand_is_no_finger_that_opens(watched):
    """While the hand holds, it is where the object was taken that counts."""
    world, opening, angles = watched
    watch(watched, angles, holds=False, seconds=0.5)
    away = world.data.qpos[26:29].copy()
    for k in range(60):
        world.data.qpos[26:29] = away - [0, 0.0005 * k, 0]
        watch(watched, angles, holds=True, seconds=SECONDS)
    assert not opening.open.any()
    for k in range(60):
        world.data.qpos[26:29] = away - [0, 0.03 + 0.0005 * k, 0]
        watch(watched, angles, holds=False, seconds=SECONDS)
    assert opening.open.all()


def test_trembling_opens_nothing(watched):
    """Tips that a tracker has seven millimetres off, from frame to frame."""
    _, opening, angles = watched
    watch(watched, angles, holds=False, seconds=0.5)
    rng = np.random.default_rng(0)
    for _ in range(500):
        watch(watched, angles + 0.08 * rng.normal(size=20), holds=True, seconds=SECONDS)
        assert not opening.open.any()


def test_a_hand_that_moves_opens_nothing(watched):
    """The engine leaves places a step behind the state: of a quick wrist they are where it was."""
    world, opening, angles = watched
    watch(watched, angles, holds=False, seconds=0.5)
    world.data.qpos[0] += 0.05
    watch(watched, angles, holds=True, seconds=1.0)
    assert not opening.open.any()
