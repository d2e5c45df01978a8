"""What lies between the solver's passes over a recording: first guesses, key frames, smoothing."""

import itertools

import jax
import numpy as np
from jaxtyping import Float, Int

from mjx_hand.capture.marker_fit.batches import BY_FRAME
from mjx_hand.capture.marker_fit.linearise import PoseState
from mjx_hand.capture.marker_fit.pose_solver import Frames
from mjx_hand.capture.marker_fit.shape_solver import Subject, subject_points
from mjx_hand.capture.marker_fit.skinned_points import SkinnedPoints
from mjx_hand.capture.marker_fit.track import Track, wrist_guess
from mjx_hand.capture.pose.pose_prior import PosePrior
from mjx_hand.motion.resample import interpolation_index
from mjx_hand.pytree import replace

Array = np.ndarray


def begin(
    track: Track,
    points: SkinnedPoints,
    subject: Subject,
    palm: Float[Array, "m"],
    prior: PosePrior,
    marker_deviation: float,
    outlier: float,
) -> tuple[Frames, PoseState]:
    """A track's frames for the solver, and a first guess: fingers at the prior's mean, the wrist from the palm."""
    rest, centres = (np.asarray(array) for array in subject_points(points, subject))
    rotation, position = wrist_guess(track, (rest - centres[0]).astype(np.float64), palm)
    count = len(track.frames)
    mean = np.broadcast_to(np.asarray(prior.mean), (count, 15, 3))
    frames = Frames(
        observed=track.observed.astype(np.float32),
        weight=(track.believed / marker_deviation**2).astype(np.float32),
        rest=np.broadcast_to(rest, (count, *rest.shape)),
        centres=np.broadcast_to(centres, (count, *centres.shape)),
        mean=mean,
        precision=np.asarray(prior.precision),
        ranges=prior.ranges,
        outlier=np.float32(outlier),
    )
    state = PoseState(
        vectors=mean,
        wrist_rotation=rotation.astype(np.float32),
        wrist_position=position.astype(np.float32),
    )
    return frames, state


def keyframes(track: Track, count: int) -> Int[Array, "k"]:
    """Up to `count` of a track's frames, spread over it: of each stretch the frame that shows most markers."""
    shown = track.believed.sum(axis=1)
    edges = np.unique(np.linspace(0, len(shown), count + 1).round().astype(int))
    return np.array([start + np.argmax(shown[start:stop]) for start, stop in itertools.pairwise(edges)])


def between_keyframes(
    frames: Int[Array, "b"], key: Int[Array, "k"], vectors: Float[Array, "k 15 3"]
) -> Float[Array, "b 15 3"]:
    """Rotation vectors of all frames, interpolated between the key frames'."""
    before, after, fraction = interpolation_index(frames[key].astype(float), frames.astype(float))
    step = fraction[:, None, None].astype(np.float32)
    return (1 - step) * vectors[before] + step * vectors[after]


def drawn_towards(frames: Frames, vectors: Float[Array, "b 15 3"], deviation: float) -> Frames:
    """The frames with a prior that is the present one times a normal one about `vectors` (rad)."""
    pull = np.eye(9) / deviation**2
    precision = frames.precision + pull
    off = (vectors - frames.mean).reshape(-1, 5, 9) / deviation**2
    mean = frames.mean + np.einsum("fpq,bfq->bfp", np.linalg.inv(precision), off).reshape(vectors.shape)
    return replace(frames, mean=mean.astype(np.float32), precision=precision.astype(np.float32))


def joined(pieces: list[tuple[Frames, PoseState]]) -> tuple[Frames, PoseState]:
    """The frames and poses of several tracks in one row."""
    frames = [piece[0] for piece in pieces]

    def row(name: str) -> Array:
        return np.concatenate([getattr(f, name) for f in frames])

    together = replace(frames[0], **{name: row(name) for name in BY_FRAME})
    return together, jax.tree.map(lambda *arrays: np.concatenate(arrays), *[piece[1] for piece in pieces])
