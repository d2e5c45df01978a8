"""Recordings of 21 keypoints onto any hand: each frame on its own evidence, then frames held to their neighbours.

First every frame is solved alone (`frames_alone`). A degree of freedom that nothing
shows in a frame takes its value from the frames before and after. Then some steps of all frames together hold
neighbours to each other, as `Objective.smoothness` says: per second, whatever the rate is.
"""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from mjx_hand.errors import InputError
from mjx_hand.motion.gaps import fill_lines, fill_turns
from mjx_hand.pytree import pytree
from mjx_hand.robots.solver.chunks import in_chunks, solve_chunk
from mjx_hand.robots.solver.frames_alone import solve_alone
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
    determined,
)
from mjx_hand.robots.solver.projected_newton import Improved
from mjx_hand.robots.solver.smoothing import held_share, links
from mjx_hand.rotations import matrix_to_quaternion

TOGETHER, WITH_BASE = 3, 12  # iterations of neighbours that hold each other; where the base makes up for joints


@pytree
class Followed:
    """What a hand does to follow keypoints. Degrees of freedom in the order of the tree's `dof_names`.

    Attributes:
        dofs: rad (m for sliding joints).
        base_position, base_quaternion: the base in the keypoints' frame, m and wxyz; zero and the identity where the
            objective holds it still.
        value: the objective, without smoothness.
        valid: False where too few keypoints were seen to say anything; the postures there are interpolated.
    """

    dofs: Float[np.ndarray, "*b t n"]
    base_position: Float[np.ndarray, "*b t 3"]
    base_quaternion: Float[np.ndarray, "*b t 4"]
    value: Float[np.ndarray, "*b t"]
    valid: Bool[np.ndarray, "*b t"]


def retarget_keypoints(
    keypoints: np.ndarray | Array,
    tree: KinematicTree,
    objective: Objective,
    *,
    fps: float | int = 30.0,
) -> Followed:
    """Follow recordings of keypoints; leading axes are recordings of one length, solved side by side.

    Args:
        keypoints: (..., frames, 21, 3), m, in the order of `capture.keypoints.layouts.KEYPOINTS`; NaN where one is
            missing. For an objective whose base stands still, in the base's frame (`palm_frame.in_palm`).
        tree: the hand.
        objective: what it is to do.
        fps: frames per second, which say how much of the smoothness neighbours feel.

    Raises:
        InputError: no frames, not 21 keypoints, infinite or huge coordinates, no frame with enough keypoints, or a
            rate that is none.
    """
    share = held_share(fps)
    given = check_keypoints(keypoints)
    *batch, frames = given.shape[:-2]
    flat = jnp.asarray(given.reshape(-1, *given.shape[-2:]), jnp.float32)
    first = np.arange(len(flat)) % frames == 0
    targets, seen = _targets(flat, jnp.asarray(~first), objective)
    valid = np.asarray(seen).reshape(*batch, frames)
    if not valid.any(axis=-1).all():
        raise InputError("keypoints: no frame of a recording shows enough of them to follow; give other frames")
    chosen = np.flatnonzero(seen)
    targets = jax.tree.map(lambda a: np.asarray(a)[..., chosen], targets)
    found = solve_alone(targets, chosen, frames, tree, objective)
    values = _with_unseen_filled(np.asarray(found.posture.values), targets, chosen, frames, tree, objective)
    linked = share * links(values, np.diff(chosen, prepend=-1) == 1, first[chosen])
    found = _together(found, values, targets, linked, tree, objective)

    quaternion = np.asarray(matrix_to_quaternion(jnp.moveaxis(jnp.asarray(found.posture.rotation), -1, 0)))
    rows = (found.posture.values.T, found.posture.position.T, quaternion, found.value[:, None])
    dofs, position, turn, value = (
        _everywhere(np.asarray(r, float), chosen, len(flat)).reshape(*batch, frames, r.shape[-1]) for r in rows
    )
    return Followed(
        dofs=_per_recording(fill_lines, dofs, valid),
        base_position=_per_recording(fill_lines, position, valid),
        base_quaternion=_per_recording(fill_turns, turn, valid),
        value=value[..., 0],
        valid=valid,
    )


