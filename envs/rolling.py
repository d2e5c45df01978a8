"""Rolling a twin out: every demonstration from its first frame, unassisted, to its end and beyond."""

from collections.abc import Callable, Sequence

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from envs.observation import wrist_rotation
from envs.rollout import Rollouts
from envs.scene import NUM_WRIST
from envs.tracking import TrackingEnv, twin_of
from mjx_hand.hand.joints import NUM_HINGES
from mjx_hand.rigid.rigid_hand import RigidHand, forward_kinematics, stack_hands, tip_positions

_NUM_TARGETS = NUM_WRIST + NUM_HINGES


def zero_residual(parameters: object, observation: Float[Array, "n o"]) -> Float[Array, "n 26"]:
    """The policy that leaves the reference as it is: the baseline."""
    return jnp.zeros((observation.shape[0], _NUM_TARGETS))


def make_roll_out(
    env: TrackingEnv, hands: Sequence[RigidHand], policy: Callable[[object, Array], Array], hold: float = 0.0
) -> Callable[[object], Rollouts]:
    """A function from a policy's parameters to the rollouts of every demonstration of `env`; compiled once.

    Nothing ends a rollout early: a dropped object counts in every frame after it.

    Args:
        env: the environment.
        hands: the twin's hand for each demonstration.
        policy: from (parameters, observations of all worlds) to actions.
        hold: how long the last target is held on after each demonstration (s).
    """
    length = np.asarray(env.reference.length)
    steps = int(length.max()) - 1 + round(hold * env.fps)
    bodies = stack_hands(hands)

    @jax.jit
    def run(parameters: object) -> tuple[Array, Array, Array]:
        def step(state, _):  # type: ignore[no-untyped-def]
            state = jax.vmap(env.step)(state, policy(parameters, state.obs))
            physics = twin_of(state).physics
            return state, (physics.qpos, physics.sensordata, state.reward)

        count = env.num_demonstrations
        first = jax.vmap(env.start)(jnp.arange(count), jnp.zeros(count, int))
        physics = twin_of(first).physics
        start = (physics.qpos, physics.sensordata, first.reward)
        _, rest = jax.lax.scan(step, first, length=steps)
        return jax.tree.map(lambda a, b: jnp.moveaxis(jnp.concatenate([a[None], b]), 0, 1), start, rest)

    @jax.jit
    def centres(qpos: Float[Array, "n t q"], base: Float[Array, "n 3 3"], bodies: RigidHand) -> tuple[Array, Array]:
        def one(q: Array, base: Array, hand: RigidHand) -> tuple[Array, Array]:
            rotation = wrist_rotation(q[3:NUM_WRIST], base)
            rot, pos = forward_kinematics(q[NUM_WRIST:_NUM_TARGETS], hand)
            tips = tip_positions(rot, pos, hand)
            return pos @ rotation.T + base @ q[:3], tips @ rotation.T + base @ q[:3]

        return jax.vmap(lambda qs, b, h: jax.lax.map(lambda q: one(q, b, h), qs, batch_size=64))(qpos, base, bodies)

    # After a demonstration its last frame is the reference.
    frame = np.minimum(np.arange(steps + 1)[None], length[:, None] - 1)
    rows = np.arange(len(length))[:, None]
    reference = np.asarray(env.reference.targets)[rows, frame]
    pose = np.asarray(env.reference.object_pose)[rows, frame]
    wanted_joints, wanted_tips = (np.asarray(a) for a in centres(reference, env.reference.base, bodies))
    time = np.arange(steps + 1)[None]
    counted = time < length[:, None]
    held = (time >= length[:, None]) & (time < length[:, None] + round(hold * env.fps))

    def roll_out(parameters: object) -> Rollouts:
        qpos, sensors, reward = run(parameters)
        joints, _ = centres(qpos[..., :_NUM_TARGETS], env.reference.base, bodies)
        return Rollouts(
            demonstration=np.arange(len(length)),
            qpos=np.asarray(qpos),
            object_pose=np.asarray(qpos[..., _NUM_TARGETS:]),
            object_reference=pose,
            joints=np.asarray(joints),
            joints_reference=wanted_joints,
            tips=np.asarray(sensors).reshape(*sensors.shape[:2], 5, 3),
            tips_reference=wanted_tips,
            counted=counted,
            held=held,
            reward=np.asarray(reward),
            fps=env.fps,
        )

    return roll_out
