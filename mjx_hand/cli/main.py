"""The command `mjx-hand`: one file a subcommand beside this one, and those of other packages."""

import functools
import importlib
import os
import sys
from collections.abc import Callable, Sequence
from typing import Any

import tyro

from mjx_hand.cli.plugin_commands import plugin_commands, run_plugin, summary
from mjx_hand.cli.terminal.usage import later, parsed
from mjx_hand.cli.terminal.wording import as_options
from mjx_hand.compile_cache import enable_compile_cache
from mjx_hand.errors import InputError

COMMANDS = ("build", "fit", "info", "keypoints", "retarget", "robot", "scene", "track", "view")


def _function(command: str) -> Callable[..., Any]:
    return later(getattr(importlib.import_module(f"mjx_hand.cli.{command}"), command))


def _all_functions() -> dict[str, Callable[..., Any]]:
    """What the help lists. Subcommands of other packages read their arguments themselves, before this is looked at."""
    functions = {command: _function(command) for command in COMMANDS}
    for name, point in plugin_commands().items():

        def described() -> None: ...

        described.__doc__ = summary(point)
        functions[name] = later(described)
    return functions


def main(argv: Sequence[str] | None = None) -> int:
    """Run a subcommand; returns the exit status.

    0; 2 for input that cannot be used (one line on standard error); 1 where a subcommand did the rest of its input.

    Args:
        argv: the arguments; the process's own if None.

    Raises:
        SystemExit: by tyro, after `--help` (0) and for unknown or missing options (2), or by another package's
            subcommand.
    """
    argv = sys.argv[1:] if argv is None else argv
    try:
        if argv and argv[0] not in COMMANDS and (plugin := plugin_commands().get(argv[0])):
            return run_plugin(plugin, argv[1:])
        enable_compile_cache()
        if argv and argv[0] in COMMANDS:  # one command's module alone: importing all of them takes a second
            parse = functools.partial(tyro.cli, _function(argv[0]), prog=f"mjx-hand {argv[0]}", args=argv[1:])
        else:
            functions = _all_functions()
            parse = functools.partial(tyro.extras.subcommand_cli_from_dict, functions, prog="mjx-hand", args=argv)
        status = parsed(parse)()
    except InputError as error:
        print(f"mjx-hand: {as_options(str(error))}", file=sys.stderr)
        return 2
    except BrokenPipeError:  # whoever read the output has seen enough, as `head` does
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # Python flushes once more as it ends
        return 1
    except OSError as error:  # a path that the system cannot use: too long a name, no permission, a full disk
        print(f"mjx-hand: {InputError(error)}", file=sys.stderr)
        return 2
    return status or 0
