"""Make a demonstration set, check it and show it: `mjx-hand demonstrations config=power data.people=2`.

Takes the `data` part of an experiment's configuration (`configs/config/NAME.yaml`) and overrides of it, and
`demonstrations=FOLDER`, below which sets are kept; with `part=sealed` the part that stands apart is made. Prints what
came of all attempts and how good the demonstrations are, and writes a picture of them, `sheet.png`, into the set's
folder.
"""

import json
import sys
from collections.abc import Mapping, Sequence
from importlib import resources
from pathlib import Path
from typing import cast

import numpy as np
from omegaconf import DictConfig, OmegaConf
from PIL import Image

from envs.demonstrations.contact_sheet import contact_sheet
from envs.demonstrations.dataset import AS_RECORDED, VARIED, YIELD, make_sealed, make_set
from envs.demonstrations.load_set import PARTS, SEALED, load_part
from envs.demonstrations.quality import check_part, check_streamed
from envs.demonstrations.recordings.recording_page import RECORDINGS
from envs.demonstrations.scripted.perform import OUTCOMES
from envs.demonstrations.scripted.trials import NO_POSTURE, SPARE
from envs.demonstrations.set_settings import SetSettings
from envs.demonstrations.twin_hands import twins
from envs.grip_force import RECORDED
from envs.settings import from_dict
from mjx_hand.cli.output import print_table
from mjx_hand.compile_cache import enable_compile_cache
from mjx_hand.errors import InputError, reason_of
from mjx_hand.files.npz_archive import replacing
from mjx_hand.files.working_folder import working_file
from mjx_hand.progress import shares
from mjx_hand.view.video.renderer import RendererUnavailable

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
        raise InputError(f"{unknown[0]!r} is not an option; valid: config, demonstrations, part={SEALED}, data.*")
    try:
        schema = OmegaConf.structured(SetSettings)
        _make_writable(schema)
        data = OmegaConf.to_container(OmegaConf.create(files[experiment].read_text()))
        overrides = OmegaConf.from_dotlist([f"{key.removeprefix('data.')}={value}" for key, value in given.items()])
        merged = OmegaConf.merge(schema, cast(dict, data).get("data", {}), overrides)
        return from_dict(SetSettings, OmegaConf.to_container(merged, throw_on_missing=True)), Path(root)
    except InputError:
        raise
    except Exception as error:  # numbers and brackets that Python itself gives up on are not OmegaConf's own errors
        raise InputError(f"{reason_of(error)}; python -m train.ppo --cfg job lists the options of data") from None


def _make_writable(node: DictConfig) -> None:
    """Frozen dataclasses make read-only nodes, which files and overrides could not change."""
    OmegaConf.set_readonly(node, False)
    for name in node:
        if isinstance(child := node._get_node(name), DictConfig):
            _make_writable(child)


def main(arguments: Sequence[str]) -> None:
    """Make the set where it is missing, print its tables, write its picture; `config=all` does so for each type."""
    sealed = f"part={SEALED}" in arguments
    settings, root = settings_of([argument for argument in arguments if argument != f"part={SEALED}"])
    enable_compile_cache()
    if settings.folder:
        raise InputError(f"{settings.folder}: these demonstrations are finished; leave out data.folder to make a set")
    for single in settings.expand_types():
        _make_and_show(single, root, sealed)


def _make_and_show(settings: SetSettings, root: Path, sealed: bool) -> None:
    with shares() as report:
        folder = make_sealed(settings, root, report) if sealed else make_set(settings, root, report)
    parts = (SEALED,) if sealed else PARTS
    yields = json.loads((folder / YIELD).read_text())
    rows = _yield_rows(yields, parts)
    if settings.grasp != RECORDED:
        rows += _streamed_rows(folder, parts) if settings.streamed else _quality_rows(folder, parts)
    print_table(str(folder), ("", *parts), rows)
    if settings.grasp == RECORDED:
        _print_recordings(folder)
    demonstrations = load_part(folder, parts[0])
    try:
        sheet = contact_sheet(demonstrations, twins(demonstrations))
    except RendererUnavailable as error:
        print(f"no picture: {error}")
    else:
        path = folder / "sheet.png"
        # The working file goes with the next start, where a kill leaves it.
        with working_file(path) as temporary, replacing(temporary) as file:
            Image.fromarray(np.asarray(sheet)).save(file, format="png")
        print(f"picture: {path}")


def _yield_rows(yields: Mapping[str, Mapping[str, int]], parts: Sequence[str]) -> list[tuple[str, ...]]:
    known = (*OUTCOMES, NO_POSTURE, SPARE, AS_RECORDED, VARIED)
    outcomes = [o for o in known if any(o in tally for tally in yields.values())]
    attempts = ("attempts", *(str(sum(yields[part].values())) for part in parts))
    return [attempts, *((outcome, *(str(yields[part].get(outcome, 0)) for part in parts)) for outcome in outcomes)]


def _quality_rows(folder: Path, parts: Sequence[str]) -> list[tuple[str, ...]]:
    measured = [check_part(folder, part) for part in parts]
    return [
        ("length (s)", *(_range(q.seconds) for q in measured)),
        ("lift (cm)", *(_range(100 * q.lift) for q in measured)),
        ("hinges from the truth (°)", *(_range(np.rad2deg(q.angle_error)) for q in measured)),
        ("wrist from the truth (mm)", *(_range(1000 * q.wrist_error) for q in measured)),
        ("object from the truth, at most (mm)", *(_range(1000 * q.object_error) for q in measured)),
    ]


def _streamed_rows(folder: Path, parts: Sequence[str]) -> list[tuple[str, ...]]:
    measured = [check_streamed(folder, part) for part in parts]
    return [
        ("length (s)", *(_range(q.seconds) for q in measured)),
        ("tracked hinges from the hand's (°)", *(_range(np.rad2deg(q.angle_error)) for q in measured)),
        ("tracked wrist from the hand's (mm)", *(_range(1000 * q.wrist_error) for q in measured)),
    ]


def _print_recordings(folder: Path) -> None:
    """A row for each recording, and a line for each that is not in the set."""
    told = json.loads((folder / RECORDINGS).read_text())
    rows = [
        (
            row["name"],
            f"{row['side']}, {row['object']}",
            f"{row['first']} to {row['last']} of {row['frames']}",
            f"{1e3 * row['gap']:.1f}",
            f"{1e3 * row['depth']:.1f}",
            f"{1e3 * row['hand_moved']:.1f}",
            f"{row['carried']:.0%}",
            row["part"],
        )
        for row in told["recordings"]
    ]
    columns = ("recording", "hand", "frames", "tip gap (mm)", "in it (mm)", "hand moved (mm)", "carried", "part")
    print_table("recordings", columns, rows)
    for row in told["refused"]:
        print(f"left out: {row['why']}")
    print(f"pages: {folder / 'pages'}")


def _range(values: np.ndarray) -> str:
    return f"{values.min():.1f} to {values.max():.1f}"


def command_line() -> int:
    """The command, with this process's arguments; the exit status: 0, or 2 for input that cannot be used."""
    try:
        main(sys.argv[1:])
    except InputError as error:
        print(f"demonstrations: {error}", file=sys.stderr)
        return 2
    except OSError as error:  # a path that the system cannot use: too long a name, no permission, a full disk
        print(f"demonstrations: {InputError(error)}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(command_line())
