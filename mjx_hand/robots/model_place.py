"""Where a robot hand's URDF or MJCF is, as its description says: one place, or several of which the first is taken."""

import os
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from mjx_hand.errors import InputError
from mjx_hand.files.safe_yaml import shown
from mjx_hand.robots.robot_file import check_mjcf

_KINDS = ("urdf", "mjcf")


@dataclass(frozen=True)
class ModelPlace:
    """Where the file is.

    Attributes:
        path: the file, whether it is there or not; None where it is in a package that is not installed.
        package: the Python package that it comes with, "" if with none.
        unset: environment variables that would have named a place before that, and are not set.
    """

    path: Path | None
    package: str = ""
    unset: tuple[str, ...] = ()

    def found(self, robot: str) -> Path:
        """The file.

        Raises:
            InputError: it comes with a package that is not installed.
        """
        if self.path is None:
            raise InputError(
                f"{robot}: its file comes with the Python package {self.package}, which is not installed: pip install "
                f"{self.package.replace('_', '-')}, or give a URDF of your own{self.others()}"
            )
        return self.path

    def others(self) -> str:
        """Where else the file is looked for, to be said where what is found does not do; "" if nowhere."""
        return "".join(f"; or set {name} to a folder that has it (docs/robots.md)" for name in self.unset)


def model_place(path: Path, content: Mapping[str, Any]) -> ModelPlace | None:
    """Where a description at `path` says its file is, None where it does not.

    A place is a path from the description's folder on, `PACKAGE:PATH` in an installed Python package, or
    `$VARIABLE/PATH`, which counts only where the environment has that variable. Of a list the first that counts is
    taken, and what is wrong with it is said; nothing is searched for beyond that.

    Raises:
        InputError: not such places, or a variable that names a folder without the file.
    """
    given = [name for name in _KINDS if content.get(name) is not None]
    if not given:
        return None
    if len(given) > 1:
        raise InputError(f"{path}: has urdf and mjcf; give one of them")
    kind, value = given[0], content[given[0]]
    places = value if isinstance(value, list) else [value]
    if not places or not all(isinstance(place, str) and place for place in places):
        raise InputError(f"{path}: {kind} is {shown(value)}; give a path from this file on, or PACKAGE:PATH")
    unset: list[str] = []
    for place in places:
        variable, slash, inside = place.partition("/")
        if not variable.startswith("$"):
            return _named(path, kind, place, tuple(unset))
        folder = os.environ.get(variable[1:], "")
        if folder:
            file = Path(folder).expanduser() / inside
            if not slash or not file.is_file():
                raise InputError(f"{path}: {variable[1:]} is {shown(folder)}, which has no {inside}; give its folder")
            return _checked(kind, ModelPlace(file))
        unset.append(variable[1:])
    raise InputError(f"{path}: {kind} is {shown(value)}; set {unset[0]} to the folder that has it")


def _named(path: Path, kind: str, place: str, unset: tuple[str, ...]) -> ModelPlace:
    package, found, inside = place.partition(":")
    if not found or Path(place).is_absolute():  # as with the letter of a drive
        return _checked(kind, ModelPlace(path.parent / place, "", unset))
    spec = find_spec(package) if package.isidentifier() else None
    if spec is None or spec.origin is None:
        return ModelPlace(None, package, unset)
    return _checked(kind, ModelPlace(Path(spec.origin).parent / inside, package, unset))


def _checked(kind: str, place: ModelPlace) -> ModelPlace:
    if kind == "mjcf" and place.path is not None and place.path.is_file():
        check_mjcf(place.path)
    return place
