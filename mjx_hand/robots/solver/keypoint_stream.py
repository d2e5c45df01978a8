"""Keypoints onto a hand frame by frame, for teleoperation.

`follow` is the pure step; `KeypointStream` keeps its state. Each frame starts from the one before it, so that a few
iterations are enough; the first one, and the first after a gap, from what it shows itself.
"""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from mjx_hand.errors import InputError
from mjx_hand.pytree import pytree, replace
from mjx_hand.robots.solver.kinematic_tree import KinematicTree
from mjx_hand.robots.solver.normal_equations import Posture
from mjx_hand.robots.solver.objectives import (
    Objective,
    Targets,
    brought_together,
    human_vectors,
    num_thumb_pairs,
    targets_of,
)
from mjx_hand.robots.solver.posture_samples import (
    PostureSamples,
    determined,
    posture_samples,
    rest_posture,
    start_posture,
)
from mjx_hand.robots.solver.projected_newton import Holds, improve
from mjx_hand.robots.solver.retarget_keypoints import enough
from mjx_hand.robots.solver.smoothing import UNIT, held_share
from mjx_hand.rotations import exp, log, matrix_to_quaternion

FIRST = 200  # iterations, at most, for a frame that follows none
NEXT = 40  # and for each one after it; a hand that moves as hands do takes three to six


@pytree
class StreamState:
    """What one frame leaves to the next.

    Attributes:
        posture: as solved, a batch of one.
        shown: the same low-pass filtered: what `step` returns.
        together: which fingers count as brought together with the thumb (`dexpilot`).
        started: whether a frame has been followed yet.
        seen: whether the last frame was, rather than held over a gap.
        value: the objective at the last frame that was followed, without smoothness.
    """

    posture: Posture
    shown: Posture
    together: Bool[Array, "t"]
    started: Bool[Array, ""]
    seen: Bool[Array, ""]
    value: Float[Array, ""]


@pytree
class StreamedPose:
    """One frame's result.

    Attributes:
        dofs: rad (m for sliding joints), in the order of the tree's `dof_names`.
        base_position, base_quaternion: the base in the keypoints' frame, m and wxyz.
        value: the objective, without smoothness, before the low-pass.
        seen: False where too few keypoints were seen and the pose before was held.
    """

    dofs: Float[np.ndarray | Array, "n"]
    base_position: Float[np.ndarray | Array, "3"]
    base_quaternion: Float[np.ndarray | Array, "4"]
    value: Float[np.ndarray | Array, ""]
    seen: Bool[np.ndarray | Array, ""]


def start_state(tree: KinematicTree, objective: Objective) -> StreamState:
    """The state before the first frame: the rest posture."""
    posture = Posture(
        values=jnp.asarray(rest_posture(tree), jnp.float32)[:, None],
        rotation=jnp.eye(3)[..., None],
        position=jnp.zeros((3, 1)),
    )
    return StreamState(
        posture=posture,
        shown=posture,
        together=jnp.zeros(num_thumb_pairs(objective), bool),
        started=jnp.array(False),
        seen=jnp.array(False),
        value=jnp.zeros(()),
    )


@jax.jit
def follow(
    state: StreamState,
    keypoints: Float[Array | np.ndarray, "21 3"],
    tree: KinematicTree,
    objective: Objective,
    samples: PostureSamples,
    low_pass: float | Array,
    share: float | Array,
    iterations: int | Array = NEXT,
) -> tuple[StreamState, StreamedPose]:
    """The state after one more frame, and what to show; a frame with too few keypoints changes nothing but `seen`.

    Args:
        state: of `start_state`, or after the frame before.
        keypoints: m; NaN where one is missing.
        tree, objective: the hand and what it is to do.
        samples: its `posture_samples`.
        low_pass: share of the way from the pose shown before to the new one; 1 shows the new one.
        share: of the smoothness, that holds a frame to the one before it; see `smoothing.held_share`.
        iterations: of the solver, at most. What they leave is made up for in the next frames.
    """
    vectors = human_vectors(jnp.asarray(keypoints)[None], objective)
    together = brought_together(vectors, objective, jnp.ones(1, bool), state.together)
    targets = targets_of(vectors, objective, together)
    seen = enough(targets, objective)[0]
    begin = jax.lax.cond(
        state.seen,
        lambda: state.posture,
        lambda: _afresh(state, targets, start_posture(targets, samples, tree, objective), tree, objective),
    )
    holds = Holds(
        anchor=jnp.asarray(state.posture.values),
        strength=jnp.where(state.seen, share * jnp.asarray(objective.smoothness), 0.0)[None],
        linked=jnp.zeros(1),
    )
    found = improve(begin, targets, holds, tree, objective, jnp.where(state.seen, iterations, FIRST))
    posture = found.posture
    shown = _part_way(state.shown, posture, jnp.where(state.seen, low_pass, 1.0))
    after = StreamState(
        posture=posture,
        shown=shown,
        together=together[:, 0],
        started=jnp.array(True),
        seen=jnp.array(True),
        value=found.value[0],
    )
    state = jax.tree.map(lambda new, old: jnp.where(seen, new, old), after, replace(state, seen=jnp.array(False)))
    pose = StreamedPose(
        dofs=state.shown.values[:, 0],
        base_position=state.shown.position[:, 0],
        base_quaternion=matrix_to_quaternion(jnp.asarray(state.shown.rotation[..., 0])),
        value=state.value,
        seen=state.seen,
    )
    return state, pose


