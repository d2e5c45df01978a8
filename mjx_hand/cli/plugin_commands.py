"""Subcommands of `mjx-hand` that stand in other packages: entry points of the group `mjx_hand.commands`.

Each is a function without arguments that reads `sys.argv`, as a console script's is, and returns the exit status. Any
package that is installed may have some.
"""

import ast
import sys
import tomllib
from collections.abc import Sequence
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path

from mjx_hand.cli.packages import PACKAGES, ROOT, check_packages

GROUP = "mjx_hand.commands"


def plugin_commands() -> dict[str, EntryPoint]:
    """The entry points by the subcommands' names: of a checkout those of its pyproject.toml, installed or not."""
    found = {point.name: point for point in entry_points(group=GROUP)}
    checkout = ROOT / "pyproject.toml"
    if checkout.is_file():
        project = tomllib.loads(checkout.read_text()).get("project", {})
        declared = project.get("entry-points", {}).get(GROUP, {})
        found |= {name: EntryPoint(name, value, GROUP) for name, value in declared.items()}
    return {name: point for name, point in sorted(found.items()) if not _is_ours(point) or _source(point).is_file()}


def run_plugin(point: EntryPoint, arguments: Sequence[str]) -> int:
    """Run a subcommand with its arguments; the exit status.

    Raises:
        InputError: by the subcommand, or something else would be imported in the place of this project's packages.
        SystemExit: by the subcommand.
    """
    if _is_ours(point):
        check_packages()
    before = sys.argv
    sys.argv = [f"mjx-hand {point.name}", *arguments]
    try:
        return point.load()() or 0
    finally:
        sys.argv = before


def summary(point: EntryPoint) -> str:
    """The first line of the docstring of a subcommand's module, which is read and not imported: that takes seconds."""
    if not _is_ours(point):
        return f"From {point.module}."
    text = ast.get_docstring(ast.parse(_source(point).read_text())) or ""
    return text.splitlines()[0].split(": `")[0].rstrip(".:") + "."


def _is_ours(point: EntryPoint) -> bool:
    return point.module.split(".")[0] in PACKAGES


def _source(point: EntryPoint) -> Path:
    """The file of a module of this project; an installation lacks some."""
    return ROOT.joinpath(*point.module.split(".")).with_suffix(".py")
