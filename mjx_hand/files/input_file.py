"""What every reader asks of a file before it opens it: that it is one, and that what should be in it is."""

import stat
from pathlib import Path

from mjx_hand.errors import InputError

_POINTER = b"version https://git-lfs.github.com/spec/"


def check_input_file(path: Path, give: str) -> None:
    """Look at a file that is to be read.

    Opening a pipe would wait for a writer, so nothing but a regular file is opened.

    Args:
        path: of the file.
        give: what the message asks for instead, as in "give the path of a recording".

    Raises:
        InputError: there is none, it is a folder, a pipe or a device, it is empty, or it is the pointer that Git LFS
            leaves where a file has not been fetched.
    """
    try:
        found = path.stat()
    except (OSError, ValueError) as error:
        absent = isinstance(error, FileNotFoundError | NotADirectoryError)
        reason = "no such file" if absent else getattr(error, "strerror", None) or "no path"
        raise InputError(f"{str(path)[:200]}: {reason}; {give}") from None
    if stat.S_ISDIR(found.st_mode):
        raise InputError(f"{path}: a folder; {give}")
    if not stat.S_ISREG(found.st_mode):
        raise InputError(f"{path}: a pipe or a device, not a file; save what comes from it, and {give}")
    if found.st_size == 0:
        raise InputError(f"{path}: the file is empty; {give}")
    refuse_pointer(path)


def refuse_pointer(path: Path) -> None:
    """Look whether a regular file is a pointer of Git LFS (https://github.com/git-lfs/git-lfs/blob/main/docs/spec.md).

    Raises:
        InputError: it is one, or may not be read.
    """
    try:
        with path.open("rb") as opened:
            start = opened.read(len(_POINTER))
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}); check its permissions") from None
    if start == _POINTER:
        raise InputError(f"{path}: a Git LFS pointer, not the file itself; run 'git lfs pull' where it comes from")
