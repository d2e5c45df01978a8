"""What a hand is asked to follow: keypoints of a person's hand, as positions, as vectors, or as DexPilot does.

The definitions are dex-retargeting's (Qin et al., AnyTeleop, RSS 2023, https://arxiv.org/abs/2307.04577;
https://github.com/dexsuite/dex-retargeting), after Handa et al., DexPilot, ICRA 2020,
https://arxiv.org/abs/1910.03135. With h the Huber loss, h(d) = d²/2β below β and d - β/2 above:

    position  mean of h over the three coordinates of every point's error
    vector    mean of h(‖robot vector - scaling · human vector‖)
    dexpilot  the same with a weight for each vector: finger tips that a person brings together are pulled together

and to each `smoothness` · ‖change of the degrees of freedom since the frame before‖² is added.
"""

from itertools import combinations

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from mjx_hand.pytree import pytree, static
from mjx_hand.robots.solver.kinematic_tree import BASE

KINDS = ("position", "vector", "dexpilot")
# DexPilot's own numbers: how far apart (m) tips brought together are asked to be, for the thumb and a finger and for
# two fingers; what these vectors weigh; and how near two fingers must be that both touch the thumb.
_TOGETHER = (1e-4, 3e-2)
_WEIGHTS = (200.0, 400.0)
_FINGERS_NEAR = 0.03


@pytree
class Objective:
    """Vectors from one point of the hand to another, and the pairs of keypoints that they follow.

    Attributes:
        scaling: the hand's vectors over the person's.
        huber: β above, m.
        smoothness: see the module.
        pinch, release: distance (m) of thumb tip and finger tip below which they count as brought together, and above
            which no longer; for `dexpilot`.
        kind: a name in KINDS.
        origins, tasks: points of the tree at which the vectors begin and end; BASE for the frame's origin.
        human_origins, human_tasks: the keypoints in their places; BASE for the frame's origin.
        free_base: the base moves freely too, and the points are where the keypoints are; else it stands still at the
            origin.
        second_order: steps use the full Hessian, which pays where targets are out of reach; else Gauss and Newton's
            part of it, which pays where they are within.
    """

    scaling: Float[np.ndarray | Array, ""] | float = 1.0
    huber: Float[np.ndarray | Array, ""] | float = 0.02
    smoothness: Float[np.ndarray | Array, ""] | float = 4e-3
    pinch: Float[np.ndarray | Array, ""] | float = 0.03
    release: Float[np.ndarray | Array, ""] | float = 0.05
    kind: str = static()
    origins: tuple[int, ...] = static()
    tasks: tuple[int, ...] = static()
    human_origins: tuple[int, ...] = static()
    human_tasks: tuple[int, ...] = static()
    free_base: bool = static(default=False)
    second_order: bool = static(default=True)


@pytree
class Targets:
    """What an objective's vectors should be (m), and what each weighs; weight zero where a keypoint is missing.

    The batch is the last axis, as everywhere in the solver.
    """

    vectors: Float[Array, "k 3 b"]
    weights: Float[Array, "k b"]


def dexpilot_pairs(tips: int) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """Origins and tasks of DexPilot's vectors among wrist (0) and tips (1 the thumb): tip to tip, wrist to tip."""
    between = list(combinations(range(1, tips + 1), 2))
    origins = (*(second for _, second in between), *(0 for _ in range(tips)))
    return origins, (*(first for first, _ in between), *range(1, tips + 1))


def human_vectors(keypoints: Float[Array, "b 21 3"], objective: Objective) -> Float[Array, "k 3 b"]:
    """The person's vectors (m), not scaled; NaN where a keypoint is missing."""
    points = jnp.moveaxis(keypoints, 0, -1)
    origin = jnp.stack([jnp.zeros_like(points[0]) if k == BASE else points[k] for k in objective.human_origins])
    return points[jnp.array(objective.human_tasks)] - origin


def brought_together(
    vectors: Float[Array, "k 3 b"], objective: Objective, linked: Bool[Array, "b"], before: Bool[Array, "t"]
) -> Bool[Array, "t b"]:
    """Whether thumb and each finger count as brought together, frame by frame.

    Below `pinch` they do, above `release` they do not, and between the two they are as they were in the frame before.

    Args:
        vectors: of `human_vectors`, for `dexpilot`.
        objective: for its two distances.
        linked: whether a frame follows the one before it in the batch.
        before: what held before the first frame, where that is linked.
    """
    distance = _length(vectors[: len(before)])
    begins, ends = distance < objective.pinch, distance > objective.release
    # What the last frame said that said anything: the running composition of "set", "clear" and "keep".
    says = begins | ends | ~linked
    (_, state) = jax.lax.associative_scan(
        lambda a, b: (a[0] | b[0], jnp.where(b[0], b[1], a[1])), (says, begins), axis=-1
    )
    said = jax.lax.associative_scan(jnp.logical_or, says, axis=-1)
    return jnp.where(jnp.asarray(said), jnp.asarray(state), before[:, None])


def num_thumb_pairs(objective: Objective) -> int:
    """How many pairs of the thumb and a finger `dexpilot` has; none for the other kinds."""
    if objective.kind != "dexpilot":
        return 0
    return _num_tips(objective) - 1


def _num_tips(objective: Objective) -> int:
    return round((np.sqrt(8 * len(objective.tasks) + 1) - 1) / 2)  # n tips make n (n - 1) / 2 + n vectors


def targets_of(vectors: Float[Array, "k 3 b"], objective: Objective, together: Bool[Array, "t b"]) -> Targets:
    """Targets and weights for the person's vectors."""
    count = len(objective.tasks)
    seen = jnp.isfinite(vectors).all(axis=1)
    vectors = jnp.where(seen[:, None], vectors, 0.0)
    wanted = jnp.asarray(objective.scaling) * vectors
    weights = jnp.full(seen.shape, 1.0 / (3 * count if objective.kind == "position" else count), vectors.dtype)
    if objective.kind == "dexpilot":
        tips = _num_tips(objective)
        pairs = list(combinations(range(tips - 1), 2))
        between = count - tips
        length = _length(vectors[:between])
        both = [together[i] & together[j] & (length[tips - 1 + k] <= _FINGERS_NEAR) for k, (i, j) in enumerate(pairs)]
        near = jnp.concatenate([together, jnp.stack(both)])
        gaps, importance = (np.repeat(values, (tips - 1, len(pairs)))[:, None] for values in (_TOGETHER, _WEIGHTS))
        short = vectors[:between] * (gaps / (length + 1e-6))[:, None]
        wanted = jnp.concatenate([jnp.where(near[:, None], short, wanted[:between]), wanted[between:]])
        important = jnp.where(near, importance, 1.0)
        to_wrist = jnp.full((tips, seen.shape[1]), float(between + tips))
        weights = weights * jnp.concatenate([important, to_wrist])
    return Targets(vectors=wanted, weights=jnp.where(seen, weights, 0.0))


def _length(vectors: Float[Array, "k 3 b"]) -> Float[Array, "k b"]:
    return jnp.sqrt(jnp.sum(vectors**2, axis=1))
