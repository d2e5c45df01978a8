"""Cutting a long unrolled computation into stages that XLA compiles apart."""

from collections.abc import Callable
from typing import TypeVar

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

T = TypeVar("T")


def stage(compute: Callable[[], T], like: Float[Array, "b"]) -> T:
    """`compute()`, every number in it as an array like `like`, and all of it computed before anything that uses it.

    XLA fuses what it is given into ever longer loops, and computes shared intermediate results again in each: on the
    CPU the dense systems of `dexpilot` then take minutes to compile and run a hundred times slower (measured). It does
    not look across the border of a loop whose length it cannot know, so this is one, of a single round.
    """

    def computed() -> T:
        return jax.tree.map(lambda x: jnp.broadcast_to(jnp.asarray(x, like.dtype), like.shape), compute())

    blank = jax.tree.map(lambda x: jnp.zeros(x.shape, x.dtype), jax.eval_shape(computed))
    once = jnp.where(jnp.isnan(like[0]), 2, 1)  # once, whatever it is: but XLA cannot tell
    return jax.lax.fori_loop(0, once, lambda _, before: computed(), blank)
