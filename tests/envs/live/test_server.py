"""The service: who may look and drive, newest wins, and the twin's state for others."""

import asyncio
import contextlib
import http.client
import json
import socket
import threading
import time
from collections.abc import Iterator

import numpy as np
import pytest
import websockets
from websockets.asyncio.client import connect
from websockets.sync.client import connect as connect_now

from envs.live.flow.timing import Timing
from envs.live.service.feed import Feed
from envs.live.service.pictures import WINDOW
from envs.live.service.server import Server
from envs.live.twin.contacts import Touch
from mjx_hand.errors import InputError
from mjx_hand.hand.joints import HINGES
from tests.envs.live.fakes import FakeLive, snapshot

TOKEN = "0123456789abcdef"
GARBAGE = (
    "",
    "{",
    "[1]",
    '{"wish": "rm"}',
    '{"drawn": "x"}',
    '{"wish": ["reset"]}',
    b"\x00\xff",
    "[" * 190,
    "x" * 60_000,
)
SCENE = json.dumps({"moving": [], "still": []})


class Served:
    """A server with its surroundings."""

    def __init__(self, driven: bool = True, publish: tuple[tuple[str, int], ...] = ()):
        self.feed, self.live, self.timing = Feed(), FakeLive(), Timing()
        self.feed.scene = SCENE
        self.heard: list[bytes | str] = []
        receive = self.heard.append if driven else None
        self.server = Server("127.0.0.1", 0, TOKEN, self.feed, self.live, self.timing, receive, publish)
        self.server.start()
        self.port = self.server.port

    def url(self, path: str, token: str = TOKEN) -> str:
        return f"ws://127.0.0.1:{self.port}{path}?token={token}"


@pytest.fixture
def served() -> Iterator[Served]:
    made = Served()
    yield made
    made.server.stop()


def get(port: int, path: str, host: str | None = None) -> tuple[int, bytes]:
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=10)
    connection.putrequest("GET", path, skip_host=True)
    connection.putheader("Host", host or f"127.0.0.1:{port}")
    connection.endheaders()
    answer = connection.getresponse()
    found = answer.status, answer.read()
    connection.close()
    return found


def status(url: str, origin: str | None = None) -> int:
    """With what a websocket is refused, 101 where it is let in."""
    try:
        with connect_now(url, origin=origin):  # type: ignore[arg-type]
            return 101
    except websockets.InvalidStatus as refusal:
        return refusal.response.status_code


def until(true, seconds: float = 10.0) -> None:
    deadline = time.monotonic() + seconds
    while not true():
        assert time.monotonic() < deadline
        time.sleep(0.01)


def test_only_the_address_with_its_token_opens(served):
    code, page = get(served.port, f"/?token={TOKEN}")
    assert code == 200
    assert b"live.js" in page
    assert get(served.port, "/live.js")[0] == 200  # the same for everybody
    for path in (
        "/",
        "/?token=",
        "/?token=no",
        f"/?token={TOKEN}0",
        "/live.html",
        "/view",
        "/../pyproject.toml",
        "/[?token=x",
    ):
        assert get(served.port, path)[0] in (400, 403)
    assert get(served.port, f"/passwords?token={TOKEN}")[0] == 404
    assert get(served.port, f"/?token={TOKEN}", host="evil.example")[0] == 403


def test_pages_of_others_and_strangers_do_not_get_in(served):
    for path in ("/view", "/state", "/hand"):
        assert status(served.url(path)) == 101
        assert status(served.url(path), f"http://127.0.0.1:{served.port}") == 101
        assert status(served.url(path), "https://evil.example") == 403
        assert status(served.url(path), f"http://127.0.0.1:{served.port + 1}") == 403
        assert status(served.url(path, "no")) == 403
    assert any("refused" in notice for notice in served.timing.report()["notices"])


def test_a_page_gets_the_scene_and_poses_and_wishes(served):
    with connect_now(served.url("/view")) as ws:
        served.feed.publish(snapshot(1, arrived=time.monotonic() - 0.02))
        told, poses = [], None
        while poses is None or len(told) < 2:
            message = ws.recv(timeout=10)
            if isinstance(message, str):
                told.append(json.loads(message))
            else:
                poses = message
        assert any("moving" in each for each in told)
        assert any("panel" in each for each in told)
        assert np.frombuffer(poses[:8], np.uint32).tolist() == [1, 1]
        rows = np.frombuffer(poses[8:], np.float32).reshape(17, 7)
        np.testing.assert_allclose(rows[:, 0], 0.01 * np.arange(17), rtol=1e-6)
        ws.send(json.dumps({"drawn": 1}))
        ws.send(json.dumps({"wish": "reset"}))
        ws.send(json.dumps({"wish": "record"}))
        until(lambda: served.live.wishes == ["reset", "record"])
    picture = served.timing.stages["picture"]
    assert picture.count == 1
    assert 0.02 <= picture.largest < 5
    assert served.timing.stages["wire"].largest >= 0.02


@pytest.mark.parametrize(
    "message",
    ["", "{", "[1]", '{"wish": "rm"}', '{"drawn": "x"}', '{"wish": ["reset"]}', b"\x00\xff", "[" * 190, "x" * 60_000],
)
def test_garbage_of_a_page_is_refused_and_ends_nothing(served, message):
    with connect_now(served.url("/view")) as ws:
        ws.send(message)
        ws.send(json.dumps({"wish": "reset"}))
        until(lambda: served.live.wishes == ["reset"])
    assert served.timing.counts["refused"] == 1


