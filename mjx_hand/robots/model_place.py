"""Where a robot hand's URDF or MJCF is, as its description says: one place, or several of which the first is taken."""

import os
import re
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from mjx_hand.errors import InputError
from mjx_hand.files.safe_yaml import shown
from mjx_hand.robots.robot_file import check_mjcf

_KINDS = ("urdf", "mjcf")
_VARIABLE = re.compile(r"\$([A-Za-z_]\w*)/(.+)")
_VALID = "give a path from this file on, PACKAGE:PATH, $VARIABLE/PATH, or a list of such places"


@dataclass(frozen=True)
class ModelPlace:
    """Where the file is.

    Attributes:
        path: the file, whether it is there or not; None where nobody can say.
        fault: then, why.
        unset: environment variables that would have named a place before that, and are not set.
    """

    path: Path | None
    fault: str = ""
    unset: tuple[str, ...] = ()

    def found(self, robot: str) -> Path:
        """The file.

        Raises:
            InputError: a package that is not installed, or a variable that is not set or names a folder without it.
        """
        if self.path is None:
            raise InputError(f"{robot}: {self.fault}{self.others()}")
        return self.path

    def others(self) -> str:
        """Where else the file is looked for, to be said where what is found does not do; "" if nowhere."""
        return "".join(f"; or set {name} to a folder that has it (docs/robots.md)" for name in self.unset)


def model_place(path: Path, content: Mapping[str, Any]) -> ModelPlace | None:
    """Where a description at `path` says its file is, None where it does not.

    A place is a path from the description's folder on, `PACKAGE:PATH` in an installed Python package, or
    `$VARIABLE/PATH`, which counts only where the environment has that variable. Of a list the first that counts is
    taken, and what is wrong with it is said when it is wanted; nothing is searched for beyond that.

    Raises:
        InputError: not such places.
    """
    given = [name for name in _KINDS if content.get(name) is not None]
    if not given:
        return None
    if len(given) > 1:
        raise InputError(f"{path}: has urdf and mjcf; give one of them")
    kind, value = given[0], content[given[0]]
    places = value if isinstance(value, list) else [value]
    if not places or not all(isinstance(place, str) and place for place in places):
        raise InputError(f"{path}: {kind} is {shown(value)}; {_VALID}")
    variables = [_VARIABLE.fullmatch(place) for place in places]
    if any(found is None and place.startswith("$") for found, place in zip(variables, places, strict=True)):
        raise InputError(f"{path}: {kind} is {shown(value)}; {_VALID}")
    if None in variables[:-1]:
        raise InputError(f"{path}: {kind} is {shown(value)}; only its last place may be without a $VARIABLE")
    unset: list[str] = []
    for found in variables:
        if found is None:
            return _named(path, kind, places[-1], tuple(unset))
        name, inside = found.groups()
        if folder := os.environ.get(name, ""):
            file = Path(folder).expanduser() / inside
            if file.is_file():
                return _checked(kind, ModelPlace(file))
            return ModelPlace(None, f"{name} is {shown(folder)}, which has no {inside}; give the folder that has it")
        unset.append(name)
    return ModelPlace(None, f"its file is in a folder that {unset[0]} would name, which is not set", tuple(unset))


def _named(path: Path, kind: str, place: str, unset: tuple[str, ...]) -> ModelPlace:
    package, found, inside = place.partition(":")
    if not found or Path(place).is_absolute():  # as with the letter of a drive
        return _checked(kind, ModelPlace(path.parent / place, "", unset))
    spec = find_spec(package) if package.isidentifier() else None
    if spec is None or spec.origin is None:
        fault = (
            f"its file comes with the Python package {package}, which is not installed: pip install "
            f"{package.replace('_', '-')}, or give a URDF of your own"
        )
        return ModelPlace(None, fault, unset)
    return _checked(kind, ModelPlace(Path(spec.origin).parent / inside, "", unset))


def _checked(kind: str, place: ModelPlace) -> ModelPlace:
    if kind == "mjcf" and place.path is not None and place.path.is_file():
        check_mjcf(place.path)
    return place
