"""When an object stands still: from its recorded poses alone, with as much noise as they have."""

import dataclasses

import numpy as np
from jaxtyping import Bool, Float
from scipy.ndimage import median_filter
from scipy.spatial.transform import Rotation

from mjx_hand.motion.gaps import fill_lines, fill_turns, spans
from mjx_hand.motion.resample import quaternion_matrices
from mjx_hand.motion.scene import RecordedObject

_WINDOW, _APART, _SHORTEST = 0.2, 0.3, 0.2  # s: of the mean; between the two that are compared; of what counts
_PLACE, _TURN = (0.003, 0.02), (0.05, np.pi)  # m and rad between those two, at least and at most
_OF_NOISE = 2.0
_TO_SIGMA = 0.6745 * np.sqrt(6.0)  # a second difference's median size, of noise of unit variance
NOISY = np.deg2rad(3.0)  # rad of noise from frame to frame from which single orientations say little


@dataclasses.dataclass(frozen=True)
class ObjectPath:
    """An object's poses in every frame, gaps bridged.

    Attributes:
        position, rotation: scene from object (m).
        seen: frames that were recorded.
        place_noise, turn_noise: standard deviation of a frame's position (m) and orientation (rad).
        still: frames in which it does not move.
    """

    position: Float[np.ndarray, "t 3"]
    rotation: Float[np.ndarray, "t 3 3"]
    seen: Bool[np.ndarray, "t"]
    place_noise: float
    turn_noise: float
    still: Bool[np.ndarray, "t"]

    @property
    def noisy(self) -> bool:
        """Whether single orientations say little."""
        return bool(self.turn_noise > NOISY)


def object_path(recorded: RecordedObject, fps: float) -> ObjectPath:
    """The object's poses, how noisy they are, and when it stands still.

    It stands still while its place and orientation, of medians and means over 0.2 s, change by less in 0.3 s than noise
    makes them, or than 3 mm and 3°.
    """
    position = fill_lines(recorded.position, recorded.seen)
    rotation = quaternion_matrices(fill_turns(recorded.quaternion, recorded.seen))
    place = np.linalg.norm([_sigma(column) for column in position.T])
    steps = Rotation.from_matrix(np.swapaxes(rotation[:-1], 1, 2) @ rotation[1:]).as_rotvec()
    turn = _sigma(np.linalg.norm(np.diff(steps, axis=0), axis=1), order=0) if len(steps) > 1 else 0.0
    width = max(2 * round(_WINDOW * fps / 2) + 1, 3)
    middle = median_filter(position, size=(width, 1), mode="nearest")
    half = max(round(_APART * fps / 2), 1)
    frames = np.arange(len(position))
    before, after = np.maximum(frames - half, 0), np.minimum(frames + half, frames[-1])
    moved = np.linalg.norm(middle[after] - middle[before], axis=1)
    means = mean_rotations(rotation, width)
    turned = Rotation.from_matrix(np.swapaxes(means[before], 1, 2) @ means[after]).magnitude()
    share = (after - before) / (2 * half)  # at the ends they are nearer together
    still = (moved < share * np.clip(_OF_NOISE * place, *_PLACE)) & (turned < share * np.clip(_OF_NOISE * turn, *_TURN))
    return ObjectPath(position, rotation, recorded.seen, float(place), float(turn), _lasting(still, fps))


def mean_rotations(rotation: Float[np.ndarray, "t 3 3"], width: int) -> Float[np.ndarray, "t 3 3"]:
    """Of each frame the mean over `width` frames around it: the rotation nearest to that of the matrices."""
    kernel = np.ones(width)
    count = np.convolve(np.ones(len(rotation)), kernel, mode="same")[: len(rotation)]
    columns = [np.convolve(column, kernel, mode="same")[: len(rotation)] for column in rotation.reshape(-1, 9).T]
    return nearest_rotations((np.stack(columns, axis=1) / count[:, None]).reshape(-1, 3, 3))


def nearest_rotations(matrices: Float[np.ndarray, "t 3 3"]) -> Float[np.ndarray, "t 3 3"]:
    """The rotations nearest to matrices."""
    u, _, vt = np.linalg.svd(matrices)
    u[..., -1] *= np.sign(np.linalg.det(u @ vt))[:, None]
    return u @ vt


def _sigma(values: Float[np.ndarray, "t"], order: int = 2) -> float:
    changes = np.abs(np.diff(values, order)) if order else values
    return float(np.median(changes) / _TO_SIGMA) if len(changes) else 0.0


def _lasting(flags: Bool[np.ndarray, "t"], fps: float) -> Bool[np.ndarray, "t"]:
    """Without short runs, first of motion and then of rest."""
    out, fewest = flags.copy(), max(round(_SHORTEST * fps), 2)
    for value in (False, True):
        for begin, end in spans(out == value):
            if end - begin < fewest and (begin, end) != (0, len(out)):
                out[begin:end] = not value
    return out
