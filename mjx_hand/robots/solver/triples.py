"""Vectors in space as three arrays over a batch.

The solver's work is small sums over thousands of frames. With the batch as the only axis of every array, XLA makes
vectorised loops of it; with a batch of small matrices it calls a matrix routine for each. A component that is the
plain number 0.0 is left out of sums and products when they are traced.
"""

from typing import Any

import jax.numpy as jnp

Scalar = Any  # an array over the batch, or one number for all of it
Scalars = list[Scalar]
Triple = list[Scalar]  # x, y, z


def plus(a: Scalar, b: Scalar) -> Scalar:
    """a + b."""
    return b if _nothing(a) else a if _nothing(b) else a + b


def product(a: Scalar, b: Scalar) -> Scalar:
    """a * b."""
    return 0.0 if _nothing(a) or _nothing(b) else a * b


def add(a: Triple, b: Triple) -> Triple:
    """a + b."""
    return [plus(x, y) for x, y in zip(a, b, strict=True)]


def subtract(a: Triple, b: Triple) -> Triple:
    """a - b."""
    return [x if _nothing(y) else x - y for x, y in zip(a, b, strict=True)]


def times(scale: Scalar, a: Triple) -> Triple:
    """scale * a."""
    return [product(scale, x) for x in a]


def dot(a: Triple, b: Triple) -> Scalar:
    """The inner product."""
    return plus(plus(product(a[0], b[0]), product(a[1], b[1])), product(a[2], b[2]))


def cross(a: Triple, b: Triple) -> Triple:
    """The vector product."""
    return [plus(product(a[i], b[j]), product(product(a[j], b[i]), -1.0)) for i, j in ((1, 2), (2, 0), (0, 1))]


def columns_times(columns: list[Triple], a: Triple) -> Triple:
    """The matrix with these columns times a."""
    return add(add(times(a[0], columns[0]), times(a[1], columns[1])), times(a[2], columns[2]))


def _nothing(a: Scalar) -> bool:
    return isinstance(a, float) and a == 0.0


def turned_about_z(frame: list[Triple], angle: Scalar) -> list[Triple]:
    """The frame's axes after a turn by `angle` about its own third."""
    c, s = jnp.cos(angle), jnp.sin(angle)
    x, y, z = frame
    return [add(times(c, x), times(s, y)), subtract(times(c, y), times(s, x)), z]
