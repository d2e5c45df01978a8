"""`DisturbanceTables`: what an environment with disturbances looks up when an episode starts."""

import dataclasses
from collections.abc import Callable, Sequence

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Int

from envs.disturbances.episode import Episode, EpisodeTables, draw_episode, episode_tables
from envs.disturbances.randomize import Randomize
from envs.disturbances.variation import Variation, varied_pose
from envs.physics.engine import PhysicsState
from envs.reference import Reference
from envs.scene import NUM_WRIST
from mjx_hand.hand.joints import NUM_HINGES
from mjx_hand.motion.demonstration import Demonstration
from mjx_hand.pytree import pytree

_NUM_TARGETS = NUM_WRIST + NUM_HINGES


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
    reference: Reference,
    starts: PhysicsState,
    states: Callable[..., PhysicsState],
) -> DisturbanceTables:
    """The tables of these ranges.

    Args:
        randomize: the ranges.
        demonstrations: what is tracked.
        variations: of each demonstration.
        reference: of all.
        starts: the states of each demonstration's frames.
        states: the engine's state for rows of variant, qpos, qvel and the targets' controls.
    """
    each = len(variations[0])
    qpos, qvel = (np.repeat(np.asarray(rows[:, 0]), each, axis=0) for rows in (starts.qpos, starts.qvel))
    every = [(d, variation) for d, own in zip(demonstrations, variations, strict=True) for variation in own]
    qpos[:, _NUM_TARGETS:] = [varied_pose(d, variation) for d, variation in every]
    controls = np.repeat(np.asarray(reference.controls[:, 0]), each, axis=0)
    return DisturbanceTables(
        first=states(np.arange(len(every), dtype=np.int32), qpos, qvel, controls),
        elsewhere=jnp.array([variation.is_elsewhere for _, variation in every]),
        episode=episode_tables(randomize, reference, demonstrations[0].motion.fps),
    )


def disturbed_start(
    tables: DisturbanceTables,
    reference: Reference,
    demonstration: Int[Array, ""],
    frame: Int[Array, ""],
    physics: PhysicsState,
    key: Array,
) -> tuple[Int[Array, ""], PhysicsState, Episode]:
    """A frame, state and episode drawn for one of a demonstration's variations; `physics` is the undisturbed state."""
    which, others = jax.random.split(key)
    each = tables.elsewhere.shape[0] // reference.length.shape[0]
    variation = demonstration * each + jax.random.randint(which, (), 0, each)
    frame = jnp.where(tables.elsewhere[variation], 0, frame)
    first = jax.tree.map(lambda table: table[variation], tables.first)
    later = dataclasses.replace(physics, variant=variation)
    physics = jax.tree.map(lambda a, b: jnp.where(frame == 0, a, b), first, later)
    return frame, physics, draw_episode(tables.episode, demonstration, reference.controls[demonstration, frame], others)
