"""The public API is documented: every name that the packages export or the reference shows, and every public method."""

import importlib
import inspect
import re
from collections.abc import Iterator
from functools import cached_property
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).resolve().parent.parent
PACKAGES = ("mjx_hand", "envs", "train")


def exported() -> dict[str, Any]:
    """What the packages export, by full name."""
    modules = {name: importlib.import_module(name) for name in PACKAGES}
    return {
        f"{package}.{name}": getattr(module, name)
        for package, module in modules.items()
        for name in getattr(module, "__all__", ())
        if not name.startswith("__")
    }


def described() -> dict[str, Any]:
    """What the reference's pages show, by full name."""
    names = [
        name
        for page in sorted((ROOT / "docs/api").glob("*.md"))
        for name in re.findall(r"^::: (\S+)$", page.read_text(), flags=re.MULTILINE)
    ]
    found = {}
    for name in names:
        module, _, member = name.rpartition(".")
        found[name] = getattr(importlib.import_module(module), member)
    return found


def methods(name: str, cls: type) -> Iterator[tuple[str, Any]]:
    """Methods and properties that a class defines itself and that are not private."""
    for member, value in vars(cls).items():
        if isinstance(value, classmethod | staticmethod):
            value = value.__func__
        if isinstance(value, cached_property):
            value = value.func
        if not member.startswith("_") and (inspect.isfunction(value) or isinstance(value, property)):
            yield f"{name}.{member}", value


PUBLIC = described() | exported()


def test_something_is_walked():
    assert len(PUBLIC) > 60
    assert any(inspect.isclass(value) and list(methods("", value)) for value in PUBLIC.values())


@pytest.mark.parametrize("name", sorted(PUBLIC))
def test_a_public_name_and_its_methods_have_docstrings(name: str):
    value = PUBLIC[name]
    # A dataclass without a docstring gets its signature for one.
    bare = inspect.isclass(value) and (value.__doc__ or "").startswith(f"{value.__name__}(")
    assert value.__doc__
    assert not bare
    if inspect.isclass(value):
        lacking = [member for member, defined in methods(name, value) if not defined.__doc__]
        assert not lacking


@pytest.mark.parametrize("name", sorted(name for name, value in PUBLIC.items() if inspect.isfunction(value)))
def test_a_public_function_says_what_each_parameter_is(name: str):
    """Functions of two parameters and more: in a section of arguments, or by name or type in the text."""
    parameters = [p for p in inspect.signature(PUBLIC[name]).parameters.values() if p.name != "self"]
    text = inspect.getdoc(PUBLIC[name]) or ""
    if len(parameters) > 1 and "Args:" in text:
        section = text.split("Args:")[1].split("Returns:")[0].split("Raises:")[0]
        listed = {n for line in re.findall(r"^ +([\w, ]+):", section, flags=re.MULTILINE) for n in line.split(", ")}
        missing = [p.name for p in parameters if p.name not in listed]
        assert not missing
