"""Keypoints to motion: known motions recovered, gaps and noise, real recordings, and what is refused."""

import numpy as np
import pytest

from mjx_hand.capture.keypoint_files.load_keypoints import load_keypoints
from mjx_hand.capture.keypoint_fit.fit import KeypointSettings, fit_keypoints
from mjx_hand.capture.keypoint_fit.smooth import fill_short_gaps, low_pass_keypoints
from mjx_hand.capture.keypoints.bone_lengths import lengths, median_lengths, shape_of_lengths
from mjx_hand.capture.keypoints.layouts import KEYPOINTS
from mjx_hand.capture.keypoints.recording import KeypointRecording
from mjx_hand.capture.keypoints.side import bend_towards_right, known_side
from mjx_hand.capture.keypoints.skeleton import rest_keypoints
from mjx_hand.errors import InputError
from mjx_hand.hand.load import load_hand
from mjx_hand.motion.resample import quaternion_matrices
from mjx_hand.pytree import replace
from tests.capture.keypoint_fit.test_rotations import angles_between
from tests.capture.keypoints.grips import FPS, FRAMES, grip, keypoints_of

SHAPE = np.array([1.5, -0.5, 0.4, 0.8, -0.6, 0, 0, 0, 0, 0])


def recorded(side: str = "right", shape: np.ndarray | None = None, said: str = "") -> KeypointRecording:
    return KeypointRecording(fps=FPS, positions=keypoints_of(grip(side, shape)), side=said, source="made")


@pytest.mark.parametrize("side", ["right", "left"])
def test_shape_wrist_and_rotations_of_another_person_are_recovered(side):
    truth = grip(side, SHAPE)
    motion, report = fit_keypoints(recorded(side, SHAPE), load_hand(side=side))
    assert motion.side == side
    assert motion.valid.all()
    assert report.distance.max() < 0.003
    assert np.abs(report.bone_error).max() < 0.002
    assert np.linalg.norm(motion.wrist_position - truth.wrist_position, axis=1).max() < 0.003
    wrist = angles_between(_matrices(motion.wrist_quaternion), _matrices(truth.wrist_quaternion))
    assert wrist.max() < 1.5
    assert angles_between(truth.rotations, motion.rotations).mean() < 2.5


def test_own_bones_reproduce_the_keypoints_themselves():
    points = keypoints_of(grip(shape=SHAPE))
    stretched = points + 0.0  # a person whose middle finger no shape has: its last two bones half as long again
    tip, dip, pip = (KEYPOINTS.index(f"middle_{j}") for j in ("tip", "dip", "pip"))
    stretched[:, dip] = points[:, pip] + 1.5 * (points[:, dip] - points[:, pip])
    stretched[:, tip] = stretched[:, dip] + 1.5 * (points[:, tip] - points[:, dip])
    recording = KeypointRecording(fps=FPS, positions=stretched, source="made")
    _, shaped = fit_keypoints(recording, load_hand())
    motion, own = fit_keypoints(recording, load_hand(), KeypointSettings(own_bones=True))
    assert motion.link_offset is not None
    assert motion.tip_offset is not None
    assert np.abs(own.bone_error).max() < 1e-6
    assert own.distance.max() < 0.003 < shaped.distance[tip]


def test_bone_lengths_do_not_vary_and_outliers_do_not_move_them():
    recording = recorded(shape=SHAPE)
    noisy = recording.positions + np.random.default_rng(0).normal(scale=0.003, size=recording.positions.shape)
    noisy[7] += 5.0 * np.random.default_rng(1).normal(size=(21, 3))  # one frame is nonsense
    motion, report = fit_keypoints(replace(recording, positions=noisy), load_hand())
    assert report.spread_seen > 0.05
    assert report.spread_fitted < 1e-6
    fitted = lengths(report.fitted)
    true = lengths(recording.positions)
    assert np.abs(np.median(fitted, axis=0) - true[0]).max() < 0.006
    assert np.linalg.norm(motion.shape - SHAPE) < np.linalg.norm(SHAPE)


def test_shape_of_exact_lengths_is_found():
    hand = load_hand()
    mean, change = rest_keypoints(hand)
    truth = lengths(mean + change @ SHAPE)
    found = shape_of_lengths(hand, truth)
    # The prior draws it a little towards the mean; what the lengths tell is right to a fraction of a millimetre.
    assert np.abs(lengths(mean + change @ found) - truth).max() < 0.0015
    assert abs(found[0] - SHAPE[0]) < 0.3
    unknown = np.where(np.arange(len(truth)) < 20, np.nan, truth)
    assert np.isfinite(shape_of_lengths(hand, unknown)).all()


def test_low_pass_lowers_jitter_and_keeps_the_movement():
    recording = recorded()
    noisy = recording.positions + np.random.default_rng(0).normal(scale=0.002, size=recording.positions.shape)
    given = replace(recording, positions=noisy)
    _, raw = fit_keypoints(given, load_hand())
    motion, smooth = fit_keypoints(given, load_hand(), KeypointSettings(cutoff=6.0))
    assert smooth.jitter_fitted < 0.4 * raw.jitter_fitted
    assert raw.jitter_fitted < raw.jitter_seen * 1.2
    assert np.linalg.norm(smooth.fitted - recording.positions, axis=-1).mean() < 0.004
    assert motion.valid.all()


