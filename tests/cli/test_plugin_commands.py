"""Subcommands of other packages, and a user's own modules that have the names of this project's."""

import os
import subprocess
import sys
from importlib.metadata import EntryPoint
from pathlib import Path

import pytest

import mjx_hand.cli.plugin_commands as plugins
from mjx_hand.cli.main import COMMANDS, main
from mjx_hand.cli.packages import ROOT

OURS = {"ablations", "bench", "demo", "demonstrations", "evaluate", "play", "results", "train"}
# The console script, as an installer writes it: the folder on the path is then the script's, not the current one.
SCRIPT = "import sys; from mjx_hand.cli.main import main; sys.exit(main())"


def run(folder: Path, *command: str) -> subprocess.CompletedProcess[str]:
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    return subprocess.run(
        [sys.executable, *command], cwd=folder, env=environment, capture_output=True, text=True, check=False
    )


@pytest.fixture
def script(tmp_path_factory) -> str:
    path = tmp_path_factory.mktemp("bin") / "mjx-hand"
    path.write_text(SCRIPT)
    return str(path)


@pytest.fixture
def users_folder(tmp_path) -> Path:
    """A folder in which somebody else's project stands."""
    (tmp_path / "train.py").write_text("print('somebody else trains')")
    for package in ("envs", "configs"):
        (tmp_path / package).mkdir()
        (tmp_path / package / "__init__.py").write_text("")
    return tmp_path


def test_a_checkout_has_its_subcommands_installed_or_not():
    found = plugins.plugin_commands()
    assert set(found) >= OURS
    assert not set(found) & set(COMMANDS)


def test_every_subcommand_is_a_function_and_has_a_line_of_its_own():
    commands = plugins.plugin_commands()
    lines = {plugins.summary(commands[name]) for name in OURS}
    assert len(lines) == len(OURS)
    for name in OURS:
        assert callable(commands[name].load())
    assert plugins.summary(commands["train"]) == "Train a residual tracking policy with Brax PPO."


def test_what_an_installation_lacks_is_not_offered(monkeypatch, tmp_path):
    """As in the wheel, which leaves benchmarks out: the entry point is there, its module is not."""
    points = [EntryPoint(name, f"train.{name}:main", plugins.GROUP) for name in ("ppo", "benchmark")]
    (tmp_path / "train").mkdir()
    (tmp_path / "train" / "ppo.py").write_text("")
    monkeypatch.setattr(plugins, "ROOT", tmp_path)
    monkeypatch.setattr(plugins, "entry_points", lambda group: points)
    assert list(plugins.plugin_commands()) == ["ppo"]


def test_another_packages_subcommand_gets_its_arguments_and_gives_its_status(monkeypatch, capsys):
    seen = []
    point = EntryPoint("count", "tests.cli.counting:count", plugins.GROUP)
    monkeypatch.setattr(EntryPoint, "load", lambda self: lambda: seen.append(sys.argv) or 3)
    monkeypatch.setattr(plugins, "entry_points", lambda group: [point])
    before = sys.argv
    assert main(["count", "a=1", "--fast"]) == 3
    assert seen == [["mjx-hand count", "a=1", "--fast"]]
    assert sys.argv is before
    with pytest.raises(SystemExit) as ended:
        main(["--help"])
    assert ended.value.code == 0
    said = capsys.readouterr().out
    assert "count" in said
    assert all(name in said for name in (*COMMANDS, *OURS))


def test_the_command_is_the_projects_own_among_a_users_modules(users_folder, script):
    before = sorted(users_folder.rglob("*"))
    done = run(users_folder, script, "train", "config=pinch_demo", "seed=3", "--cfg", "job")
    assert done.returncode == 0, done.stderr
    assert "name: pinch_demo\n" in done.stdout
    assert "seed: 3\n" in done.stdout
    assert sorted(users_folder.rglob("*")) == before


def test_a_folder_without_init_hides_nothing_and_a_wrong_option_is_a_line(tmp_path):
    (tmp_path / "envs").mkdir()
    (tmp_path / "envs" / "mine.py").write_text("")
    done = run(tmp_path, "-m", "mjx_hand", "train", "ppo.num_env=3")
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.startswith("train: 'ppo.num_env' is not an option; did you mean ppo.num_envs?")
    assert done.stderr.count("\n") == 1


def test_a_module_in_the_place_of_ours_is_named_in_one_line(users_folder):
    done = run(users_folder, "-m", "mjx_hand", "train", "config=pinch_demo", "--cfg", "job")
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.startswith(f"mjx-hand: {users_folder / 'train.py'} hides mjx-hand's own 'train'; run the ")
    assert done.stderr.count("\n") == 1
    (users_folder / "train.py").unlink()
    done = run(users_folder, "-m", "train.ppo", "config=pinch_demo", "--cfg", "job")
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.startswith(f"train: {users_folder / 'envs' / '__init__.py'} hides mjx-hand's own 'envs'")
    assert done.stderr.count("\n") == 1
