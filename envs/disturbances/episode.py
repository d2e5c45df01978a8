"""`Episode`: what is disturbed for one episode without another scene: pushes, delays, and how the object is seen."""

import dataclasses
from collections.abc import Sequence

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int, UInt32

from envs.disturbances.randomize import MOST_DELAY, Randomize
from mjx_hand.player.approach import HELD_AWAY
from mjx_hand.pytree import pytree
from mjx_hand.rotations import exp, matrix_to_quaternion, quaternion_to_matrix

_NEVER = 2**30


@pytree
class EpisodeTables:
    """What an episode is drawn from; arrays, so that a compiled function takes another's.

    Attributes:
        delay: least and greatest control steps.
        seen_move, seen_turn: ranges of the observed pose's constant error (m, rad).
        seen_noise: standard deviation of what is added in each step (m, rad).
        push: range of the force (N).
        push_steps: control steps that a push lasts.
        push_prob: share of episodes with one.
        held: control steps from frame to frame in which each demonstration's object may be pushed: first and last.
    """

    delay: Int[Array, "2"]
    seen_move: Float[Array, "2"]
    seen_turn: Float[Array, "2"]
    seen_noise: Float[Array, "2"]
    push: Float[Array, "2"]
    push_steps: Int[Array, ""]
    push_prob: Float[Array, ""]
    held: Int[Array, "d 2"]


@pytree
class Episode:
    """The disturbances of one world until its next reset.

    Attributes:
        delay: control steps by which targets come late.
        waiting: the targets of the last steps (m, rad), the newest first.
        seen_offset: what the observed pose of the object is off by: m, and a rotation vector (rad), in the world.
        push: force on the object (N, world) from control step `push_start` on.
        push_start: the frame before it.
        key: of the noise, with the frame folded in; a key's data, so that worlds are plain numbers.
        displacement: where the object was seen at first, from where the demonstration has it: x, y (m), turn (rad).
    """

    delay: Int[Array, "*b"]
    waiting: Float[Array, "*b w u"]
    seen_offset: Float[Array, "*b 6"]
    push: Float[Array, "*b 3"]
    push_start: Int[Array, "*b"]
    key: UInt32[Array, "*b k"]
    displacement: Float[Array, "*b 3"]


def episode_tables(randomize: Randomize, object_poses: Sequence[Float[np.ndarray, "_ 7"]], fps: float) -> EpisodeTables:
    """What episodes are drawn from by these ranges, on demonstrations with these poses (`fps` a second)."""
    randomize = randomize.scaled()
    steps = round(randomize.push_seconds * fps)
    return EpisodeTables(
        delay=jnp.array(randomize.delay, jnp.int32),
        seen_move=jnp.array(randomize.seen_move, jnp.float32),
        seen_turn=jnp.deg2rad(jnp.array(randomize.seen_turn_deg, jnp.float32)),
        seen_noise=jnp.array([randomize.seen_noise, np.deg2rad(randomize.seen_noise_deg)], jnp.float32),
        push=jnp.array(randomize.push, jnp.float32),
        push_steps=jnp.asarray(steps, jnp.int32),
        push_prob=jnp.asarray(randomize.push_prob, jnp.float32),
        held=jnp.array([_held(pose, steps) for pose in object_poses], jnp.int32),
    )


def _held(pose: Float[np.ndarray, "_ 7"], steps: int) -> tuple[int, int]:
    """The first and the last frame of a demonstration from which a push of so many steps finds the object held."""
    away = np.linalg.norm(pose[:, :3] - pose[0, :3], axis=1) > HELD_AWAY
    first = int(away.argmax()) if away.any() else _NEVER
    return first, max(len(pose) - 2 - steps, first)  # over before the last frame, which an evaluation holds on


def draw_episode(
    tables: EpisodeTables, demonstration: Int[Array, ""], control: Float[Array, "u"], key: Array
) -> Episode:
    """An episode of a demonstration; `control` (m, rad) is what the actuators were told so far."""
    keys = jax.random.split(key, 10)
    ranges = (tables.seen_move, tables.seen_turn, tables.push)
    distance, angle, force = (
        jax.random.uniform(k, minval=limits[0], maxval=limits[1]) for k, limits in zip(keys[:3], ranges, strict=True)
    )
    offset = jnp.concatenate([distance * _direction(keys[3], 3), angle * _direction(keys[4], 3)])
    pushed = jax.random.bernoulli(keys[5], tables.push_prob)
    sideways = jnp.concatenate([_direction(keys[6], 2), jnp.zeros(1)])
    first, last = tables.held[demonstration]
    return Episode(
        delay=jax.random.randint(keys[7], (), tables.delay[0], tables.delay[1] + 1),
        waiting=jnp.broadcast_to(control, (MOST_DELAY, *control.shape)),
        seen_offset=offset,
        push=force * pushed * sideways,
        push_start=jax.random.randint(keys[9], (), first, last + 1),
        key=jax.random.key_data(keys[8]),
        displacement=jnp.zeros(3),
    )


def delayed(episode: Episode, targets: Float[Array, "u"]) -> tuple[Episode, Float[Array, "u"]]:
    """The episode with these targets on their way, and those that arrive now, `delay` control steps later."""
    sent = jnp.concatenate([targets[None], episode.waiting])
    return dataclasses.replace(episode, waiting=sent[:-1]), sent[episode.delay]


def pushing(episode: Episode, tables: EpisodeTables, frame: Int[Array, ""]) -> Float[Array, "6"]:
    """Force (N, world) and no torque on the object in the control step that ends at `frame`."""
    since = frame - 1 - episode.push_start
    now = (since >= 0) & (since < tables.push_steps)
    return jnp.concatenate([jnp.where(now, episode.push, 0.0), jnp.zeros(3)])


def seen_pose(
    episode: Episode, tables: EpisodeTables, frame: Int[Array, ""], pose: Float[Array, "7"]
) -> Float[Array, "7"]:
    """The object's pose as it is observed at a frame."""
    noise = jax.random.normal(jax.random.fold_in(jax.random.wrap_key_data(episode.key), frame), (6,))
    off = episode.seen_offset + noise * jnp.repeat(tables.seen_noise, 3)
    turned = exp(off[3:]) @ quaternion_to_matrix(pose[3:])
    return jnp.concatenate([pose[:3] + off[:3], matrix_to_quaternion(turned)])


def _direction(key: Array, dimensions: int) -> Float[Array, "{dimensions}"]:
    vector = jax.random.normal(key, (dimensions,))
    return vector / jnp.linalg.norm(vector)
