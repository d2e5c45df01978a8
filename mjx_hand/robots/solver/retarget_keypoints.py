"""Recordings of 21 keypoints onto any hand: all frames at once, coarse in time first.

Every eighth frame is solved from the rest posture; between them the result is interpolated, which is so near that a few
steps of all frames together finish it. Neighbouring frames hold each other as `Objective.smoothness` says.
"""

import os
from concurrent.futures import ThreadPoolExecutor

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from mjx_hand.errors import InputError
from mjx_hand.motion.gaps import fill_lines, fill_turns
from mjx_hand.motion.resample import interpolation_index
from mjx_hand.pytree import pytree
from mjx_hand.robots.solver.alignment import aligned
from mjx_hand.robots.solver.kinematic_tree import KinematicTree
from mjx_hand.robots.solver.normal_equations import Posture
from mjx_hand.robots.solver.objectives import (
    Objective,
    Targets,
    brought_together,
    human_vectors,
    num_thumb_pairs,
    targets_of,
)
from mjx_hand.robots.solver.projected_newton import Holds, improve
from mjx_hand.rotations import matrix_to_quaternion

CHUNK = 256  # frames solved in one call: its arrays stay in the processor's cache
STRIDE = 8  # frames between those that are solved first
COARSE, FINE = 40, 5  # iterations of those, and then of all frames
REST_HOLD = 1e-8  # draws degrees of freedom that nothing else determines to the rest posture


@pytree
class Followed:
    """What a hand does to follow keypoints. Degrees of freedom in the order of the tree's `dof_names`.

    Attributes:
        dofs: rad (m for sliding joints).
        base_position, base_quaternion: the base in the keypoints' frame, m and wxyz; zero and the identity where the
            objective holds it still.
        value: the objective, without smoothness.
        valid: False where too few keypoints were seen to say anything; the postures there are interpolated.
    """

    dofs: Float[np.ndarray, "*b t n"]
    base_position: Float[np.ndarray, "*b t 3"]
    base_quaternion: Float[np.ndarray, "*b t 4"]
    value: Float[np.ndarray, "*b t"]
    valid: Bool[np.ndarray, "*b t"]


def rest_posture(tree: KinematicTree) -> Float[Array, "n"]:
    """Where a search begins: the middle of each range; zero, as near as the limits allow, where a range has no end."""
    lower, upper = jnp.asarray(tree.lower), jnp.asarray(tree.upper)
    bounded = jnp.isfinite(lower) & jnp.isfinite(upper)
    return jnp.where(bounded, (lower + upper) / 2, jnp.clip(0.0, lower, upper))


