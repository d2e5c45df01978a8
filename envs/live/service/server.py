"""`Server`: the page, the poses that it shows, the hand that it streams, and the twin's state, on one port."""

import asyncio
import contextlib
import json
import logging
import ssl
import threading
import time
from collections.abc import AsyncIterator, Callable, Sequence
from typing import Any, Protocol, runtime_checkable

from websockets.asyncio.server import Server as SocketServer
from websockets.asyncio.server import ServerConnection, serve
from websockets.exceptions import ConnectionClosed
from websockets.http11 import Request, Response

from envs.live.flow.timing import Timing
from envs.live.flow.urgency import hurry
from envs.live.service.feed import Feed
from envs.live.service.pictures import Drawn, pose_bytes
from envs.live.service.requests import HAND, STATE, VIEW, Requests, path_of
from envs.live.service.snapshot import Snapshot
from envs.live.sources.messages import LONGEST
from mjx_hand.errors import InputError

_PANEL = 0.5  # s
_MOST = 8  # who may look, or follow, at once
_BUFFER = 2**15  # bytes that wait for a slow reader
_TAKEN, _FULL = 4409, 4429  # codes of websockets that are closed at once


@runtime_checkable
class Driven(Protocol):
    """What the server tells of its visitors' wishes, and asks for the page's panel."""

    def wish(self, what: str) -> None:
        """A visitor wants something: "reset" or "record"."""
        ...

    def status(self) -> dict[str, Any]:
        """What the panel says."""
        ...

    def state(self, snapshot: Snapshot) -> str:
        """A snapshot as JSON."""
        ...


