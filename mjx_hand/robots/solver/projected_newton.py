"""Damped Newton steps within limits, over a batch of frames at once.

A projected Newton method (Bertsekas, SIAM J. Control Optim. 20(2), 1982, https://doi.org/10.1137/0320018) with
Marquardt's damping: degrees of freedom that stand at a limit and are pulled outwards rest, the others take a Newton
step and are clipped to their limits. A frame whose objective a step does not lower goes back and tries a shorter one.
Each iteration looks at one place only, which serves the test of the step before and the next step. It shares no loop
with other solvers here: the batch stands last, the matrix is a dictionary of the entries that a hand's tree has, and
neighbouring frames hold each other.
"""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from mjx_hand.pytree import pytree, replace
from mjx_hand.robots.solver.kinematic_tree import KinematicTree
from mjx_hand.robots.solver.normal_equations import FREE, Equations, Posture, linearise
from mjx_hand.robots.solver.objectives import Objective, Targets
from mjx_hand.robots.solver.sparse_solve import solve_definite
from mjx_hand.robots.solver.triples import Scalars, plus
from mjx_hand.rotations import exp

INITIAL_DAMPING, LEAST_DAMPING, MOST_DAMPING = 1e-3, 1e-6, 1e3
ACCEPTED, REJECTED = 0.2, 4.0  # the damping's factors after a good and a bad step
SHORTER = 0.3  # of a bad step, what is tried next
FLOOR = 0.02  # least pivot, of Gauss and Newton's stiffness
_LEAST_STIFFNESS = 1e-6  # of an unknown that nothing holds
LONGEST = 0.5  # rad or m; beyond it the objective's quadratic model says nothing
_AT_LIMIT = 1e-6
NEAR = 2e-3  # rad or m; a step shorter than that ends a search


@pytree
class Holds:
    """What keeps the degrees of freedom near something, frame by frame.

    Attributes:
        anchor: where they are held, for every frame.
        strength: of each frame's hold; `strength` · ‖values - anchor‖² is added to the objective.
        linked: how much of `smoothness` holds a frame and the one before it in the batch together, 0 for none.
    """

    anchor: Float[Array, "n b"]
    strength: Float[Array, "b"]
    linked: Float[Array, "b"]


@pytree
class _Search:
    """The best place so far, the step being tried from it, and the most that it moves any unknown by."""

    best: Posture
    step: Float[Array, "u b"]
    value: Float[Array, "b"]
    damping: Float[Array, "b"]
    left: Float[Array, "b"]


@pytree
class Improved:
    """What a search found.

    Attributes:
        posture: the best place.
        value: the objective there, without holds and smoothness.
        left: how far (rad or m) the next step would move the unknown that it moves most.
    """

    posture: Posture
    value: Float[Array | np.ndarray, "b"]
    left: Float[Array | np.ndarray, "b"]


def improve(
    start: Posture,
    targets: Targets,
    holds: Holds,
    tree: KinematicTree,
    objective: Objective,
    iterations: int | Int[Array, ""],
    near: float | Float[Array, ""] = NEAR,
) -> Improved:
    """The postures where the next step is smaller than `near`, or that are reached after a number of iterations.

    A frame that has arrived rests while others of the batch go on: alone it would end in the same place.

    Args:
        start: within the limits.
        targets, holds: what to follow and where to stay.
        tree, objective: the hand and what is asked of it.
        iterations: at most; one or more.
        near: rad or m; 0 for all iterations.
    """
    count, batch = tree.num_dofs + FREE * objective.free_base, start.values.shape[1]

    def goes_on(search: _Search) -> Bool[Array, "b"]:
        return ~(search.left < near)

    def iterate(search: _Search) -> _Search:
        tried = _moved(search.best, search.step, tree, objective)
        equations = linearise(tried, targets, tree, objective)
        anchor, strength = _held(search.best, holds, objective)
        value = jnp.asarray(equations.value)
        better = value + _pull(tried, anchor, strength) <= search.value + _pull(search.best, anchor, strength)
        damping = jnp.clip(search.damping * jnp.where(better, ACCEPTED, REJECTED), LEAST_DAMPING, MOST_DAMPING)
        step = _step(tried, equations, anchor, strength, damping, tree, objective)
        step = jnp.where(better, step, SHORTER * search.step)
        best = jax.tree.map(lambda new, old: jnp.where(better, new, old), tried, search.best)
        after = _Search(
            best=best,
            step=step,
            value=jnp.where(better, value, search.value),
            damping=damping,
            left=_reach(best, step, tree, objective),
        )
        moving = goes_on(search)
        return jax.tree.map(lambda new, old: jnp.where(moving, new, old), after, search)

    begin = _Search(
        best=start,
        step=jnp.zeros((count, batch)),
        value=jnp.full((batch,), jnp.inf),
        damping=jnp.full((batch,), INITIAL_DAMPING / ACCEPTED),
        left=jnp.full((batch,), jnp.inf),
    )
    _, search = jax.lax.while_loop(
        lambda state: (state[0] < iterations) & goes_on(state[1]).any(),
        lambda state: (state[0] + 1, iterate(state[1])),
        (jnp.zeros((), jnp.int32), begin),
    )
    return Improved(posture=search.best, value=search.value, left=search.left)


