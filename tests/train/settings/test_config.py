import dataclasses
import os
import subprocess
import sys
from pathlib import Path

import pytest

from envs.task import Task
from mjx_hand.errors import InputError
from train.settings.config import Config, compose, compose_seeds

ROOT = Path(__file__).resolve().parent.parent.parent.parent
EXPERIMENTS = sorted(path.stem for path in (ROOT / "configs" / "config").glob("*.yaml") if path.stem != "given")


def refusal(*overrides: str) -> str:
    with pytest.raises(InputError) as caught:
        compose(overrides)
    text = str(caught.value)
    assert "\n" not in text
    return text


@pytest.mark.parametrize("name", EXPERIMENTS)
def test_every_experiment_composes(name):
    recording = ["data.recording.path=recording"] if name in ("mustard", "recording") else []
    config = compose([f"config={name}", *recording])
    assert config.name == name
    assert config.out == f"outputs/{name}/seed0"


def test_experiments_change_what_their_file_says_and_the_command_line_wins():
    assert compose(["config=pinch_demo"]).data.people == 8
    config = compose(["config=pinch_demo", "data.people=2", "seed=5"])
    assert (config.data.people, config.data.trials, config.seed) == (2, 3, 5)
    assert config.out == "outputs/pinch_demo/seed5"


def test_without_overrides_the_values_are_those_of_the_dataclasses():
    """Of a pinch, the default experiment, which wraps nothing."""
    assert compose() == Config(out="outputs/pinch/seed0", task=Task(wrap_torque=0.0))


@pytest.mark.parametrize(
    "override",
    [
        "out=outputs/${nmae}/x",
        "out=${out}",
        "out=${oc.env:NO_SUCH_VARIABLE}",
        "out=${oc.env:}",
        "out=${",
        "out=",
        "out='  '",
        "seed=-1",
        f"seed={2**31}",
        "seed=99999999999999999999",
        f"seed={'9' * 5000}",
        f"seeds={'[' * 900}",
        f"ppo.policy_layers={'[' * 900}{']' * 900}",
        f"task={{{'a: {' * 300}",
    ],
)
def test_values_that_cannot_be_used_are_refused_in_a_line(override):
    assert len(refusal(override)) < 1000


def test_options_by_their_old_names_are_taken():
    assert (
        compose(["task.finger=0.9", "task.lost_at=0.2"]).task
        == compose(["task.residual_scale_fingers=0.9", "task.termination_distance=0.2"]).task
    )


def test_what_is_composed_is_frozen_and_hashable():
    config = compose(["task.lookahead=[2,9]", "ppo.policy_layers=[32,16]", "ppo.value_layers=[8]"])
    assert (config.task.lookahead, config.ppo.policy_layers, config.ppo.value_layers) == ((2, 9), (32, 16), (8,))
    hash(config)
    for part, field in (
        (config, "seed"),
        (config.ppo, "num_envs"),
        (config.task, "lookahead"),
        (config.checks, "every"),
    ):
        with pytest.raises(dataclasses.FrozenInstanceError):
            setattr(part, field, 1)


@pytest.mark.parametrize(
    ("override", "nearest"),
    [
        ("ppo.num_env=8", "did you mean ppo.num_envs?"),
        ("task.grip_forse=1", "did you mean task.grip_force?"),
        (
            "task.rewards.positon=2",
            "did you mean task.rewards.position?; valid in task.rewards: position, rotation, action",
        ),
        ("enginee=native", "did you mean engine?"),
        ("data.capture.markr_noise=0", "did you mean data.capture.marker_noise?"),
    ],
)
def test_for_an_unknown_key_the_closest_valid_one_is_suggested(override, nearest):
    assert nearest in refusal(override)


def test_an_unknown_key_is_told_the_valid_ones():
    text = refusal("bogus=1")
    assert "'bogus'" in text
    assert "did you mean" not in text
    assert text.endswith("valid options: " + ", ".join(field.name for field in dataclasses.fields(Config)))
    assert "valid in checks: every, stop_at" in refusal("checks.bogus=1")
    assert "'new'" in refusal("+new=1")
    assert "'seed.deeper'" in refusal("seed.deeper=1")


