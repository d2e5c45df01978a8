"""Who may look at a viewer, and what a browser may tell it.

Browsers let any page open a websocket to any address, and viser's server takes whoever comes: a page that is open
beside the viewer could read the recording and steer it, or have it published through viser's share tunnel. Here
requests are answered that are for the viewer's own address (`address.OwnAddress`), and of what clients send viser hears
only where they look from and the values of controls, each checked.
"""

import asyncio
import dataclasses
import functools
import http
import logging
import math
import threading
import typing
from collections.abc import Mapping
from typing import Any

import msgspec
import viser
import websockets.asyncio.server
from viser import _messages
from websockets.asyncio.server import ServerConnection
from websockets.http11 import Request, Response

from mjx_hand.view.browser.address import OwnAddress

_LARGEST = 2**16  # bytes of a message; a control's value takes a hundred
_LONGEST = 2**12  # letters of a text
_FAR = 1e6  # m, rad, pixels: what a camera says is less
_patching = threading.Lock()


def guarded_server(host: str, port: int, label: str) -> viser.ViserServer:
    """viser's server behind a gate.

    Raises:
        RuntimeError: this version of viser serves in a way that the gate does not know; nothing is served then.
    """
    gate = _Gate(host)
    original = websockets.asyncio.server.serve

    def serve(handler: Any, *args: Any, process_request: Any, **options: Any) -> Any:
        gate.stands = True
        options |= {
            "process_request": gate.asked(process_request),
            "create_connection": functools.partial(_Connection, gate),
            "max_size": _LARGEST,
            "logger": _silent(),
        }
        return original(handler, *args, **options)

    # viser has no place to hand these options in; it looks `serve` up in the moment that it starts.
    with _patching:
        websockets.asyncio.server.serve = serve  # type: ignore[assignment,misc]
        try:
            server = viser.ViserServer(host=host, port=port, label=label, verbose=False)
        finally:
            websockets.asyncio.server.serve = original  # type: ignore[misc]
    if not gate.stands:
        server.stop()
        raise RuntimeError(f"viser {viser.__version__} cannot be guarded; install viser 1.1")
    gate.server = server
    return server


class _Gate:
    """What is let in.

    Attributes:
        server: whose controls are told of; None until it is made.
        stands: whether the server was made with it.
    """

    def __init__(self, host: str):
        self._address = OwnAddress(host)
        self.server: viser.ViserServer | None = None
        self.stands = False

    def asked(self, answer: Any) -> Any:
        """viser's `answer` to a request, or a refusal."""

        def process_request(connection: ServerConnection, request: Request) -> Response | None:
            if not self._address.knows(request.headers):
                text = "This viewer answers pages of its own address only; see --host of mjx-hand view.\n"
                return connection.respond(http.HTTPStatus.FORBIDDEN, text)
            response = answer(connection, request)
            if response is not None:  # a page: other sites must not frame it, and have its buttons clicked
                response.headers["Content-Security-Policy"] = "frame-ancestors 'self'"
            return response

        return process_request

    def takes(self, message: str | bytes) -> bool:
        """Whether a message is one that viser can do something with: a camera, or a new value of a control."""
        if self.server is None or isinstance(message, str):
            return False
        try:
            told = msgspec.msgpack.decode(message)
            kind = told.pop("type")
            if kind == "ViewerCameraMessage":
                return _is_camera(told)
            return kind == "GuiUpdateMessage" and self._is_value(told)
        except Exception:  # a stranger's bytes raise anything at all
            return False

    def _is_value(self, told: Mapping[str, Any]) -> bool:
        assert self.server is not None
        if set(told) != {"uuid", "updates"} or set(told["updates"]) != {"value"}:
            return False
        for gui in (self.server.gui, *(client.gui for client in self.server.get_clients().values())):
            if (control := gui._gui_input_handle_from_uuid.get(told["uuid"])) is not None:
                return _fits_control(told["updates"]["value"], control)
        return False


class _Connection(ServerConnection):
    """A client's connection, of which viser hears what the gate takes."""

    def __init__(self, gate: _Gate, *args: Any, **options: Any):
        super().__init__(*args, **options)
        self._gate = gate

    async def recv(self, decode: bool | None = None) -> Any:
        """The next message that is taken."""
        while not self._gate.takes(message := await super().recv(decode)):
            await asyncio.sleep(0)  # others have their turn, however fast one talks
        return message


def _silent() -> logging.Logger:
    """websockets prints a stack trace of every stranger who hangs up."""
    logger = logging.getLogger("mjx_hand.viewer")
    logger.propagate = False
    logger.addHandler(logging.NullHandler())
    return logger


def _is_camera(told: Mapping[str, Any]) -> bool:
    kind = _messages.ViewerCameraMessage
    hints = typing.get_type_hints(kind)
    wanted = {field.name: hints[field.name] for field in dataclasses.fields(kind)}
    if set(told) != set(wanted):
        return False
    return all(_fits_type(told[name], annotation) for name, annotation in wanted.items())


def _fits_type(value: Any, annotation: Any) -> bool:
    if typing.get_origin(annotation) is tuple:
        parts = typing.get_args(annotation)
        return isinstance(value, list) and len(value) == len(parts) and all(map(_fits_type, value, parts))
    return annotation in (int, float) and _is_number(value) and abs(value) <= _FAR


def _fits_control(value: Any, control: Any) -> bool:
    """Whether a person could have given that value to a control."""
    if control.disabled or not control.visible:
        return False
    now = control.value
    if (options := getattr(control, "options", None)) is not None:
        return isinstance(value, str) and value in options
    if isinstance(now, tuple):
        return isinstance(value, list) and len(value) == len(now) and all(map(_is_number, value))
    if isinstance(now, bool):
        return isinstance(value, bool)
    if isinstance(now, int | float):
        low, high = getattr(control, "min", None), getattr(control, "max", None)
        above, below = low is None or value >= low, high is None or value <= high
        return _is_number(value) and above and below
    return isinstance(now, str) and isinstance(value, str) and len(value) <= _LONGEST


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
