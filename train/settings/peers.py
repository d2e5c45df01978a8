"""The other processes of a training: when one dies, the rest end at once and say so.

Left alone, JAX finds out after a minute without heartbeats, and ends the process with a stack of its own C++. Here each
process holds a connection to the first one, which the system closes in the moment in which either of them ends.
"""

import contextlib
import hmac
import os
import secrets
import socket
import sys
import threading
from collections.abc import Iterator
from typing import Any

from jax._src import distributed

from mjx_hand.errors import InputError
from train.settings.options import Distributed

_KEY = "mjx-hand/peers"
_BYE = b"."
_TOKEN = 16  # bytes


@contextlib.contextmanager
def watching_others(settings: Distributed) -> Iterator[None]:
    """A context in which the death of another process ends this one, with one line and status 1.

    Args:
        settings: of the processes, which have joined (`train.settings.processes.join`).
    """
    if settings.processes == 1:
        yield
        return
    links = _to_others(settings) if settings.process == 0 else [_to_first(settings)]
    for number, link in links:
        threading.Thread(target=_wait, args=(number, link), daemon=True, name=f"process {number}").start()
    try:
        yield
    except (InputError, SystemExit):
        _say_goodbye(links)
        raise
    _say_goodbye(links)


def _to_others(settings: Distributed) -> list[tuple[int, socket.socket]]:
    token, links = secrets.token_bytes(_TOKEN), {}
    with socket.create_server(("", 0)) as server:
        server.settimeout(settings.timeout)
        _client().key_value_set(_KEY, f"{server.getsockname()[1]} {token.hex()}")
        while len(links) < settings.processes - 1:
            try:
                link, _ = server.accept()
            except TimeoutError:
                raise InputError(
                    f"{settings.processes - 1 - len(links)} processes did not answer within {settings.timeout} s; "
                    "start all of them"
                ) from None
            link.settimeout(settings.timeout)
            with contextlib.suppress(OSError):
                said = link.recv(_TOKEN + 4, socket.MSG_WAITALL)
                if hmac.compare_digest(said[:_TOKEN], token):
                    link.settimeout(None)
                    links[int.from_bytes(said[_TOKEN:])] = link
                    continue
            link.close()  # a stranger
    return list(links.items())


def _to_first(settings: Distributed) -> tuple[int, socket.socket]:
    port, token = _client().blocking_key_value_get(_KEY, 1000 * settings.timeout).split()
    link = socket.create_connection((settings.coordinator.rpartition(":")[0], int(port)), settings.timeout)
    link.settimeout(None)
    link.sendall(bytes.fromhex(token) + settings.process.to_bytes(4))
    return 0, link


def _client() -> Any:
    """What JAX's processes tell each other through."""
    assert distributed.global_state.client is not None, "the processes have joined"
    return distributed.global_state.client


def _wait(number: int, link: socket.socket) -> None:
    try:
        said = link.recv(1)
    except OSError:
        said = b""
    if said != _BYE:
        print(
            f"train: process {number} has ended, and this one with it; start all again to go on from the last state",
            file=sys.stderr,
            flush=True,
        )
        os._exit(1)


def _say_goodbye(links: list[tuple[int, socket.socket]]) -> None:
    for _, link in links:
        with contextlib.suppress(OSError):
            link.sendall(_BYE)
