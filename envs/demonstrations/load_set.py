"""Demonstrations from disk: sets that the project made, and anyone's finished demonstrations."""

from pathlib import Path

from envs.demonstrations.set_settings import GIVEN, SetSettings, sealed_folder, set_folder
from envs.grasps import grasp_names
from mjx_hand.errors import InputError
from mjx_hand.files.digests import digest, file_piece
from mjx_hand.motion.demonstration import Demonstration, load_demonstration

PARTS = ("train", "heldout")
SEALED = "sealed"  # what nothing is tuned on: made and evaluated apart, at the end
EVERY_PART = (*PARTS, SEALED)


def load_demonstrations(settings: SetSettings, part: str, root: str | Path) -> list[Demonstration]:
    """The demonstrations of one part, of all grasp types together one type after the other. Nothing is made.

    Args:
        settings: of a set, or of a folder of finished demonstrations.
        part: "train", "heldout" or "sealed".
        root: folder below which sets are kept.

    Raises:
        InputError: a set that has not been made, or as `load_part`.
    """
    if settings.grasp == GIVEN:
        return load_part(settings.folder, part)
    demonstrations = []
    for single in settings.expand_types():
        folder = sealed_folder(single, root) if part == SEALED else set_folder(single, root)
        if not folder.is_dir():
            config = single.grasp if single.grasp in grasp_names() else "NAME"
            raise InputError(
                f"{folder}: this demonstration set is not made yet; make it first: python -m envs.demonstrations "
                f"config={config}{f' part={SEALED}' if part == SEALED else ''}, with the same data.* and "
                "demonstrations=FOLDER"
            )
        demonstrations += load_part(folder, part)
    return demonstrations


def load_part(folder: str | Path, part: str) -> list[Demonstration]:
    """The demonstrations of one part of a folder, in order: `demonstration_files` says which.

    Raises:
        InputError: as `demonstration_files`, or a file that is no demonstration.
    """
    return [load_demonstration(path) for path in demonstration_files(folder, part)]


def is_divided(folder: str | Path) -> bool:
    """Whether a folder has a part for training, one held out or a sealed one."""
    return any(Path(folder, part).is_dir() for part in EVERY_PART)


def demonstration_files(folder: str | Path, part: str) -> list[Path]:
    """The files `PART/NNN.npz` of a folder; of one without parts its own `NNN.npz`, which are then both parts.

    Raises:
        InputError: no such folder or part, or it holds no demonstrations.
    """
    if part not in EVERY_PART:
        raise InputError(f"part {part!r} is not known; valid: {', '.join(EVERY_PART)}")
    if not Path(folder).is_dir():
        raise InputError(f"{folder}: no such folder; give one that holds finished demonstrations, NNN.npz")
    where = Path(folder, part) if is_divided(folder) else Path(folder)
    paths = [path for path in sorted(where.glob("*.npz")) if path.stem.isdigit()]
    if not paths:
        raise InputError(
            f"{folder}: no {part} demonstrations; valid are train/NNN.npz and heldout/NNN.npz, or NNN.npz, as "
            "save_demonstration writes them (of a set that the project made, delete the folder to make it anew)"
        )
    return paths


def part_digest(folder: str | Path, part: str) -> str:
    """A digest of what one part of a folder holds, wherever the folder is.

    Raises:
        InputError: as `demonstration_files`.
    """
    return digest(map(file_piece, demonstration_files(folder, part)))[:16]
