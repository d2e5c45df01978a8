"""Strangers at the viewer: pages of other sites see and steer nothing, and garbage stops nobody's playing."""

import asyncio
import http.client
import time
from collections.abc import Iterator
from typing import Any

import msgspec
import numpy as np
import pytest
import viser
import websockets
from websockets.asyncio.client import connect

from mjx_hand.view.browser.address import OwnAddress
from mjx_hand.view.browser.scene import PointLayer, Scene
from mjx_hand.view.browser.viewer import Viewer

CAMERA = {
    "type": "ViewerCameraMessage",
    "wxyz": [1, 0, 0, 0],
    "position": [0, 0, 1],
    "fov": 0.6,
    "near": 0.01,
    "far": 1000,
    "image_height": 600,
    "image_width": 800,
    "look_at": [0, 0, 0],
    "up_direction": [0, 0, 1],
}


@pytest.fixture(scope="module")
def viewer() -> Iterator[Viewer]:
    made = Viewer(Scene("points", 100.0, (PointLayer("p", np.zeros((50, 1, 3)), (0, 0, 255)),)), port=0)
    yield made
    made.close()


def entered(port: int, host: str | None = None, origin: str | None = None) -> bool:
    """Whether a websocket is let in and told anything."""

    async def attempt() -> bool:
        # Where the connection goes is said apart, so that the Host in the request may be any.
        uri = f"ws://{host or f'127.0.0.1:{port}'}/"
        subprotocols: Any = [f"viser-v{viser.__version__}"]
        where = {"host": "127.0.0.1", "port": port}
        try:
            async with connect(uri, origin=origin, subprotocols=subprotocols, **where) as ws:  # type: ignore[arg-type]
                return bool(await asyncio.wait_for(ws.recv(), 10))
        except websockets.InvalidStatus as refusal:
            return refusal.response.status_code != 403

    return asyncio.run(attempt())


def status(port: int, host: str) -> int:
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=10)
    connection.putrequest("GET", "/", skip_host=True)
    connection.putheader("Host", host)
    connection.endheaders()
    found = connection.getresponse().status
    connection.close()
    return found


def talk(viewer: Viewer, *messages: Any) -> None:
    """Connect as a browser does, say these (bytes as they are), and leave."""

    async def said() -> None:
        port = viewer.server.get_port()
        subprotocols: Any = [f"viser-v{viser.__version__}"]
        async with connect(f"ws://127.0.0.1:{port}/", subprotocols=subprotocols) as ws:
            await ws.recv()
            for message in ({**CAMERA}, *messages):
                raw = message if isinstance(message, bytes | str) else msgspec.msgpack.encode(message)
                await ws.send(raw)
            await (await ws.ping())
            await asyncio.sleep(0.3)

    asyncio.run(said())


def update(control: Any, **updates: Any) -> dict[str, Any]:
    return {"type": "GuiUpdateMessage", "uuid": control._impl.uuid, "updates": updates}


def test_own_pages_and_programs_are_let_in(viewer):
    port = viewer.server.get_port()
    assert entered(port)
    assert entered(port, origin=f"http://127.0.0.1:{port}")
    assert entered(port, host=f"localhost:{port}", origin=f"http://localhost:{port}")
    assert entered(port, host="localhost:9000", origin="http://localhost:9000"), "a forwarded port"
    for host in (f"localhost:{port}", "127.0.0.1", f"[::1]:{port}", "LOCALHOST"):
        assert status(port, host) == 200


@pytest.mark.parametrize(
    "origin",
    [
        "http://evil.example",
        "null",
        "http://localhost:1",
        "http://127.0.0.1.evil.example",
        "http://localhost@evil.example",
        "file://",
        "chrome-extension://abcdef",
    ],
)
def test_pages_of_others_are_refused(viewer, origin):
    assert not entered(viewer.server.get_port(), origin=origin)


