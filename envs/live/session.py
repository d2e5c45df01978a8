"""`serving`: a source's hand, its twin, and the server that shows it, together while a block runs."""

import contextlib
import ssl
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from envs.live.flow.timing import Timing
from envs.live.pipeline import Pipeline
from envs.live.service.feed import Feed
from envs.live.service.server import Server
from envs.live.sources.mailbox import Mailbox
from envs.live.sources.recorded import Recorded
from envs.live.sources.source import Source
from envs.live.twin.tabletop import Tabletop
from envs.live.twin.tracker import Tracker
from envs.live.twin.world import OFF, Assist


class Session(NamedTuple):
    """What runs.

    Attributes:
        pipeline: from the source to the twin; `wait` for its end.
        server: says its port.
        timing: of all of it.
    """

    pipeline: Pipeline
    server: Server
    timing: Timing


@contextlib.contextmanager
def serving(
    source: Source,
    table: Tabletop,
    side: str,
    token: str,
    *,
    host: str = "127.0.0.1",
    port: int = 0,
    publish: tuple[tuple[str, int], ...] = (),
    secure: ssl.SSLContext | None = None,
    folder: Path = Path("outputs/live"),
    assist: Assist = OFF,
) -> Iterator[Session]:
    """Compile, serve, and run, until the end of the block.

    Args:
        source: of the hand.
        table: the object.
        side: of the hand.
        token: that addresses have to have.
        host, port: to listen at; port 0 chooses a free one.
        publish: addresses to which the twin's state goes by UDP.
        secure: for HTTPS.
        folder: for recordings.
        assist: see `World`.

    Raises:
        InputError: the port is taken.
    """
    timing, feed = Timing(), Feed()
    hand = source.hand if isinstance(source, Recorded) else None
    tracker = Tracker(side, source.up, source.forward, hand, timing.say)
    pipeline = Pipeline(source, tracker, table, side, folder, timing, feed, assist)
    receive = source.receive if isinstance(source, Mailbox) else None
    server = Server(host, port, token, feed, pipeline, timing, receive, publish, secure)
    server.start()
    try:
        pipeline.start()
        yield Session(pipeline, server, timing)
    finally:
        pipeline.stop()
        server.stop()
