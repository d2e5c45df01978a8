"""Every frame of recordings on its own evidence, until its steps vanish.

A frame starts where its own targets say (`posture_samples`), or between the frames of every eight that are solved
before, where that is nearer.
"""

from typing import Any

import jax
import numpy as np
from jaxtyping import Int

from mjx_hand.motion.resample import interpolation_index
from mjx_hand.robots.solver.chunks import CHUNK, in_chunks, solve_chunk
from mjx_hand.robots.solver.kinematic_tree import KinematicTree
from mjx_hand.robots.solver.normal_equations import Posture
from mjx_hand.robots.solver.objectives import Objective, Targets
from mjx_hand.robots.solver.posture_samples import nearer_start, placed, posture_samples, range_posture, start_posture
from mjx_hand.robots.solver.projected_newton import NEAR, Improved

ROUNDS = (4, 4, 8, 16, 32, 64)  # iterations; after each, frames that have arrived leave the others
STRIDE = 8  # frames between those that are solved first
ELSEWHERE = 0.2  # rad or m; a posture beyond it may be on another side of a hill
AS_LOW = 1.02  # times a value of the objective, below which another is as good
OTHER_STARTS = (0.2, 0.8)  # of each range, for positions that are not reached
REACHED = 1e-7  # of the objective; below it each point is within half a millimetre


def solve_alone(
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
    own = in_chunks(lambda part: start_posture(part, samples, *parameters), targets)
    keys = _key_frames(at // frames)
    known = _keys_converged(_some(own, keys), _some(targets, keys), at[keys] // frames, parameters)
    before, after, share = interpolation_index(at[keys].astype(float), at.astype(float))
    between = ((1 - share) * known.values[:, before] + share * known.values[:, after]).astype(np.float32)
    start = in_chunks(lambda part: nearer_start(*part, *parameters), (own, between, targets))
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
        begin = in_chunks(lambda both: placed(*both, *parameters), (values, part))
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
        begin = in_chunks(lambda both: placed(*both, *parameters), (other[:, beside], part))
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

        after = in_chunks(onwards, part)
        found = jax.tree.map(lambda old, new: _put(old, going, new), found, after)  # noqa: B023
    return found


def _put(old: np.ndarray, at: Int[np.ndarray, "k"], new: np.ndarray) -> np.ndarray:
    changed = np.array(old)
    changed[..., at] = new
    return changed
