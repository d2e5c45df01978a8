import dataclasses

import numpy as np
import pytest

from mjx_hand.errors import InputError
from mjx_hand.files.npz_archive import load_arrays, save_arrays
from mjx_hand.player.exported_policy import (
    SCHEMA,
    ExportedPolicy,
    Layer,
    load_exported_policy,
    save_exported_policy,
)


@pytest.fixture
def policy() -> ExportedPolicy:
    """Five features, the last two of them the residual; seven units; two actions."""
    rng = np.random.default_rng(0)

    def drawn(*shape: int) -> np.ndarray:
        return rng.normal(size=shape).astype(np.float32)

    return ExportedPolicy(
        offset=drawn(5),
        scale=10 * np.abs(drawn(5)),
        limit=5.0,
        layers=(Layer(drawn(5, 7), drawn(7)), Layer(drawn(7, 2), drawn(2))),
        residual_start=3,
        residual_scale=np.array([0.02, 0.35], np.float32),
        smoothing=0.9,
        contract={"inputs": []},
    )


def by_hand(policy: ExportedPolicy, features: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The same, number by number."""
    x = [max(-5.0, min(5.0, float((f - o) * s))) for f, o, s in zip(features, policy.offset, policy.scale, strict=True)]
    hidden = [sum(x[i] * policy.layers[0].kernel[i, j] for i in range(5)) + policy.layers[0].bias[j] for j in range(7)]
    hidden = [h / (1 + np.exp(-h)) for h in hidden]
    out = [
        sum(hidden[i] * policy.layers[1].kernel[i, j] for i in range(7)) + policy.layers[1].bias[j] for j in range(2)
    ]
    action = np.clip(out, -1, 1)
    return action, 0.9 * features[3:] + 0.1 * np.array([0.02, 0.35]) * action


def test_a_step_is_scaling_network_and_filter(policy):
    features = np.random.default_rng(1).normal(size=(3, 4, 5))
    action, residual = policy.step(features)
    assert action.shape == residual.shape == (3, 4, 2)
    assert np.abs(action).max() == 1 > np.abs(action).min()
    for index in np.ndindex(3, 4):
        wanted = by_hand(policy, features[index])
        np.testing.assert_allclose(action[index], wanted[0], atol=1e-5)
        np.testing.assert_allclose(residual[index], wanted[1], atol=1e-6)


def test_units_far_below_zero_are_zero_without_a_warning(policy):
    low = Layer(policy.layers[0].kernel, policy.layers[0].bias - 1000)
    action, _ = dataclasses.replace(policy, layers=(low, policy.layers[1])).step(np.zeros(5))
    np.testing.assert_allclose(action, np.clip(policy.layers[1].bias, -1, 1))


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_what_is_not_finite_is_named(policy, bad):
    features = np.zeros((2, 5))
    features[1, 3] = bad
    with pytest.raises(InputError, match=r"feature 3 is NaN or infinite"):
        policy.step(features)


def test_another_number_of_features(policy):
    with pytest.raises(InputError, match=r"shape \(4,\), this policy reads 5"):
        policy.step(np.zeros(4))


def test_a_file_gives_the_same_policy(policy, tmp_path):
    save_exported_policy(policy, tmp_path / "policy.npz")
    read = load_exported_policy(tmp_path / "policy.npz")
    features = np.random.default_rng(2).normal(size=(9, 5))
    np.testing.assert_array_equal(read.step(features), policy.step(features))
    assert read.digest == policy.digest
    assert read.contract == {"inputs": []}


@pytest.mark.parametrize(
    "name", ["offset", "scale", "kernel0", "bias1", "residual_scale", "smoothing", "residual_start"]
)
def test_a_changed_file_does_not_match_its_digest(policy, tmp_path, name):
    save_exported_policy(policy, tmp_path / "policy.npz")
    arrays = dict(load_arrays(tmp_path / "policy.npz", SCHEMA))
    arrays.pop("schema", None)
    arrays[name] = arrays[name] + 1
    save_arrays(tmp_path / "policy.npz", SCHEMA, arrays)
    with pytest.raises(InputError, match=r"do not match its digest"):
        load_exported_policy(tmp_path / "policy.npz")


@pytest.mark.parametrize("missing", ["kernel0", "bias0", "offset", "digest", "contract", "limit"])
def test_an_incomplete_file(policy, tmp_path, missing):
    save_exported_policy(policy, tmp_path / "policy.npz")
    arrays = dict(load_arrays(tmp_path / "policy.npz", SCHEMA))
    arrays.pop("schema", None)
    del arrays[missing]
    save_arrays(tmp_path / "policy.npz", SCHEMA, arrays)
    with pytest.raises(InputError):
        load_exported_policy(tmp_path / "policy.npz")
