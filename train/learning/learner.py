"""Proximal policy optimisation over many worlds: one update is one compiled function of a state that can be saved.

Networks, unrolls and the loss are Brax's. The loop around them is ours because Brax's own gives out parameters alone:
Adam's moments, the worlds and the random key stay inside it, so that nothing it can save lets a training go on as if
it had not been stopped.
"""

import functools
from collections.abc import Callable, Mapping
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import optax
from brax.envs.base import State
from brax.training import acting
from brax.training.agents.ppo import losses, networks
from jax.sharding import Mesh, NamedSharding, PartitionSpec
from jaxtyping import Array, Float, Int, UInt

from envs.commands import EXPERT
from envs.parallel import ParallelEnv
from envs.twin import Tables
from mjx_hand.errors import InputError
from mjx_hand.pytree import pytree
from train.learning.policy import network_factory
from train.settings.options import Ppo

_AXIS = "worlds"
_EXTRAS = ("truncation", "episode_metrics", "episode_done")


@pytree
class Networks:
    """Parameters of the policy's and of the value's network, nested dictionaries of arrays as Flax has them."""

    policy: Any
    value: Any


@pytree
class LearnerState:
    """All that a training carries from update to update.

    Attributes:
        params: parameters of policy and value network.
        optimizer: Adam's moments.
        worlds: the environment's state, a leading axis over worlds.
        key: of everything random that is still to come.
        updates: how many were made.
        unstable: how many simulations have diverged, and were started anew.
    """

    params: Networks
    optimizer: Any
    worlds: State
    key: UInt[Array, "2"]
    updates: Int[Array, ""]
    unstable: Int[Array, ""]


