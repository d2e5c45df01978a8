"""Angles over time: no jumps of whole turns, and a low-pass filter that takes gaps as unknown.

The filter minimises Σ over valid frames |x - y|² + λ Σ |second difference of x|² (Whittaker 1923; Eilers 2003). Its
amplitude response is 1 / (1 + λ (2 sin(ω/2))⁴), for λ = (2 sin(ω_c/2))⁻⁴ that of a second-order Butterworth filter run
forward and back, one half at the cut-off: what motion laboratories use, but without a value needed in every frame.
(That one itself, in NumPy and for a recording without gaps, is `motion.smooth`.)

Computed as the mean of a random walk of velocities that is seen with noise where a frame is valid: Kalman's filter and
the smoother of Rauch, Tung and Striebel (1965), which give the same numbers in two passes over time, in float32 too.
"""

import math

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from mjx_hand.motion.smooth import check_cutoff

_UNKNOWN = 1e3  # variance of what is not known before the first frame, against 1 of a frame


@jax.jit
def unwrap(
    angles: Float[Array | np.ndarray, "t n"],
    valid: Bool[Array | np.ndarray, "t"],
    middle: Float[Array | np.ndarray, "n"],
) -> Float[Array, "t n"]:
    """Angles (rad) with whole turns added so that each valid frame is within half a turn of the valid one before it.

    Two-hinge solutions in (-π, π]² are unique (docs/projection.md, section 2), so that whole turns of single angles
    are the only jumps that equal rotations leave. Frames that are not valid keep what they hold. Can be vmapped.

    Args:
        angles: one row per frame.
        valid: which frames were recorded.
        middle: of each hinge's range: of the courses that differ by whole turns, the one whose mean is nearest.
    """
    angles, valid = jnp.asarray(angles), jnp.asarray(valid)
    frames = jnp.arange(len(valid))
    last = jax.lax.cummax(jnp.where(valid, frames, -1))
    before = jnp.concatenate([jnp.full(1, -1), last[:-1]])  # the valid frame before each
    step = angles - angles[jnp.maximum(before, 0)]
    counts = (valid & (before >= 0))[:, None]
    turns = jnp.cumsum(jnp.where(counts, jnp.round(step / (2 * jnp.pi)), 0.0), axis=0)
    course = angles - 2 * jnp.pi * turns
    mean = jnp.sum(jnp.where(valid[:, None], course, 0.0), axis=0) / jnp.maximum(jnp.sum(valid), 1)
    course -= 2 * jnp.pi * jnp.round((mean - middle) / (2 * jnp.pi))
    return jnp.where(valid[:, None], course, angles)


def penalty(fps: float, cutoff: float) -> float:
    """λ of the filter that halves an oscillation of `cutoff` Hz.

    Raises:
        InputError: the cut-off is not between 0 and half the frame rate.
    """
    check_cutoff(cutoff, fps)
    return (2 * math.sin(math.pi * cutoff / fps)) ** -4


@jax.jit
def smooth(
    values: Float[Array | np.ndarray, "t n"],
    valid: Bool[Array | np.ndarray, "t"],
    penalty: Float[Array | np.ndarray, ""] | float,
) -> Float[Array, "t n"]:
    """Each column low-pass filtered along time; see the module. Can be vmapped.

    Args:
        values: one row per frame; what stands in frames that are not valid has no effect, NaN included.
        valid: which frames were recorded. With fewer than two, values come back as they are there.
        penalty: λ, from `penalty(fps, cutoff)`.

    Returns:
        The filtered values; in gaps the cubic course that follows from the frames around.
    """
    values = jnp.where(valid[:, None], values, 0.0)
    start = values[jnp.argmax(valid)]
    jitter = 1 / jnp.asarray(penalty, values.dtype)  # variance of the walk's steps, against 1 of a frame's noise
    weight = valid.astype(values.dtype)

    def forward(state: tuple, frame: tuple) -> tuple:
        place, speed, p, q, r = state  # mean, and covariance [[p, q], [q, r]] of place and speed
        value, seen = frame
        gain = seen / (p + 1)
        off = value - place
        place, speed = place + gain * p * off, speed + gain * q * off
        after = p * (1 - gain * p), q * (1 - gain * p), r - gain * q * q
        p, q, r = after
        ahead = (place + speed, speed, p + 2 * q + r, q + r, r + jitter)
        return ahead, (place, speed, *after, *ahead)

    def backward(state: tuple, frame: tuple) -> tuple:
        place, speed, p, q, r, place_ahead, speed_ahead, p_ahead, q_ahead, r_ahead = frame
        off, off_speed = state[0] - place_ahead, state[1] - speed_ahead
        determinant = p_ahead * r_ahead - q_ahead * q_ahead
        a, b = r_ahead * off - q_ahead * off_speed, p_ahead * off_speed - q_ahead * off
        a, b = a / determinant, b / determinant
        state = (place + (p + q) * a + q * b, speed + (q + r) * a + r * b)
        return state, state[0]

    one, none = jnp.full((), _UNKNOWN, values.dtype), jnp.zeros((), values.dtype)
    first = (start, jnp.zeros_like(start), one, none, one)
    last, passed = jax.lax.scan(forward, first, (values, weight))
    return jax.lax.scan(backward, (last[0], last[1]), passed, reverse=True)[1]
