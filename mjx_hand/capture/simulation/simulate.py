"""Simulated capture: what an optical system would have recorded of a known motion."""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int
from scipy.spatial.transform import Rotation

from mjx_hand.capture.marker_fit.skinned_points import SkinnedPoints, pose_points, shape_points, skinned_points
from mjx_hand.capture.markers.marker_recording import MarkerRecording
from mjx_hand.capture.markers.marker_set import MarkerSet
from mjx_hand.errors import InputError
from mjx_hand.hand.model import HandModel
from mjx_hand.motion.motion import Motion, check_motion
from mjx_hand.motion.resample import quaternion_matrices, resample_motion

CHUNK = 256  # frames a compiled call: recordings of every length share one compilation
BURST = 0.15  # mean length of a gap, s (an occluded finger's, in real recordings, is 0.1 to 0.6)


def simulate_markers(
    hand: HandModel,
    motion: Motion,
    marker_set: MarkerSet,
    seed: int,
    *,
    noise: float = 0.0005,
    gap_fraction: float = 0.05,
    placement: float = 0.001,
    sliding: float = 0.0,
    fps: float | None = None,
) -> MarkerRecording:
    """Record a known motion of a known hand as an optical system would.

    Each marker rides on the skin, its offset along the posed surface's normal; where it was stuck on differs from
    the marker set by a constant error. The same seed gives the same recording.

    Args:
        hand: the hand that moves.
        motion: how it moves; frames that are not valid show no marker.
        marker_set: the markers it wears.
        seed: of all random draws.
        noise: standard deviation of each coordinate in each frame, m.
        gap_fraction: mean share of frames in which a marker is hidden, in bursts of several frames.
        placement: standard deviation of each component of a marker's constant placement error, m.
        sliding: how far soft tissue carries a marker along the skin, in a direction of the marker's own, for each
            radian that the nearest joint turns, m; 0.002 to 0.005 on the back of a finger.
        fps: the capture system's rate; the motion's own if None.

    Raises:
        InputError: the motion is not for this hand, or an argument is out of range.
    """
    check_simulation(hand, motion, noise, gap_fraction, placement, sliding)
    if fps is not None and fps != motion.fps:
        motion = resample_motion(motion, fps)
    markers = len(marker_set.names)
    placing, noising, hiding, carrying = np.random.default_rng(seed).spawn(4)
    offset = np.zeros((markers, 3))
    offset[:, 0] = marker_set.offsets
    offset += placing.normal(scale=placement, size=offset.shape)
    slide = sliding * skin_slide(carrying, hand, motion, marker_set)
    local = posed_markers(hand, motion, marker_set, offset, slide)
    world = np.einsum("tab,tmb->tma", quaternion_matrices(motion.wrist_quaternion), local)
    world += motion.wrist_position[:, None, :] + noising.normal(scale=noise, size=world.shape)
    visible = ~gap_bursts(hiding, (motion.num_frames, markers), gap_fraction, BURST * motion.fps)
    visible &= motion.valid[:, None]
    return MarkerRecording(
        fps=motion.fps,
        positions=np.where(visible[..., None], world, 0.0),
        visible=visible,
        names=marker_set.names,
        source=f"simulated capture of {motion.source or 'a motion'}, seed {seed}",
    )


def check_simulation(
    hand: HandModel, motion: Motion, noise: float, gap_fraction: float, placement: float, sliding: float = 0.0
) -> None:
    """Refuse what cannot be simulated."""
    check_motion(motion)
    if motion.side != hand.side:
        raise InputError(f"a motion of the {motion.side} hand for {hand.name}, a {hand.side} hand; load the other side")
    if motion.link_offset is not None:
        raise InputError(
            "the motion carries link offsets of its own, which no skin goes with; "
            "give it without (link_offset=None) and with a shape of this hand"
        )
    if len(motion.shape) > hand.num_shape:
        raise InputError(f"the motion has {len(motion.shape)} shape coefficients, {hand.name} only {hand.num_shape}")
    if not 0 <= gap_fraction < 1:
        raise InputError(f"gap_fraction is {gap_fraction}, expected 0 to below 1")
    lengths = (noise, placement, sliding)
    if not (np.isfinite(lengths).all() and min(lengths) >= 0):
        raise InputError(
            f"noise is {noise}, placement {placement} and sliding {sliding}, expected metres, 0 or more each"
        )


def gap_bursts(
    rng: np.random.Generator, shape: tuple[int, int], fraction: float, mean_length: float
) -> Bool[np.ndarray, "t m"]:
    """Gaps of geometric length that hide each column for `fraction` of the time on average.

    A two-state Markov chain a marker: a gap ends with probability 1/mean_length a frame, and begins with the
    probability that balances it.
    """
    leave = 1 / max(mean_length, 1.0)
    enter = leave * fraction / (1 - fraction)
    draws = rng.random(shape)
    hidden = np.empty(shape, bool)
    hidden[0] = draws[0] < fraction
    for t in range(1, shape[0]):
        hidden[t] = draws[t] < np.where(hidden[t - 1], 1 - leave, enter)
    return hidden