class Server:
    """Serves from a thread of its own, from `start` to `stop`.

    Args:
        host, port: to listen at, port 0 for a free one.
        token: that addresses have to have.
        feed: the snapshots.
        live: what they are of.
        timing: told of what is sent and seen.
        receive: given the messages of the one who drives; None where nobody may.
        publish: addresses to which the state goes by UDP.
        secure: for HTTPS.
    """

    def __init__(
        self,
        host: str,
        port: int,
        token: str,
        feed: Feed,
        live: Driven,
        timing: Timing,
        receive: Callable[[bytes | str], None] | None = None,
        publish: tuple[tuple[str, int], ...] = (),
        secure: ssl.SSLContext | None = None,
    ):
        self._host, self.port, self._secure = host, port, secure
        self._requests = Requests(host, token)
        self._feed, self._live, self._timing = feed, live, timing
        self._receive, self._publish = receive, publish
        self._driver: ServerConnection | None = None
        self._looking = self._following = 0
        self._sent = 0  # the last snapshot whose way to the wire was timed
        self._ended: asyncio.Event | None = None
        self._loop: asyncio.AbstractEventLoop | None = None
        self._started = threading.Event()
        self._failure: InputError | None = None
        self._thread = threading.Thread(target=self._run, daemon=True, name="live server")

    def start(self) -> None:
        """Serve.

        Raises:
            InputError: the port is taken, or an address to publish to is none.
        """
        self._thread.start()
        self._started.wait()
        if self._failure is not None:
            raise self._failure

    def stop(self) -> None:
        """Serve no more."""
        if self._loop is not None and self._ended is not None:
            with contextlib.suppress(RuntimeError):  # it has ended by itself
                self._loop.call_soon_threadsafe(self._ended.set)
        self._thread.join()

    def _run(self) -> None:
        hurry()
        asyncio.run(self._serve())

    async def _serve(self) -> None:
        self._loop, self._ended = asyncio.get_running_loop(), asyncio.Event()
        self._feed.attach()
        followers: list[asyncio.Task[None]] = []
        server: SocketServer | None = None
        try:
            server = await serve(
                self._visit,
                self._host,
                self.port,
                process_request=self._asked,
                ssl=self._secure,
                max_size=LONGEST,
                max_queue=4,
                write_limit=_BUFFER,
                compression=None,
                server_header=None,
                logger=_silent(),
            )
            self.port = next(iter(server.sockets)).getsockname()[1]
            followers += [asyncio.create_task(self._publish_to(address)) for address in self._publish]
            self._started.set()
            await self._ended.wait()
        except OSError as error:
            reason = error.strerror or error
            self._failure = InputError(f"cannot serve at {self._host}:{self.port}: {reason}; choose another --port")
        finally:
            self._feed.detach()
            await _cancel(followers)
            if server is not None:
                server.close()
                await server.wait_closed()
            self._started.set()

    def _asked(self, connection: ServerConnection, request: Request) -> Response | None:
        answer = self._requests.answer(request)
        if answer is not None and answer.status_code == 403:
            self._timing.count("refused")
            self._timing.say("a request was refused: of another address, or without the token")
        return answer

    async def _visit(self, connection: ServerConnection) -> None:
        path = path_of(connection.request)
        with contextlib.suppress(ConnectionClosed):
            if path == HAND:
                await self._be_driven(connection)
            elif self._looking + self._following >= _MOST:
                await connection.close(_FULL, "too many look already")
            elif path == VIEW:
                await self._show(connection)
            elif path == STATE:
                await self._tell_state(connection)

    async def _be_driven(self, connection: ServerConnection) -> None:
        """Take the hand's messages from the first who comes; he keeps the place until he goes."""
        if self._receive is None or self._driver is not None:
            why = "another drives already" if self._receive is not None else "the hand comes from another source"
            self._timing.count("refused")
            self._timing.say(f"a driver was refused: {why}")
            await connection.close(_TAKEN, why)
            return
        self._driver = connection
        try:
            async for message in connection:
                self._receive(message)
        finally:
            self._driver = None

    async def _show(self, connection: ServerConnection) -> None:
        self._looking += 1
        drawn = Drawn(self._timing)
        tasks = [asyncio.create_task(step(connection, drawn)) for step in (self._send_poses, self._listen, self._panel)]
        try:
            done, _ = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
            for task in done:
                task.result()
        finally:
            self._looking -= 1
            await _cancel(tasks)

    async def _send_poses(self, connection: ServerConnection, drawn: Drawn) -> None:
        number, scene = 0, None
        while True:
            await self._feed.newer(number)
            await drawn.room()
            snapshot = self._feed.latest  # newest wins: while there was no room others have gone by
            assert snapshot is not None
            if scene is None and (scene := self._feed.scene) is not None:
                await connection.send(scene)
            if number:
                self._timing.count("pictures_dropped", snapshot.number - number - 1)
            number = snapshot.number
            drawn.sent(snapshot)
            await connection.send(pose_bytes(snapshot))
            self._time_sending(snapshot)

    async def _listen(self, connection: ServerConnection, drawn: Drawn) -> None:
        async for message in connection:
            try:
                told = json.loads(message) if len(message) <= 200 else None
            except (ValueError, RecursionError):
                told = None
            if isinstance(told, dict) and isinstance(told.get("drawn"), int):
                drawn.seen(told["drawn"])
            elif isinstance(told, dict) and told.get("wish") in ("reset", "record"):
                self._live.wish(told["wish"])
            else:
                self._timing.count("refused")
                self._timing.say("a message of the page was refused")

    async def _panel(self, connection: ServerConnection, drawn: Drawn) -> None:
        while True:
            await connection.send(json.dumps({"panel": self._live.status()}))
            await asyncio.sleep(_PANEL)

    async def _tell_state(self, connection: ServerConnection) -> None:
        async def tell() -> None:
            async for snapshot, text in self._states():
                await connection.send(text)
                self._time_sending(snapshot)

        tasks = [asyncio.create_task(tell()), asyncio.create_task(connection.wait_closed())]
        try:
            await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        finally:
            await _cancel(tasks)

    async def _publish_to(self, address: tuple[str, int]) -> None:
        transport, _ = await asyncio.get_running_loop().create_datagram_endpoint(_Deaf, remote_addr=address)
        try:
            async for snapshot, text in self._states():
                transport.sendto(text.encode())
                self._time_sending(snapshot)
        finally:
            transport.close()

    async def _states(self) -> AsyncIterator[tuple[Snapshot, str]]:
        """Each snapshot as JSON, newest wins."""
        self._following += 1
        self._feed.wants_touches = True
        number = 0
        try:
            while True:
                snapshot = await self._feed.newer(number)
                number = snapshot.number
                yield snapshot, self._live.state(snapshot)
        finally:
            self._following -= 1
            self._feed.wants_touches = self._following > 0

    def _time_sending(self, snapshot: Snapshot) -> None:
        """Time a snapshot's way to the first to whom it is sent."""
        if snapshot.number > self._sent:
            self._sent, now = snapshot.number, time.monotonic()
            self._timing.add("sending", now - snapshot.stepped)
            if snapshot.arrived is not None:
                self._timing.add("wire", now - snapshot.arrived)


class _Deaf(asyncio.DatagramProtocol):
    """Whoever the state goes to need not be there."""

    def error_received(self, exc: Exception) -> None:
        """Nobody listens; perhaps later."""


async def _cancel(tasks: Sequence[asyncio.Task[None]]) -> None:
    for task in tasks:
        task.cancel()
    await asyncio.gather(*tasks, return_exceptions=True)


def _silent() -> logging.Logger:
    """websockets prints a stack trace of every stranger who hangs up."""
    logger = logging.getLogger("mjx_hand.live")
    logger.propagate = False
    logger.addHandler(logging.NullHandler())
    return logger
