"""Folders that appear whole or not at all: made under a temporary name, and cleared away where a kill left them."""

import contextlib
import importlib.util
import os
import re
import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path

from mjx_hand.errors import InputError

_LOCKS = importlib.util.find_spec("fcntl") is not None  # not on Windows, where nothing tells a folder in use


@contextlib.contextmanager
def working_folder(final: Path) -> Iterator[Path]:
    """Yield a new folder beside `final`, to be renamed to it; it goes if it still has its own name at the end.

    So do those of other processes that were killed, which the system tells from those that are at work: it holds a
    lock (flock) on each until its process ends.

    Raises:
        InputError: no folder can be made there.
    """
    try:
        final.parent.mkdir(parents=True, exist_ok=True)
        folder, lock = _made(final)
    except OSError as error:
        raise InputError(f"cannot write {final}: {error.strerror}; choose a folder that you may write to") from None
    try:
        remove_abandoned(final)
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)
        if lock is not None:
            os.close(lock)


@contextlib.contextmanager
def working_file(final: Path) -> Iterator[Path]:
    """Yield a path to write in a working folder; on success the file takes `final`'s place.

    Raises:
        InputError: as `working_folder`.
    """
    with working_folder(final) as folder:
        yield folder / final.name
        (folder / final.name).replace(final)


def remove_abandoned(final: Path) -> None:
    """Delete the working folders of `final` whose processes were killed."""
    if not _LOCKS:
        return
    name = re.compile(rf"\.{re.escape(final.name)}-[a-z0-9_]{{8}}")
    for folder in final.parent.glob(f".{final.name}-*"):
        with contextlib.suppress(OSError):  # in use, or on a file system without locks
            lock = _locked(folder) if name.fullmatch(folder.name) else None
            if lock is not None:
                shutil.rmtree(folder, ignore_errors=True)
                os.close(lock)


def _made(final: Path) -> tuple[Path, int | None]:
    while True:
        folder = Path(tempfile.mkdtemp(dir=final.parent, prefix=f".{final.name}-"))
        try:
            lock = _locked(folder) if _LOCKS else None
        except (BlockingIOError, FileNotFoundError):
            continue  # another process has taken it for abandoned in the moment before it was locked
        except OSError:  # a file system without locks
            return folder, None
        if folder.is_dir():
            return folder, lock
        if lock is not None:
            os.close(lock)


def _locked(folder: Path) -> int:
    """A file handle that holds the folder's lock.

    Raises:
        BlockingIOError: another process holds it.
        OSError: the folder is gone, or its file system has no locks.
    """
    import fcntl

    handle = os.open(folder, os.O_RDONLY)
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        os.close(handle)
        raise
    return handle
