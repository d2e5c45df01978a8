"""The policy and value networks, and policies as plain functions of their parameters."""

import functools
from collections.abc import Callable
from pathlib import Path
from typing import Any

import flax
import jax
import numpy as np
from brax.training.agents.ppo import networks
from jaxtyping import Array, Float

from mjx_hand.errors import InputError
from train.settings.options import Ppo

_KEY = jax.ShapeDtypeStruct((2,), np.uint32)  # a random key, where no parameters are drawn


def network_factory(ppo: Ppo) -> Callable[..., networks.PPONetworks]:
    """What Brax PPO makes its networks with.

    Actions are normal with a deviation that does not depend on the state and starts small: a residual that begins as
    loud noise shakes the object out of the hand before anything can be learned from holding it. Their mean starts at
    next to nothing, so that a learning curve starts at the zero-residual baseline.

    Raises:
        InputError: a Flax that does not run on this JAX.
    """
    _check_flax(jax.__version_info__, flax.__version__)
    return functools.partial(
        networks.make_ppo_networks,
        policy_hidden_layer_sizes=ppo.policy_layers,
        value_hidden_layer_sizes=ppo.value_layers,
        distribution_type="normal",
        noise_std_type="log",
        init_noise_std=ppo.initial_std,
        mean_kernel_init_fn=jax.nn.initializers.variance_scaling,
        mean_kernel_init_kwargs={"scale": 1e-4, "mode": "fan_in", "distribution": "uniform"},
    )


def _check_flax(jax_version: tuple[int, ...], flax_version: str) -> None:
    """Flax names no upper bound of JAX, so that an installer keeps an old one beside a new JAX."""
    if jax_version >= (0, 11) and tuple(int(part) for part in flax_version.split(".")[:3]) < (0, 12, 12):
        raise InputError(
            f"flax {flax_version} does not run on jax {'.'.join(map(str, jax_version))}, which needs flax 0.12.12 or "
            "newer; install it with: pip install --upgrade flax"
        )


def check_policy(path: str | Path, parameters: Any, ppo: Ppo, observation_size: int, action_size: int) -> None:
    """Raise InputError unless parameters from a file are those of this network, all finite."""
    made = network_factory(ppo)(observation_size, action_size)
    wanted = {
        jax.tree_util.keystr(place): leaf.shape
        for place, leaf in jax.tree_util.tree_leaves_with_path(jax.eval_shape(made.policy_network.init, _KEY))
    }
    found = {jax.tree_util.keystr(place): leaf for place, leaf in jax.tree_util.tree_leaves_with_path(parameters)}
    for name in sorted(wanted.keys() | found.keys()):
        shape = found[name].shape if name in found else None
        if shape != wanted.get(name):
            raise InputError(
                f"{path}: has {name} of shape {shape}, a network of ppo.policy_layers={list(ppo.policy_layers)} "
                f"{wanted.get(name)}; give the layers it was trained with, or train again"
            )
        if not np.isfinite(np.asarray(found[name])).all():
            raise InputError(f"{path}: {name} has NaN or infinity; train again")


def deterministic_policy(
    ppo: Ppo, observation_size: int, action_size: int
) -> Callable[[Any, Float[Array, "n o"]], Float[Array, "n u"]]:
    """The policy's mean action as a function of (policy parameters, observations)."""
    made = network_factory(ppo)(observation_size, action_size)
    infer = networks.make_inference_fn(made)

    def act(parameters: Any, observation: Float[Array, "n o"]) -> Float[Array, "n u"]:
        # Observations are scaled by hand, so Brax's normaliser has nothing to say.
        return infer((None, parameters, None), deterministic=True)(observation, jax.random.key(0))[0]

    return act
