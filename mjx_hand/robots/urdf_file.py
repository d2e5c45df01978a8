"""A URDF (https://wiki.ros.org/urdf/XML) read with yourdfpy, its joints checked before anything is made of them."""

import contextlib
import logging
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import yourdfpy
from yourdfpy.urdf import Joint

from mjx_hand.errors import InputError
from mjx_hand.files.input_file import refuse_pointer
from mjx_hand.files.safe_yaml import shown

MOVABLE = ("revolute", "continuous", "prismatic")
_LARGEST = 100.0  # m, rad, or a factor; nothing of a hand comes near


def read_urdf(path: Path) -> yourdfpy.Robot:
    """The robot in a URDF, without meshes.

    Raises:
        InputError: no such file, or not a URDF that can be read.
    """
    if not path.is_file():
        raise InputError(f"{path}: {'a folder' if path.is_dir() else 'no such file'}; give the path of a URDF")
    refuse_pointer(path)
    try:
        ElementTree.parse(path)  # yourdfpy takes what it can of a file that is cut short
        with _quiet("yourdfpy.urdf"):
            model = yourdfpy.URDF.load(str(path), build_scene_graph=False, load_meshes=False)
    except Exception as error:  # yourdfpy passes on whatever XML and number parsing raise
        reason = (str(error).splitlines() or [type(error).__name__])[0]
        raise InputError(f"{path}: not a URDF that can be read ({reason[:160]})") from None
    if not model.robot.links:
        raise InputError(f"{path}: not a URDF: it has no links")
    return model.robot


@contextlib.contextmanager
def _quiet(logger: str) -> Iterator[None]:
    # yourdfpy logs an error for every mesh that is not beside the file; kinematics need none.
    log = logging.getLogger(logger)
    before = log.disabled
    log.disabled = True
    try:
        yield
    finally:
        log.disabled = before


def check_joint(path: Path, joint: Joint) -> None:
    """Nothing, if the joint is one that a hand can have.

    Raises:
        InputError: an unknown type, no limits or limits out of order, or numbers that place it nowhere.
    """
    name = f"{path}: joint {shown(joint.name)}"
    if joint.type not in ("fixed", *MOVABLE):
        raise InputError(f"{name} is of type {shown(joint.type)}; valid: fixed, {', '.join(MOVABLE)}")
    if joint.origin is not None and not _sound(joint.origin, (4, 4)):
        raise InputError(f"{name} has an origin that is no place; give <origin xyz=... rpy=...> three numbers each")
    if joint.mimic is not None and not _sound([joint.mimic.multiplier or 0, joint.mimic.offset or 0], (2,)):
        raise InputError(f"{name} mimics by {joint.mimic.multiplier} and {joint.mimic.offset}; give numbers")
    if joint.type == "fixed":
        return
    if not _sound(joint.axis, (3,)) or not np.linalg.norm(joint.axis) > 1e-9:
        raise InputError(f"{name} has axis {shown(np.asarray(joint.axis).tolist())}; give a direction of three numbers")
    if joint.type == "continuous":
        return
    if joint.limit is None or (joint.limit.lower is None and joint.limit.upper is None):
        raise InputError(f"{name} has no limits; add <limit lower=... upper=...>")
    lower, upper = limits_of(joint)
    if not lower <= upper:
        raise InputError(f"{name} has limits from {lower} to {upper}; give the lower one first")


def limits_of(joint: Joint) -> tuple[float, float]:
    """A joint's limits (rad or m), infinite where it has none; one that is left out is 0 (the standard)."""
    if joint.type == "continuous" or joint.limit is None:
        return -np.inf, np.inf
    lower, upper = joint.limit.lower or 0.0, joint.limit.upper or 0.0
    return -np.inf if lower < -_LARGEST else lower, np.inf if upper > _LARGEST else upper


def _sound(values: object, shape: tuple[int, ...]) -> bool:
    found = np.asarray(values, float)
    return found.shape == shape and bool((np.abs(found) <= _LARGEST).all())
