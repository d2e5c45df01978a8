"""Rolling a twin out: every demonstration from its first frame, unassisted, to its end and beyond."""

from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from envs.evaluation.hand_places import make_hand_places
from envs.evaluation.rollout import Rollouts
from envs.tracking import TrackingEnv
from envs.twin import Tables, twin_of
from mjx_hand.bodies.coordinates import hand_coordinates


def zero_residual(parameters: object, observation: Float[Array, "n o"]) -> Float[Array, "n 1"]:
    """The policy that leaves the reference as it is, whatever the hand: the baseline."""
    return jnp.zeros((observation.shape[0], 1))


def make_roll_out(
    env: TrackingEnv,
    policy: Callable[[object, Array], Array],
    hold: float = 0.0,
    repeats: int = 1,
) -> Callable[..., Rollouts]:
    """A function from a policy's parameters to the rollouts of every demonstration of `env`; compiled once.

    Its other argument, if given, are tables to take the place of the environment's: other controls of the same
    demonstrations.

    Nothing ends a rollout early: a dropped object counts in every frame after it. All rollouts run side by side.

    Args:
        env: the environment.
        policy: from (parameters, observations of all worlds) to actions, (n, u), or (n, 1) for the same of all joints.
        hold: how long the last target is held on after each demonstration (s).
        repeats: rollouts of each demonstration, one set after the other. They differ where an engine adds forces up in
            an order that it does not keep, as on a GPU; the native engine's are the same to the last bit.
    """
    which = np.tile(np.arange(env.num_demonstrations), repeats)
    length = np.asarray(env.reference.length)[which]
    steps = int(length.max()) - 1 + round(hold * env.fps)

    @jax.jit
    def run(parameters: object, tables: Tables) -> tuple[tuple[Array, ...], Array]:
        given = env.with_tables(tables)

        def step(state, _):  # type: ignore[no-untyped-def]
            actions = jnp.broadcast_to(policy(parameters, state.obs), (len(which), env.action_size))
            state = jax.vmap(given.step)(state, actions)
            physics = twin_of(state).physics
            return state, (physics.qpos, physics.sensordata, physics.contact, state.reward)

        first = jax.vmap(given.start)(jnp.asarray(which, jnp.int32), jnp.zeros(len(which), jnp.int32))
        physics = twin_of(first).physics
        start = (physics.qpos, physics.sensordata, physics.contact, first.reward)
        _, rest = jax.lax.scan(step, first, length=steps)
        frames = jax.tree.map(lambda a, b: jnp.moveaxis(jnp.concatenate([a[None], b]), 0, 1), start, rest)
        return frames, tables.least_force[physics.variant]

    # After a demonstration its last frame is the reference.
    frame = np.minimum(np.arange(steps + 1)[None], length[:, None] - 1)
    reference = np.asarray(env.reference.targets)[which[:, None], frame]
    pose = np.asarray(env.reference.object_pose)[which[:, None], frame]
    places = make_hand_places([env.hands[k] for k in which], env.reference.base[which])
    wanted_joints, wanted_tips = places(hand_coordinates(env.models[0], reference))
    hand = env.body.num_coordinates
    time = np.arange(steps + 1)[None]
    counted = time < length[:, None]
    held = (time >= length[:, None]) & (time < length[:, None] + round(hold * env.fps))

    def roll_out(parameters: object, tables: Tables | None = None) -> Rollouts:
        (qpos, sensors, contact, reward), least_force = run(parameters, env.tables if tables is None else tables)
        joints, _ = places(qpos[..., :hand])
        return Rollouts(
            demonstration=which,
            qpos=np.asarray(qpos),
            object_pose=np.asarray(qpos[..., hand:]),
            object_reference=pose,
            joints=joints,
            joints_reference=wanted_joints,
            tips=np.asarray(sensors).reshape(*sensors.shape[:2], -1, 3),
            tips_reference=wanted_tips,
            contact=np.asarray(contact),
            least_force=np.asarray(least_force),
            counted=counted,
            held=held,
            reward=np.asarray(reward),
            fps=env.fps,
        )

    return roll_out