def retarget_keypoints(
    keypoints: np.ndarray | Array,
    tree: KinematicTree,
    objective: Objective,
    *,
    coarse: int = COARSE,
    fine: int = FINE,
) -> Followed:
    """Follow recordings of keypoints; leading axes are recordings of one length, solved side by side.

    Args:
        keypoints: (..., frames, 21, 3), m, in the order of `capture.keypoints.layouts.KEYPOINTS`; NaN where one is
            missing. For an objective whose base stands still, in the base's frame (`palm_frame.in_palm`).
        tree: the hand.
        objective: what it is to do.
        coarse, fine: iterations of every eighth frame, then of all.

    Raises:
        InputError: no frames, not 21 keypoints, infinite or huge coordinates, no frame with enough keypoints, or
            iterations out of range.
    """
    if not (coarse > 0 and 0 < fine <= CHUNK // 4):
        raise InputError(f"coarse and fine are {coarse} and {fine}; give at least 1, and fine up to {CHUNK // 4}")
    given = check_keypoints(keypoints)
    *batch, frames = given.shape[:-2]
    flat = jnp.asarray(given.reshape(-1, *given.shape[-2:]), jnp.float32)
    linked = np.ones((flat.shape[0] // frames, frames), bool)
    linked[:, 0] = False
    targets, seen = _targets(flat, jnp.asarray(linked.ravel()), objective)
    valid = np.asarray(seen).reshape(*batch, frames)
    if not valid.any(axis=-1).all():
        raise InputError("keypoints: no frame of a recording shows enough of them to follow; give other frames")
    posture, value = _solve(targets, valid.ravel(), frames, tree, objective, coarse, fine)
    quaternion = np.asarray(matrix_to_quaternion(jnp.moveaxis(posture.rotation, -1, 0)))
    rows = (posture.values.T, posture.position.T, quaternion)
    dofs, position, turn = (np.asarray(r, float).reshape(*batch, frames, r.shape[-1]) for r in rows)
    return Followed(
        dofs=_per_recording(fill_lines, dofs, valid),
        base_position=_per_recording(fill_lines, position, valid),
        base_quaternion=_per_recording(fill_turns, turn, valid),
        value=np.where(valid, np.asarray(value, float).reshape(*batch, frames), 0.0),
        valid=valid,
    )


def check_keypoints(keypoints: np.ndarray | Array) -> Float[np.ndarray, "*b t 21 3"]:
    """`keypoints` as an array, if they are such.

    Raises:
        InputError: no frames, another shape, or coordinates that cannot be metres.
    """
    given = np.asarray(keypoints)
    if given.dtype.kind not in "fiu" or given.ndim < 3 or given.shape[-2:] != (21, 3) or given.size == 0:
        raise InputError(
            f"keypoints have shape {given.shape}; give (..., frames, 21, 3) numbers (m), one frame or more"
        )
    if (np.abs(given[~np.isnan(given)]) > 1e3).any():
        raise InputError("keypoints lie kilometres away or are infinite; give metres, and NaN where one is missing")
    return given


def _per_recording(fill, rows: np.ndarray, valid: np.ndarray) -> np.ndarray:
    if valid.all():
        return rows
    flat = zip(rows.reshape(-1, *rows.shape[-2:]), valid.reshape(-1, valid.shape[-1]), strict=True)
    return np.stack([fill(r, v) for r, v in flat]).reshape(rows.shape)


def enough(targets: Targets, objective: Objective) -> Bool[Array, "b"]:
    """Whether a frame shows enough vectors to say something: three points for a base that moves, else any."""
    return jnp.sum(targets.weights > 0, axis=0) >= (3 if objective.free_base else 1)


@jax.jit
def _targets(
    keypoints: Float[Array, "b 21 3"], linked: Bool[Array, "b"], objective: Objective
) -> tuple[Targets, Bool[Array, "b"]]:
    vectors = human_vectors(keypoints, objective)
    apart = jnp.zeros(num_thumb_pairs(objective), bool)
    targets = targets_of(vectors, objective, brought_together(vectors, objective, linked, apart))
    return targets, enough(targets, objective)


def _solve(
    targets: Targets,
    seen: Bool[np.ndarray, "b"],
    frames: int,
    tree: KinematicTree,
    objective: Objective,
    coarse: int,
    fine: int,
) -> tuple[Posture, Float[np.ndarray, "b"]]:
    """All recordings, of `frames` frames each, from nothing. Frames in gaps hold none beside them."""
    targets = jax.tree.map(np.asarray, targets)
    count = targets.weights.shape[-1]
    few = np.unique([*range(0, frames, STRIDE), frames - 1])
    chosen = (np.arange(0, count, frames)[:, None] + few).ravel()
    rest = np.tile(np.asarray(rest_posture(tree))[:, None], len(chosen))
    sparse = jax.tree.map(lambda a: a[..., chosen], targets)
    found, _ = _in_chunks(rest, sparse, np.zeros(len(chosen), np.float32), tree, objective, coarse, 0)
    before, after, share = interpolation_index(few.astype(float), np.arange(frames, dtype=float))
    values = np.asarray(found.values).reshape(tree.num_dofs, -1, len(few))
    between = (1 - share) * values[..., before] + share * values[..., after]
    linked = (np.tile(np.arange(frames) > 0, count // frames) & seen & np.roll(seen, 1)).astype(np.float32)
    return _in_chunks(between.reshape(tree.num_dofs, -1), targets, linked, tree, objective, fine, fine)


def _in_chunks(
    start: Float[np.ndarray, "n b"],
    targets: Targets,
    linked: Float[np.ndarray, "b"],
    tree: KinematicTree,
    objective: Objective,
    iterations: int,
    margin: int,
) -> tuple[Posture, Float[np.ndarray, "b"]]:
    """Frames in chunks of one size, which overlap by twice `margin` frames.

    What a frame does reaches one neighbour an iteration: with a margin of as many frames as there are iterations the
    result is the same as that of all frames at once.
    """
    count, inner = len(linked), CHUNK - 2 * margin
    places = range(0, count, inner)
    behind = len(places) * inner - count + margin
    frames = (start.astype(np.float32), targets, linked)
    padded = jax.tree.map(lambda a: np.pad(a, [(0, 0)] * (a.ndim - 1) + [(margin, behind)]), frames)
    parameters = jax.device_put((tree, objective))

    def one(first: int) -> tuple[Posture, np.ndarray]:
        solved = solve_chunk(*jax.tree.map(lambda a: a[..., first : first + CHUNK], padded), *parameters, iterations)
        return jax.tree.map(lambda a: np.asarray(a)[..., margin : margin + inner], solved)

    with ThreadPoolExecutor(len(os.sched_getaffinity(0))) as pool:  # JAX runs one such call on one core
        solved = list(pool.map(one, places))
    return jax.tree.map(lambda *parts: np.concatenate(parts, axis=-1)[..., :count], *solved)


@jax.jit
def solve_chunk(
    start: Float[Array | np.ndarray, "n b"],
    targets: Targets,
    linked: Float[Array | np.ndarray, "b"],
    tree: KinematicTree,
    objective: Objective,
    iterations: int | Array,
) -> tuple[Posture, Float[Array, "b"]]:
    """Frames from given degrees of freedom, a base that moves from where it fits these best."""
    targets = jax.tree.map(jnp.asarray, targets)
    posture = aligned(jnp.asarray(start), targets, tree, objective)
    rest = jnp.broadcast_to(rest_posture(tree)[:, None], start.shape)
    holds = Holds(anchor=rest, strength=jnp.full(rest.shape[1], REST_HOLD), linked=jnp.asarray(linked))
    return improve(posture, targets, holds, tree, objective, iterations)
