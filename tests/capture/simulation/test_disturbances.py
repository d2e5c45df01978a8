"""Swaps, ghosts, shaking rigs, sliding skin: their statistics, and what the fit makes of them."""

import dataclasses

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mjx_hand.capture.keypoints.layouts import KEYPOINTS
from mjx_hand.capture.marker_fit.fit import fit_many
from mjx_hand.capture.pose.wrist import rigid_fit
from mjx_hand.capture.simulation.disturbances import add_ghosts, shake_rig, swap_labels
from mjx_hand.capture.simulation.simulate import simulate_markers
from mjx_hand.capture.simulation.simulate_keypoints import simulate_keypoints
from mjx_hand.errors import InputError
from mjx_hand.hand.joints import LINKS
from tests.capture.grasps import SAMPLED, errors, grasp, world_points


@pytest.fixture(scope="module")
def known(hand, marker_set):
    """A motion and what a system without faults records of it."""
    truth = grasp(hand, 11)
    return truth, simulate_markers(hand, truth, marker_set, 11)


def test_swaps_exchange_near_markers_for_a_while(known):
    _, recording = known
    swapped = swap_labels(recording, 3, fraction=0.2, seconds=0.1, reach=0.03)
    changed = (swapped.positions != recording.positions).any(axis=2)
    pairs = changed.sum(axis=1)
    assert 0.02 < (pairs > 0).mean() < 0.5
    for frame in np.flatnonzero(pairs == 2):  # one swap at a time: the two have changed places
        a, b = np.flatnonzero(changed[frame])
        np.testing.assert_array_equal(swapped.positions[frame, [a, b]], recording.positions[frame, [b, a]])
        np.testing.assert_array_equal(swapped.visible[frame, [a, b]], recording.visible[frame, [b, a]])
    np.testing.assert_allclose(swapped.positions.sum(axis=1), recording.positions.sum(axis=1))  # none made, none lost
    unchanged = swap_labels(recording, 3, fraction=0.0)
    np.testing.assert_array_equal(unchanged.positions, recording.positions)


def test_ghosts_have_their_share_and_place(known):
    _, recording = known
    ghostly = add_ghosts(recording, 4, fraction=0.05, reach=0.1)
    changed = (ghostly.positions != recording.positions).any(axis=2)
    assert changed.mean() == pytest.approx(0.05, rel=0.1)
    assert ghostly.visible[changed].all()
    np.testing.assert_array_equal(ghostly.visible[~changed], recording.visible[~changed])
    centre = recording.positions.sum(axis=1) / recording.visible.sum(axis=1)[:, None]
    off = (ghostly.positions - centre[:, None])[changed]
    assert off.std() == pytest.approx(0.1, rel=0.1)


def test_a_shaking_rig_moves_all_markers_of_a_frame_as_one_body(known):
    _, recording = known
    shaken = shake_rig(recording, 5, position=0.002, rotation=0.001)
    frame = int(np.argmax(recording.visible.sum(axis=1)))
    seen = recording.visible[frame]
    before, after = recording.positions[frame, seen], shaken.positions[frame, seen]
    turn, _, known = rigid_fit(before, after[None], np.ones((1, len(before))))
    assert known.all()
    off = before - before.mean(axis=0)
    np.testing.assert_allclose(off @ turn[0].T, after - after.mean(axis=0), atol=1e-9)
    steady = shake_rig(recording, 5, position=0.002, rotation=0.0)
    shift = (steady.positions - recording.positions)[recording.visible]
    assert shift.std() == pytest.approx(0.002, rel=0.1)
    assert not shaken.positions[~recording.visible].any()


def test_skin_slides_with_the_joint_below_it(hand, marker_set):
    truth = grasp(hand, 11)
    exact = {"noise": 0.0, "gap_fraction": 0.0, "placement": 0.0}

    def simulated(sliding):
        return simulate_markers(hand, truth, marker_set, 0, sliding=sliding, **exact)

    slid = np.linalg.norm(simulated(0.004).positions - simulated(0.0).positions, axis=2)
    for name, link in (("index_nail", "index3"), ("ring_dip", "ring3"), ("thumb_nail", "thumb3")):
        angle = Rotation.from_matrix(truth.rotations[:, LINKS.index(link) - 1]).magnitude()
        np.testing.assert_allclose(slid[:, marker_set.names.index(name)], 0.004 * angle, atol=2e-6)


