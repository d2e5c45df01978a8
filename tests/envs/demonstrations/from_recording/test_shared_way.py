"""A hand and an object that were seen to drift apart while one carried the other."""

import itertools

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from envs.demonstrations.from_recording.observed import ObservedSequence
from envs.demonstrations.from_recording.shared_way import shared_way

FRAMES, LIFTED, FPS = 150, 60, 50.0
CORNERS = 0.03 * np.array(list(itertools.product((-1.0, 1.0), repeat=3)))
WRIST = np.array([0.02, -0.12, 0.03])  # beside the object


def carried(spin: np.ndarray | float = 0.0) -> ObservedSequence:
    """A cube goes up and comes down again, the wrist beside it."""
    times = np.arange(FRAMES) / FPS
    share = np.clip((np.arange(FRAMES) - LIFTED) / (FRAMES - 1 - LIFTED), 0, 1)
    away = np.sin(np.pi * share) ** 2
    position = np.stack([0 * times, 0 * times, 0.03 + 0.1 * away], axis=1)
    turn = Rotation.from_rotvec((spin * np.ones(FRAMES))[:, None] * [0.0, 0.0, 1.0]).as_matrix()
    return ObservedSequence(
        times=times,
        angles=np.zeros((FRAMES, 20)),
        hand_rotation=np.tile(np.eye(3), (FRAMES, 1, 1)),
        hand_position=position + WRIST,
        rotation=turn,
        position=position,
    )


@pytest.mark.parametrize("rests", [True, False])
def test_each_takes_half_of_what_they_disagree_by_and_a_rest_none(rests):
    seen = carried()
    late = np.arange(FRAMES) > 110  # from then on the hand is seen 4 cm further off than it was
    seen.hand_position[late] += [0.0, -0.04, 0.0]
    found, wrist = shared_way(seen, LIFTED, CORNERS, rests=rests, spun=False)
    np.testing.assert_allclose(wrist, WRIST, atol=1e-3)  # as in most of the frames
    moved = found.position - seen.position
    np.testing.assert_allclose(moved[:LIFTED], 0, atol=1e-12)
    np.testing.assert_allclose(moved[80:110], 0, atol=1e-3)
    np.testing.assert_allclose(moved[115:125], np.tile([0.0, -0.02, 0.0], (10, 1)), atol=1e-3)
    np.testing.assert_allclose(moved[-1], [0.0, 0.0 if rests else -0.02, 0.0], atol=1e-3)


def test_what_is_put_lower_does_not_go_through_the_table():
    seen = carried()
    seen.hand_position[110:, 2] -= 0.2
    found, _ = shared_way(seen, LIFTED, CORNERS, rests=False, spun=False)
    lowest = found.position[:, 2] + (found.rotation[:, 2] @ CORNERS.T).min(axis=1)
    assert lowest.min() > -1e-9
    assert (found.position[110:, 2] < seen.position[110:, 2] - 1e-6).any()


def test_a_turn_that_was_not_seen_is_the_hands_and_one_that_was_seen_stays():
    spin = np.clip((np.arange(FRAMES) - LIFTED) / 60, 0, 1)
    seen = carried(spin)
    found, wrist = shared_way(seen, LIFTED, CORNERS, rests=False, spun=True)
    beside = np.einsum("tji,tj->ti", found.rotation, found.hand_position - found.position)
    off = np.linalg.norm(beside - wrist, axis=1)[LIFTED + 25 :]
    before = np.einsum("tji,tj->ti", seen.rotation, seen.hand_position - seen.position)
    assert off.max() < 0.02 < 0.05 < np.ptp(before[LIFTED + 25 :], axis=0).max()
    kept, _ = shared_way(seen, LIFTED, CORNERS, rests=False, spun=False)
    np.testing.assert_array_equal(kept.rotation, seen.rotation)
