"""A robot's links and joints from its file, URDF or MJCF; which of them it is, its first element says."""

import xml.etree.ElementTree as ElementTree
from pathlib import Path

import yourdfpy

from mjx_hand.errors import InputError
from mjx_hand.files.input_file import check_input_file
from mjx_hand.robots.mjcf_file import read_mjcf
from mjx_hand.robots.urdf_file import read_urdf

_MJCF = "mujoco"


def read_robot(path: Path) -> yourdfpy.Robot:
    """The robot in a URDF or an MJCF; meshes of a URDF are not read.

    Raises:
        InputError: see `read_urdf` and `read_mjcf`.
    """
    return read_mjcf(path) if path.is_file() and is_mjcf(path) else read_urdf(path)


def is_mjcf(path: Path) -> bool:
    """Whether a file is an MJCF."""
    try:
        with path.open("rb") as file:  # left to itself, iterparse keeps a path's file open after the first element
            return next(element.tag for _, element in ElementTree.iterparse(file, ["start"])) == _MJCF
    except (ElementTree.ParseError, OSError, StopIteration, UnicodeDecodeError):
        return False


def check_mjcf(path: Path) -> None:
    """Raise InputError unless a file is an MJCF."""
    check_input_file(path, "give the path of an MJCF")
    if not is_mjcf(path):
        raise InputError(f"{path}: not an MJCF, whose first element is <mujoco>; give a URDF as --urdf or urdf:")
