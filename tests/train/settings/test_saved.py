"""Settings of runs from before there were some options."""

import pytest

from mjx_hand.errors import InputError
from train.settings import saved
from train.settings.config import compose
from train.settings.saved import (
    contradiction,
    differing,
    policy_settings,
    read_settings,
    settings_of,
    with_settings_of,
    write_settings,
)

SINCE = ("task.wrap_torque",)


@pytest.fixture
def older(tmp_path):
    """A run's settings, without the options that came after it."""
    write_settings(compose(["config=power"]), tmp_path / "config.yaml")
    told = read_settings(tmp_path / "config.yaml")
    assert set(SINCE) <= set(told)
    return {option: value for option, value in told.items() if option not in SINCE}


def test_an_older_run_goes_on_as_it_was_made(older):
    now = compose(["config=power"])
    assert now.task.wrap_torque == 0.5
    then = with_settings_of(now, older, {"config"}, "the run")
    assert then.task.wrap_torque == 0.0
    assert differing(older, settings_of(then)) == []
    assert differing(older, settings_of(now)) == sorted(SINCE)


def test_what_it_was_not_made_with_is_refused(older):
    given = compose(["config=power", "task.wrap_torque=0.5"])
    with pytest.raises(InputError, match=r"the run holds a training with task.wrap_torque=0.0, now 0.5"):
        with_settings_of(given, older, {"config", "task.wrap_torque"}, "the run")


def test_a_run_may_be_measured_on_new_people(older):
    """The sealed part is no part of what a policy was trained on."""
    now = compose(["config=power", "task.wrap_torque=0", "data.sealed_seed=2", "data.sealed_people=3"])
    then = with_settings_of(now, older, {"config", "data.sealed_seed", "data.sealed_people"}, "the run")
    assert (then.data.sealed_seed, then.data.sealed_people) == (2, 3)
    assert differing(older, settings_of(then)) == []


def test_a_robots_training_goes_on_with_the_demonstrations_it_began_with(tmp_path, monkeypatch):
    """How a person's demonstrations become a robot's changes from version to version; a policy is scored on any."""
    config = compose(["config=pinch", "hand=allegro"])
    write_settings(config, tmp_path / "config.yaml")
    told = read_settings(tmp_path / "config.yaml")
    assert contradiction("it", told, settings_of(config)) == ""
    policy = policy_settings(config)
    monkeypatch.setattr(saved, "METHOD", saved.METHOD + 1)
    assert "as another version of mjx-hand made them" in contradiction("it", told, settings_of(config))
    assert contradiction("it", policy, policy_settings(config)) == ""
    then = with_settings_of(config, told, {"config", "hand"}, "the run")
    assert policy_settings(then) == policy
    human = settings_of(compose(["config=pinch"]))
    assert "robot" not in " ".join(human)
    assert contradiction("it", told, human) == "it holds a training with hand=allegro, now human"
