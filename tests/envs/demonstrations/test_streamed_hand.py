"""A demonstration that is streamed is the same act, late, with a tracker's trembling."""

import dataclasses

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from envs.demonstrations.dataset import make_set
from envs.demonstrations.load_set import PARTS, load_part
from envs.demonstrations.quality import check_streamed
from envs.demonstrations.set_settings import SetSettings, set_folder
from envs.demonstrations.streamed_hand import LATE, streamed_demonstration
from mjx_hand.errors import InputError
from mjx_hand.motion.demonstration import load_demonstration, save_demonstration
from mjx_hand.motion.mirror import mirrored_demonstration
from tests.envs.conftest import SETTINGS


@pytest.fixture(scope="module")
def streamed(demonstrations):
    return streamed_demonstration(demonstrations[0], seed=0)


def test_hand_and_object_are_late_together_and_by_what_the_tracker_is(demonstrations, streamed):
    shown, fps = demonstrations[0], demonstrations[0].motion.fps
    late = int(np.flatnonzero(np.any(np.diff(streamed.motion.wrist_position, axis=0), axis=1))[0])
    assert LATE < late / fps < LATE + 0.15
    for was, now in (
        (shown.object_pose, streamed.object_pose),
        (shown.motion.wrist_position, streamed.motion.wrist_position),
        (shown.motion.angles, streamed.motion.angles),
    ):
        np.testing.assert_array_equal(now[late:], was[: len(was) - late])
        np.testing.assert_array_equal(now[:late], np.repeat(was[:1], late, axis=0))


def test_the_tracked_hand_is_near_the_moving_one_and_trembles(streamed):
    place, turn, angles = np.split(streamed.tracked, [3, 7], axis=1)
    off = np.linalg.norm(place - streamed.motion.wrist_position, axis=1)
    assert 2e-4 < off.mean() < 4e-3
    turned = Rotation.from_quat(turn, scalar_first=True).inv() * Rotation.from_quat(
        streamed.motion.wrist_quaternion, scalar_first=True
    )
    assert np.degrees(turned.magnitude().mean()) < 3
    assert 0.005 < np.abs(angles - streamed.motion.angles).mean() < 0.15


def test_a_seed_is_a_tracker_of_its_own(demonstrations, streamed):
    np.testing.assert_array_equal(streamed_demonstration(demonstrations[0], seed=0).tracked, streamed.tracked)
    assert np.any(streamed_demonstration(demonstrations[0], seed=1).tracked != streamed.tracked)


def test_a_file_keeps_it_and_two_mirrors_undo_each_other(tmp_path, streamed):
    save_demonstration(streamed, tmp_path / "000.npz")
    np.testing.assert_array_equal(load_demonstration(tmp_path / "000.npz").tracked, streamed.tracked)
    mirrored = mirrored_demonstration(streamed)
    assert mirrored.tracked is not None
    assert np.sign(mirrored.tracked[0, 0]) == -np.sign(streamed.tracked[0, 0])
    np.testing.assert_array_equal(mirrored_demonstration(mirrored).tracked, streamed.tracked)


def test_a_streamed_set_is_the_recorded_one_with_what_trackers_of_their_own_saw(set_root, set_path, capsys):
    settings = dataclasses.replace(SETTINGS, streamed=True)
    folder = make_set(settings, set_root)
    assert folder not in (set_path, set_folder(dataclasses.replace(settings, seed=4), set_root))
    for part in PARTS:
        for recorded, seen in zip(load_part(set_path, part), load_part(folder, part), strict=True):
            assert recorded.tracked is None
            assert seen.tracked is not None
            np.testing.assert_array_equal(seen.motion.angles[0], recorded.motion.angles[0])
    quality = check_streamed(folder, "train")
    assert len(quality.seconds) == 2
    assert np.all(quality.wrist_error < 5e-3)
    with pytest.raises(InputError, match="not streamed"):
        check_streamed(set_path, "train")


def test_recordings_and_given_folders_are_not_streamed():
    with pytest.raises(InputError, match=r"data\.streamed is true"):
        SetSettings("given", folder="x", streamed=True)
