"""A report's two files: its text, and its figures with what they were measured on."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from envs.physics.native import cores
from mjx_hand.files.npz_archive import replacing
from train.reports.machine import accelerator, processor, versions


def write_report(
    folder: Path, name: str, lines: Sequence[str], schema: str, packages: Sequence[str], figures: Mapping[str, Any]
) -> tuple[Path, Path]:
    """Write `NAME.md` and `NAME.json`, and return their paths.

    Args:
        folder: for the two, made where missing.
        name: of both.
        lines: of the text.
        schema: of the figures.
        packages: whose versions stand with them.
        figures: what was measured and with which options, as JSON can say it.

    Raises:
        InputError: the folder cannot be written.
    """
    content = {
        "schema": schema,
        "machine": {"processor": processor(), "cores": cores(), "accelerator": accelerator()},
        "versions": versions(*packages),
        **figures,
    }
    page, data = folder / f"{name}.md", folder / f"{name}.json"
    with replacing(page) as temporary:
        temporary.write_text("\n".join(lines) + "\n")
    with replacing(data) as temporary:
        temporary.write_text(json.dumps(content, indent=1) + "\n")
    return page, data
