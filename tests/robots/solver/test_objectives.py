"""What is asked of a robot hand: which tips are together, in which axes the palm is seen, where the base stands."""

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mjx_hand.errors import InputError
from mjx_hand.pytree import replace
from mjx_hand.robots.palm_frame import in_palm
from mjx_hand.robots.solver.alignment import aligned
from mjx_hand.robots.solver.kinematic_tree import BASE, tree_points
from mjx_hand.robots.solver.objectives import (
    Objective,
    Targets,
    brought_together,
    dexpilot_pairs,
    human_vectors,
    num_thumb_pairs,
    targets_of,
)
from tests.robots.solver.trees import small_tree


def test_tips_are_together_from_pinch_to_release():
    origins, tasks = dexpilot_pairs(3)
    human = tuple(4 * k for k in range(4))
    objective = Objective(
        kind="dexpilot",
        origins=origins,
        tasks=tasks,
        human_origins=tuple(human[k] for k in origins),
        human_tasks=tuple(human[k] for k in tasks),
    )
    assert num_thumb_pairs(objective) == 2
    apart = np.array([0.10, 0.04, 0.02, 0.04, 0.06, 0.04, 0.02, np.nan, 0.04])
    keypoints = np.zeros((len(apart), 21, 3), np.float32)
    keypoints[:, 8, 0] = apart  # the index tip, from the thumb's at the origin
    keypoints[:, 12, 1] = 0.02  # the middle finger's stays near
    vectors = human_vectors(jnp.asarray(keypoints), objective)
    linked = jnp.asarray([False, *[True] * 8])
    together = np.asarray(brought_together(vectors, objective, linked, jnp.zeros(2, bool)))
    expected = [False, False, True, True, False, False, True, True, True]
    np.testing.assert_array_equal(together[0], expected)
    assert together[1].all()
    again = brought_together(vectors, objective, linked.at[5].set(False), jnp.zeros(2, bool))
    np.testing.assert_array_equal(np.asarray(again)[0], expected)
    targets = targets_of(vectors, objective, jnp.asarray(together))
    np.testing.assert_allclose(targets.weights[0, :3] * 6, [1, 1, 200])  # thumb and index
    np.testing.assert_allclose(np.linalg.norm(targets.vectors[0, :, 2]), 1e-4, rtol=1e-2)
    np.testing.assert_allclose(targets.weights[2, 2] * 6, 400)  # index and middle: both touch the thumb, and are near
    assert targets.weights[0, 7] == 0


def test_palms_are_brought_to_the_robots_axes_from_any_frame(video):
    fingers, palmar = np.array([0.0, 0, 1]), np.array([1.0, 0, 0])
    seen = in_palm(video, "right", fingers, palmar)
    turn, shift = Rotation.from_rotvec([0.3, -1.2, 2.0]).as_matrix(), np.array([0.1, 2.0, -0.4])
    np.testing.assert_allclose(in_palm(video @ turn.T + shift, "right", fingers, palmar), seen, atol=1e-6)
    middle = seen[:, 9] / np.linalg.norm(seen[:, 9], axis=-1, keepdims=True)
    np.testing.assert_allclose(middle, np.tile(fingers, (len(seen), 1)), atol=1e-6)
    assert (seen[:, 5, 1] > seen[:, 13, 1]).all()  # a right hand's index finger lies on the side of fingers × palmar
    mirrored = in_palm(video * [1, -1, 1], "left", fingers, palmar)
    np.testing.assert_allclose(mirrored, seen * [1, -1, 1], atol=1e-6)
    with pytest.raises(InputError, match="give 'right' or 'left'"):
        in_palm(video, "both", fingers, palmar)


def test_alignment_finds_where_the_base_stands():
    tree = small_tree()
    objective = Objective(
        kind="position", origins=(BASE,) * 4, tasks=(0, 1, 2, 3), human_origins=(BASE,) * 4, human_tasks=(0, 5, 9, 17)
    )
    objective = replace(objective, free_base=True)
    rng = np.random.default_rng(8)
    values = rng.uniform(-1, 1, (50, 4)).astype(np.float32)
    turn, shift = Rotation.random(50, rng=rng).as_matrix(), rng.normal(0, 0.5, (50, 3))
    points = np.einsum("tij,tkj->tki", turn, tree_points(values, tree)) + shift[:, None]
    targets = Targets(vectors=jnp.asarray(np.moveaxis(points, 0, -1), jnp.float32), weights=jnp.full((4, 50), 0.25))
    found = jax.jit(partial(aligned))(jnp.asarray(values.T), targets, tree, objective)
    np.testing.assert_allclose(np.moveaxis(found.rotation, -1, 0), turn, atol=1e-3)
    np.testing.assert_allclose(np.asarray(found.position).T, shift, atol=1e-4)
