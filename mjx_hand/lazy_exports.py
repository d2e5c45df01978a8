"""A package's public names, each imported from its module when it is first used.

`__init__.pyi` beside a package's `__init__.py` lists them as imports, which type checkers and editors read; so does
`lazy_exports`. Importing the package then takes no time, and whoever uses one name waits for that name alone.
"""

import ast
import importlib
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any


def lazy_exports(package: str, init: str) -> tuple[Callable[[str], Any], Callable[[], list[str]], list[str]]:
    """`__getattr__`, `__dir__` and `__all__` of a package.

    Args:
        package: its `__name__`.
        init: its `__file__`, beside which `__init__.pyi` stands.
    """
    homes = exported(Path(init).with_name("__init__.pyi"))
    names = sorted(homes)

    def get(name: str) -> Any:
        if name not in homes:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        value = getattr(importlib.import_module(homes[name]), name)
        setattr(sys.modules[package], name, value)  # found at once from now on
        return value

    return get, lambda: sorted({*vars(sys.modules[package]), *names}), names


def exported(stub: Path) -> dict[str, str]:
    """The module of each name that a stub imports, `from MODULE import NAME as NAME`."""
    imports = [node for node in ast.parse(stub.read_text()).body if isinstance(node, ast.ImportFrom)]
    return {alias.name: str(node.module) for node in imports for alias in node.names}
