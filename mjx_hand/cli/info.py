"""`mjx-hand info`: what a file is, what is in it, and what to run next."""

from pathlib import Path
from typing import Annotated, Literal

import tyro

from mjx_hand.cli.file_facts import file_facts
from mjx_hand.errors import in_one_line


def info(
    file: Annotated[Path, tyro.conf.Positional],
    side: Literal["right", "left"] | None = None,
    sequence: str | None = None,
    mano: Path | None = None,
    fps: float | None = None,
    units: str | None = None,
) -> int:
    """Describe a file or dataset folder: what it is, what it holds, and what to run next.

    The exit status is 1 for a dataset's recording that cannot be read as it is; the output says why.

    Args:
        file: anything that mjx-hand reads or writes.
        side: which hand to describe, where there are both.
        sequence: which recording to describe, where there are several.
        mano: a licensed MANO file, for datasets whose poses need one.
        fps: frames per second, where the recording does not say.
        units: m, cm, mm or in, where a marker file's own unit is wrong or missing.
    """
    found = file_facts(file, side, sequence, mano, fps, units)
    print(in_one_line(f"{file}: {found.kind}"))
    width = max((len(label) for label, _ in found.facts), default=0)
    for label, text in found.facts:
        print(f"  {label:<{width}}  {in_one_line(text)}")
    for command in found.next:
        print(f"next: {command}")
    return 0 if found.sound else 1