def skin_slide(
    rng: np.random.Generator, hand: HandModel, motion: Motion, marker_set: MarkerSet
) -> Float[np.ndarray, "t m 3"]:
    """How far the skin carries each marker (normal, two tangents), for one metre a radian of its nearest joint.

    The nearest joint is that of the link, the wrist's excepted, that moves the marker most.
    """
    towards = rng.uniform(0, 2 * np.pi, len(marker_set.names))
    direction = np.stack([np.zeros_like(towards), np.cos(towards), np.sin(towards)], axis=1)
    joint = np.asarray(hand.weights)[marker_set.vertices, 1:].argmax(axis=1)
    angle = Rotation.from_matrix(motion.rotations[:, joint].reshape(-1, 3, 3)).magnitude()
    return angle.reshape(motion.num_frames, -1, 1) * direction


def posed_markers(
    hand: HandModel,
    motion: Motion,
    marker_set: MarkerSet,
    offset: Float[np.ndarray, "m 3"],
    slide: Float[np.ndarray, "t m 3"],
) -> Float[np.ndarray, "t m 3"]:
    """Marker centres relative to the wrist joint (m, hand axes); offsets and slides are (normal, two tangents)."""
    ring, corners, incident = one_rings(np.asarray(hand.faces), marker_set.vertices)
    points = skinned_points(hand, ring, np.zeros((len(ring), 3)), len(motion.shape))
    at = jnp.asarray(np.searchsorted(ring, marker_set.vertices))
    out = []
    for start in range(0, motion.num_frames, CHUNK):
        rotations = np.asarray(motion.rotations[start : start + CHUNK], np.float32)
        padding = np.broadcast_to(np.eye(3, dtype=np.float32), (CHUNK - len(rotations), 15, 3, 3))
        posed = marker_chunk(
            points,
            jnp.asarray(motion.shape, jnp.float32),
            jnp.concatenate([rotations, padding]),
            at,
            jnp.asarray(corners),
            jnp.asarray(incident, jnp.float32),
            jnp.asarray(offset, jnp.float32),
            jnp.asarray(np.pad(slide[start : start + CHUNK], ((0, len(padding)), (0, 0), (0, 0))), jnp.float32),
        )
        out.append(np.asarray(posed)[: len(rotations)])
    return np.concatenate(out).astype(np.float64)


@jax.jit
def marker_chunk(
    points: SkinnedPoints,
    shape: Float[Array, "s"],
    rotations: Float[Array, "b 15 3 3"],
    at: Int[Array, "m"],
    corners: Int[Array, "m k 3"],
    incident: Float[Array, "m k"],
    offset: Float[Array, "m 3"],
    slide: Float[Array, "b m 3"],
) -> Float[Array, "b m 3"]:
    """Markers of a chunk of frames: the skin about each marker, its normal and its tangents."""
    rest, centres = shape_points(points, jnp.broadcast_to(shape, (rotations.shape[0], *shape.shape)))
    skin = pose_points(points, rest, centres, rotations)
    triangles = skin[:, corners]
    edge1 = triangles[..., 1, :] - triangles[..., 0, :]
    area_normals = jnp.cross(edge1, triangles[..., 2, :] - triangles[..., 0, :])
    normal = unit(jnp.einsum("mk,bmkc->bmc", incident, area_normals))
    edge = edge1[:, :, 0]
    tangent = unit(edge - jnp.sum(edge * normal, axis=-1, keepdims=True) * normal)
    frame = jnp.stack([normal, tangent, jnp.cross(normal, tangent)], axis=-1)
    stuck = skin[:, at] + jnp.einsum("bmcd,md->bmc", frame, offset)
    return stuck + jnp.einsum("bmcd,bmd->bmc", frame, slide)


def unit(v: Float[Array, "*b 3"]) -> Float[Array, "*b 3"]:
    """v at length 1."""
    return v / jnp.linalg.norm(v, axis=-1, keepdims=True)


def one_rings(
    faces: Int[np.ndarray, "f 3"], vertices: Int[np.ndarray, "m"]
) -> tuple[Int[np.ndarray, "p"], Int[np.ndarray, "m k 3"], Bool[np.ndarray, "m k"]]:
    """The faces about each vertex.

    Returns:
        The vertices of all these faces; each face's corners as indices into them, padded to the largest count; and
        which of the k are faces, not padding.
    """
    about = [faces[(faces == v).any(axis=1)] for v in vertices]
    most = max(len(f) for f in about)
    corners = np.stack([np.concatenate([f, np.repeat(f[:1], most - len(f), axis=0)]) for f in about])
    incident = np.stack([np.arange(most) < len(f) for f in about])
    ring, inverse = np.unique(corners, return_inverse=True)
    return ring, inverse.reshape(corners.shape), incident
