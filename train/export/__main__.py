"""Write a policy for other programs: `mjx-hand export config=pinch to=onnx`, or `npz`, `c`, or several: `to=onnx,c`.

Beside the policy, with its scaling and its filter, stand a contract (`contract.json`, `contract.md`: every input and
output, body, rate, versions, digest) and some held-out demonstrations with their scenes (`export.demonstrations=3`), in
`export.folder=FOLDER`, usually `out`/export. What has not been trained here is exported from the bundled policy.
"""

import sys
from collections.abc import Sequence

from train.experiment.setup import settled
from train.export.export_policy import export_policy
from train.settings.config import Config, command


def main(config: Config) -> None:
    """Write, and say what is there."""
    folder = export_policy(config)
    print(f"written: {folder.resolve()}")
    for path in sorted(path for path in folder.rglob("*") if path.is_file()):
        print(f"  {path.relative_to(folder)}: {path.stat().st_size / 1000:.0f} kB")


def full_options(arguments: Sequence[str]) -> list[str]:
    """The arguments, with `export.to=[onnx,c]` for `to=onnx,c`."""
    return [
        f"export.to=[{argument.removeprefix('to=').strip('[]')}]" if argument.startswith("to=") else argument
        for argument in arguments
    ]


def command_line() -> None:
    """The command, with this process's arguments."""
    sys.argv[1:] = full_options(sys.argv[1:])
    command(main, settled)


if __name__ == "__main__":
    command_line()
