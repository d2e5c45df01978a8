"""What goes wrong in a marker recording, added to one that is known: swapped labels, ghosts, a rig that shakes."""

import numpy as np
from scipy.spatial.transform import Rotation

from mjx_hand.capture.markers.marker_recording import MarkerRecording
from mjx_hand.errors import InputError
from mjx_hand.pytree import replace


def swap_labels(
    recording: MarkerRecording, seed: int, *, fraction: float = 0.02, seconds: float = 0.3, reach: float = 0.03
) -> MarkerRecording:
    """Exchange the labels of two markers that are near each other, now and then and for a while.

    Args:
        recording: with the right labels.
        seed: of the random draws; the same seed swaps the same.
        fraction: mean share of frames in which two labels are swapped.
        seconds: how long a swap lasts.
        reach: how near (m) two markers must be to be taken for each other.

    Raises:
        InputError: an argument is out of range.
    """
    _check(fraction, "fraction", 1.0)
    _check(reach, "reach", 1.0)
    frames = recording.num_frames
    length = max(round(seconds * recording.fps), 1)
    rng = np.random.default_rng(seed)
    positions, visible = np.array(recording.positions), np.array(recording.visible)
    for start in np.flatnonzero(rng.random(frames) < fraction / length):
        here = recording.positions[start]
        distance = np.linalg.norm(here[:, None] - here, axis=-1)
        both = recording.visible[start][:, None] & recording.visible[start]
        near = np.argwhere(np.triu(both & (distance < reach), 1))
        if len(near):
            a, b = near[rng.integers(len(near))]
            stop = start + length
            positions[start:stop, [a, b]] = positions[start:stop, [b, a]]
            visible[start:stop, [a, b]] = visible[start:stop, [b, a]]
    return replace(recording, positions=positions, visible=visible)


def add_ghosts(recording: MarkerRecording, seed: int, *, fraction: float = 0.01, reach: float = 0.1) -> MarkerRecording:
    """Put reflections in the place of markers: single sights somewhere about the hand, under a marker's label.

    Args:
        recording: without them.
        seed: of the random draws.
        fraction: mean share of sights, hidden ones included, that are ghosts.
        reach: standard deviation of each coordinate of a ghost about the frame's markers, m.

    Raises:
        InputError: an argument is out of range.
    """
    _check(fraction, "fraction", 1.0)
    _check(reach, "reach", 10.0)
    rng = np.random.default_rng(seed)
    shape = recording.visible.shape
    ghost = (rng.random(shape) < fraction) & np.asarray(recording.visible.any(axis=1))[:, None]
    count = np.maximum(recording.visible.sum(axis=1), 1)[:, None]
    centre = recording.positions.sum(axis=1) / count  # markers that are not visible are zero
    where = centre[:, None] + rng.normal(scale=reach, size=(*shape, 3))
    return replace(
        recording,
        positions=np.where(ghost[..., None], where, recording.positions),
        visible=recording.visible | ghost,
    )


def shake_rig(
    recording: MarkerRecording, seed: int, *, position: float = 0.0005, rotation: float = 0.0005
) -> MarkerRecording:
    """Move all markers of a frame together, as cameras that shake or are calibrated anew do.

    Args:
        recording: of a rig that stands still.
        seed: of the random draws.
        position: standard deviation of each coordinate of a frame's shift, m.
        rotation: standard deviation of each component of its turn about the recording's origin, rad.

    Raises:
        InputError: an argument is out of range.
    """
    _check(position, "position", 1.0)
    _check(rotation, "rotation", 1.0)
    shifting, turning = np.random.default_rng(seed).spawn(2)
    shift = shifting.normal(scale=position, size=(recording.num_frames, 1, 3))
    turn = Rotation.from_rotvec(turning.normal(scale=rotation, size=(recording.num_frames, 3))).as_matrix()
    moved = np.einsum("tab,tmb->tma", turn, recording.positions) + shift
    return replace(recording, positions=np.where(recording.visible[..., None], moved, 0.0))


def _check(value: float, name: str, most: float) -> None:
    if not (np.isfinite(value) and 0 <= value <= most):
        raise InputError(f"{name} is {value}, expected 0 to {most:g}")
