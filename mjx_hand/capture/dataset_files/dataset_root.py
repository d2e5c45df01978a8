"""Files that a recording names, elsewhere in its data set.

A data set's root is some folders above a recording. Recordings, folders and the root itself may be symbolic links, for
data sets are large and lie on several disks: what is named may then lie beside the links or beside what they lead to.
"""

import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from mjx_hand.errors import InputError
from mjx_hand.files.safe_yaml import shown

_MOST_LINKS = 40


def beside(recording: Path, up: int, place: str) -> Path:
    """The path of `place` below the folder that is `up` above `recording`; where nothing is there, as it would be.

    Args:
        recording: file or folder, by any path.
        up: 1 for the folder that holds it.
        place: a relative path, as the recording's layout says.
    """
    roots = [path.parents[up - 1] for path in _paths(recording) if len(path.parents) >= up]
    places = [root / place for root in roots]
    return next((path for path in places if path.exists()), places[0])


def _paths(path: Path) -> Iterator[Path]:
    """`path` in full, and with one symbolic link after the other followed, the outermost first."""
    current = Path(os.path.normpath(path.absolute()))
    for _ in range(_MOST_LINKS):
        yield current
        link = next((above for above in (*reversed(current.parents), current) if above.is_symlink()), None)
        if link is None:
            break
        current = Path(os.path.normpath(link.parent / link.readlink() / current.relative_to(link)))
    yield Path(os.path.realpath(path))  # `..` behind a link leads elsewhere than its letters say


def one_name(path: Path, key: str, value: Any) -> str:
    """A name in a recording's settings that becomes part of a path, if it is one name of a file or folder.

    Args:
        path: of the settings, for the message.
        key, value: the entry.

    Raises:
        InputError: it is none, or leads out of its folder.
    """
    name = str(value)
    sound = isinstance(value, str | int) and not isinstance(value, bool) and 0 < len(name) <= 200
    if not sound or name in (".", "..") or any(letter in "/\\" or not letter.isprintable() for letter in name):
        raise InputError(f"{path}: {key} is {shown(value)}, expected one name, without folders")
    return name
