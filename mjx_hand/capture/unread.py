"""What a file is that nothing here reads: what it holds, and the nearest that would be read."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from mjx_hand.capture.keypoint_files.load_keypoints import NEAREST, keypoint_contents
from mjx_hand.files.describe import described

_HOT3D = {"timestamp_ns", "hand_poses"}


def described_for_reading(path: Path, contents: Mapping[str, Any]) -> str:
    """What a file or folder holds, and what would be read instead.

    Args:
        path: of the file or folder.
        contents: what `read_contents` found in it.

    Raises:
        InputError: the file is damaged.
    """
    if path.is_dir():
        return f"a folder of no layout that is known here: {described(path)}"
    found = keypoint_contents(path, contents)
    lines = found if isinstance(found, list) else [found]
    name = "HOT3D's hand poses, which are read from its folder, by UmeTrack's file: " if _is_hot3d(lines) else ""
    return f"{name}{described(path, found if found is not None else contents)}; {NEAREST}"


def _is_hot3d(lines: list[Any]) -> bool:
    return bool(lines) and isinstance(lines[0], Mapping) and set(lines[0]) >= _HOT3D
