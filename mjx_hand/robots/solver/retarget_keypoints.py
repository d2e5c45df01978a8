"""Recordings of 21 keypoints onto any hand: each frame on its own evidence, then frames held to their neighbours.

First every frame is solved alone, until its steps vanish. It starts where its own targets say (`posture_samples`), or
between the frames of every eight that are solved before, where that is nearer. A degree of freedom that nothing
shows in a frame takes its value from the frames before and after. Then some steps of all frames together hold
neighbours to each other, as `Objective.smoothness` says: per second, whatever the rate is.
"""

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from mjx_hand.errors import InputError
from mjx_hand.motion.gaps import fill_lines, fill_turns
from mjx_hand.motion.resample import interpolation_index
from mjx_hand.pytree import pytree
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
from mjx_hand.robots.solver.posture_samples import (
    determined,
    nearer_start,
    placed,
    posture_samples,
    range_posture,
    start_posture,
)
from mjx_hand.robots.solver.projected_newton import NEAR, Holds, Improved, improve
from mjx_hand.robots.solver.smoothing import held_share, links
from mjx_hand.rotations import matrix_to_quaternion

CHUNK = 256  # frames solved in one call: its arrays stay in the processor's cache
ROUNDS = (4, 4, 8, 16, 32, 64)  # iterations; after each, frames that have arrived leave the others
STRIDE = 8  # frames between those that are solved first
ELSEWHERE = 0.2  # rad or m; a posture beyond it may be on another side of a hill
AS_LOW = 1.02  # times a value of the objective, below which another is as good
OTHER_STARTS = (0.2, 0.8)  # of each range, for positions that are not reached
REACHED = 1e-7  # of the objective; below it each point is within half a millimetre
TOGETHER, WITH_BASE = 3, 12  # iterations of neighbours that hold each other; where the base makes up for joints
REST_HOLD = 1e-8  # draws degrees of freedom that nothing else determines to where they begin


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


