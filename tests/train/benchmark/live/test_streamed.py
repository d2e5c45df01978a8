"""The benchmark of streamed demonstrations says what it lacks; what it streams through is tested where it is."""

from pathlib import Path

import pytest

from envs.demonstrations.dataset import make_set
from envs.demonstrations.load_set import load_part
from envs.demonstrations.set_settings import SetSettings
from envs.live.assistance import assistance
from mjx_hand.errors import InputError
from train.benchmark.live.streamed import Options, report, streamed


def test_sets_have_to_be_given():
    with pytest.raises(InputError, match="--sets FOLDER"):
        report(Options())
    with pytest.raises(InputError, match="no such folder"):
        report(Options(sets=(Path("nowhere"),)))


def test_the_projects_policy_holds_and_lets_go_what_an_unhelped_hand_does_not_hold(tmp_path):
    made = make_set(
        SetSettings("cylindrical", people=1, heldout_people=1, trials=1, heldout_trials=1, seed=3), tmp_path
    )
    (shown,) = load_part(made, "heldout")
    assert streamed(shown, assistance("off", "right"), 0) == (False, False)
    assert streamed(shown, assistance("policy", "right"), 0) == (True, True)
