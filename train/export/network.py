"""A trained policy as one function of features in physical units, compared with Brax's own inference."""

import dataclasses
from collections.abc import Mapping
from typing import Any

import jax
import numpy as np
from jaxtyping import Float

from envs.observation import observed_features, residual_scale
from envs.task import Task
from mjx_hand.bodies.body import Body
from mjx_hand.errors import InputError
from mjx_hand.player.exported_policy import ExportedPolicy, Layer
from mjx_hand.player.features import OBSERVATION_LIMIT, offsets_and_scales, reciprocal
from train.learning.policy import deterministic_policy
from train.settings.options import Ppo

TOLERANCE = 1e-5  # of an action, which is -1 to 1
INPUTS = 10_000


def exported_policy(parameters: Mapping[str, Any], task: Task, body: Body) -> ExportedPolicy:
    """The policy of these parameters, without a contract.

    Args:
        parameters: of the policy's network, as Flax has them.
        task: that it was trained on.
        body: that it moves.

    Raises:
        InputError: the network reads other features than this task has.
    """
    table = observed_features(task, body.names, body.reach)
    offset, scale = offsets_and_scales(table)
    layers = policy_layers(parameters)
    if layers[0].kernel.shape[0] != len(offset):
        raise InputError(
            f"the policy reads {layers[0].kernel.shape[0]} features, this task gives {len(offset)}; "
            "use the task options it was trained with, or train again"
        )
    names = [feature.name for feature in table]
    return ExportedPolicy(
        offset=offset.astype(np.float32),
        scale=scale.astype(np.float32),
        limit=OBSERVATION_LIMIT,
        layers=layers,
        residual_start=sum(feature.size for feature in table[: names.index("residual.wrist_position")]),
        residual_scale=residual_scale(task, body.names, body.reach).astype(np.float32),
        smoothing=task.smoothing,
        contract={},
    )


def policy_layers(parameters: Mapping[str, Any]) -> tuple[Layer, ...]:
    """The layers of Brax's policy network: those of its MLP, then the mean's."""
    inner = parameters["params"]
    hidden = inner.get("MLP_0", {})
    rows = [*(hidden[f"hidden_{k}"] for k in range(len(hidden))), inner["Dense_0"]]
    return tuple(Layer(np.asarray(row["kernel"], np.float32), np.asarray(row["bias"], np.float32)) for row in rows)


def difference_from_brax(policy: ExportedPolicy, parameters: Mapping[str, Any], ppo: Ppo) -> float:
    """Largest difference of an action from Brax's inference, over 10,000 random features, some beyond the limits.

    Raises:
        InputError: it is more than 1e-5.
    """
    spread = (policy.limit + 1) * np.random.default_rng(0).uniform(-1, 1, (INPUTS, policy.offset.size))
    features = (policy.offset + spread * reciprocal(policy.scale)).astype(np.float32)
    difference = float(np.abs(policy.step(features)[0] - brax_actions(policy, parameters, ppo, features)).max())
    if not difference <= TOLERANCE:
        raise InputError(
            f"the policy's actions as exported differ from Brax's by {difference:.1e}, more than {TOLERANCE:g}: its "
            "weights are too large for single precision, or this version of Brax makes other networks; train it again"
        )
    return difference


def brax_actions(
    policy: ExportedPolicy, parameters: Mapping[str, Any], ppo: Ppo, features: Float[np.ndarray, "n f"]
) -> Float[np.ndarray, "n a"]:
    """What Brax's inference answers to these features, within an action's limits."""
    sizes = tuple(layer.bias.size for layer in policy.layers[:-1])
    act = deterministic_policy(
        dataclasses.replace(ppo, policy_layers=sizes), policy.offset.size, policy.residual_scale.size
    )
    observation = np.clip((features - policy.offset) * policy.scale, -policy.limit, policy.limit)
    with jax.default_matmul_precision("highest"):  # a GPU would round to ten bits
        return np.clip(np.asarray(jax.jit(act)(parameters, observation)), -1.0, 1.0)
