"""An objective's value, gradient and Hessian by the degrees of freedom, in closed form.

The derivative of a point by a joint's value is geometric: axis × lever for a joint that turns, the axis for one that
slides. So are the second derivatives: a joint nearer the base turns the derivative by a joint further out as it turns
everything else. With the Huber loss's own curvature that makes the full Hessian, not only Gauss and Newton's part of
it: where a hand cannot reach its target the residual is large, and Gauss-Newton needs many more steps
(docs/keypoints.md has the figures).

Everything is unrolled over the tree when it is traced, so that products that are zero by its structure cost nothing.
"""

from dataclasses import dataclass

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from mjx_hand.pytree import pytree
from mjx_hand.robots.solver.kinematic_tree import HELD, Base, KinematicTree, Placed, ancestors, forward
from mjx_hand.robots.solver.objectives import Objective, Targets
from mjx_hand.robots.solver.sparse_solve import Entries
from mjx_hand.robots.solver.stages import stage
from mjx_hand.robots.solver.triples import Scalar, Scalars, Triple, add, cross, dot, plus, product, subtract, times

FREE = 6  # unknowns of a base that moves: turns about the frame's axes, then shifts along them
_TINY = 1e-12  # m^2; keeps the length of a vanishing residual differentiable
_AXES: list[Triple] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]


@pytree
class Posture:
    """A hand's degrees of freedom and where its base stands. The batch is the last axis.

    Attributes:
        values: the degrees of freedom.
        rotation, position: frame from base; the identity and zero where the base does not move.
    """

    values: Float[Array | np.ndarray, "n b"]
    rotation: Float[Array | np.ndarray, "3 3 b"]
    position: Float[Array | np.ndarray, "3 b"]


@pytree
class Equations:
    """One linearisation.

    Attributes:
        value: the objective without its smoothness.
        gradient: by every unknown.
        hessian: the entries (row, column), row ≥ column, that the tree's structure allows to differ from zero.
        stiffness: the diagonal of Gauss and Newton's part, which is never negative.
    """

    value: Scalar
    gradient: Scalars
    hessian: Entries
    stiffness: Scalars


@dataclass(frozen=True)
class _Mover:
    """A joint, or a direction of the base's freedom, that moves a point."""

    unknown: int
    slope: Scalar
    axis: Triple | None  # None for one that slides: it turns nothing further out
    column: Triple  # derivative of the point by the unknown


def base_of(posture: Posture, objective: Objective) -> Base | None:
    """The base's place, None where it does not move."""
    if not objective.free_base:
        return None
    axes = [[posture.rotation[row, column] for row in range(3)] for column in range(3)]
    return Base(axes, [posture.position[k] for k in range(3)])


def place(posture: Posture, tree: KinematicTree, objective: Objective) -> Placed:
    """The tree in the frame of the targets."""
    return forward([posture.values[k] for k in range(tree.num_dofs)], tree, base_of(posture, objective))


def objective_value(posture: Posture, targets: Targets, tree: KinematicTree, objective: Objective) -> Float[Array, "b"]:
    """The objective at a posture, without smoothness."""
    placed = place(posture, tree, objective)
    loss = _component_loss if objective.kind == "position" else _vector_loss
    value: Scalar = 0.0
    for k, (origin, task) in enumerate(zip(objective.origins, objective.tasks, strict=True)):
        residual = subtract(_vector(placed, origin, task), [targets.vectors[k, axis] for axis in range(3)])
        part, *_ = loss(residual, targets.weights[k], jnp.asarray(objective.huber))
        value = plus(value, part)
    return jnp.broadcast_to(jnp.asarray(value), posture.values.shape[1:])


def linearise(posture: Posture, targets: Targets, tree: KinematicTree, objective: Objective) -> Equations:
    """Value, gradient and Hessian (or, as the objective says, Gauss and Newton's part of it) at a posture."""
    like = posture.values[0]
    placed = stage(lambda: place(posture, tree, objective), like)
    return stage(lambda: _equations(placed, posture, targets, tree, objective), like)