def test_short_gaps_are_bridged_and_long_ones_masked():
    positions = recorded().positions
    positions[5:8, KEYPOINTS.index("ring_tip")] = np.nan
    positions[20:40, KEYPOINTS.index("index_pip")] = np.nan
    motion, report = fit_keypoints(KeypointRecording(fps=FPS, positions=positions, source="made"), load_hand())
    assert motion.valid[:20].all()
    assert not motion.valid[20:40].any()
    np.testing.assert_array_equal(motion.rotations[25], np.tile(np.eye(3), (15, 1, 1)))
    assert np.isfinite(motion.wrist_position).all()
    assert np.isnan(report.fitted[25]).all()


def test_gap_filling_is_on_straight_lines_and_leaves_the_ends():
    positions = np.linspace([0.0, 0, 0], [29.0, 0, 0], 30)[:, None] * np.ones((30, 21, 3))
    holed = positions.copy()
    holed[[0, 1, 10, 11, 29], 3] = np.nan
    holed[15:21, 4] = np.nan
    filled = fill_short_gaps(holed, 3)
    np.testing.assert_allclose(filled[10:12, 3], positions[10:12, 3])
    assert np.isnan(filled[[0, 1, 29], 3]).all()
    assert np.isnan(filled[15:21, 4]).all()
    smooth = low_pass_keypoints(filled, 30.0, 6.0)
    np.testing.assert_array_equal(np.isnan(smooth), np.isnan(filled))


@pytest.mark.parametrize("side", ["right", "left"])
def test_side_is_told_by_the_fingers(side):
    recording = recorded(side)
    assert known_side(recording) == (side, "as its fingers bend")
    assert (bend_towards_right(recording.positions) > 0) == (side == "right")
    other = "left" if side == "right" else "right"
    with pytest.raises(InputError, match=f"said to be a {other} hand, but its fingers bend as a {side} hand's"):
        known_side(recording, other)


def test_a_mirrored_frame_is_noticed():
    mirrored = replace(recorded(), positions=recorded().positions * [1, 1, -1], side="right")
    with pytest.raises(InputError, match="left-handed"):
        known_side(mirrored)


def test_a_flat_hand_needs_to_be_told_apart():
    flat = np.broadcast_to(rest_keypoints(load_hand())[0], (5, 21, 3))
    recording = KeypointRecording(fps=FPS, positions=flat, source="flat.npz")
    with pytest.raises(InputError, match="too flat to tell"):
        known_side(recording)
    assert known_side(recording, "left") == ("left", "as asked")


def broken(recording: KeypointRecording, how: str) -> KeypointRecording:
    positions = recording.positions.copy()
    if how == "millimetres":
        positions *= 1000
    elif how == "centimetres":
        positions *= 100
    elif how == "image":
        positions *= 4
    elif how == "a point":
        positions[:] = 1.0
    elif how == "nothing":
        positions[:] = np.nan
    elif how == "no thumb tip":
        positions[:, 4] = np.nan
    elif how == "never whole":
        positions[::2, 8] = np.nan
        positions[1::2, 12] = np.nan
        return replace(recording, positions=positions, fps=2.0)
    elif how == "no rate":
        return replace(recording, fps=None)
    return replace(recording, positions=positions)


@pytest.mark.parametrize(
    ("how", "says"),
    [
        ("millimetres", "about 1000 times too big, so positions are in mm"),
        ("centimetres", "about 100 times too big, so positions are in cm"),
        ("image", "4 times too big; give positions in metres"),
        ("a point", "all keypoints are at one place"),
        ("nothing", "all 60 frames are gaps"),
        ("no thumb tip", "thumb_tip never seen"),
        ("never whole", "no frame shows a whole hand"),
        ("no rate", "give fps"),
    ],
)
def test_what_is_no_hand_is_refused_in_one_line(how, says):
    with pytest.raises(InputError, match=says) as caught:
        fit_keypoints(broken(recorded(), how), load_hand())
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("clip", "hand"),
    [
        ("grab", None),
        ("pinch", None),
        ("rollAndPitchCropped", None),
        ("confidence-37fps", "left_29"),
        ("confidence-37fps", "right_31"),
    ],
)
def test_leap_clips_keep_every_bone_direction(recordings, clip, hand):
    recording = load_keypoints(recordings / "leap_motion" / f"{clip}.npz", sequence=hand)
    motion, report = fit_keypoints(recording, load_hand(side=known_side(recording)[0]))
    assert np.rad2deg(report.direction).mean() < 0.01  # 2 degrees are asked for
    assert motion.valid.mean() > 0.99
    assert report.spread_fitted < 1e-6
    filtered = fit_keypoints(recording, load_hand(side=motion.side), KeypointSettings(cutoff=6.0))[1]
    assert np.rad2deg(filtered.direction).mean() < 3.0
    assert report.distance[1:].mean() < 0.009


def test_mediapipe_video_becomes_a_steady_hand(recordings):
    recording = load_keypoints(recordings / "mediapipe_video" / "joints.npz")
    assert known_side(recording)[0] == "right"
    motion, report = fit_keypoints(recording, load_hand())
    assert motion.valid.all()
    assert report.spread_seen > 0.05
    assert report.spread_fitted < 1e-6
    assert report.jitter_fitted < report.jitter_seen
    assert report.distance.mean() < 0.009
    smooth = fit_keypoints(recording, load_hand(), KeypointSettings(cutoff=6.0))[1]
    assert smooth.jitter_fitted < 0.4 * report.jitter_seen
    assert np.rad2deg(smooth.direction).mean() < 2.0


def test_median_ignores_missing_frames():
    positions = recorded().positions
    positions[: FRAMES // 2 - 1] = np.nan
    np.testing.assert_allclose(median_lengths(positions), lengths(recorded().positions)[0], atol=1e-6)


def _matrices(quaternion: np.ndarray) -> np.ndarray:
    return quaternion_matrices(quaternion)[:, None]
