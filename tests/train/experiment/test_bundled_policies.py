import dataclasses
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import train.experiment.bundled_policies
from envs.evaluation.evaluate import evaluate
from envs.evaluation.roll_out import make_roll_out, zero_residual
from envs.grasps import FIVE
from mjx_hand.bodies.human_body import HUMAN
from mjx_hand.errors import InputError
from mjx_hand.player.features import OBSERVATION_LIMIT
from tools import bundle_policy
from train.experiment.bundled_policies import bundled_env, bundled_policy, with_policy
from train.experiment.setup import chosen_checkpoint, load_env, settled
from train.learning.checkpoint import load_checkpoint
from train.learning.curve import Point
from train.learning.policy import deterministic_policy
from train.play import viewer
from train.settings.config import Config, compose
from train.settings.options import Play
from train.settings.saved import contradiction, policy_settings

Trained = tuple[Path, list[Point]]
# Experiments and hands of the policies that come along for robots.
ROBOTS = sorted(
    (name, hand)
    for name, dash, hand in (
        path.stem.partition("-") for path in train.experiment.bundled_policies.FOLDER.glob("*.npz")
    )
    if dash and not hand.endswith(".demonstration")
)


@pytest.fixture
def untrained(tiny: Config, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Config:
    """An experiment without a training of its own; nothing is included yet."""
    monkeypatch.setattr(train.experiment.bundled_policies, "FOLDER", tmp_path / "included")
    return dataclasses.replace(tiny, out=str(tmp_path / "nothing"), play=Play(port=0))


def test_what_is_included_is_played_where_nothing_was_trained(
    trained: Trained, tiny: Config, untrained: Config, capsys: pytest.CaptureFixture[str]
):
    with pytest.raises(InputError, match="this policy follows no held-out demonstration; train it further"):
        bundle_policy.main(tiny)
    demonstration = load_env(tiny, "heldout").demonstrations[0]
    bundle_policy.include(load_checkpoint(trained[0] / "best.npz"), demonstration, "tiny")
    capsys.readouterr()
    shown = viewer(untrained)
    shown.close()
    assert "taking the policy that comes with mjx-hand" in capsys.readouterr().out
    assert shown.scene.title.startswith("tiny 0: ")
    kept, best = load_checkpoint(bundled_policy("tiny") or ""), load_checkpoint(trained[0] / "best.npz")
    for layer in ("hidden_0", "mean_kernel"):
        if layer in best.policy["params"]:
            found, wanted = (c.policy["params"][layer]["kernel"] for c in (kept, best))
            np.testing.assert_array_equal(found, wanted)
    assert (kept.value, kept.steps) == ({}, best.steps)


def test_without_one_the_command_that_trains_is_named(untrained: Config):
    with pytest.raises(InputError, match=r"no such checkpoint; train one first: python -m train\.ppo"):
        viewer(untrained)


@pytest.mark.parametrize(("name", "hand"), [*((name, HUMAN) for name in (*FIVE, "all")), *ROBOTS])
def test_the_policies_that_come_along_are_of_todays_experiments(name: str, hand: str, tmp_path):
    """As `train.play config=NAME` has it where nothing is trained, without a word on the command line."""
    asked = [f"config={name}", f"hand={hand}", f"out={tmp_path}"]
    config, included = with_policy(settled(compose(asked), {"config", "hand", "out"}))
    assert included
    told = load_checkpoint(config.checkpoint).settings
    assert contradiction("the policy", told, policy_settings(config)) == ""


@pytest.mark.parametrize(
    "name", ["pinch", "all", *(pytest.param(name, marks=pytest.mark.slow) for name in FIVE if name != "pinch")]
)
def test_the_policies_that_come_along_do_what_the_zero_residual_does_not(name: str):
    """On the demonstration beside each, from frame 0, and still there five seconds later."""
    config = compose([f"config={name}", "engine=native"])
    config = settled(dataclasses.replace(config, checkpoint=str(bundled_policy(name))), ())
    env = bundled_env(config)
    checkpoint = chosen_checkpoint(config, env.observation_size)
    policy = deterministic_policy(config.ppo, env.observation_size, env.action_size)
    objects = [d.object for d in env.demonstrations]
    scores = evaluate(make_roll_out(env, policy, 5.0)(checkpoint.policy), objects).rows()
    assert scores["manip_trans_object"] == scores["hold"] == 1
    assert scores["tracking_error_cm"] < 0.5
    idle = evaluate(make_roll_out(env, zero_residual)(None), objects).rows()
    assert idle["tracking_error_cm"] > 2 * scores["tracking_error_cm"]


@pytest.mark.parametrize(("name", "hand"), ROBOTS)
def test_the_robots_policies_hold_what_the_person_held(name: str, hand: str):
    """From frame 0 and five seconds longer; the hand by its own URDF and meshes."""
    config = compose([f"config={name}", f"hand={hand}", "engine=native"])
    config = settled(dataclasses.replace(config, checkpoint=str(bundled_policy(name, hand))), ())
    try:
        env = bundled_env(config)
    except InputError as error:
        if "is not there" not in str(error) and "is not installed" not in str(error):
            raise
        pytest.skip(str(error))
    checkpoint = chosen_checkpoint(config, env.observation_size, env.action_size)
    policy = deterministic_policy(config.ppo, env.observation_size, env.action_size)
    scores = evaluate(make_roll_out(env, policy, 5.0)(checkpoint.policy), [d.object for d in env.demonstrations]).rows()
    assert scores["manip_trans_object"] == scores["hold"] == 1
    assert scores["tracking_error_cm"] < 1.0


@pytest.mark.parametrize("name", FIVE)
def test_nothing_that_a_policy_sees_is_clipped_from_beginning_to_end(name: str):
    config = compose([f"config={name}", "engine=native"])
    env = bundled_env(config)
    frames = jnp.arange(int(env.reference.length[0]))
    observed = np.asarray(jax.jit(jax.vmap(lambda frame: env.start(jnp.asarray(0), frame).obs))(frames))
    clipped = (np.abs(observed) >= OBSERVATION_LIMIT).all(axis=0)
    assert not clipped.any(), np.flatnonzero(clipped)