class Learner:
    """PPO on an environment, its worlds spread evenly over all devices of all processes.

    The result depends on the number of devices, which draw their own noise and shuffle their own worlds, and not on
    how the devices are spread over processes.

    Attributes:
        steps_per_update: control steps of all worlds together.
        template: shapes and types of a state.
        tables: the environment's, laid out over the devices.
    """

    def __init__(self, env: ParallelEnv, ppo: Ppo):
        devices = jax.devices()
        _check_split(ppo, len(devices))
        self.steps_per_update = ppo.steps_per_update
        self.mesh = Mesh(devices, (_AXIS,))
        everywhere, split = PartitionSpec(), PartitionSpec(_AXIS)
        made = network_factory(ppo)(env.observation_size, env.action_size)
        optimizer = optax.chain(optax.clip_by_global_norm(ppo.max_grad_norm), optax.adam(ppo.learning_rate))
        spread = functools.partial(jax.shard_map, mesh=self.mesh, check_vma=False)

        def initial(seed: Int[Array, ""] | int, reset: Callable[[Array], State]) -> LearnerState:
            key, policy, value, worlds = jax.random.split(jax.random.PRNGKey(seed), 4)
            params: Any = Networks(policy=made.policy_network.init(policy), value=made.value_network.init(value))
            state = LearnerState(
                params=params,
                optimizer=optimizer.init(params),
                worlds=reset(jax.random.split(worlds, ppo.num_envs)),
                key=key,
                updates=jnp.zeros((), jnp.int32),
                unstable=jnp.zeros((), jnp.int32),
            )
            # Without JAX's weak types, which an update would lose, so that the next would compile anew.
            return jax.tree.map(lambda leaf: jax.lax.convert_element_type(leaf, leaf.dtype), state)

        self.template = jax.eval_shape(functools.partial(initial, reset=env.reset), 0)
        specs = jax.tree_util.tree_map_with_path(
            lambda path, leaf: split if path[0].name == "worlds" else everywhere, self.template
        )
        self._shardings = jax.tree.map(
            lambda spec: NamedSharding(self.mesh, spec), specs, is_leaf=lambda node: isinstance(node, PartitionSpec)
        )
        reset = spread(
            lambda keys, tables: env.with_tables(tables).reset(keys), in_specs=(split, everywhere), out_specs=split
        )
        # Tables are arguments: as constants, each new set of demonstrations would compile anew.
        self._initial = jax.jit(
            lambda seed, tables: initial(seed, lambda keys: reset(keys, tables)), out_shardings=self._shardings
        )
        update = functools.partial(_update, env=env, made=made, optimizer=optimizer, ppo=ppo, devices=len(devices))
        self._everywhere = NamedSharding(self.mesh, everywhere)
        self._update = jax.jit(
            spread(update, in_specs=(specs, everywhere, everywhere), out_specs=(specs, everywhere)),
            donate_argnums=0,
            out_shardings=(self._shardings, self._everywhere),
        )
        self.tables = self.placed_tables(env.env.tables)

    def placed(self, state: LearnerState) -> LearnerState:
        """A state of NumPy arrays, the same in every process, laid out over the devices."""
        return jax.tree.map(_placed, state, self._shardings)

    def placed_tables(self, tables: Tables) -> Tables:
        """Tables, the same in every process, on every device."""
        return jax.tree.map(lambda leaf: _placed(np.asarray(leaf), self._everywhere), tables)

    def initial(self, seed: int, tables: Tables | None = None) -> LearnerState:
        """The state from a seed, before any learning; tables as of `update`."""
        return self._initial(seed, self._given(tables))

    def update(
        self, state: LearnerState, progress: float, tables: Tables | None = None
    ) -> tuple[LearnerState, Mapping[str, Array]]:
        """One unroll of every world and the gradient steps on it.

        Args:
            state: given up: its memory is that of the state that comes out.
            progress: the share of the training that is over.
            tables: of another set of demonstrations, from `placed_tables`; the environment's own if None.

        Returns:
            The state after it, and means over the update: `training/...` of the learner, `episode/...` of the episodes
            that ended in it (sums over an episode; NaN where none ended).

        Raises:
            InputError: tables of another size than the environment's.
        """
        return self.compiled(state, np.float32(progress), self._given(tables))

    def _given(self, tables: Tables | None) -> Tables:
        if tables is None:
            return self.tables
        _check_tables(tables, self.tables)
        return tables

    @functools.cached_property
    def lowered(self) -> jax.stages.Lowered:
        """The update as a program, a function of state, progress (float32) and tables."""
        state = jax.tree.map(
            lambda leaf, sharding: jax.ShapeDtypeStruct(leaf.shape, leaf.dtype, sharding=sharding),
            self.template,
            self._shardings,
        )
        return self._update.lower(state, jax.ShapeDtypeStruct((), jnp.float32), self.tables)

    @functools.cached_property
    def compiled(self) -> jax.stages.Compiled:
        """The same, compiled."""
        return self.lowered.compile()

    def memory(self) -> int | None:
        """Bytes of each device that an update needs, state and tables included; None if XLA does not tell."""
        told = self.compiled.memory_analysis()
        if told is None:
            return None
        held = told.argument_size_in_bytes + told.output_size_in_bytes - told.alias_size_in_bytes
        return held + told.temp_size_in_bytes


def _placed(leaf: np.ndarray, sharding: NamedSharding) -> Array:
    return jax.make_array_from_callback(leaf.shape, sharding, lambda index: leaf[index])


def _check_tables(tables: Tables, own: Tables) -> None:
    given, wanted = ([(leaf.shape, leaf.dtype) for leaf in jax.tree.leaves(each)] for each in (tables, own))
    if given != wanted:
        sizes = ["{} demonstrations x {} frames".format(*t.reference.targets.shape[:2]) for t in (tables, own)]
        raise InputError(f"tables of {sizes[0]} do not fit a learner for {sizes[1]}; make a learner for them")


def _check_split(ppo: Ppo, devices: int) -> None:
    if ppo.num_envs % (devices * ppo.num_minibatches):
        raise InputError(
            f"ppo.num_envs is {ppo.num_envs}, which {devices} devices cannot share in {ppo.num_minibatches} "
            f"minibatches each; give a multiple of {devices * ppo.num_minibatches}"
        )


