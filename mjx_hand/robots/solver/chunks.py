"""Many frames in calls of one size, so that all numbers of frames run what was compiled once."""

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from mjx_hand.robots.solver.kinematic_tree import KinematicTree
from mjx_hand.robots.solver.normal_equations import Posture
from mjx_hand.robots.solver.objectives import Objective, Targets
from mjx_hand.robots.solver.projected_newton import Holds, Improved, improve

CHUNK = 256  # frames solved in one call: its arrays stay in the processor's cache
REST_HOLD = 1e-8  # draws degrees of freedom that nothing else determines to where they begin


def in_chunks(function: Callable[[Any], Any], arrays: Any, margin: int = 0) -> Any:
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
