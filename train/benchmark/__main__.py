"""Measure this machine: physics engines, solver settings, projection: `mjx-hand bench [NAME]`.

NAME is one of `MODULES`; without it, all are run but those that need what few machines have (`BY_NAME`).
"""

import sys
from collections.abc import Sequence

import tyro

from mjx_hand.compile_cache import enable_compile_cache
from mjx_hand.errors import InputError
from mjx_hand.files.npz_archive import replacing
from train.benchmark import convergence, engines, keypoints, mjbatch, retarget, solver
from train.benchmark.gpu import command as gpu
from train.benchmark.live import latency, streamed

MODULES = {
    "convergence": convergence,
    "engines": engines,
    "gpu": gpu,
    "keypoints": keypoints,
    "live": latency,
    "streamed": streamed,
    "mjbatch": mjbatch,
    "retarget": retarget,
    "solver": solver,
}
BY_NAME = ("gpu", "live", "streamed")  # need what few machines have: a browser, sets of demonstrations


def main(argv: Sequence[str] | None = None) -> int:
    """Print the reports as Markdown; returns the exit status: 0, or 2 for input that cannot be used.

    Args:
        argv: the arguments; the process's own if None.
    """
    argv = sys.argv[1:] if argv is None else argv
    options = {name: module.Options for name, module in MODULES.items()}
    try:
        enable_compile_cache()
        if argv:
            chosen = [tyro.extras.subcommand_cli_from_dict(options, prog="python -m train.benchmark", args=argv)]
        else:
            chosen = [make() for name, make in options.items() if name not in BY_NAME]
        for choice in chosen:
            (module,) = (m for m in MODULES.values() if type(choice) is m.Options)
            text = "\n".join(module.report(choice)) + "\n"
            print(text, flush=True)
            if isinstance(choice, keypoints.Options | retarget.Options) and choice.out is not None:
                with replacing(choice.out) as temporary:
                    temporary.write_text(text)
    except InputError as error:
        print(f"benchmark: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
