"""A family of MJX models as one: what they share once, what differs stacked, so that each world can run its own."""

import dataclasses
from collections.abc import Sequence
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Int
from mujoco import mjx

from mjx_hand.errors import InputError


@dataclasses.dataclass(frozen=True)
class Family:
    """Models of one structure; a family of a hundred hands is about as small as one model.

    Attributes:
        structure: of each model as a pytree.
        varying: positions among the leaves of those that differ between models.
        leaves: of the first model; those that differ, of all models, stacked.
    """

    structure: Any
    varying: tuple[int, ...]
    leaves: tuple[Array, ...]

    def model(self, variant: Int[Array, ""]) -> mjx.Model:
        """The variant's model."""
        leaves = list(self.leaves)
        for k in self.varying:
            leaves[k] = leaves[k][variant]
        return jax.tree_util.tree_unflatten(self.structure, leaves)


def make_family(models: Sequence[mjx.Model]) -> Family:
    """Raise InputError if the models differ in anything that MJX compiles in (types, addresses), else stack them."""
    structures = [jax.tree_util.tree_structure(m) for m in models]
    for i, structure in enumerate(structures):
        if structure != structures[0]:
            raise InputError(
                f"model {i} differs from model 0 in structure (types of geoms or joints, or frames that coincide), "
                "which MJX compiles in; build all models of a family from one scene with different parameters, or run "
                "several kinds of object or support on engine 'native'"
            )
    rows = [jax.tree_util.tree_leaves(m) for m in models]
    varying = tuple(
        k
        for k in range(len(rows[0]))
        if any(not np.array_equal(np.asarray(row[k]), np.asarray(rows[0][k])) for row in rows[1:])
    )
    leaves = tuple(
        jnp.stack([row[k] for row in rows]) if k in varying else jnp.asarray(leaf) for k, leaf in enumerate(rows[0])
    )
    return Family(structure=structures[0], varying=varying, leaves=leaves)


def leaf_names(model: mjx.Model) -> list[str]:
    """The dotted name of each leaf, in the order of `Family.leaves`."""
    paths = jax.tree_util.tree_flatten_with_path(model)[0]
    return [".".join(str(getattr(key, "name", key)) for key in path) for path, _ in paths]
