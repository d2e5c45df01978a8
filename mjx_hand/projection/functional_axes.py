"""Hinge axes that fit a person: those whose exact projection comes nearest to the rotations of a recording.

docs/axes.md derives the fit and measures it.
"""

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Shaped

from mjx_hand.errors import InputError
from mjx_hand.hand.joints import HINGE_LINKS, NUM_BALL_JOINTS, NUM_HINGES, ONE_DOF, TWO_DOF
from mjx_hand.projection.check import check_rotations, compose
from mjx_hand.projection.hinge_parameters import ONE_HINGE, TWO_HINGES, JointKind
from mjx_hand.pytree import replace
from mjx_hand.rigid.rigid_hand import RigidHand

MIN_FRAMES = 10  # fewer say little about a joint's four or five numbers
MAX_FRAMES = 4096  # more are thinned evenly: neighbouring frames say the same
_PADDING = 256  # frames are padded to a multiple of this, so that most recordings share a compilation
_ITERATIONS = 30
_LEAST_SINE = 0.2  # of the angle between a base joint's axes, below which they say little about order and sign
_LEAST_STIFFNESS = 1e-9  # of a number that nothing holds
_OUTLIER = np.radians(5.0)  # error of a frame from which on its pull grows no more

# The prior (rad, one standard deviation): how far a joint's axes are turned from the anatomical ones, opened from their
# angle, and turned at rest, against the error that all frames may share, which no number of frames averages out.
_TURN, _SKEW, _REST, _SHARED_ERROR = np.radians([45.0, 15.0, 45.0, 0.5])
# How far it may be at most. Axes that turn by less than 45 degrees, half the skew included, stay nearest to their own
# anatomical axis, so that a base joint's two cannot change places; one that turns by less than 90 keeps its sign.
_FARTHEST_TURN = {1: np.radians(80.0), 2: np.radians(36.0)}
_FARTHEST_SKEW, _FARTHEST_REST = np.radians(16.0), np.radians(45.0)

_HINGES_OF = [[h for h in range(NUM_HINGES) if HINGE_LINKS[h] == joint + 1] for joint in range(NUM_BALL_JOINTS)]


