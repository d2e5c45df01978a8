"""Make a demonstration set, check it and show it: `python -m envs.demonstrations config=power data.people=2`.

Takes the `data` part of an experiment's configuration (`configs/config/NAME.yaml`) and overrides of it, and
`demonstrations=FOLDER`, below which sets are kept. Prints what came of all attempts and how good the demonstrations
are, and writes a picture of them, `sheet.png`, into the set's folder.
"""

import json
import sys
from collections.abc import Mapping, Sequence
from importlib import resources
from pathlib import Path
from typing import cast

import numpy as np
from omegaconf import DictConfig, OmegaConf
from omegaconf.errors import OmegaConfBaseException
from PIL import Image
from rich.console import Console
from rich.table import Table

from envs.demonstrations.contact_sheet import contact_sheet
from envs.demonstrations.dataset import PARTS, YIELD, SetSettings, load_part, make_set, twins
from envs.demonstrations.quality import Quality, check_part
from mjx_hand.compile_cache import enable_compile_cache
from mjx_hand.errors import InputError
from mjx_hand.motion.archive import replacing
from mjx_hand.view.progress import shares
from mjx_hand.view.renderer import RendererUnavailable

_ROOT = "outputs/demonstrations"


def settings_of(arguments: Sequence[str]) -> tuple[SetSettings, Path]:
    """The set that command-line arguments ask for, and the folder below which it is kept.

    Raises:
        InputError: no or an unknown experiment, or an option that there is not.
    """
    given = {key: value for key, _, value in (argument.partition("=") for argument in arguments)}
    files = {Path(f.name).stem: f for f in resources.files("configs.config").iterdir() if f.name.endswith(".yaml")}
    experiment = given.pop("config", "")
    if experiment not in files:
        raise InputError(f"config is {experiment!r}; give config=NAME, one of {', '.join(sorted(files))}")
    root = given.pop("demonstrations", _ROOT)
    unknown = [key for key in given if not key.startswith("data.")]
    if unknown:
        raise InputError(f"{unknown[0]!r} is not an option; valid: config, demonstrations, data.*")
    try:
        schema = OmegaConf.structured(SetSettings)
        _make_writable(schema)
        data = OmegaConf.to_container(OmegaConf.create(files[experiment].read_text()))
        overrides = OmegaConf.from_dotlist([f"{key.removeprefix('data.')}={value}" for key, value in given.items()])
        merged = OmegaConf.merge(schema, cast(dict, data).get("data", {}), overrides)
        return cast(SetSettings, OmegaConf.to_object(merged)), Path(root)
    except OmegaConfBaseException as error:
        line = str(error).strip().splitlines()[0]
        raise InputError(f"{line}; python -m train.ppo --cfg job lists the options of data") from None


def _make_writable(node: DictConfig) -> None:
    """Frozen dataclasses make read-only nodes, which files and overrides could not change."""
    OmegaConf.set_readonly(node, False)
    for name in node:
        if isinstance(child := node._get_node(name), DictConfig):
            _make_writable(child)


def main(arguments: Sequence[str]) -> None:
    """Make the set where it is missing, print its tables, write its picture."""
    settings, root = settings_of(arguments)
    enable_compile_cache()
    with shares() as report:
        folder = make_set(settings, root, report)
    for table in (_yield_table(json.loads((folder / YIELD).read_text())), _quality_table(folder)):
        Console().print(table)
    demonstrations = load_part(folder, PARTS[0])
    try:
        sheet = contact_sheet(demonstrations, twins(demonstrations))
    except RendererUnavailable as error:
        print(f"no picture: {error}")
    else:
        with replacing(folder / "sheet.png") as temporary:
            Image.fromarray(np.asarray(sheet)).save(temporary, format="png")
        print(f"picture: {folder / 'sheet.png'}")
    print(f"demonstrations: {folder}")


def _yield_table(yields: Mapping[str, Mapping[str, int]]) -> Table:
    outcomes = sorted({outcome for tally in yields.values() for outcome in tally})
    table = Table("part", "attempts", *outcomes)
    for part, tally in yields.items():
        table.add_row(part, str(sum(tally.values())), *(str(tally.get(outcome, 0)) for outcome in outcomes))
    return table


def _quality_table(folder: Path) -> Table:
    table = Table(
        "part", "demonstrations", "seconds", "lift (cm)", "hinges off (°)", "wrist off (mm)", "object off (mm)"
    )
    for part in PARTS:
        q: Quality = check_part(folder, part)
        table.add_row(
            part,
            str(len(q.lift)),
            f"{q.seconds.min():.1f} to {q.seconds.max():.1f}",
            f"{100 * q.lift.min():.1f} to {100 * q.lift.max():.1f}",
            f"{np.rad2deg(q.angle_error.mean()):.1f}",
            f"{1000 * q.wrist_error.mean():.1f}",
            f"at most {1000 * q.object_error.max():.1f}",
        )
    return table


if __name__ == "__main__":
    try:
        main(sys.argv[1:])
    except InputError as error:
        print(f"demonstrations: {error}", file=sys.stderr)
        sys.exit(2)
