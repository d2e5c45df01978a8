"""A recorded hand's posture corrected: tips that touch lie on the surface, and nothing is in the object.

Capture is off by millimetres, contacts are made or missed by them. In each frame, angles and wrist near the recorded
ones are solved by damped Gauss-Newton steps: gaps of the fingers that touch, depths, the distance from what was
recorded. What changes over time is low-pass filtered; a second, stiffer solution then clears what the filter let in.
"""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from scipy.ndimage import median_filter

from envs.demonstrations.from_recording.grasp_pose import (
    GraspPose,
    capsule_axes,
    capsule_gaps,
    last_phalanges,
    linear_gaps,
)
from mjx_hand.hand.joints import NUM_HINGES
from mjx_hand.motion.resample import matrix_quaternions, quaternion_matrices
from mjx_hand.motion.smooth import smooth_rows
from mjx_hand.rigid.rigid_hand import RigidHand, on_device
from mjx_hand.rotations import exp

TOUCHES = 0.015  # m: a finger tip that is nearer than this, for long enough, while the object is handled, touches it
DEPTH = 0.002  # m that a hand may be in an object
_RAMP, _CHUNK, _STEPS = 0.3, 64, 14  # s; frames a call; Gauss-Newton steps
# What a residual of 1 is worth: gaps, depths (m), limits (rad); then hinges (rad), wrist (m, rad) off the recording.
_FIRST = (0.001, 0.0005, 0.02, 0.25, 0.015, 0.1)
_SECOND = (0.002, 0.0003, 0.02, 0.05, 0.003, 0.02)
_CLEARANCE = 0.0003  # m that the first solution keeps off where nothing touches, for the filter


def gaps_over_time(held: GraspPose, hand: RigidHand, planes: Float[np.ndarray, "h f 4"]) -> Float[np.ndarray, "t c"]:
    """Distance (m) of each of the hand's capsules from the object in each frame; negative inside."""
    bare, table = on_device(hand), jnp.asarray(_padded_planes(planes), jnp.float32)
    parts = [_gaps(*part, bare, table) for part in _chunks(held.angles, held.rotation, held.position)]
    return np.concatenate([np.asarray(part, float) for part in parts])[: len(held.angles)]