def _afresh(state: StreamState, targets: Targets, start: Posture, tree: KinematicTree, objective: Objective) -> Posture:
    """The start that a frame gives itself; what it does not show stays as it was."""
    kept = state.started & ~determined(targets, tree, objective)
    return replace(start, values=jnp.where(kept, state.posture.values, start.values))


def _part_way(old: Posture, new: Posture, share: Array) -> Posture:
    """`share` of the way from one posture to another; the base turns along the shortest arc."""
    before, after = jnp.moveaxis(old.rotation, -1, 0), jnp.moveaxis(new.rotation, -1, 0)
    arc = log(jnp.swapaxes(before, -1, -2) @ after)
    return Posture(
        values=old.values + share * (new.values - old.values),
        rotation=jnp.moveaxis(before @ exp(share * arc), 0, -1),
        position=old.position + share * (new.position - old.position),
    )


class KeypointStream:
    """Follows one hand, frame by frame.

    The first call compiles for some seconds, unless `warm_up` was called before.
    """

    def __init__(
        self,
        tree: KinematicTree,
        objective: Objective,
        low_pass: float = 1.0,
        iterations: int = NEXT,
        fps: float | int = 30.0,
    ):
        """Prepare to follow.

        Args:
            tree: the hand.
            objective: what it is to do.
            low_pass: share of the way from the pose shown to the new one that is gone in 1/30 s; smaller is smoother
                and later.
            iterations: for each frame after the first, at most; fewer take less time where the hand moves fast.
            fps: frames per second, which say how much of low-pass and smoothness a frame feels.

        Raises:
            InputError: `low_pass` is not in (0, 1], no iterations, or a rate that is none.
        """
        if iterations < 1:
            raise InputError(f"iterations is {iterations}; give at least 1")
        if not 0 < low_pass <= 1:
            raise InputError(f"low_pass is {low_pass}; give a number above 0 and up to 1, which filters nothing")
        share = held_share(fps)
        samples = posture_samples(tree, objective)
        filtered = 1 - (1 - low_pass) ** (1 / (fps * UNIT))
        numbers = (jnp.float32(filtered), jnp.float32(share), jnp.int32(iterations))
        self._settings = jax.device_put((tree, objective, samples, *numbers))
        self.reset()

    def reset(self) -> None:
        """Forget all frames."""
        tree, objective, *_ = self._settings
        self.state = start_state(tree, objective)

    def warm_up(self) -> None:
        """Compile, without following anything."""
        jax.block_until_ready(self._follow(np.zeros((21, 3), np.float32)))

    def step(self, keypoints: np.ndarray) -> StreamedPose:
        """Follow one frame: (21, 3) keypoints in metres, NaN where one is missing.

        Raises:
            InputError: not 21 points, or coordinates that cannot be metres.
        """
        given = np.asarray(keypoints, np.float32)
        if given.shape != (21, 3):
            raise InputError(f"keypoints have shape {given.shape}; give one frame of 21 x 3 numbers (m)")
        if (np.abs(given) > 1e3).any():
            raise InputError("keypoints lie kilometres away or are infinite; give metres, and NaN where one is missing")
        self.state, pose = self._follow(given)
        return jax.tree.map(np.asarray, pose)

    def _follow(self, keypoints: np.ndarray) -> tuple[StreamState, StreamedPose]:
        return follow(self.state, keypoints, *self._settings)