def _update(
    state: LearnerState,
    progress: Float[Array, ""],
    tables: Tables,
    *,
    env: ParallelEnv,
    made: networks.PPONetworks,
    optimizer: optax.GradientTransformation,
    ppo: Ppo,
    devices: int,
) -> tuple[LearnerState, dict[str, Array]]:
    """One update on this device's worlds, its gradients averaged over all devices."""
    env = env.with_tables(tables)
    key, here = jax.random.split(state.key)
    here = jax.random.fold_in(here, jax.lax.axis_index(_AXIS))
    acting_key, shuffle_key = jax.random.split(here)

    policy = networks.make_inference_fn(made)((None, state.params.policy, state.params.value))
    info = state.worlds.info
    worlds = state.worlds.replace(info={**info, "progress": jnp.full_like(info["progress"], progress)})  # type: ignore[attr-defined]
    extras = (*_EXTRAS, EXPERT) if ppo.imitation else _EXTRAS
    worlds, data = acting.generate_unroll(env, worlds, policy, acting_key, ppo.unroll_length, extra_fields=extras)
    data = jax.tree.map(lambda leaf: jnp.swapaxes(leaf, 0, 1), data)  # one row per world: minibatches are of rows

    ppo_loss = functools.partial(
        losses.compute_ppo_loss,
        ppo_network=made,
        entropy_cost=ppo.entropy_cost,
        discounting=ppo.discounting,
        gae_lambda=ppo.gae_lambda,
        clipping_epsilon=ppo.clipping_epsilon,
    )

    def loss(params: Networks, normalizer: None, rows: Any, key: Array) -> tuple[Any, Any]:
        total, metrics = ppo_loss(params, normalizer, rows, key)  # type: ignore[arg-type]
        if not ppo.imitation:
            return total, metrics
        weight = ppo.imitation * jnp.clip(1 - progress / ppo.imitation_until, 0.0, 1.0)
        mean = made.parametric_action_distribution.mode(
            made.policy_network.apply(normalizer, params.policy, rows.observation)
        )
        off = jnp.sum((mean - rows.extras["state_extras"][EXPERT]) ** 2, axis=-1).mean()
        return total + weight * off, {**metrics, "imitation_loss": off}

    gradient = jax.grad(loss, has_aux=True)
    rows = ppo.num_envs // devices

    def minibatch(carry: Any, row: Any) -> tuple[Any, Any]:
        params, moments = carry
        chosen, loss_key = row
        grads, metrics = gradient(params, None, jax.tree.map(lambda leaf: leaf[chosen], data), loss_key)
        grads = jax.lax.pmean(grads, _AXIS)
        change, moments = optimizer.update(grads, moments, params)
        return (optax.apply_updates(params, change), moments), metrics

    def epoch(carry: Any, epoch_key: Array) -> tuple[Any, Any]:
        order_key, loss_key = jax.random.split(epoch_key)
        order = jax.random.permutation(order_key, rows).reshape(ppo.num_minibatches, -1)
        return jax.lax.scan(minibatch, carry, (order, jax.random.split(loss_key, ppo.num_minibatches)))

    (params, moments), metrics = jax.lax.scan(
        epoch, (state.params, state.optimizer), jax.random.split(shuffle_key, ppo.num_updates_per_batch)
    )
    episodes = data.extras["state_extras"]
    diverged = (episodes["episode_metrics"]["unstable"] * episodes["episode_done"]).sum()
    learned = LearnerState(
        params=params,
        optimizer=moments,
        worlds=worlds,
        key=key,
        updates=state.updates + 1,
        unstable=state.unstable + jax.lax.psum(diverged, _AXIS).astype(jnp.int32),
    )
    return learned, _metrics(metrics, episodes)


def _metrics(learning: Mapping[str, Array], episodes: Mapping[str, Any]) -> dict[str, Array]:
    """Means over the update and all devices; episodes count where they ended (NaN where none did)."""
    ended = episodes["episode_done"]
    count = jax.lax.psum(ended.sum(), _AXIS)
    sums = {name: jax.lax.psum((value * ended).sum(), _AXIS) for name, value in episodes["episode_metrics"].items()}
    return {
        **{f"training/{name}": jax.lax.pmean(value.mean(), _AXIS) for name, value in learning.items()},
        **{f"episode/{name}": value / count for name, value in sums.items()},
        "episode/ended": count,
    }
