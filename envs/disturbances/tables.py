"""`DisturbanceTables`: what an environment with disturbances looks up when an episode starts."""

import dataclasses
from collections.abc import Callable, Sequence

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from envs.disturbances.episode import Episode, EpisodeTables, draw_episode, episode_tables, seen_pose
from envs.disturbances.randomize import Randomize
from envs.disturbances.variation import Variation, varied_pose
from envs.physics.engine import PhysicsState
from mjx_hand.motion.demonstration import Demonstration
from mjx_hand.player.approach import displacement
from mjx_hand.pytree import pytree

_FREE = 7  # coordinates of the object, a scene's last


@pytree
class DisturbanceTables:
    """v variations, a demonstration's own one after the other.

    Attributes:
        first: the engine's state at frame 0 of each.
        elsewhere: whether an episode with it has to start at frame 0, because its object is not where the demonstration
            has it.
        episode: what else is drawn.
    """

    first: PhysicsState
    elsewhere: Bool[Array, "v"]
    episode: EpisodeTables


def disturbance_tables(
    randomize: Randomize,
    demonstrations: Sequence[Demonstration],
    variations: Sequence[Sequence[Variation]],
    controls: Float[np.ndarray, "d t u"],
    starts: PhysicsState,
    states: Callable[..., PhysicsState],
) -> DisturbanceTables:
    """The tables of these ranges.

    Args:
        randomize: the ranges.
        demonstrations: what is tracked.
        variations: of each demonstration.
        controls: of each demonstration (m, rad).
        starts: the states of each demonstration's frames.
        states: the engine's state for rows of variant, qpos, qvel and the targets' controls.
    """
    each = len(variations[0])
    qpos, qvel = (np.repeat(np.asarray(rows[:, 0]), each, axis=0) for rows in (starts.qpos, starts.qvel))
    every = [(d, variation) for d, own in zip(demonstrations, variations, strict=True) for variation in own]
    qpos[:, -_FREE:] = [varied_pose(d, variation) for d, variation in every]
    return DisturbanceTables(
        first=states(np.arange(len(every), dtype=np.int32), qpos, qvel, np.repeat(controls[:, 0], each, axis=0)),
        elsewhere=jnp.array([variation.is_elsewhere for _, variation in every]),
        episode=episode_tables(randomize, [d.object_pose for d in demonstrations], demonstrations[0].motion.fps),
    )


def disturbed_start(
    tables: DisturbanceTables,
    controls: Float[Array, "d t u"],
    object_pose: Float[Array, "d t 7"],
    follow: bool,
    demonstration: Int[Array, ""],
    frame: Int[Array, ""],
    physics: PhysicsState,
    key: Array,
) -> tuple[Int[Array, ""], PhysicsState, Episode]:
    """A frame, state and episode drawn for one of a demonstration's variations.

    Args:
        tables: what is drawn from.
        controls, object_pose: of the demonstrations (m, rad, wxyz).
        follow: whether the wrist's path goes with the object.
        demonstration, frame: what is asked for.
        physics: the undisturbed state there.
        key: of the draws.
    """
    which, others = jax.random.split(key)
    each = tables.elsewhere.shape[0] // controls.shape[0]
    variation = demonstration * each + jax.random.randint(which, (), 0, each)
    frame = jnp.where(tables.elsewhere[variation], 0, frame)
    first = jax.tree.map(lambda table: table[variation], tables.first)
    later = dataclasses.replace(physics, variant=variation)
    physics = jax.tree.map(lambda a, b: jnp.where(frame == 0, a, b), first, later)
    episode = draw_episode(tables.episode, demonstration, controls[demonstration, frame], others)
    if follow:
        seen = seen_pose(episode, tables.episode, jnp.zeros_like(frame), first.qpos[-_FREE:])
        moved = displacement(seen, object_pose[demonstration, 0], jnp)
        episode = dataclasses.replace(episode, displacement=moved)
    return frame, physics, episode
