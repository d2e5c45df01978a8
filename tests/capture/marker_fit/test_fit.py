"""Fits against motions of which everything is known."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from mjx_hand.capture.marker_fit.fit import FitSettings, fit_many, fit_markers
from mjx_hand.capture.markers.marker_recording import select_markers
from mjx_hand.capture.markers.marker_set import included_marker_set
from mjx_hand.capture.simulation.simulate import simulate_markers
from mjx_hand.errors import InputError
from mjx_hand.hand.load import load_hand
from mjx_hand.motion import check_motion
from tests.capture.grasps import errors, grasp


def test_noisy_recordings_of_unknown_shapes(hand, noisy):
    for case in noisy:
        check_motion(case.fit)
        assert case.fit.valid.all()
        error = errors(hand, case.truth, case.fit)
        assert error.vertex.mean() < 0.002
        assert error.joint.mean() < 0.0015
        assert error.tip.mean() < 0.003
        assert np.rad2deg(error.rotation.mean()) < 6
        assert 0.0003 < case.report.rms < 0.0012  # half a millimetre of noise an axis is 0.87 mm


def test_clean_recordings_are_fitted_more_closely(hand, noisy, clean):
    for case in clean:
        error = errors(hand, case.truth, case.fit)
        assert error.vertex.mean() < 0.001
        assert error.joint.mean() < 0.0006
        assert case.report.rms < 0.0003
        assert case.report.marker_rms.max() < 0.0006
    vertex = [np.mean([errors(hand, c.truth, c.fit).vertex.mean() for c in cases]) for cases in (clean, noisy)]
    assert vertex[0] < 0.8 * vertex[1]


def test_a_fit_of_one_is_the_fit_of_many(hand, marker_set, noisy):
    motion, report = fit_markers(noisy[1].recording, hand, marker_set)
    np.testing.assert_allclose(motion.rotations, noisy[1].fit.rotations, atol=1e-4)
    np.testing.assert_allclose(motion.shape, noisy[1].fit.shape, atol=1e-3)
    np.testing.assert_allclose(report.marker_rms, noisy[1].report.marker_rms, atol=1e-6)


@settings(max_examples=3, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_moving_the_world_moves_the_wrist_and_nothing_else(hand, marker_set, noisy, seed):
    case = noisy[0]
    rng = np.random.default_rng(seed)
    turn, shift = Rotation.random(rng=rng), rng.normal(size=3) * 5
    seen = case.recording.visible[..., None]
    moved = dataclasses.replace(
        case.recording, positions=np.where(seen, case.recording.positions @ turn.as_matrix().T + shift, 0.0)
    )
    fit, _ = fit_markers(moved, hand, marker_set)
    np.testing.assert_allclose(fit.wrist_position, turn.apply(case.fit.wrist_position) + shift, atol=1e-4)
    expected = turn * Rotation.from_quat(case.fit.wrist_quaternion, scalar_first=True)
    between = expected.inv() * Rotation.from_quat(fit.wrist_quaternion, scalar_first=True)
    assert np.rad2deg(between.magnitude().max()) < 0.1
    np.testing.assert_allclose(fit.rotations, case.fit.rotations, atol=5e-3)


def test_frames_without_markers_are_marked(hand, marker_set, noisy):
    case = noisy[2]
    visible = case.recording.visible.copy()
    visible[100:140] = False
    visible[:3] = False
    gappy = dataclasses.replace(
        case.recording, visible=visible, positions=np.where(visible[..., None], case.recording.positions, 0.0)
    )
    fit, _ = fit_markers(gappy, hand, marker_set)
    check_motion(fit)
    hidden = np.zeros(300, bool)
    hidden[:3] = hidden[100:140] = True
    np.testing.assert_array_equal(fit.valid, ~hidden)
    np.testing.assert_array_equal(fit.rotations[hidden], np.broadcast_to(np.eye(3), (43, 15, 3, 3)))
    # The wrist runs on through the gap in a straight line.
    np.testing.assert_allclose(
        fit.wrist_position[119], fit.wrist_position[99] + 20 / 41 * (fit.wrist_position[140] - fit.wrist_position[99])
    )
    assert np.linalg.norm(fit.wrist_position - case.truth.wrist_position, axis=1)[~hidden].max() < 0.006
    np.testing.assert_allclose(fit.wrist_position[:3], np.broadcast_to(fit.wrist_position[3], (3, 3)))


def test_hidden_fingertips_follow_the_frames_around(hand, marker_set, clean):
    case = clean[0]
    visible = case.recording.visible.copy()
    nail = case.recording.names.index("index_nail")
    visible[150:180, nail] = False
    gappy = dataclasses.replace(
        case.recording, visible=visible, positions=np.where(visible[..., None], case.recording.positions, 0.0)
    )
    fit, _ = fit_markers(gappy, hand, marker_set)
    dip = errors(hand, case.truth, fit).rotation[150:180, 2]
    assert np.rad2deg(dip.max()) < 12


def test_left_hand():
    hand = load_hand(side="left")
    marker_set = included_marker_set(hand)
    truth = grasp(hand, 5)
    fit, _ = fit_markers(simulate_markers(hand, truth, marker_set, 5), hand, marker_set)
    assert fit.side == "left"
    error = errors(hand, truth, fit)
    assert error.vertex.mean() < 0.002
    assert error.joint.mean() < 0.0015


def test_markers_in_another_order_and_fewer_of_them(hand, marker_set, noisy):
    recording = noisy[0].recording
    names = [n for n in reversed(recording.names) if n != "ring_dip"]
    fit, report = fit_markers(select_markers(recording, names), hand, marker_set)
    assert report.names == marker_set.names
    assert report.marker_rms[marker_set.names.index("ring_dip")] == 0
    assert errors(hand, noisy[0].truth, fit).vertex.mean() < 0.003


def test_progress_reaches_one(hand, marker_set, noisy):
    shares: list[float] = []
    fit_many([noisy[0].recording], hand, marker_set, progress=shares.append)
    assert shares == sorted(shares)
    assert shares[-1] == pytest.approx(1)
    # What holds the compilation is the first piece: key frames, 15 steps each, and the shape, 18 steps.
    assert shares[0] == pytest.approx(48 * (15 + 18) / (48 * (15 + 18) + len(noisy[0].recording.positions) * 8))


@pytest.mark.parametrize(
    "pair",
    [("index_nail", "middle_nail"), ("index_pip", "index_dip"), ("ring_mcp", "pinky_mcp"), ("thumb_ip", "thumb_nail")],
)
def test_swapped_names_are_noticed(hand, marker_set, noisy, pair):
    names = list(noisy[0].recording.names)
    a, b = (names.index(name) for name in pair)
    names[a], names[b] = names[b], names[a]
    with pytest.raises(InputError, match=f"no hand explains these markers .*({pair[0]}|{pair[1]}).*swapped"):
        fit_markers(dataclasses.replace(noisy[0].recording, names=tuple(names)), hand, marker_set)


def test_unknown_names_are_refused(hand, marker_set, noisy):
    names = ("elbow", *noisy[0].recording.names[1:])
    with pytest.raises(InputError, match="unknown marker 'elbow'; the marker set has wrist_radial"):
        fit_markers(dataclasses.replace(noisy[0].recording, names=names), hand, marker_set)


def test_nothing_to_fit(hand, marker_set, noisy):
    recording = noisy[0].recording
    empty = dataclasses.replace(recording, visible=np.zeros_like(recording.visible))
    with pytest.raises(InputError, match="no frame shows 8 markers"):
        fit_markers(empty, hand, marker_set)
    palm = ("wrist_radial", "wrist_ulnar", "hand_back", "middle_mcp", "pinky_mcp", "ring_mcp")
    fingers = select_markers(recording, [n for n in recording.names if n not in palm])
    with pytest.raises(InputError, match="no frame shows 3 markers of the palm"):
        fit_markers(fingers, hand, marker_set)


def test_settings_are_checked():
    with pytest.raises(InputError, match="marker_deviation is 0"):
        FitSettings(marker_deviation=0.0)