def retarget_keypoints(
    keypoints: np.ndarray | Array,
    tree: KinematicTree,
    objective: Objective,
    *,
    fps: float | int = 30.0,
) -> Followed:
    """Follow recordings of keypoints; leading axes are recordings of one length, solved side by side.

    Args:
        keypoints: (..., frames, 21, 3), m, in the order of `capture.keypoints.layouts.KEYPOINTS`; NaN where one is
            missing. For an objective whose base stands still, in the base's frame (`palm_frame.in_palm`).
        tree: the hand.
        objective: what it is to do.
        fps: frames per second, which say how much of the smoothness neighbours feel.

    Raises:
        InputError: no frames, not 21 keypoints, infinite or huge coordinates, no frame with enough keypoints, or a
            rate that is none.
    """
    share = held_share(fps)
    given = check_keypoints(keypoints)
    *batch, frames = given.shape[:-2]
    flat = jnp.asarray(given.reshape(-1, *given.shape[-2:]), jnp.float32)
    first = np.arange(len(flat)) % frames == 0
    targets, seen = _targets(flat, jnp.asarray(~first), objective)
    valid = np.asarray(seen).reshape(*batch, frames)
    if not valid.any(axis=-1).all():
        raise InputError("keypoints: no frame of a recording shows enough of them to follow; give other frames")
    chosen = np.flatnonzero(seen)
    targets = jax.tree.map(lambda a: np.asarray(a)[..., chosen], targets)
    found = _alone(targets, chosen, frames, tree, objective)
    values = _with_unseen_filled(np.asarray(found.posture.values), targets, chosen, frames, tree, objective)
    linked = share * links(values, np.diff(chosen, prepend=-1) == 1, first[chosen])
    found = _together(found, values, targets, linked, tree, objective)

    quaternion = np.asarray(matrix_to_quaternion(jnp.moveaxis(jnp.asarray(found.posture.rotation), -1, 0)))
    rows = (found.posture.values.T, found.posture.position.T, quaternion, found.value[:, None])
    dofs, position, turn, value = (
        _everywhere(np.asarray(r, float), chosen, len(flat)).reshape(*batch, frames, r.shape[-1]) for r in rows
    )
    return Followed(
        dofs=_per_recording(fill_lines, dofs, valid),
        base_position=_per_recording(fill_lines, position, valid),
        base_quaternion=_per_recording(fill_turns, turn, valid),
        value=value[..., 0],
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


def _alone(
    targets: Targets, at: Int[np.ndarray, "b"], frames: int, tree: KinematicTree, objective: Objective
) -> Improved:
    """Every frame for itself, until its steps vanish.

    Args:
        targets: of the frames that show enough.
        at: their places among all frames of all recordings, each of `frames`.
        frames: see `at`.
        tree, objective: the hand and what it is to do.
    """
    parameters = jax.device_put((tree, objective))
    samples = jax.device_put(posture_samples(tree, objective))
    own = _in_chunks(lambda part: start_posture(part, samples, *parameters), targets)
    keys = _key_frames(at // frames)
    known = _keys_converged(_some(own, keys), _some(targets, keys), at[keys] // frames, parameters)
    before, after, share = interpolation_index(at[keys].astype(float), at.astype(float))
    between = ((1 - share) * known.values[:, before] + share * known.values[:, after]).astype(np.float32)
    start = _in_chunks(lambda part: nearer_start(*part, *parameters), (own, between, targets))
    found = _converged(start, targets, parameters)
    if objective.kind != "position":
        return found
    # With a base that moves there are dead ends; where one may be, other starts are tried.
    for where in OTHER_STARTS:
        behind = np.flatnonzero(found.value > REACHED)
        if not len(behind):
            break
        part = _some(targets, behind)
        values = np.repeat(range_posture(tree, where)[:, None], len(behind), axis=1)
        begin = _in_chunks(lambda both: placed(*both, *parameters), (values, part))
        found = _with_lower(found, behind, _converged(begin, part, parameters))
    return found


def _key_frames(recording: Int[np.ndarray, "b"]) -> Int[np.ndarray, "k"]:
    """Every eighth frame of each recording, and its last."""
    count = np.arange(len(recording))
    begins = np.flatnonzero(np.diff(recording, prepend=-1))
    rank = count - np.repeat(begins, np.diff(np.append(begins, len(recording))))
    return np.flatnonzero((rank % STRIDE == 0) | (np.diff(recording, append=-1) != 0))


def _keys_converged(
    start: Posture,
    targets: Targets,
    recording: Int[np.ndarray, "k"],
    parameters: tuple[KinematicTree, Objective],
) -> Posture:
    """The key frames, each from its own start and from where its neighbours are.

    The lowest end counts, and of ends that are about as low the one that goes on as the frame before does.
    """
    found = _converged(start, targets, parameters)
    for shift, slack in ((1, AS_LOW), (-1, 1.0), (1, AS_LOW)):
        there = np.asarray(found.posture.values)
        other = np.roll(there, shift, axis=1)
        elsewhere = np.abs(other - there).max(axis=0) > ELSEWHERE
        beside = np.flatnonzero(elsewhere & (np.roll(recording, shift) == recording))
        if not len(beside):
            continue
        part = _some(targets, beside)
        begin = _in_chunks(lambda both: placed(*both, *parameters), (other[:, beside], part))
        found = _with_lower(found, beside, _converged(begin, part, parameters), slack)
    return found.posture


def _some(arrays: Any, at: Int[np.ndarray, "k"]) -> Any:
    return jax.tree.map(lambda a: np.asarray(a)[..., at], arrays)


def _with_lower(found: Improved, at: Int[np.ndarray, "k"], again: Improved, slack: float = 1.0) -> Improved:
    """`found` with those frames of another search that end lower, or higher by no more than `slack` times."""
    lower = np.flatnonzero(again.value < slack * found.value[at])
    return jax.tree.map(lambda old, new: _put(old, at[lower], new[..., lower]), found, again)


def _converged(start: Posture, targets: Targets, parameters: tuple[KinematicTree, Objective]) -> Improved:
    count = targets.weights.shape[-1]
    found = Improved(posture=start, value=np.zeros(count, np.float32), left=np.full(count, np.inf, np.float32))
    for iterations in ROUNDS:
        going = np.flatnonzero(~(found.left < NEAR))
        if not len(going):
            break
        part = _some((found.posture, targets), going)

        def onwards(part: tuple[Posture, Targets], iterations: int = iterations) -> Improved:
            return solve_chunk(*part, np.zeros(CHUNK, np.float32), *parameters, iterations, NEAR)

        after = _in_chunks(onwards, part)
        found = jax.tree.map(lambda old, new: _put(old, going, new), found, after)  # noqa: B023
    return found


def _together(
    found: Improved,
    values: Float[np.ndarray, "n b"],
    targets: Targets,
    linked: Float[np.ndarray, "b"],
    tree: KinematicTree,
    objective: Objective,
) -> Improved:
    """All frames from there, with these degrees of freedom, neighbours holding each other.

    What a frame does reaches one neighbour an iteration: with a margin of as many frames as there are iterations the
    result is the same as that of all frames at once.
    """
    start = Posture(values=values, rotation=found.posture.rotation, position=found.posture.position)
    parameters = jax.device_put((tree, objective))
    steps = WITH_BASE if objective.free_base else TOGETHER
    return _in_chunks(lambda part: solve_chunk(*part, *parameters, steps, 0.0), (start, targets, linked), margin=steps)


def _with_unseen_filled(
    values: Float[np.ndarray, "n b"],
    targets: Targets,
    chosen: Int[np.ndarray, "b"],
    frames: int,
    tree: KinematicTree,
    objective: Objective,
) -> Float[np.ndarray, "n b"]:
    """Degrees of freedom that nothing shows, on lines between the frames of their recording where something does."""
    known = np.asarray(determined(targets, tree, objective))
    if known.all():
        return values
    values = values.copy()
    for recording in np.unique(chosen[~known.all(axis=0)] // frames):
        own = np.flatnonzero(chosen // frames == recording)
        for n in np.flatnonzero(~known[:, own].all(axis=1)):
            shown = own[known[n, own]]
            if len(shown):
                values[n, own] = np.interp(chosen[own], chosen[shown], values[n, shown])
    return values


def _put(old: np.ndarray, at: Int[np.ndarray, "k"], new: np.ndarray) -> np.ndarray:
    changed = np.array(old)
    changed[..., at] = new
    return changed


def _everywhere(rows: Float[np.ndarray, "b n"], at: Int[np.ndarray, "b"], count: int) -> Float[np.ndarray, "t n"]:
    """`rows` at their places, zero elsewhere."""
    whole = np.zeros((count, rows.shape[1]))
    whole[at] = rows
    return whole


def _in_chunks(function: Callable[[Any], Any], arrays: Any, margin: int = 0) -> Any:
    """`function` of arrays whose last axis is the frames, in chunks of one size that overlap by twice `margin`."""
    count, inner = jax.tree.leaves(arrays)[0].shape[-1], CHUNK - 2 * margin
    places = range(0, count, inner)
    behind = len(places) * inner - count + margin
    # What fills up the last chunk: nothing, so that it holds no frame; where none are held, what ends as they do.
    mode = "constant" if margin else "edge"
    padded = jax.tree.map(
        lambda a: np.pad(np.asarray(a), [(0, 0)] * (np.ndim(a) - 1) + [(margin, behind)], mode=mode), arrays
    )

    def one(first: int) -> Any:
        made = function(jax.tree.map(lambda a: a[..., first : first + CHUNK], padded))
        return jax.tree.map(lambda a: np.asarray(a)[..., margin : margin + inner], made)

    with ThreadPoolExecutor(len(os.sched_getaffinity(0))) as pool:  # JAX runs one such call on one core
        made = list(pool.map(one, places))
    return jax.tree.map(lambda *parts: np.concatenate(parts, axis=-1)[..., :count], *made)


@jax.jit
def solve_chunk(
    start: Posture,
    targets: Targets,
    linked: Float[Array | np.ndarray, "b"],
    tree: KinematicTree,
    objective: Objective,
    iterations: int | Array,
    near: float | Array,
) -> Improved:
    """Frames from given postures."""
    start, targets = jax.tree.map(jnp.asarray, (start, targets))
    values = jnp.asarray(start.values)
    strength = jnp.full(values.shape[1], REST_HOLD)
    holds = Holds(anchor=values, strength=strength, linked=jnp.asarray(linked))
    return improve(start, targets, holds, tree, objective, iterations, near)