@pytest.mark.parametrize(
    ("override", "said"),
    [
        ("ppo.num_envs=many", ("'many'", "ppo.num_envs")),
        ("seed=1.5", ("'1.5'", "seed")),
        ("task.lookahead=3", ("task.lookahead",)),
        ("task.lookahead=[0]", ("task.lookahead is (0,)", "at least 1")),
        ("task.smoothing=1", ("task.smoothing is 1", "give less")),
        ("ppo=3", ("ppo",)),
        ("ppo.num_envs", ("ppo.num_envs", "EQUAL")),
        ("ppo.num_envs=10", ("ppo.num_envs is 10", "multiple of ppo.num_minibatches (8)", "for example 8")),
        ("ppo.num_timesteps=0", ("ppo.num_timesteps is 0", "above 0")),
        ("ppo.learning_rate=nan", ("ppo.learning_rate is nan",)),
        ("ppo.learning_rate=inf", ("ppo.learning_rate is inf",)),
        ("ppo.entropy_cost=-1", ("ppo.entropy_cost is -1",)),
        ("ppo.discounting=1.5", ("ppo.discounting is 1.5", "at most 1")),
        ("ppo.policy_layers=[8,0]", ("ppo.policy_layers is [8, 0]", "at least 1 unit")),
        ("checks.every=0", ("checks.every is 0",)),
        ("checks.stop_at=nan", ("checks.stop_at is nan",)),
        ("engine=gpu", ("engine is 'gpu'", "auto, native, mjx, warp")),
        ("data.trials=0", ("data.trials is 0",)),
        ("data.grasp=nope", ("'nope'", "valid: ", "pinch")),
    ],
)
def test_values_that_cannot_be_used_are_refused_by_name(override, said):
    text = refusal(override)
    assert all(part in text for part in said), text


def test_every_seed_has_a_configuration_and_a_folder_of_its_own():
    configs = compose_seeds(["config=lateral", "seeds=[2,0]", "data.people=3"])
    assert [(c.seed, c.seeds, c.out) for c in configs] == [
        (2, (), "outputs/lateral/seed2"),
        (0, (), "outputs/lateral/seed0"),
    ]
    assert {c.data.people for c in configs} == {3}
    assert compose_seeds(["seed=5"]) == [compose(["seed=5"])]
    placed = compose_seeds(["seeds=[1,2]", "out=runs/${name}-${seed}"])
    assert [c.out for c in placed] == ["runs/pinch-1", "runs/pinch-2"]


@pytest.mark.parametrize(
    ("overrides", "said"),
    [
        (("seeds=[1,1]",), "seeds is [1, 1]; give each seed once"),
        (("seeds=[1,2]", "out=here"), "put ${seed} into it: out='here/seed${seed}'"),
        (("seeds=[1,2]", "checkpoint=best.npz"), "checkpoint=FILE is one seed's policy"),
        (("seeds=[1,a]",), "'a'"),
    ],
)
def test_seeds_that_cannot_be_used_are_refused(overrides, said):
    with pytest.raises(InputError) as caught:
        compose_seeds(overrides)
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)


def test_what_takes_one_seed_refuses_several():
    assert "seeds is [1, 2], but this takes one seed" in refusal("seeds=[1,2]")


def test_an_unknown_experiment_is_told_the_known_ones():
    text = refusal("config=pich")
    assert "config/pich" in text
    assert all(name in text for name in EXPERIMENTS)


def test_the_nearest_number_of_worlds_is_one_that_works():
    assert compose(["ppo.num_envs=8"]).ppo.num_envs == 8
    assert "for example 8" in refusal("ppo.num_envs=3")


def run(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    command = [sys.executable, "-m", "train.ppo", *arguments]
    return subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)


def test_the_command_refuses_in_one_line_and_writes_nothing(tmp_path):
    done = run(tmp_path, "bogus=1")
    assert done.returncode == 2
    (line,) = done.stderr.splitlines()
    assert line.startswith("train: 'bogus' is not an option; valid options: name, ")
    assert done.stdout == ""
    assert list(tmp_path.iterdir()) == []


def test_hydras_own_flags_show_the_configuration(tmp_path):
    done = run(tmp_path, "--cfg", "job", "config=pinch_demo", "seed=7")
    assert done.returncode == 0, done.stderr
    assert "name: pinch_demo\n" in done.stdout
    assert "seed: 7\n" in done.stdout
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("overrides", "folder"),
    [
        (["config=power"], "outputs/power/seed0"),
        (["config=power", "hand=human"], "outputs/power/seed0"),
        (["config=power", "hand=allegro", "seed=2"], "outputs/power-allegro/seed2"),
        (["hand=allegro", "out=here"], "here"),
    ],
)
def test_a_robot_hand_has_a_results_folder_of_its_own(overrides, folder):
    assert compose(overrides).out == folder


def test_what_was_measured_to_differ_by_hand_does():
    """A robot's hand that wraps a recorded bottle closes; in a person's the force that the weight asks for holds it."""
    recording = ["config=mustard", "data.recording.path=here"]
    assert compose(recording).task.wrap_torque == 0.0
    assert compose([*recording, "hand=allegro"]).task.wrap_torque == 0.5
    assert compose([*recording, "hand=allegro", "task.wrap_torque=0.3"]).task.wrap_torque == 0.3
    assert compose(["config=pinch_demo"]).task.grip_force == 8
    assert compose(["config=pinch_demo", "hand=allegro"]).task.grip_force is None
