"""What every module of a package offers under one name, so that a module more needs no edit elsewhere."""

import importlib
import pkgutil
from typing import Any


def plugins(package: str, name: str) -> list[Any]:
    """The value called `name` of every module in `package` that has one, in the order of the modules' names."""
    path = importlib.import_module(package).__path__
    modules = [importlib.import_module(f"{package}.{module.name}") for module in pkgutil.iter_modules(path)]
    return [getattr(module, name) for module in modules if hasattr(module, name)]
