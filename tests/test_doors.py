"""What `mjx_hand`, `envs` and `train` offer to users: every public name is there, documented, and below its package."""

import importlib
import inspect
import subprocess
import sys
from pathlib import Path

import pytest

from mjx_hand.lazy_exports import exported

ROOT = Path(__file__).resolve().parent.parent
DOORS = ("mjx_hand", "envs", "train")


@pytest.mark.parametrize("door", DOORS)
def test_every_name_opens_on_what_its_stub_says(door: str):
    package = importlib.import_module(door)
    homes = exported(ROOT / door / "__init__.pyi")
    assert package.__all__ == sorted(homes)
    assert set(package.__all__) <= set(dir(package))
    for name, home in homes.items():
        assert home.startswith(f"{door}."), f"{door}.{name} comes from {home}: one name has one door"
        value = getattr(package, name)
        assert value is getattr(importlib.import_module(home), name)
        assert inspect.getdoc(value), f"{door}.{name} has no docstring"
        # A module of the same name would take the name's place as soon as somebody imports it.
        assert not (ROOT / door / f"{name}.py").exists()
        assert not (ROOT / door / name).exists()
    with pytest.raises(AttributeError, match=f"module '{door}' has no attribute 'nothing_like_it'"):
        package.nothing_like_it  # noqa: B018


@pytest.mark.parametrize("door", DOORS)
def test_what_is_public_is_what_the_names_need_and_no_module(door: str):
    names = importlib.import_module(door).__all__
    assert not [name for name in names if name.startswith("_")]
    assert not [name for name in names if inspect.ismodule(getattr(importlib.import_module(door), name))]


def test_opening_mjx_hand_loads_neither_jax_nor_anything_above():
    code = "import sys, mjx_hand; print(*sorted({name.split('.')[0] for name in sys.modules}))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT)
    assert not {"jax", "numpy", "mujoco", "envs", "train"} & set(done.stdout.split())