def test_keypoints_are_the_hands_joints_and_tips(hand):
    truth = grasp(hand, 12)
    recording = simulate_keypoints(hand, truth, 0, noise=0.0)
    vertices, joints = world_points(hand, truth)
    at = np.linspace(0, truth.num_frames - 1, SAMPLED).astype(int)
    for keypoint, joint in (
        ("wrist", "wrist"),
        ("index_pip", "index2"),
        ("little_mcp", "pinky1"),
        ("thumb_ip", "thumb3"),
    ):
        found = recording.positions[at, KEYPOINTS.index(keypoint)]
        np.testing.assert_allclose(found, joints[:, LINKS.index(joint)], atol=2e-6)
    tip = vertices[:, hand.tip_vertices[3]]  # fingers in MANO's order: index, middle, pinky, ring
    np.testing.assert_allclose(recording.positions[at, KEYPOINTS.index("ring_tip")], tip, atol=2e-6)


def test_keypoints_with_noise_and_gaps(hand):
    truth = grasp(hand, 12)
    valid = truth.valid.copy()
    valid[:7] = False
    clean = simulate_keypoints(hand, dataclasses.replace(truth, valid=valid), 1, noise=0.0)
    noisy = simulate_keypoints(hand, dataclasses.replace(truth, valid=valid), 1, noise=0.004, gap_fraction=0.2)
    assert np.isnan(clean.positions[:7]).all()
    assert np.isfinite(clean.positions[7:]).all()
    assert np.nanstd(noisy.positions - clean.positions) == pytest.approx(0.004, rel=0.05)
    assert np.isnan(noisy.positions[7:]).mean() == pytest.approx(0.2, rel=0.4)
    slow = simulate_keypoints(hand, truth, 1, noise=0.0, fps=30.0)
    assert (slow.fps, slow.num_frames, slow.side) == (30.0, 75, "right")


def test_bad_disturbances_are_refused(hand, marker_set, known):
    truth, recording = known
    for disturb, options, message in (
        (swap_labels, {"fraction": 1.5}, r"fraction is 1\.5, expected 0 to 1"),
        (add_ghosts, {"reach": -1.0}, r"reach is -1\.0"),
        (shake_rig, {"rotation": np.nan}, "rotation is nan"),
    ):
        with pytest.raises(InputError, match=message):
            disturb(recording, 0, **options)
    with pytest.raises(InputError, match=r"sliding -0\.1, expected metres"):
        simulate_markers(hand, truth, marker_set, 0, sliding=-0.1)


def test_swaps_and_ghosts_hardly_move_the_fit(hand, marker_set, known):
    """Not much further from the truth than without them; swapped and ghostly sights are seen for what they are."""
    truth, recording = known
    wrong = add_ghosts(swap_labels(recording, 1, fraction=0.1), 2, fraction=0.02)
    (plain, _), (robust, report) = fit_many([recording, wrong], hand, marker_set)
    before, after = errors(hand, truth, plain), errors(hand, truth, robust)
    assert after.vertex.mean() < 1.35 * before.vertex.mean()
    assert after.joint.mean() < 0.0015
    assert np.percentile(np.rad2deg(after.rotation), 95) < 15
    assert 0.01 < report.rejected.mean() < 0.06
    swapped = (np.linalg.norm(wrong.positions - recording.positions, axis=2) > 0.012) & wrong.visible
    caught = report.distance[swapped & report.seen] > 0.01
    assert caught.mean() > 0.9


def test_sliding_skin_costs_no_more_than_it_slides(hand, marker_set):
    truth = grasp(hand, 13)
    fit, _ = fit_many([simulate_markers(hand, truth, marker_set, 0, sliding=0.003)], hand, marker_set)[0]
    error = errors(hand, truth, fit)
    assert error.vertex.mean() < 0.003
    assert error.joint.mean() < 0.0025
