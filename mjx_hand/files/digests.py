"""Digests, by which content, settings and files are known again: SHA-256, as hexadecimal text.

Folders and files on users' disks have them in their names or beside their content. What is fed, and in which order,
therefore never changes: their sets, states and results would not be found again.
"""

import hashlib
import json
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any


def digest(pieces: Iterable[bytes]) -> str:
    """Of all the pieces, one after the other."""
    content = hashlib.sha256()
    for piece in pieces:
        content.update(piece)
    return content.hexdigest()


def json_digest(value: Any, default: Callable[[Any], Any] | None = None) -> str:
    """Of plain values, in whatever order a mapping has its keys.

    Args:
        value: what JSON can tell.
        default: makes that of anything else, as in `json.dumps`.

    Raises:
        TypeError: there is something else, and no `default`.
    """
    return digest([json.dumps(value, sort_keys=True, default=default).encode()])


def file_digest(path: Path) -> str:
    """Of a file's content, whatever its name.

    Raises:
        OSError: it cannot be read.
    """
    return digest([path.read_bytes()])


def file_piece(path: Path) -> bytes:
    """A file as one piece of a digest: its name, wherever it is, and its content.

    Raises:
        OSError: it cannot be read.
    """
    return path.name.encode() + bytes.fromhex(file_digest(path))
