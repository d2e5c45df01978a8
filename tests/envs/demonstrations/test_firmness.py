import dataclasses
import itertools

import numpy as np
import pytest

from envs.demonstrations.firmness import firmest
from envs.demonstrations.holding import Holding
from envs.demonstrations.posture import solve_postures
from envs.grasps import grasp_type
from mjx_hand.errors import InputError
from mjx_hand.hand.load import load_hand
from mjx_hand.motion.demonstration import ObjectDescription
from mjx_hand.rigid.build import build_rigid_hand

HALF = 0.017


@pytest.fixture(scope="module")
def hand():
    return build_rigid_hand(load_hand())


@pytest.fixture(scope="module")
def cube() -> ObjectDescription:
    corners = HALF * np.array(list(itertools.product((-1.0, 1.0), repeat=3)))
    return ObjectDescription(kind="mesh", size=np.full(3, HALF), mass=0.1, friction=0.9, hulls=corners[None])


@pytest.fixture(scope="module")
def pinched(hand) -> tuple[Holding, np.ndarray]:
    """A cube between thumb, index and middle finger, and how the hand is turned then."""
    posture = solve_postures(grasp_type("pinch"), [hand], np.full((1, 3), HALF))
    rotation = np.asarray(posture.rotation[0], float)
    angles, position = np.asarray(posture.angles[0], float), np.asarray(posture.position[0], float)
    return Holding(angles=angles, rotation=rotation.T, position=-rotation.T @ position), rotation


def test_the_holding_that_holds_is_chosen_before_likelier_ones(hand, cube, pinched):
    good, wrist = pinched
    beside = dataclasses.replace(good, position=good.position + wrist.T @ [0.0, 0.0, -0.03])  # below the finger tips
    assert firmest([beside, good], hand, cube, wrist) is good


def test_of_two_that_hold_the_likelier_is_chosen(hand, cube, pinched):
    good, wrist = pinched
    same = dataclasses.replace(good, angles=good.angles.copy())
    assert firmest([good, same], hand, cube, wrist) is good


def test_an_object_too_heavy_for_every_one_is_refused(hand, cube, pinched):
    good, wrist = pinched
    heavy = dataclasses.replace(cube, mass=20.0)
    with pytest.raises(InputError, match=r"no posture .* holds the object of 20 kg and friction 0.9 .* lighter object"):
        firmest([good], hand, heavy, wrist)
