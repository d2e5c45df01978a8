"""Whether this project's other packages are its own: a folder of a user's may hold a `train.py` or an `envs/` too."""

import importlib.util
from pathlib import Path

from mjx_hand.errors import InputError

ROOT = Path(__file__).resolve().parents[2]  # of the checkout, or site-packages
PACKAGES = ("train", "envs", "configs")


def check_packages() -> None:
    """Look where `train`, `envs` and `configs` would be imported from.

    Raises:
        InputError: one of them is not the project's.
    """
    for name in PACKAGES:
        spec = importlib.util.find_spec(name)
        if spec is None or spec.origin is None:  # no such package, or a folder without __init__.py
            raise InputError(f"{ROOT / name}: is missing; install mjx-hand again")
        if Path(spec.origin).resolve().parent != ROOT / name:
            raise InputError(
                f"{spec.origin} hides mjx-hand's own {name!r}; run the command mjx-hand, which unlike python -m does "
                "not look into the current folder, or rename that, or take its folder off PYTHONPATH"
            )