def check_keypoints(keypoints: np.ndarray | Array) -> Float[np.ndarray, "*b t 21 3"]:
    """`keypoints` as an array, if they are such.

    Raises:
        InputError: no frames, another shape, or coordinates that cannot be metres.
    """
    given = np.asarray(keypoints)
    if given.dtype.kind not in "fiu" or given.ndim < 3 or given.shape[-2:] != (21, 3) or given.size == 0:
        raise InputError(
            f"keypoints have shape {given.shape}; give (..., frames, 21, 3) numbers (m), one frame or more"
        )
    if (np.abs(given[~np.isnan(given)]) > 1e3).any():
        raise InputError("keypoints lie kilometres away or are infinite; give metres, and NaN where one is missing")
    return given


def _per_recording(fill, rows: np.ndarray, valid: np.ndarray) -> np.ndarray:
    if valid.all():
        return rows
    flat = zip(rows.reshape(-1, *rows.shape[-2:]), valid.reshape(-1, valid.shape[-1]), strict=True)
    return np.stack([fill(r, v) for r, v in flat]).reshape(rows.shape)


def enough(targets: Targets, objective: Objective) -> Bool[Array, "b"]:
    """Whether a frame shows enough vectors to say something: three points for a base that moves, else any."""
    return jnp.sum(targets.weights > 0, axis=0) >= (3 if objective.free_base else 1)


@jax.jit
def _targets(
    keypoints: Float[Array, "b 21 3"], linked: Bool[Array, "b"], objective: Objective
) -> tuple[Targets, Bool[Array, "b"]]:
    vectors = human_vectors(keypoints, objective)
    apart = jnp.zeros(num_thumb_pairs(objective), bool)
    targets = targets_of(vectors, objective, brought_together(vectors, objective, linked, apart))
    return targets, enough(targets, objective)


def _together(
    found: Improved,
    values: Float[np.ndarray, "n b"],
    targets: Targets,
    linked: Float[np.ndarray, "b"],
    tree: KinematicTree,
    objective: Objective,
) -> Improved:
    """All frames from there, with these degrees of freedom, neighbours holding each other.

    What a frame does reaches one neighbour an iteration: with a margin of as many frames as there are iterations the
    result is the same as that of all frames at once.
    """
    start = Posture(values=values, rotation=found.posture.rotation, position=found.posture.position)
    parameters = jax.device_put((tree, objective))
    steps = WITH_BASE if objective.free_base else TOGETHER
    return in_chunks(lambda part: solve_chunk(*part, *parameters, steps, 0.0), (start, targets, linked), margin=steps)


def _with_unseen_filled(
    values: Float[np.ndarray, "n b"],
    targets: Targets,
    chosen: Int[np.ndarray, "b"],
    frames: int,
    tree: KinematicTree,
    objective: Objective,
) -> Float[np.ndarray, "n b"]:
    """Degrees of freedom that nothing shows, on lines between the frames of their recording where something does."""
    known = np.asarray(determined(targets, tree, objective))
    if known.all():
        return values
    values = values.copy()
    for recording in np.unique(chosen[~known.all(axis=0)] // frames):
        own = np.flatnonzero(chosen // frames == recording)
        for n in np.flatnonzero(~known[:, own].all(axis=1)):
            shown = own[known[n, own]]
            if len(shown):
                values[n, own] = np.interp(chosen[own], chosen[shown], values[n, shown])
    return values


def _everywhere(rows: Float[np.ndarray, "b n"], at: Int[np.ndarray, "b"], count: int) -> Float[np.ndarray, "t n"]:
    """`rows` at their places, zero elsewhere."""
    whole = np.zeros((count, rows.shape[1]))
    whole[at] = rows
    return whole
