"""One training in several processes, on one machine or many: joining, agreeing, and who writes.

Every process runs the same command with its own `distributed.process` and does the same evaluations; the first alone
writes. Each needs the experiment's `out` and `demonstrations` folders at the same paths.
"""

import contextlib
import io
import socket
from collections.abc import Iterator
from typing import Any

import jax
import numpy as np
from jax.experimental import multihost_utils

from mjx_hand.errors import InputError
from train.settings.options import Distributed


def join(settings: Distributed) -> None:
    """Join the other processes, before anything is computed; nothing to do for a single one, or once more.

    Raises:
        InputError: the coordinator or the others do not answer.
    """
    if settings.processes == 1 or jax.distributed.is_initialized():
        return
    try:
        jax.distributed.initialize(
            coordinator_address=settings.coordinator,
            num_processes=settings.processes,
            process_id=settings.process,
            initialization_timeout=settings.timeout,
        )
    except RuntimeError as error:
        raise InputError(
            f"process {settings.process} of {settings.processes} on {socket.gethostname()} could not join at "
            f"{settings.coordinator} within {settings.timeout} s ({str(error).splitlines()[0]}); start process 0 on "
            "that machine, and all others"
        ) from None


def is_first() -> bool:
    """Whether this process writes."""
    return jax.process_index() == 0


@contextlib.contextmanager
def first_alone_speaks() -> Iterator[None]:
    """A context in which the other processes print nothing on standard output."""
    with contextlib.nullcontext() if is_first() else contextlib.redirect_stdout(io.StringIO()):
        yield


def wait_for_all(what: str) -> None:
    """Return when every process has come here."""
    if jax.process_count() > 1:
        multihost_utils.sync_global_devices(what)


def agreed(number: int) -> int:
    """The greatest of all processes' numbers."""
    if jax.process_count() == 1:
        return number
    return int(np.max(multihost_utils.process_allgather(np.array(number))))


def gathered(tree: Any) -> Any:
    """Arrays that may be spread over processes, whole, as NumPy arrays in each."""
    if jax.process_count() == 1:
        return jax.device_get(tree)
    return jax.tree.map(
        lambda leaf: np.asarray(
            leaf if leaf.is_fully_replicated else multihost_utils.process_allgather(leaf, tiled=True)
        ),
        tree,
    )