def _moved(posture: Posture, step: Float[Array, "u b"], tree: KinematicTree, objective: Objective) -> Posture:
    lower, upper = jnp.asarray(tree.lower)[:, None], jnp.asarray(tree.upper)[:, None]
    if not objective.free_base:
        return replace(posture, values=jnp.clip(posture.values + step, lower, upper))
    turn = jnp.moveaxis(exp(jnp.moveaxis(step[:3], 0, -1)), 0, -1)
    return Posture(
        values=jnp.clip(posture.values + step[FREE:], lower, upper),
        rotation=jnp.sum(turn[:, :, None] * posture.rotation[None], axis=1),
        position=posture.position + step[3:FREE],
    )


def _reach(best: Posture, step: Float[Array, "u b"], tree: KinematicTree, objective: Objective) -> Float[Array, "b"]:
    """How far a step moves the unknown that it moves most, limits kept."""
    first = FREE * objective.free_base
    lower, upper = jnp.asarray(tree.lower)[:, None], jnp.asarray(tree.upper)[:, None]
    moved = jnp.clip(best.values + step[first:], lower, upper) - best.values
    return jnp.max(jnp.abs(jnp.concatenate([step[:first], moved])), axis=0)


def _held(best: Posture, holds: Holds, objective: Objective) -> tuple[Float[Array, "n b"], Float[Array, "b"]]:
    """Anchor and strength of all holds on a frame: its own, and the frames before and after as they are now."""
    # One neighbour alone would pull a hand that moves back, or on: a frame is held between two or not at all.
    both = jnp.minimum(holds.linked, jnp.roll(holds.linked, -1).at[-1].set(0.0))
    neighbours = both * (jnp.roll(best.values, 1, axis=1) + jnp.roll(best.values, -1, axis=1))
    smoothness = jnp.asarray(objective.smoothness)
    strength = holds.strength + smoothness * 2 * both
    anchor = (holds.strength * holds.anchor + smoothness * neighbours) / jnp.maximum(strength, 1e-20)
    return anchor, strength


def _pull(posture: Posture, anchor: Float[Array, "n b"], strength: Float[Array, "b"]) -> Float[Array, "b"]:
    return strength * jnp.sum((posture.values - anchor) ** 2, axis=0)


def _step(
    posture: Posture,
    equations: Equations,
    anchor: Float[Array, "n b"],
    strength: Float[Array, "b"],
    damping: Float[Array, "b"],
    tree: KinematicTree,
    objective: Objective,
) -> Float[Array, "u b"]:
    """The step to try next from `posture`."""
    first = FREE * objective.free_base
    gradient, stiffness = list(equations.gradient), list(equations.stiffness)
    matrix = dict(equations.hessian)
    free: Scalars = [True] * first
    for k in range(tree.num_dofs):
        u, value = first + k, posture.values[k]
        gradient[u] = plus(gradient[u], 2 * strength * (value - anchor[k]))
        # Neighbours move in the same iteration: with twice the curvature the two do not overshoot each other.
        matrix[u, u] = plus(matrix.get((u, u), 0.0), 4 * strength)
        stiffness[u] = plus(stiffness[u], 4 * strength)
        at_lower = (value <= jnp.asarray(tree.lower)[k] + _AT_LIMIT) & (gradient[u] > 0)
        at_upper = (value >= jnp.asarray(tree.upper)[k] - _AT_LIMIT) & (gradient[u] < 0)
        free.append(~(at_lower | at_upper))
    for u in range(len(gradient)):
        matrix[u, u] = plus(matrix.get((u, u), 0.0), damping * stiffness[u])
        if u >= first:
            matrix[u, u] = jnp.where(free[u], matrix[u, u], 1.0)
    for row, column in matrix:
        if row != column:
            for u in (row, column):
                if u >= first:
                    matrix[row, column] = jnp.where(free[u], matrix[row, column], 0.0)
    right = [-g if f is True else jnp.where(f, -g, 0.0) for g, f in zip(gradient, free, strict=True)]
    floor = [FLOOR * s + _LEAST_STIFFNESS for s in stiffness]
    return jnp.clip(jnp.stack(solve_definite(matrix, right, floor)), -LONGEST, LONGEST)
