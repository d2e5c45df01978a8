"""An object's pose from markers: exact on a known motion, through gaps, swapped labels and ghosts."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mjx_hand.capture.marker_files.load_markers import load_markers
from mjx_hand.capture.markers.marker_recording import MarkerRecording
from mjx_hand.capture.object_poses.marker_cluster import track_cluster
from mjx_hand.errors import InputError

FPS, FRAMES = 100.0, 200
NAMES = ("a", "b", "c", "d")
SCALENE = np.array([[0.0, 0, 0], [0.1, 0, 0], [0.03, 0.06, 0], [0.02, 0.01, 0.05]])
ISOSCELES = np.array([[-0.05, 0, 0], [0.05, 0, 0], [0.0, 0.08, 0.0]])


def motion() -> tuple[Rotation, np.ndarray]:
    time = np.arange(FRAMES) / FPS
    turn = Rotation.from_rotvec(np.stack([np.sin(2 * time), time, 0.5 * np.cos(time)], axis=1))
    return turn, np.stack([0.2 * time, np.sin(time), 0.1 + 0 * time], axis=1)


def recording(places: np.ndarray, noise: float = 0.0) -> MarkerRecording:
    turn, place = motion()
    positions = np.einsum("tij,mj->tmi", turn.as_matrix(), places) + place[:, None]
    positions += np.random.default_rng(0).normal(scale=noise, size=positions.shape) if noise else 0.0
    names = NAMES[: len(places)]
    return MarkerRecording(fps=FPS, positions=positions, visible=np.ones(positions.shape[:2], bool), names=names)


def off(poses: np.ndarray) -> tuple[float, float]:
    """Greatest distance (m) and angle (rad) from the truth, where there is a pose."""
    turn, place = motion()
    (seen,) = np.nonzero(np.isfinite(poses).all(axis=1))
    angle = (
        Rotation.from_quat(turn.as_quat()[seen]).inv() * Rotation.from_quat(poses[seen, 3:], scalar_first=True)
    ).magnitude()
    return float(np.linalg.norm(poses[seen, :3] - place[seen], axis=1).max()), float(angle.max())


def swapped(found: MarkerRecording, one: int, other: int, frames: slice) -> MarkerRecording:
    positions = np.array(found.positions)
    positions[frames, [one, other]] = 0  # NumPy writes both below
    positions[frames, one], positions[frames, other] = found.positions[frames, other], found.positions[frames, one]
    return MarkerRecording(fps=FPS, positions=positions, visible=found.visible, names=found.names)


@pytest.mark.parametrize("places", [SCALENE, ISOSCELES])
def test_known_places_give_the_object_exactly(places):
    track = track_cluster(recording(places), NAMES[: len(places)], places)
    assert max(off(track.poses)) < 1e-6
    assert track.misfit < 1e-9
    noisy = track_cluster(recording(places, noise=5e-4), NAMES[: len(places)], places)
    distance, angle = off(noisy.poses)
    assert distance < 3e-3
    assert angle < 0.04


def test_without_places_the_frame_is_the_clusters():
    track = track_cluster(recording(SCALENE), NAMES)
    np.testing.assert_allclose(track.places.mean(axis=0), 0, atol=1e-9)
    edge = track.places[1] - track.places[0]
    np.testing.assert_allclose(edge, [0.1, 0, 0], atol=1e-6)
    third = track.places[2] - track.places[0]
    np.testing.assert_allclose(third, [0.03, 0.06, 0], atol=1e-6)
    turn = Rotation.from_quat(track.poses[:, 3:], scalar_first=True)
    np.testing.assert_allclose((motion()[0].inv() * turn).magnitude(), 0, atol=1e-6)


@pytest.mark.parametrize("places", [SCALENE[:3], SCALENE, ISOSCELES])
def test_swapped_labels_are_noticed_and_put_right(places):
    """Of the isosceles triangle the distances stay right: it is the leap by half a turn that tells."""
    names = NAMES[: len(places)]
    track = track_cluster(swapped(recording(places, noise=2e-4), 0, 1, slice(50, 71)), names, places)
    assert np.flatnonzero(track.swapped).tolist() == list(range(50, 71))
    distance, angle = off(track.poses)
    assert distance < 2e-3
    assert angle < 0.03


def test_gaps_and_ghosts_are_no_poses():
    found = recording(SCALENE)
    found.visible[10:20, 0] = False  # three are left
    found.visible[30:40, :2] = False
    found.positions[60, 3] += [0.0, 0.0, 0.5]
    track = track_cluster(found, NAMES, SCALENE)
    seen = np.isfinite(track.poses).all(axis=1)
    assert np.flatnonzero(~seen).tolist() == [*range(30, 40), 60]
    assert max(off(track.poses)) < 1e-6


def test_what_is_no_cluster_is_refused():
    loose = recording(SCALENE)
    loose.positions[:, 2] += np.random.default_rng(0).normal(scale=0.1, size=(FRAMES, 3))
    line = recording(np.array([[0.0, 0, 0], [0.05, 0, 0], [0.1, 0, 0]]))
    never = recording(SCALENE)
    never.visible[:, 3] = False
    cases = [
        (loose, NAMES, "off one rigid cluster; are all of them on the object"),
        (line, NAMES[:3], "lie on a line"),
        (never, NAMES, "never seen all together"),
        (loose, ("a", "b"), "takes 3 different markers or more"),
        (loose, ("a", "b", "cup"), "no marker 'cup'; it has a, b, c, d"),
    ]
    for found, names, message in cases:
        with pytest.raises(InputError, match=message) as refusal:
            track_cluster(found, names)
        assert "\n" not in str(refusal.value)


def test_the_real_pillow(recordings):
    """Its three markers keep their distances to a millimetre, and the pose puts them where they were seen."""
    file = recordings / "dfki_glove" / "recording.tsv"
    if not file.is_file():
        pytest.skip(f"{file} is absent: the recording is not part of the project")
    found = load_markers(file)
    names = ("pillow_top", "pillow_left", "pillow_right")
    track = track_cluster(found, names)
    assert np.isfinite(track.poses).all()
    assert not track.swapped.any()
    assert track.misfit < 1e-3
    at = [found.names.index(name) for name in names]
    turn = Rotation.from_quat(track.poses[:, 3:], scalar_first=True).as_matrix()
    predicted = np.einsum("tij,mj->tmi", turn, track.places) + track.poses[:, None, :3]
    assert np.linalg.norm(predicted - found.positions[:, at], axis=-1).max() < 4e-3
    np.testing.assert_allclose(track.poses[:, :3], found.positions[:, at].mean(axis=1), atol=1e-9)
