"""Arrays that take seconds to compute, kept beside compiled functions from one start of a program to the next."""

import contextlib
import functools
import os
from collections.abc import Callable, Iterator, Mapping
from importlib.metadata import version
from pathlib import Path
from typing import Any

import jax
import mujoco
import numpy as np

from mjx_hand.errors import InputError
from mjx_hand.files.digests import digest
from mjx_hand.files.npz_archive import load_arrays, save_arrays
from mjx_hand.files.working_folder import working_file

SCHEMA = "mjx-hand/kept/1"
_FOLDER = "arrays"
_MOST = 1_000_000_000  # bytes of all files; those that were used longest ago are deleted
_CODE = tuple(Path(__file__).parents[2] / name for name in ("mjx_hand", "envs"))  # all: what matters is easily missed
_LIBRARIES = ("jax", "jaxlib", "mujoco", "numpy", "scipy")


def cached(compute: Callable[[], Mapping[str, np.ndarray]], *ingredients: Any) -> Mapping[str, np.ndarray]:
    """What `compute` gives, or gave in an earlier start with the same ingredients, code and libraries.

    They are kept where `mjx_hand.compile_cache` keeps compiled functions, if it does; that folder is safe to delete.

    Args:
        compute: a function of the ingredients alone.
        ingredients: pytrees of arrays, numbers, strings and bytes.

    Raises:
        InputError: they cannot be written.
    """
    cache = _cache()
    if cache is None:
        return compute()
    path = Path(cache) / _FOLDER / f"{digest(_pieces(ingredients))}.npz"
    if path.is_file():
        try:
            arrays = dict(load_arrays(path, SCHEMA))  # all are read here, where damage is caught
        except InputError:  # damaged, as an archive's checksums tell: it is made anew
            pass
        else:
            with contextlib.suppress(OSError):  # another's cache, or one that was deleted this moment
                os.utime(path)
            return arrays
    arrays = compute()
    with working_file(path) as temporary:  # which goes with the next start, where a kill leaves it
        save_arrays(temporary, SCHEMA, arrays)
    _tidy(path)
    return arrays


def _tidy(newest: Path) -> None:
    """Delete the files that were used longest ago, so that all take no more than `_MOST`; the newest stays."""
    files = []
    for file in newest.parent.glob("[!.]*.npz"):
        with contextlib.suppress(OSError):  # another process tidies up too
            stat = file.stat()
            files.append((stat.st_mtime, stat.st_size, file))
    taken = sum(size for _, size, _ in files)
    for _, size, file in sorted(files):
        if taken <= _MOST:
            break
        if file != newest:
            with contextlib.suppress(OSError):  # another's, or one that is being read where that keeps it
                file.unlink()
            taken -= size


def _cache() -> str | None:
    """Where JAX keeps what it compiles, if it does."""
    return jax.config.values["jax_compilation_cache_dir"]


def model_bytes(model: mujoco.MjModel) -> bytes:
    """All of a model, as an ingredient of what is kept."""
    content = np.empty(mujoco.mj_sizeModel(model), np.uint8)
    mujoco.mj_saveModel(model, None, content)
    return content.tobytes()


@functools.cache
def _code() -> bytes:
    """A digest of the code as this process found it."""
    sources = [(root, source) for root in _CODE for source in sorted(root.rglob("*.py"))]
    return digest(str(source.relative_to(root)).encode() + source.read_bytes() for root, source in sources).encode()


def _pieces(ingredients: Any) -> Iterator[bytes]:
    """All that what is kept depends on."""
    for library in _LIBRARIES:
        yield f"{library} {version(library)} ".encode()
    yield _code()
    leaves, structure = jax.tree.flatten(ingredients)
    yield f"{jax.default_backend()} {structure}".encode()
    for leaf in leaves:
        value = np.frombuffer(leaf, np.uint8) if isinstance(leaf, bytes) else np.asarray(leaf)
        yield f"{value.dtype} {value.shape}".encode()
        yield value.tobytes()