def test_a_message_too_long_ends_its_connection_alone(served):
    with connect_now(served.url("/hand")) as ws, contextlib.suppress(websockets.ConnectionClosed):
        ws.send("x" * 100_000)
        ws.recv(timeout=10)
    until(lambda: status(served.url("/hand")) == 101)
    assert served.heard == []


def test_a_page_that_draws_nothing_is_sent_no_more_than_it_may_be_late_by(served):
    numbers = []
    with connect_now(served.url("/view")) as ws:
        for k in range(1, 61):
            served.feed.publish(snapshot(k))
            time.sleep(0.005)
        while len(numbers) < WINDOW:
            if isinstance(message := ws.recv(timeout=10), bytes):
                numbers.append(int(np.frombuffer(message[:4], np.uint32)[0]))
        ws.send(json.dumps({"drawn": numbers[-1]}))
        while not isinstance(message := ws.recv(timeout=10), bytes):
            pass
        assert int(np.frombuffer(message[:4], np.uint32)[0]) == 60  # the newest, and none between
    assert numbers[-1] < 30
    assert served.timing.counts["pictures_dropped"] > 20


def test_publishing_never_waits_for_a_slow_reader(served):
    with connect_now(served.url("/view")), connect_now(served.url("/state")):
        made = [snapshot(k) for k in range(1, 3000)]
        took = []
        for each in made:
            began = time.perf_counter()
            served.feed.publish(each)
            took.append(time.perf_counter() - began)
        assert np.median(took) < 1e-3


def test_one_drives_and_a_second_is_refused_until_the_first_goes(served):
    with connect_now(served.url("/hand")) as first:
        for k in range(200):  # all at once
            first.send(f"message {k}")
        with connect_now(served.url("/hand")) as second, pytest.raises(websockets.ConnectionClosed) as closed:
            second.recv(timeout=10)
        assert closed.value.rcvd is not None
        assert (closed.value.rcvd.code, closed.value.rcvd.reason) == (4409, "another drives already")
        until(lambda: len(served.heard) == 200)
    until(lambda: drives(served))
    assert any("a driver was refused" in notice for notice in served.timing.report()["notices"])


def drives(served: Served) -> bool:
    with connect_now(served.url("/hand")) as ws:
        ws.send("hello")
        with contextlib.suppress(websockets.ConnectionClosed, TimeoutError):
            ws.recv(timeout=0.2)
    return "hello" in served.heard


def test_nobody_drives_where_the_hand_comes_from_elsewhere():
    made = Served(driven=False)
    with connect_now(made.url("/hand")) as ws, pytest.raises(websockets.ConnectionClosed, match="another source"):
        ws.recv(timeout=10)
    made.server.stop()


def check_state(state: dict) -> None:
    assert state["schema"] == "mjx-hand/live-state/1"
    assert list(state["angles"]) == list(HINGES)
    assert state["angles"][HINGES[-1]] == 1.0
    assert state["wrist"] == {"position": [0.0, 0.0, 0.0], "quaternion": [1.0, 0.0, 0.0, 0.0]}
    assert state["objects"][0]["position"] == [0.16, 0.0, 0.0]
    assert state["contacts"] == [
        {"link": "thumb3", "object": "cube", "position": [0.1, 0.2, 0.3], "force": [0.0, 0.0, 1.5]}
    ]


TOUCH = Touch("thumb3", np.array([0.1, 0.2, 0.3]), np.array([0.0, 0.0, 1.5]))


def test_the_state_goes_to_websockets(served):
    with connect_now(served.url("/state")) as ws:
        until(lambda: served.feed.wants_touches)
        served.feed.publish(snapshot(7, (TOUCH,)))
        state = json.loads(ws.recv(timeout=10))
        assert state["number"] == 7
        check_state(state)
    until(lambda: not served.feed.wants_touches)


def test_the_state_goes_to_udp_whether_or_not_anybody_listens():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as listening:
        listening.bind(("127.0.0.1", 0))
        listening.settimeout(10)
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as gone:
            gone.bind(("127.0.0.1", 0))
            deaf = gone.getsockname()
        made = Served(publish=(listening.getsockname(), deaf))
        for k in range(1, 4):
            until(lambda: made.feed.wants_touches)
            made.feed.publish(snapshot(k, (TOUCH,)))
            state = json.loads(listening.recv(65536))
            assert state["number"] == k
            check_state(state)
        made.server.stop()


def test_a_crowd_is_turned_away(served):
    async def crowd() -> list[int | None]:
        async with contextlib.AsyncExitStack() as stack:
            sockets = [await stack.enter_async_context(connect(served.url("/view"))) for _ in range(12)]
            await asyncio.sleep(0.5)
            return [ws.close_code for ws in sockets]

    codes = asyncio.run(crowd())
    assert codes.count(None) == 8
    assert codes.count(4429) == 4


def test_a_busy_port_is_said(served):
    with pytest.raises(InputError, match=f"cannot serve at 127.0.0.1:{served.port}"):
        Server("127.0.0.1", served.port, TOKEN, Feed(), FakeLive(), Timing()).start()


def test_the_server_leaves_no_thread_behind():
    made = Served()
    with connect_now(made.url("/view")):
        made.feed.publish(snapshot(1))
        made.server.stop()
    made.feed.publish(snapshot(2))
    assert not [t for t in threading.enumerate() if t.name == "live server"]