def _equations(
    placed: Placed, posture: Posture, targets: Targets, tree: KinematicTree, objective: Objective
) -> Equations:
    movers = {p: _movers(p, placed, tree, base_of(posture, objective)) for p in {*objective.tasks, *objective.origins}}
    columns = {p: _columns(moving) for p, moving in movers.items()}
    count = tree.num_dofs + FREE * objective.free_base
    value: Scalar = 0.0
    gradient: Scalars = [0.0] * count
    stiffness: Scalars = [0.0] * count
    hessian: Entries = {}
    pulls: dict[int, Triple] = {p: [0.0, 0.0, 0.0] for p in movers}
    for k, (origin, task) in enumerate(zip(objective.origins, objective.tasks, strict=True)):
        target = [targets.vectors[k, axis] for axis in range(3)]
        residual = subtract(_vector(placed, origin, task), target)
        loss = _component_loss if objective.kind == "position" else _vector_loss
        part, pull, stiff, curve = loss(residual, targets.weights[k], jnp.asarray(objective.huber))
        value = plus(value, part)
        ends = [(task, 1.0)] + ([(origin, -1.0)] if origin >= 0 else [])
        total: dict[int, Triple] = {}
        for point, sign in ends:
            pulls[point] = add(pulls[point], times(sign, pull))
            for unknown, column in columns[point].items():
                signed = column if sign > 0 else times(-1.0, column)
                total[unknown] = add(total[unknown], signed) if unknown in total else signed
        for row in sorted(total):
            gradient[row] = plus(gradient[row], dot(pull, total[row]))
            stiffened = [product(s, x) for s, x in zip(stiff, total[row], strict=True)]
            stiffness[row] = plus(stiffness[row], dot(stiffened, total[row]))
            bent = curve(total[row]) if objective.second_order else stiffened
            for column in (c for c in total if c <= row):
                _add(hessian, row, column, dot(bent, total[column]))
    if objective.second_order:
        for point, moving in movers.items():
            _add_turning(hessian, pulls[point], moving)
    return Equations(value=value, gradient=gradient, hessian=hessian, stiffness=stiffness)


def _vector(placed: Placed, origin: int, task: int) -> Triple:
    return placed.points[task] if origin < 0 else subtract(placed.points[task], placed.points[origin])


def _movers(point: int, placed: Placed, tree: KinematicTree, base: Base | None) -> list[_Mover]:
    """What moves a point, from the base outwards."""
    if point < 0:
        return []
    place, first = placed.points[point], 0 if base is None else FREE
    found = []
    if base is not None:
        lever = subtract(place, base.origin)
        # Shifts first: the base turns about its own origin, so that a turn leaves them as they are.
        found += [_Mover(3 + k, 1.0, None, axis) for k, axis in enumerate(_AXES)]
        found += [_Mover(k, 1.0, axis, cross(axis, lever)) for k, axis in enumerate(_AXES)]
    for joint in ancestors(tree, tree.point_joints[point]):
        if tree.dofs[joint] == HELD:
            continue
        axis, slope, unknown = placed.axes[joint], jnp.asarray(tree.slope)[joint], first + tree.dofs[joint]
        if tree.slides[joint]:
            found.append(_Mover(unknown, slope, None, times(slope, axis)))
        else:
            column = cross(axis, subtract(place, placed.origins[joint]))
            found.append(_Mover(unknown, slope, times(slope, axis), times(slope, column)))
    return found


def _columns(movers: list[_Mover]) -> dict[int, Triple]:
    """The derivative of a point by each unknown: tied joints' derivatives add up."""
    columns: dict[int, Triple] = {}
    for mover in movers:
        known = columns.get(mover.unknown)
        columns[mover.unknown] = mover.column if known is None else add(known, mover.column)
    return columns


def _add_turning(hessian: Entries, pull: Triple, movers: list[_Mover]) -> None:
    """Second derivatives of a point, weighed by the pull on it: each mover turns the columns of those further out."""
    for k, inner in enumerate(movers):
        if inner.axis is None:
            continue
        swept = cross(pull, inner.axis)
        for outer in movers[k:]:
            value = dot(swept, outer.column)
            twice = inner is not outer and inner.unknown == outer.unknown
            row, column = max(inner.unknown, outer.unknown), min(inner.unknown, outer.unknown)
            _add(hessian, row, column, product(2.0, value) if twice else value)


def _add(hessian: Entries, row: int, column: int, value: Scalar) -> None:
    hessian[row, column] = plus(hessian.get((row, column), 0.0), value)


def _vector_loss(residual: Triple, weight: Scalar, huber: Scalar):
    """weight · h(‖residual‖): value, gradient, Gauss-Newton's diagonal stiffness, and the Hessian as a function."""
    squared = dot(residual, residual) + _TINY
    inverse = 1 / jnp.sqrt(squared)
    length = squared * inverse
    far = length > huber
    value = weight * jnp.where(far, length - huber / 2, squared / (2 * huber))
    stiff = weight * jnp.where(far, inverse, 1 / huber)
    # Beyond huber the loss is straight along the residual: that direction's stiffness goes.
    straight = jnp.where(far, stiff * inverse * inverse, 0.0)

    def curve(column: Triple) -> Triple:
        return subtract(times(stiff, column), times(straight * dot(residual, column), residual))

    return value, times(stiff, residual), [stiff] * 3, curve


def _component_loss(residual: Triple, weight: Scalar, huber: Scalar):
    """weight · the sum of h over the components; as `_vector_loss`."""
    length = [jnp.abs(x) for x in residual]
    value = weight * sum(jnp.where(d > huber, d - huber / 2, d * d / (2 * huber)) for d in length)
    stiff = [weight / jnp.maximum(d, huber) for d in length]
    bends = [jnp.where(d > huber, 0.0, s) for d, s in zip(length, stiff, strict=True)]
    pull = [s * x for s, x in zip(stiff, residual, strict=True)]
    return value, pull, stiff, lambda column: [product(b, x) for b, x in zip(bends, column, strict=True)]
