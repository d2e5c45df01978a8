"""The folder of a robot's run, without a training: a random policy over the one demonstration that is included."""

import shutil
from pathlib import Path

import jax
import numpy as np

from envs.demonstrations.set_settings import GIVEN, SetSettings
from envs.observation import observed_features
from envs.task import Task
from mjx_hand.bodies.named_body import named_body
from train.experiment.bundled_policies import demonstration_path
from train.learning.checkpoint import Checkpoint, save_checkpoint
from train.learning.policy import network_factory
from train.settings.config import Config
from train.settings.options import Ppo
from train.settings.saved import FILE, policy_settings, write_settings

_LOUD = 30  # times the first actions of a training: up to 0.7


def robot_run(folder: Path, hand: str) -> Config:
    given = folder / "given"
    given.mkdir()
    shutil.copy(demonstration_path("pinch"), given / "000.npz")
    config = Config(
        name="pinch",
        hand=hand,
        engine="native",
        out=str(folder / "out"),
        data=SetSettings(GIVEN, folder=str(given)),
        task=Task(grip_force=8.0),
        ppo=Ppo(policy_layers=(16,), value_layers=(16,)),
    )
    body = named_body(hand)
    size = sum(feature.size for feature in observed_features(config.task, body.names, body.reach))
    made = network_factory(config.ppo)(size, body.num_targets).policy_network.init(jax.random.key(0))
    mean = made["params"]["Dense_0"]
    parameters = {"params": {**made["params"], "Dense_0": {**mean, "kernel": _LOUD * mean["kernel"]}}}
    Path(config.out).mkdir()
    write_settings(config, Path(config.out) / FILE)
    save_checkpoint(
        Checkpoint(parameters, {}, 0, np.nan, config.name, size, policy_settings(config)), Path(config.out) / "best.npz"
    )
    return config