def fit_functional_axes(
    rigid: RigidHand,
    rotations: Shaped[Array | np.ndarray, "..."],
    valid: Bool[Array | np.ndarray, "..."] | None = None,
    *,
    rest_rotation: bool = True,
) -> RigidHand:
    """`rigid` with hinge axes, and rest rotations, that a person's own motion shows.

    For each joint, minimises the mean squared error of the exact projection (the chord 2 sin(ψ/2) of its angle ψ) over
    the frames, and keeps near `rigid`'s axes what the motion does not show: a joint that hardly moves keeps its
    axes. Frames far off count little. Angles are eliminated by the projection's closed form; what is left is four or
    five numbers per joint, solved by Levenberg and Marquardt's method for all joints at once.

    Order and signs stay: the first hinge of a base joint stays within 44 degrees of `rigid`'s first and the second of
    its second, a single hinge within 80; angles count from the flat hand. So limits, names and policies carry over.
    Two axes need not be at right angles.

    Args:
        rigid: the hand whose axes are the prior (anatomical ones, as built); its rest rotations are replaced.
        rotations: (..., 15, 3, 3), frames of one person, of one recording or several.
        valid: (...), frames to use; all if None. What stands in the others does not matter.
        rest_rotation: let each joint keep a constant turn while its hinges are at zero (`RigidHand.rest_rotation`).
            Without it all hinges pass through the flat hand, and errors are larger.

    Raises:
        InputError: fewer than ten valid frames, wrong shapes, valid frames that are not rotations, or a hand with
            parallel axes at a base joint.
    """
    rotations = np.asarray(rotations)
    used = _valid_frames(rotations, valid)
    if rotations.shape[-3:] == (NUM_BALL_JOINTS, 3, 3):
        rotations = np.where(used[..., None, None, None], rotations, np.eye(3))
    frames = np.asarray(check_rotations(rotations, NUM_BALL_JOINTS), np.float32)[used]
    if len(frames) < MIN_FRAMES:
        raise InputError(
            f"{len(frames)} of {used.size} frames are valid; axes need at least {MIN_FRAMES} frames of motion:"
            " give a longer recording, or keep the anatomical axes"
        )
    if len(frames) > MAX_FRAMES:
        frames = frames[np.linspace(0, len(frames) - 1, MAX_FRAMES).round().astype(int)]
    weight = np.zeros(-(-len(frames) // _PADDING) * _PADDING, np.float32)
    weight[: len(frames)] = 1 / len(frames)
    padded = np.tile(np.eye(3, dtype=np.float32), (len(weight), NUM_BALL_JOINTS, 1, 1))
    padded[: len(frames)] = frames
    axes = np.array(rigid.hinge_axis, float)
    pairs = axes[[_HINGES_OF[j] for j in TWO_DOF]]
    if np.linalg.norm(np.cross(pairs[:, 0], pairs[:, 1]), axis=1).min() < _LEAST_SINE:
        raise InputError("the hand's abduction and flexion axes are nearly parallel; start from axes='anatomical'")
    rest = np.tile(np.eye(3), (NUM_BALL_JOINTS, 1, 1))
    for joints, kind in ((ONE_DOF, ONE_HINGE), (TWO_DOF, TWO_HINGES)):
        hinges = [_HINGES_OF[j] for j in joints]
        numbers = (padded[:, list(joints)], weight, axes[hinges].astype(np.float32), np.float32(rest_rotation))
        found = _fit(*(jnp.asarray(n) for n in numbers), kind)
        axes[hinges], rest[list(joints)] = (np.asarray(a, float) for a in found)
    axes /= np.linalg.norm(axes, axis=-1, keepdims=True)
    return replace(rigid, hinge_axis=axes, rest_rotation=rest if rest_rotation else None)


def _valid_frames(rotations: np.ndarray, valid: Bool[Array | np.ndarray, "..."] | None) -> Bool[np.ndarray, "..."]:
    lead = rotations.shape[:-3]
    if valid is None:
        return np.ones(lead, bool)
    if np.shape(valid) != lead:
        raise InputError(
            f"valid has shape {np.shape(valid)}; for rotations of shape {rotations.shape} it must be {lead}"
        )
    return np.asarray(valid)


@partial(jax.jit, static_argnames="kind")
def _fit(
    rotations: Float[Array, "t j 3 3"],
    weight: Float[Array, "t"],
    axes: Float[Array, "j h 3"],
    resting: Float[Array, ""],
    kind: JointKind,
) -> tuple[Float[Array, "j h 3"], Float[Array, "j 3 3"]]:
    """Axes and rest rotations of joints of one kind; `resting` is 1, or 0 for none of the latter."""
    parts = ((kind.turns, _FARTHEST_TURN[kind.hinges]), (kind.skews, _FARTHEST_SKEW), (kind.rests, _FARTHEST_REST))
    spread = jnp.zeros(kind.size).at[kind.turns].set(_TURN).at[kind.skews].set(_SKEW).at[kind.rests].set(_REST)

    def bounded(free: Float[Array, "p"]) -> Float[Array, "p"]:
        # Each part inside its ball, smoothly, so that the solver needs no care at the edge.
        for part, farthest in parts:
            free = free.at[part].divide(jnp.sqrt(1 + jnp.sum(free[part] ** 2) / farthest**2))
        return free.at[kind.rests].multiply(resting)

    def solve(frames: Float[Array, "t 3 3"], prior: Float[Array, "h 3"]) -> tuple[Array, Array]:
        def residuals(free: Float[Array, "p"]) -> tuple[Float[Array, "t 9"], Float[Array, "p"]]:
            numbers = bounded(free)
            joint_axes, rest = kind.joint(numbers, prior)
            asked = compose(frames, rest.T)
            off = asked - kind.nearest(asked, joint_axes)
            return off.reshape(-1, 9) / jnp.sqrt(2.0), _SHARED_ERROR * numbers / spread

        def cost(off: Float[Array, "t 9"], moved: Float[Array, "p"]) -> Float[Array, ""]:
            robust = jnp.sqrt(1 + jnp.sum(off**2, axis=-1) / _OUTLIER**2) - 1
            return 2 * _OUTLIER**2 * (weight @ robust) + moved @ moved

        def linearised(free: Float[Array, "p"]) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
            found = residuals(free)
            return found, found

        # A loop of its own: residuals are weighted anew in each step, and thousands of frames share one axis.
        def iterate(_: Array, state: tuple[Array, Array, Array]) -> tuple[Array, Array, Array]:
            free, value, damping = state
            (off_slope, moved_slope), (off, moved) = jax.jacfwd(linearised, has_aux=True)(free)
            pull = weight / jnp.sqrt(1 + jnp.sum(off**2, axis=-1) / _OUTLIER**2)
            normal = jnp.einsum("t,tap,taq->pq", pull, off_slope, off_slope) + moved_slope.T @ moved_slope
            slope = jnp.einsum("t,tap,ta->p", pull, off_slope, off) + moved_slope.T @ moved
            damped = normal + jnp.diag(damping * jnp.diag(normal) + _LEAST_STIFFNESS)
            tried = free - jnp.linalg.solve(damped, slope)
            reached = cost(*residuals(tried))
            better = reached < value
            chosen = jax.lax.select(better, tried, free)
            return chosen, jnp.minimum(reached, value), damping * jnp.where(better, 0.3, 5.0)

        begin = jnp.zeros(kind.size)
        state = (begin, cost(*residuals(begin)), jnp.asarray(1e-2))
        return kind.joint(bounded(jax.lax.fori_loop(0, _ITERATIONS, iterate, state)[0]), prior)

    return jax.vmap(solve, in_axes=(1, 0))(rotations, axes)