def touching_shares(
    gaps: Float[np.ndarray, "t c"], hand: RigidHand, handled: np.ndarray, fps: float
) -> Float[np.ndarray, "t 5"]:
    """How much each finger's tip is to touch in each frame, 0 to 1, with ramps.

    Args:
        gaps: of all capsules, as recorded (m).
        hand: whose they are.
        handled: frames in which the object is carried.
        fps: frames per second.
    """
    ramp = 2 * round(_RAMP * fps / 2) + 1
    near = gaps[:, last_phalanges(hand)] < TOUCHES
    about = np.convolve(handled, np.ones(ramp), mode="same")[: len(handled)] > 0
    near = median_filter(near & about[:, None], size=(ramp, 1), mode="nearest")
    window = np.hanning(ramp + 2)[1:-1]
    padded = np.pad(near.astype(float), ((ramp // 2, ramp // 2), (0, 0)), mode="edge")
    columns = [np.convolve(column, window / window.sum(), mode="valid") for column in padded.T]
    return np.clip(np.stack(columns, axis=1), 0, 1)


def corrected(
    held: GraspPose,
    shares: Float[np.ndarray, "t 5"],
    hand: RigidHand,
    planes: Float[np.ndarray, "h f 4"],
    fps: float,
    cutoff: float,
) -> GraspPose:
    """The posture nearest to the recorded one in which tips that are to touch do, and nothing is in the object.

    Args:
        held: as recorded.
        shares: how much each finger's tip is to touch.
        hand: the twin's; its capsules stand for its skin.
        planes: of the object's convex pieces.
        fps: frames per second.
        cutoff: Hz of the filter.
    """
    bare, table = on_device(hand), jnp.asarray(_padded_planes(planes), jnp.float32)
    first = _solved(held, shares, bare, table, _FIRST, _CLEARANCE)
    change = np.concatenate([first.angles - held.angles, first.position - held.position], axis=1)
    change = smooth_rows(change, fps, cutoff)
    quaternion = smooth_rows(matrix_quaternions(first.rotation), fps, cutoff)
    smooth = GraspPose(
        angles=held.angles + change[:, :NUM_HINGES],
        rotation=quaternion_matrices(quaternion / np.linalg.norm(quaternion, axis=1, keepdims=True)),
        position=held.position + change[:, NUM_HINGES:],
    )
    return _solved(smooth, shares, bare, table, _SECOND, 0.0)


def _solved(
    held: GraspPose,
    shares: Float[np.ndarray, "t 5"],
    hand: RigidHand,
    planes: Array,
    scales: tuple[float, ...],
    clearance: float,
) -> GraspPose:
    worth = jnp.asarray([*scales, clearance], jnp.float32)
    parts = [_solve(*part, hand, planes, worth) for part in _chunks(held.angles, held.rotation, held.position, shares)]
    rows = [np.concatenate([np.asarray(part[k], float) for part in parts])[: len(shares)] for k in range(3)]
    rotation = quaternion_matrices(matrix_quaternions(rows[1]))
    return GraspPose(np.clip(rows[0], hand.hinge_lower, hand.hinge_upper), rotation, rows[2])


@jax.jit
def _gaps(angles: Array, rotation: Array, position: Array, hand: RigidHand, planes: Array) -> Float[Array, "n c"]:
    return jax.lax.map(
        lambda row: capsule_gaps(row[0], row[1], row[2], hand, planes), (angles, rotation, position), batch_size=8
    )


@jax.jit
def _solve(
    angles: Array, rotation: Array, position: Array, shares: Array, hand: RigidHand, planes: Array, worth: Array
) -> tuple[Array, Array, Array]:
    touch, clear, limit, off_angle, off_place, off_turn, clearance = worth
    tips = jnp.array(last_phalanges(hand))

    def one(row: tuple[Array, Array, Array, Array]) -> tuple[Array, Array, Array]:
        q0, r0, p0, share = row

        def placed(x: Array) -> tuple[Array, Array, Array]:
            return x[:NUM_HINGES], r0 @ exp(x[NUM_HINGES + 3 :]), p0 + x[NUM_HINGES : NUM_HINGES + 3]

        def residual(x: Array) -> tuple[Array, Array]:
            q, r, p = placed(x)
            gaps = linear_gaps(capsule_axes(q, r, p, hand), jnp.asarray(hand.capsule_radius), planes)
            outside = jnp.maximum(q - hand.hinge_upper, 0) + jnp.maximum(hand.hinge_lower - q, 0)
            free = jnp.zeros_like(gaps).at[tips].set(share)
            rows = jnp.concatenate(
                [
                    share * gaps[tips] / touch,
                    jnp.minimum(gaps - clearance * (1 - free), 0.0) / clear,
                    outside / limit,
                    (q - q0) / off_angle,
                    x[NUM_HINGES : NUM_HINGES + 3] / off_place,
                    x[NUM_HINGES + 3 :] / off_turn,
                ]
            )
            return rows, rows

        def step(_: Array, state: tuple[Array, Array, Array]) -> tuple[Array, Array, Array]:
            x, damping, cost = state
            slope, rows = jax.jacfwd(residual, has_aux=True)(x)
            square = slope.T @ slope
            moved = x - jnp.linalg.solve(square + damping * jnp.diag(jnp.diagonal(square)), slope.T @ rows)
            new = jnp.sum(residual(moved)[0] ** 2)
            better = new < cost
            damping = jnp.clip(jnp.where(better, damping / 5, damping * 8), 1e-5, 1e3)
            return jnp.where(better, moved, x), damping, jnp.where(better, new, cost)

        start = jnp.concatenate([q0, jnp.zeros(6, q0.dtype)])
        first = (start, jnp.asarray(1e-2, q0.dtype), jnp.sum(residual(start)[0] ** 2))
        return placed(jax.lax.fori_loop(0, _STEPS, step, first)[0])

    return jax.lax.map(one, (angles, rotation, position, shares), batch_size=8)


def _chunks(*arrays: np.ndarray) -> list[tuple[Array, ...]]:
    """Parts of one size, the last one filled with its last frame: recordings of any length share a compilation."""
    parts = []
    for begin in range(0, len(arrays[0]), _CHUNK):
        rows = [array[begin : begin + _CHUNK] for array in arrays]
        missing = _CHUNK - len(rows[0])
        parts.append(
            tuple(jnp.asarray(np.concatenate([r, np.repeat(r[-1:], missing, axis=0)]), jnp.float32) for r in rows)
        )
    return parts


def _padded_planes(planes: Float[np.ndarray, "h f 4"]) -> Float[np.ndarray, "k g 4"]:
    """With pieces and faces repeated up to powers of two, so that few shapes are compiled."""
    pieces, faces = (max(1 << (n - 1).bit_length(), least) for n, least in zip(planes.shape[:2], (4, 64), strict=True))
    return np.pad(planes, ((0, pieces - len(planes)), (0, faces - planes.shape[1]), (0, 0)), mode="edge")
