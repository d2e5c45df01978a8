"""`DatasetFormat`: what one importer offers, and the list of all of them."""

import dataclasses
import importlib
import pkgutil
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np

from mjx_hand.motion import Motion

Arrays = Mapping[str, np.ndarray]


@dataclasses.dataclass(frozen=True)
class DatasetFormat:
    """A recording format. A module of this package that names one `FORMAT` adds it; nothing else needs an edit.

    Attributes:
        name: one line for people: what the format is called and what marks it.
        recognises: whether a file is of this format, from its path and, of an `.npz`, its arrays (else empty).
        read: the motion in it; raises InputError where the file is of the format but not sound.
    """

    name: str
    recognises: Callable[[Path, Arrays], bool]
    read: Callable[[Path, Arrays], Motion]


def dataset_formats() -> list[DatasetFormat]:
    """The `FORMAT` of every module in `mjx_hand.capture.datasets`, in the order of the modules' names."""
    package = importlib.import_module("mjx_hand.capture.datasets")
    modules = [importlib.import_module(f"{package.__name__}.{m.name}") for m in pkgutil.iter_modules(package.__path__)]
    return [module.FORMAT for module in modules if hasattr(module, "FORMAT")]