@pytest.mark.parametrize(
    "host", ["rebind.evil.example", "localhost.evil.example:{port}", "", "8.8.8.8", "[::2]", "a b"]
)
def test_other_hosts_are_refused(viewer, host):
    port = viewer.server.get_port()
    assert status(port, host.format(port=port)) == 403


def test_everywhere_is_any_address_and_this_computers_names_but_no_others():
    address = OwnAddress("0.0.0.0")
    for host, known in (("192.168.1.5:8080", True), ("localhost", True), ("rebind.evil.example", False)):
        assert address.knows(websockets.Headers(Host=host)) == known


def test_a_browser_may_steer_but_not_publish(viewer, monkeypatch):
    asked = []
    monkeypatch.setattr(viser.ViserServer, "request_share_url", lambda self, **_: asked.append("share"))
    monkeypatch.setattr(viser.ViserServer, "disconnect_share_url", lambda self: asked.append("unshare"))
    talk(viewer, {"type": "ShareUrlRequest"}, {"type": "ShareUrlDisconnect"}, update(viewer._slider, value=7))
    assert asked == []
    assert viewer.frame == 7


def test_garbage_is_passed_over_and_playing_goes_on(viewer, capfd):
    slider, speed, loop = viewer._slider, viewer._speed, viewer._loop
    nested: Any = []
    for _ in range(900):
        nested = [nested]
    wrong = [
        b"",
        b"\xc1",
        b"\x93" * 3000,
        "text",
        *(1, None, [], {}, {"type": 3}, {"type": "Message"}, {"type": "NoSuchMessage"}, {"type": nested}),
        *({"type": kind} for kind in ("GuiUpdateMessage", "ViewerCameraMessage", "GuiFormDirtyMessage")),
        *(update(slider, **{name: True}) for name in ("removed", "uuid", "update_cb", "nothing")),
        *(update(slider, uuid="zzz") | {"extra": 1}, {"type": "GuiUpdateMessage", "uuid": [], "updates": {}}),
        *(update(slider, value=value) for value in ("x", None, [], -1, 1e9, float("nan"), float("inf"), True, nested)),
        *(update(speed, value=value) for value in ("hax", "", 4, ["1x"], "1x\0")),
        *(update(loop, value=value) for value in ("no", 0, None)),
        update(viewer._time, value="now"),
        *({**CAMERA, name: value} for name in CAMERA if name != "type" for value in ("x", None, [1], float("nan"))),
        {**CAMERA, "more": 1},
        {"type": "FileTransferStartUpload", "source_component_uuid": slider._impl.uuid, "transfer_uuid": "a"},
        {"type": "GuiSetPanelPositionMessage", "uuid": "a"},
        {"type": "RemoveSceneNodeMessage", "name": "/p"},
    ]
    viewer._loop.value = True
    viewer.play(speed=1.0)
    talk(viewer, *wrong)
    before, deadline = viewer.frame, time.monotonic() + 5
    while viewer.frame == before and time.monotonic() < deadline:
        time.sleep(0.02)
    assert viewer.frame != before
    assert (speed.value, loop.value) == ("1x", True)
    talk(viewer, update(speed, value="2x"), update(loop, value=False))
    assert (speed.value, loop.value) == ("2x", False)
    loop.value = True
    viewer.pause()
    said = capfd.readouterr()
    assert (said.out, said.err) == ("", "")


def test_an_error_while_playing_pauses_and_play_works_again(viewer, monkeypatch, capsys):
    with monkeypatch.context() as patched:
        patched.setattr(viewer, "_draw", lambda frame: 1 / 0)
        viewer.play()
        deadline = time.monotonic() + 5
        while viewer._playback is not None and time.monotonic() < deadline:
            time.sleep(0.02)
    assert capsys.readouterr().err.count("\n") == 1
    before = viewer.frame
    viewer.play()
    deadline = time.monotonic() + 5
    while viewer.frame == before and time.monotonic() < deadline:
        time.sleep(0.02)
    assert viewer.frame != before
    viewer.pause()
