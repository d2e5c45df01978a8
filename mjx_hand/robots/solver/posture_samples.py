"""Where a search begins: the mean of the postures whose points lie near a frame's own targets.

Some hundred postures are spread over the ranges of every finger's joints (a Latin hypercube), once for a hand and an
objective. Of a frame's targets the start is then E[posture | targets], with normal errors: a smooth function of that
frame alone, near enough to the end that few steps are left, and on the same side of local minima for targets that are
nearly the same. A finger none of whose points is seen begins in the middle of its ranges.
"""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from mjx_hand.pytree import pytree, replace, static
from mjx_hand.robots.solver.alignment import aligned
from mjx_hand.robots.solver.kinematic_tree import HELD, KinematicTree, ancestors, tree_points
from mjx_hand.robots.solver.normal_equations import Posture, objective_value
from mjx_hand.robots.solver.objectives import Objective, Targets

COUNT = 128  # postures
_WIDTH = 0.12  # the errors' standard deviation, of the spread of a group's points
_AS_NEAR = 1.5  # times the objective's value of a frame's own start, below which another start is taken
_TURN = np.pi  # rad; the half range of a joint without limits


@pytree
class PostureSamples:
    """Postures of a hand, and where its points are in them, in the base's frame.

    Attributes:
        dofs: the postures.
        vectors: the objective's vectors (m).
        width: standard deviation (m) of each group's errors.
        groups: degrees of freedom that share vectors, and these vectors: a finger each, where fingers are apart.
    """

    dofs: Float[Array | np.ndarray, "m n"]
    vectors: Float[Array | np.ndarray, "m k 3"]
    width: Float[Array | np.ndarray, "g"]
    groups: tuple[tuple[tuple[int, ...], tuple[int, ...]], ...] = static()


def rest_posture(tree: KinematicTree) -> Float[Array, "n"]:
    """The middle of each range; zero, as near as the limits allow, where a range has no end."""
    lower, upper = jnp.asarray(tree.lower), jnp.asarray(tree.upper)
    bounded = jnp.isfinite(lower) & jnp.isfinite(upper)
    return jnp.where(bounded, (lower + upper) / 2, jnp.clip(0.0, lower, upper))


def moved_by(tree: KinematicTree, point: int) -> set[int]:
    """The degrees of freedom that move a point."""
    above = ancestors(tree, tree.point_joints[point]) if point >= 0 else ()
    return {tree.dofs[joint] for joint in above if tree.dofs[joint] != HELD}


def determined(targets: Targets, tree: KinematicTree, objective: Objective) -> Bool[Array, "n b"]:
    """Whether a frame shows a vector that a degree of freedom changes."""
    pairs = zip(objective.origins, objective.tasks, strict=True)
    changes = [moved_by(tree, origin) | moved_by(tree, task) for origin, task in pairs]
    table = np.array([[n in moved for moved in changes] for n in range(tree.num_dofs)], float)
    return jnp.asarray(table) @ jnp.where(jnp.asarray(targets.weights) > 0, 1.0, 0.0) > 0


def range_posture(tree: KinematicTree, share: float) -> Float[np.ndarray, "n"]:
    """Each degree of freedom at that share of its range."""
    lower, upper = _ends(tree)
    return (lower + share * (upper - lower)).astype(np.float32)


def _ends(tree: KinematicTree) -> tuple[Float[np.ndarray, "n"], Float[np.ndarray, "n"]]:
    """The ranges, half a turn either way where one has no end."""
    rest = np.asarray(rest_posture(tree), float)
    lower, upper = np.asarray(tree.lower, float), np.asarray(tree.upper, float)
    return np.where(np.isfinite(lower), lower, rest - _TURN), np.where(np.isfinite(upper), upper, rest + _TURN)


def spread_postures(tree: KinematicTree) -> Float[np.ndarray, "m n"]:
    """`COUNT` postures that lie evenly in all joints' ranges."""
    lower, upper = _ends(tree)
    even = np.tile(((np.arange(COUNT) + 0.5) / COUNT)[:, None], tree.num_dofs)
    spread = np.random.default_rng(0).permuted(even, axis=0)
    return (lower + spread * (upper - lower)).astype(np.float32)


