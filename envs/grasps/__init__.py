"""The grasp types, one file each."""

import importlib
import pkgutil

from envs.grasps.grasp_type import Box, Contact, GraspType, Pads, Wrap
from mjx_hand.errors import InputError

__all__ = ["FIVE", "Box", "Contact", "GraspType", "Pads", "Wrap", "grasp_names", "grasp_type"]

# The types of arXiv 2512.07359, in its order: what `config=all` and `make results` stand for.
FIVE = ("power", "pinch", "lateral", "cylindrical", "spherical")


def grasp_names() -> list[str]:
    """Names of all grasp types: the files of this folder."""
    return sorted(m.name for m in pkgutil.iter_modules(__path__) if m.name != "grasp_type")


def grasp_type(name: str) -> GraspType:
    """The grasp type called `name`.

    Raises:
        InputError: there is none of that name.
    """
    if name not in grasp_names():
        raise InputError(f"grasp type {name!r} is not known; valid: {', '.join(grasp_names())}")
    return importlib.import_module(f"envs.grasps.{name}").GRASP
