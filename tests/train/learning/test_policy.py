import jax
import numpy as np
import pytest
from brax.training.agents.ppo import networks

from mjx_hand.errors import InputError
from train.learning.policy import _check_flax, deterministic_policy, network_factory
from train.settings.options import Ppo

PPO = Ppo(policy_layers=(12, 8), value_layers=(6,), initial_std=0.3)
OBSERVATIONS, ACTIONS = 9, 26


@pytest.fixture(scope="module")
def made() -> networks.PPONetworks:
    return network_factory(PPO)(OBSERVATIONS, ACTIONS)


@pytest.fixture(scope="module")
def parameters(made):
    return made.policy_network.init(jax.random.key(1))


@pytest.fixture(scope="module")
def observation() -> jax.Array:
    return jax.random.normal(jax.random.key(2), (5, OBSERVATIONS))


def policy_layers(parameters):
    inner = parameters["params"]
    return [*inner["MLP_0"].values(), inner["Dense_0"]]


def test_layers_are_those_of_the_configuration(made, parameters):
    assert [layer["kernel"].shape for layer in policy_layers(parameters)] == [(9, 12), (12, 8), (8, 26)]
    value = made.value_network.init(jax.random.key(0))["params"]
    assert [value[f"hidden_{k}"]["kernel"].shape for k in range(2)] == [(9, 6), (6, 1)]


def test_the_action_is_the_mean_of_the_network(parameters, observation):
    """The same sums in NumPy: swish layers, then a linear one, and nothing that squashes it."""
    x = np.asarray(observation, float)
    for k, layer in enumerate(policy_layers(parameters)):
        x = x @ np.asarray(layer["kernel"], float) + np.asarray(layer["bias"], float)
        x = x / (1 + np.exp(-x)) if k < 2 else x
    action = deterministic_policy(PPO, OBSERVATIONS, ACTIONS)(parameters, observation)
    np.testing.assert_allclose(action, x, rtol=1e-4, atol=1e-5)


def test_the_action_is_brax_own_inference(made, parameters, observation):
    """Training's policy, asked for its mode, with the normaliser that training has switched off."""
    infer = networks.make_inference_fn(made)((None, parameters, None), deterministic=True)
    action = deterministic_policy(PPO, OBSERVATIONS, ACTIONS)(parameters, observation)
    np.testing.assert_array_equal(action, infer(observation, jax.random.key(123))[0])


def test_noise_starts_at_the_configured_size_whatever_the_state(made, parameters, observation):
    infer = networks.make_inference_fn(made)((None, parameters, None), deterministic=False)
    many = jax.numpy.repeat(observation[:2], 4000, axis=0)
    drawn = np.asarray(infer(many, jax.random.key(0))[0]).reshape(2, 4000, ACTIONS)
    mean = deterministic_policy(PPO, OBSERVATIONS, ACTIONS)(parameters, observation[:2])
    np.testing.assert_allclose(drawn.mean(axis=1), mean, atol=0.03)
    np.testing.assert_allclose(drawn.std(axis=1), 0.3, rtol=0.1)


@pytest.mark.parametrize(
    ("jax_version", "flax_version", "runs"),
    [
        ((0, 10, 2), "0.12.6", True),
        ((0, 11, 2), "0.12.6", False),
        ((0, 12, 0), "0.12.12", True),
        ((0, 11, 0), "0.13.0", True),
    ],
)
def test_a_flax_that_jax_has_outgrown_is_named(jax_version, flax_version, runs):
    if runs:
        _check_flax(jax_version, flax_version)
    else:
        with pytest.raises(InputError, match=r"flax 0.12.6 does not run on jax 0.11.2.* pip install --upgrade flax"):
            _check_flax(jax_version, flax_version)
