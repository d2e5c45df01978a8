"""Every form of an exported policy gives Brax's actions, on random inputs and on those of a rollout."""

import ctypes
import dataclasses
import shutil
import subprocess
from pathlib import Path

import jax
import numpy as np
import pytest

from mjx_hand.errors import InputError
from mjx_hand.player.exported_policy import ExportedPolicy, Layer, load_exported_policy
from mjx_hand.player.play_policy import Player
from mjx_hand.player.tracking_reference import load_tracking_reference
from train.export import network
from train.export.c_source import save_c
from train.export.network import difference_from_brax, policy_layers
from train.learning.checkpoint import load_checkpoint
from train.learning.policy import deterministic_policy
from train.settings.config import Config

TOLERANCE = 1e-5
Rows = np.ndarray


@pytest.fixture(scope="module")
def policy(exported: Path) -> ExportedPolicy:
    return load_exported_policy(exported / "policy.npz")


@pytest.fixture(scope="module")
def inputs(policy: ExportedPolicy, exported: Path) -> Rows:
    """A rollout's features, the same disturbed, and random ones to beyond the limits: 10,000 of these."""
    folder = exported / "demonstrations"
    player = Player(policy, load_tracking_reference(folder / "000.npz"), folder)
    rows = []
    for _ in range(player.reference.num_frames - 1):
        rows.append(player.features())
        player.step()
    rng = np.random.default_rng(0)
    around = np.array(rows)[rng.integers(len(rows), size=5000)] + 0.3 / policy.scale * rng.normal(size=(5000, 225))
    anywhere = policy.offset + rng.uniform(-7, 7, (5000, 225)) / policy.scale
    return np.concatenate([rows, around, anywhere]).astype(np.float32)


@pytest.fixture(scope="module")
def wanted(included: Config, inputs: Rows, policy: ExportedPolicy) -> tuple[Rows, Rows]:
    """Brax's actions within their limits, and the residual by the environment's formula."""
    parameters = load_checkpoint(included.checkpoint).policy
    observation = np.clip((inputs - policy.offset) * policy.scale, -5, 5)
    act = deterministic_policy(included.ppo, 225, 26)
    action = np.clip(np.asarray(jax.jit(act)(parameters, observation)), -1, 1)
    scale = np.repeat([0.02, 0.2, 0.7], [3, 3, 20])
    return action, 0.9 * inputs[:, 52:78] + 0.1 * scale * action


def check(found: tuple[Rows, Rows], wanted: tuple[Rows, Rows]) -> None:
    for got, right in zip(found, wanted, strict=True):
        np.testing.assert_allclose(got, right, rtol=0, atol=TOLERANCE)


def test_numpy(policy: ExportedPolicy, inputs: Rows, wanted: tuple[Rows, Rows]):
    assert np.abs(wanted[0]).max() == 1
    assert np.median(np.abs(wanted[0])) < 0.9
    check(policy.step(inputs), wanted)


def test_onnx(exported: Path, inputs: Rows, wanted: tuple[Rows, Rows], policy: ExportedPolicy):
    runtime = pytest.importorskip("onnxruntime", reason="the package onnxruntime is not installed: make setup")
    session = runtime.InferenceSession(exported / "policy.onnx", providers=["CPUExecutionProvider"])
    assert [(i.name, i.shape) for i in session.get_inputs()] == [("features", ["batch", 225])]
    assert session.get_modelmeta().custom_metadata_map["digest"] == policy.digest
    check(session.run(["action", "residual"], {"features": inputs}), wanted)
    check(session.run(["action", "residual"], {"features": inputs[:1]}), (wanted[0][:1], wanted[1][:1]))


def compiled(folder: Path, out: Path) -> ctypes.CDLL:
    if shutil.which("cc") is None:
        pytest.skip("no C compiler `cc`")
    strict = ["-std=c99", "-O2", "-Wall", "-Wextra", "-pedantic", "-Werror", "-shared", "-fPIC"]
    subprocess.run(["cc", *strict, str(folder / "policy.c"), "-o", str(out / "policy.so"), "-lm"], check=True)
    return ctypes.CDLL(str(out / "policy.so"))


def test_c(exported: Path, tmp_path: Path, inputs: Rows, wanted: tuple[Rows, Rows]):
    step = compiled(exported, tmp_path).policy_step
    action, residual = np.zeros((2, len(inputs), 26), np.float32)
    pointer = ctypes.POINTER(ctypes.c_float)
    for k in range(len(inputs)):
        assert step(*(row[k].ctypes.data_as(pointer) for row in (inputs, action, residual))) == 0
    check((action, residual), wanted)
    before = action[0].copy(), residual[0].copy()
    for bad in (np.nan, np.inf):
        row = inputs[0].copy()
        row[100] = bad
        assert step(*(a.ctypes.data_as(pointer) for a in (row, action[0], residual[0]))) == 101
    check((action[0], residual[0]), before)


def test_c_of_a_policy_without_hidden_layers(policy: ExportedPolicy, tmp_path: Path):
    """And with whole numbers, which C would otherwise take for integers with a wrong suffix."""
    kernel = np.zeros((225, 26), np.float32)
    kernel[:26] = 2 * np.eye(26)
    plain = dataclasses.replace(
        policy,
        layers=(Layer(kernel, np.zeros(26, np.float32)),),
        scale=np.ones(225, np.float32),
        offset=kernel[:, 0] * 0,
    )
    save_c(plain, tmp_path)
    step = compiled(tmp_path, tmp_path).policy_step
    features = np.linspace(-0.6, 0.6, 225, dtype=np.float32)
    action, residual = np.zeros((2, 26), np.float32)
    step(*(a.ctypes.data_as(ctypes.POINTER(ctypes.c_float)) for a in (features, action, residual)))
    np.testing.assert_allclose(action, np.clip(2 * features[:26], -1, 1), atol=1e-6)


def test_a_network_of_another_kind_is_refused(policy, included, monkeypatch):
    """As where a version of Brax takes another activation."""
    parameters = load_checkpoint(included.checkpoint).policy
    brax = network.brax_actions
    monkeypatch.setattr(network, "brax_actions", lambda *args: brax(*args) + 1e-3)
    with pytest.raises(InputError, match=r"differ from Brax's by 1\.0e-03, more than 1e-05"):
        difference_from_brax(policy, parameters, included.ppo)


def test_layers_are_those_of_the_checkpoint(included):
    shapes = [layer.kernel.shape for layer in policy_layers(load_checkpoint(included.checkpoint).policy)]
    assert shapes == [(225, 128), (128, 128), (128, 26)]
