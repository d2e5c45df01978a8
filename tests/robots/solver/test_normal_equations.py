"""The objective's derivatives, against automatic differentiation, and the sparse systems they make."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mjx_hand.robots.solver.kinematic_tree import BASE, tree_points
from mjx_hand.robots.solver.normal_equations import FREE, Posture, linearise
from mjx_hand.robots.solver.objectives import Objective, Targets
from mjx_hand.robots.solver.sparse_solve import solve_definite
from mjx_hand.rotations import axis_angle_matrix
from tests.robots.solver.trees import small_tree


@pytest.mark.parametrize("kind", ["vector", "position"])
@pytest.mark.parametrize("free_base", [True, False])
def test_gradient_and_hessian_are_those_of_automatic_differentiation(kind, free_base):
    """Huber's straight part, both sides of it, tied and sliding joints, vectors between moving points."""
    tree = small_tree()
    objective = Objective(
        kind=kind,
        origins=(BASE, 0, 3, 1),
        tasks=(1, 2, 2, 3),
        human_origins=(0,) * 4,
        human_tasks=(1, 2, 3, 4),
        free_base=free_base,
    )
    rng = np.random.default_rng(5)
    targets = Targets(
        vectors=jnp.asarray(rng.uniform(-0.06, 0.06, (4, 3, 1)), jnp.float32),
        weights=jnp.asarray([[1.0], [0.5], [2.0], [0.0]]),
    )
    turn = Rotation.random(rng=rng).as_matrix().astype(np.float32)

    def posture_at(unknowns):
        step = unknowns[:FREE] if free_base else jnp.zeros(FREE)
        # Turns about the three axes one after the other, whose second derivatives the solver takes.
        spin = jnp.eye(3)
        for k in range(3):
            spin = spin @ axis_angle_matrix(jnp.eye(3)[k], step[k])
        rotation = (spin @ turn if free_base else jnp.eye(3))[..., None]
        return Posture(values=unknowns[-4:, None], rotation=rotation, position=step[3:, None])

    def value(unknowns):
        """The objective from its definition."""
        posture = posture_at(unknowns)
        points = posture.rotation[..., 0] @ tree_points(posture.values[:, 0], tree).T + posture.position
        begin = jnp.stack([points[:, k] if k >= 0 else jnp.zeros(3) for k in objective.origins])
        error = points[:, jnp.array(objective.tasks)].T - begin - targets.vectors[..., 0]
        size = jnp.abs(error) if kind == "position" else jnp.linalg.norm(error, axis=1, keepdims=True)
        huber = jnp.where(size < 0.02, size**2 / 0.04, size - 0.01)
        return jnp.sum(targets.weights * huber)

    start = jnp.concatenate([jnp.zeros(FREE * free_base), jnp.asarray(rng.uniform(-1, 1, 4), jnp.float32)])
    found = jax.jit(lambda unknowns: linearise(posture_at(unknowns), targets, tree, objective))(start)
    gradient = jax.jit(jax.jacfwd(value))(start)
    hessian = np.asarray(jax.jit(jax.jacfwd(jax.jacfwd(value)))(start))
    np.testing.assert_allclose(found.value[0], jax.jit(value)(start), rtol=1e-5)
    np.testing.assert_allclose(np.array([g[0] for g in found.gradient]), gradient, rtol=1e-4, atol=1e-4)
    mine = np.zeros_like(hessian)
    for (row, column), entry in found.hessian.items():
        mine[row, column] = mine[column, row] = entry[0]
    np.testing.assert_allclose(mine, hessian, rtol=1e-3, atol=2e-3 * np.abs(hessian).max())


def test_sparse_systems_are_solved():
    rng = np.random.default_rng(6)
    tree_like = [(3, 0), (3, 2), (4, 1), (2, 0)]  # and entries that fill in
    entries = {(k, k): jnp.asarray([5.0 + k]) for k in range(5)} | {
        p: jnp.asarray(rng.normal(size=1)) for p in tree_like
    }
    dense = np.zeros((5, 5))
    for (i, j), value in entries.items():
        dense[i, j] = dense[j, i] = float(value[0])
    right = rng.normal(size=5)
    found = solve_definite(entries, [jnp.asarray([r]) for r in right], [1e-6] * 5)
    np.testing.assert_allclose(np.array(found)[:, 0], np.linalg.solve(dense, right), rtol=1e-5)
