"""The wheel holds all that a user needs, and works away from this folder."""

import subprocess
import sys
import sysconfig
import venv
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent


@pytest.fixture(scope="module")
def wheel(tmp_path_factory) -> Path:
    out = tmp_path_factory.mktemp("dist")
    command = [sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", str(out), str(ROOT)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    (made,) = out.glob("*.whl")
    return made


@pytest.fixture(scope="module")
def installed(wheel, tmp_path_factory) -> Path:
    """The `bin` folder of an environment that has the wheel and, from this one, everything that it depends on."""
    home = tmp_path_factory.mktemp("user") / "venv"
    venv.create(home, with_pip=False)
    python = home / "bin" / "python"
    # Dependencies come by path, so that nothing is downloaded. Only this folder's own packages must not: a .pth file
    # in a folder that is itself reached through a .pth file is not read, so the editable install is not followed.
    packages = next((home / "lib").glob("python3*/site-packages"))
    (packages / "dependencies.pth").write_text(sysconfig.get_path("purelib") + "\n")
    install = [
        "-m",
        "pip",
        "--python",
        str(python),
        "install",
        "--quiet",
        "--no-deps",
        "--no-index",
        "--force-reinstall",
    ]
    done = subprocess.run([sys.executable, *install, str(wheel)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return home / "bin"


def run(command: list[str | Path], folder: Path) -> str:
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def test_wheel_holds_code_configurations_and_the_open_hand(wheel):
    names = set(zipfile.ZipFile(wheel).namelist())
    for top in ("mjx_hand", "envs", "train", "configs"):
        files = [p for p in (ROOT / top).rglob("*") if p.is_file() and not {"__pycache__", "benchmark"} & {*p.parts}]
        sources = {str(p.relative_to(ROOT)) for p in files}
        assert sources <= names, f"missing: {sorted(sources - names)}"
    assert "mjx_hand/hand/open_hand.npz" in names
    assert "mjx_hand/py.typed" in names
    assert any(name.endswith("/licenses/LICENSE") for name in names)
    assert not any(name.startswith(("tests/", "tools/", "train/benchmark/")) for name in names)


def test_installed_package_is_the_wheels_own(installed, tmp_path):
    where = run([installed / "python", "-c", "import mjx_hand; print(mjx_hand.__file__)"], tmp_path)
    assert Path(where.strip()).is_relative_to(installed.parent)


def test_command_builds_a_hand_from_another_folder(installed, tmp_path):
    run([installed / "mjx-hand", "build", "--out", "hand"], tmp_path)
    assert (tmp_path / "hand" / "right_hand.xml").is_file()
    assert (tmp_path / "hand" / "right_hand.urdf").is_file()


@pytest.mark.parametrize("command", [("python", "-m", "train.ppo"), ("mjx-hand", "train")])
def test_training_entry_point_finds_its_configurations(installed, tmp_path, command):
    program, *arguments = command
    shown = run([installed / program, *arguments, "--cfg", "job", "config=pinch_demo"], tmp_path)
    assert "name: pinch_demo\n" in shown
    assert list(tmp_path.iterdir()) == []