def posture_samples(tree: KinematicTree, objective: Objective) -> PostureSamples:
    """Postures for `start_posture`."""
    dofs = spread_postures(tree)
    points = np.asarray(tree_points(dofs, tree))
    origins = np.array(objective.origins)
    begin = np.where((origins >= 0)[:, None], points[:, origins], 0.0)
    vectors = points[:, list(objective.tasks)] - begin
    groups = _groups(tree, objective)
    spans = [np.sqrt(np.var(vectors[:, list(own)], axis=0).sum()) for _, own in groups]
    return PostureSamples(
        dofs=dofs,
        vectors=vectors.astype(np.float32),
        width=np.maximum(_WIDTH * np.array(spans), 1e-4).astype(np.float32),
        groups=groups,
    )


def _groups(tree: KinematicTree, objective: Objective) -> tuple[tuple[tuple[int, ...], tuple[int, ...]], ...]:
    """Vectors from points that stand still, in groups that share no degree of freedom.

    A vector from one finger to another would make one group of both; what these vectors say, the others say too.
    """
    groups: list[tuple[set[int], list[int]]] = []
    for k, (origin, task) in enumerate(zip(objective.origins, objective.tasks, strict=True)):
        moved = moved_by(tree, task)
        if not moved or moved_by(tree, origin):
            continue
        shared = [group for group in groups if group[0] & moved]
        groups = [group for group in groups if not group[0] & moved]
        own = sorted([k, *(vector for _, vectors in shared for vector in vectors)])
        groups.append((moved.union(*(dofs for dofs, _ in shared)), own))
    return tuple((tuple(sorted(dofs)), tuple(vectors)) for dofs, vectors in groups)


@jax.jit
def placed(
    values: Float[Array | np.ndarray, "n b"], targets: Targets, tree: KinematicTree, objective: Objective
) -> Posture:
    """These degrees of freedom, a base that moves where they fit the targets best."""
    return aligned(jnp.asarray(values), jax.tree.map(jnp.asarray, targets), tree, objective)


@jax.jit
def nearer_start(
    own: Posture,
    between: Float[Array | np.ndarray, "n b"],
    targets: Targets,
    tree: KinematicTree,
    objective: Objective,
) -> Posture:
    """A frame's own start, or other degrees of freedom where these are as near to what it shows.

    Those come from the frames around, and so go on as these do; where a hand changes faster than frames come they are
    far away.
    """
    own, targets = jax.tree.map(jnp.asarray, (own, targets))
    other = aligned(jnp.asarray(between), targets, tree, objective)
    alone, joined = (objective_value(posture, targets, tree, objective) for posture in (own, other))
    return jax.tree.map(lambda a, b: jnp.where(joined < _AS_NEAR * alone, a, b), other, own)


@jax.jit
def start_posture(targets: Targets, samples: PostureSamples, tree: KinematicTree, objective: Objective) -> Posture:
    """Where the search for each frame of a batch begins; a base that moves where it fits best."""
    targets = jax.tree.map(jnp.asarray, targets)
    batch = targets.weights.shape[-1]
    middle = aligned(jnp.broadcast_to(rest_posture(tree)[:, None], (tree.num_dofs, batch)), targets, tree, objective)
    wanted = jnp.where(targets.weights[:, None] > 0, targets.vectors, 0.0)
    if objective.free_base:
        wanted = jnp.einsum("jib,kjb->kib", middle.rotation, wanted - middle.position)
    seen = jnp.where(targets.weights > 0, 1.0, 0.0)
    values = jnp.asarray(middle.values)
    for g, (dofs, vectors) in enumerate(samples.groups):
        own, known = jnp.asarray(samples.vectors)[:, list(vectors)], seen[jnp.array(vectors)]
        goal = wanted[jnp.array(vectors)] * known[:, None]
        squared = jnp.sum(own**2, axis=-1) @ known - 2 * own.reshape(len(own), -1) @ goal.reshape(
            -1, batch
        )  # less what all postures share
        likely = jax.nn.softmax(-squared / (2 * jnp.asarray(samples.width)[g] ** 2), axis=0)
        values = values.at[jnp.array(dofs)].set(jnp.asarray(samples.dofs)[:, list(dofs)].T @ likely)
    values = jnp.clip(values, jnp.asarray(tree.lower)[:, None], jnp.asarray(tree.upper)[:, None])
    return aligned(values, targets, tree, objective) if objective.free_base else replace(middle, values=values)
