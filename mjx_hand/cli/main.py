"""The command `mjx-hand`: one file a subcommand beside this one."""

import sys
from collections.abc import Sequence

import tyro

from mjx_hand.cli.build import build
from mjx_hand.cli.fit import fit
from mjx_hand.cli.info import info
from mjx_hand.cli.keypoints import keypoints
from mjx_hand.cli.retarget import retarget
from mjx_hand.cli.robot import robot
from mjx_hand.cli.track import track
from mjx_hand.cli.view import view
from mjx_hand.compile_cache import enable_compile_cache
from mjx_hand.errors import InputError

COMMANDS = {
    "build": build,
    "fit": fit,
    "info": info,
    "keypoints": keypoints,
    "retarget": retarget,
    "robot": robot,
    "track": track,
    "view": view,
}


def main(argv: Sequence[str] | None = None) -> int:
    """Run a subcommand; returns the exit status.

    0; 2 for input that cannot be used (one line on standard error); 1 where a subcommand did the rest of its input.

    Args:
        argv: the arguments; the process's own if None.

    Raises:
        SystemExit: by tyro, after `--help` (0) and for unknown or missing options (2).
    """
    try:
        enable_compile_cache()
        status = tyro.extras.subcommand_cli_from_dict(COMMANDS, prog="mjx-hand", args=argv)
    except InputError as error:
        print(f"mjx-hand: {error}", file=sys.stderr)
        return 2
    return status or 0
