"""Simulated capture against the whole skinned mesh, and its random parts against their statistics."""

import dataclasses

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from mjx_hand.capture.simulation.off_axis import add_off_axis_rotation
from mjx_hand.capture.simulation.simulate import gap_bursts, simulate_markers
from mjx_hand.errors import InputError
from mjx_hand.hand.load import load_hand
from mjx_hand.motion.resample import resample_motion
from tests.capture.grasps import SAMPLED, grasp, world_points


def test_markers_stand_off_the_posed_skin(hand, marker_set):
    truth = grasp(hand, 7)
    recording = simulate_markers(hand, truth, marker_set, 0, noise=0.0, gap_fraction=0.0, placement=0.0)
    assert recording.visible.all()
    vertices, _ = world_points(hand, truth)
    at = np.linspace(0, truth.num_frames - 1, SAMPLED).astype(int)
    for k in (0, 11, SAMPLED - 1):
        mesh = trimesh.Trimesh(vertices[k], hand.faces, process=False)
        corners = mesh.triangles
        area_normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        normals = np.zeros_like(vertices[k])
        for c in range(3):
            np.add.at(normals, hand.faces[:, c], area_normals)
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        expected = vertices[k][marker_set.vertices] + 0.005 * normals[marker_set.vertices]
        np.testing.assert_allclose(recording.positions[at[k]], expected, atol=2e-6)


def test_noise_placement_and_gaps_have_their_sizes(hand, marker_set):
    truth = grasp(hand, 8)

    def simulated(**kwargs):
        quiet = {"noise": 0.0, "gap_fraction": 0.0, "placement": 0.0}
        return simulate_markers(hand, truth, marker_set, 3, **{**quiet, **kwargs})

    exact = simulated()
    noise = simulated(noise=0.002).positions - exact.positions
    assert noise.std() == pytest.approx(0.002, rel=0.05)
    placed = simulated(placement=0.001).positions - exact.positions
    distance = np.linalg.norm(placed, axis=-1)
    np.testing.assert_allclose(distance, np.broadcast_to(distance[0], distance.shape), atol=1e-6)  # constant
    assert np.sqrt((distance[0] ** 2).mean() / 3) == pytest.approx(0.001, rel=0.3)
    gappy = simulated(gap_fraction=0.3)
    assert not gappy.positions[~gappy.visible].any()
    np.testing.assert_array_equal(gappy.positions[gappy.visible], exact.positions[gappy.visible])


def test_gap_bursts():
    hidden = gap_bursts(np.random.default_rng(0), (20000, 10), 0.1, 15.0)
    assert hidden.mean() == pytest.approx(0.1, rel=0.1)
    begins = (hidden[1:] & ~hidden[:-1]).sum()
    assert hidden.sum() / begins == pytest.approx(15.0, rel=0.1)
    assert not gap_bursts(np.random.default_rng(0), (100, 3), 0.0, 15.0).any()


def test_a_seed_is_a_recording(hand, marker_set):
    truth = grasp(hand, 9)
    one, same, other = (simulate_markers(hand, truth, marker_set, seed) for seed in (1, 1, 2))
    np.testing.assert_array_equal(one.positions, same.positions)
    np.testing.assert_array_equal(one.visible, same.visible)
    assert not np.array_equal(one.positions, other.positions)


def test_rate_and_gaps_of_the_motion(hand, marker_set):
    truth = grasp(hand, 9, frames=101, fps=50.0)
    valid = truth.valid.copy()
    valid[20:30] = False
    recording = simulate_markers(hand, dataclasses.replace(truth, valid=valid), marker_set, 0, fps=120.0)
    assert recording.fps == 120.0
    assert recording.num_frames == 241
    assert not recording.visible[48:70].any()
    assert recording.visible[71:].mean() > 0.8


def test_bad_simulations_are_refused(hand, marker_set):
    truth = grasp(hand, 9)
    with pytest.raises(InputError, match="motion of the right hand"):
        simulate_markers(load_hand(side="left"), truth, marker_set, 0)
    with pytest.raises(InputError, match="gap_fraction is 1"):
        simulate_markers(hand, truth, marker_set, 0, gap_fraction=1.0)
    with pytest.raises(InputError, match=r"noise is -1\.0"):
        simulate_markers(hand, truth, marker_set, 0, noise=-1.0)
    with pytest.raises(InputError, match="link offsets"):
        simulate_markers(hand, dataclasses.replace(truth, link_offset=np.zeros((16, 3))), marker_set, 0)


def test_off_axis_rotation_is_smooth_of_its_size_and_off_the_axis():
    frames, fps = 600, 120.0
    angle = np.linspace(0, 1, frames)
    rng = np.random.default_rng(0)
    axes = rng.normal(size=(15, 3))
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    rotations = Rotation.from_rotvec((angle[:, None, None] * axes).reshape(-1, 3)).as_matrix().reshape(-1, 15, 3, 3)
    moved = add_off_axis_rotation(rotations, 4, 1.0, fps)
    added = Rotation.from_matrix((moved @ np.swapaxes(rotations, -1, -2)).reshape(-1, 3, 3)).as_rotvec()
    added = added.reshape(frames, 15, 3)
    np.testing.assert_allclose(np.einsum("tjc,jc->tj", added, axes), 0, atol=1e-9)
    peak = np.rad2deg(np.linalg.norm(added, axis=-1).max(axis=0)).reshape(5, 3)
    assert (peak <= np.array([16, 8, 3]) + 1e-9).all()
    assert (peak >= np.array([8, 4, 1.5]) - 1e-9).all()
    assert np.abs(np.diff(added, axis=0)).max() * fps < 6  # rad/s, a moving finger's own speed
    np.testing.assert_allclose(add_off_axis_rotation(rotations, 4, 0.0, fps), rotations, atol=1e-12)
    with pytest.raises(InputError, match="scale is -1"):
        add_off_axis_rotation(rotations, 4, -1.0, fps)


def test_resampling_there_and_back(hand):
    truth = grasp(hand, 3, frames=101, fps=50.0)
    back = resample_motion(resample_motion(truth, 300.0), 50.0)
    assert back.num_frames == truth.num_frames
    np.testing.assert_allclose(back.rotations, truth.rotations, atol=1e-9)
    np.testing.assert_allclose(back.wrist_position, truth.wrist_position, atol=1e-9)
    np.testing.assert_allclose(back.wrist_quaternion, truth.wrist_quaternion, atol=1e-9)
