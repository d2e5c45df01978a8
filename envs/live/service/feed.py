"""`Feed`: snapshots from the thread of the physics to those who send them, who each take the newest when they can."""

import asyncio

from envs.live.service.snapshot import Snapshot


class Feed:
    """The newest snapshot, and the scene that it moves; publishing never waits.

    Attributes:
        latest: the newest snapshot.
        scene: what a page needs once, before poses: see `scene_message`.
        wants_touches: whether anybody is told of contacts.
    """

    def __init__(self) -> None:
        self.latest: Snapshot | None = None
        self.scene: str | None = None
        self.wants_touches = False
        self._loop: asyncio.AbstractEventLoop | None = None
        self._waiting: set[asyncio.Event] = set()
        self._waking = False

    def attach(self) -> None:
        """Wake those who wait in the running event loop from now on."""
        self._loop = asyncio.get_running_loop()

    def detach(self) -> None:
        """Wake nobody any more: the loop is about to end."""
        self._loop = None

    def publish(self, snapshot: Snapshot) -> None:
        """There is a new one; called by the physics."""
        self.latest = snapshot
        loop = self._loop
        if loop is not None and not self._waking:
            self._waking = True
            try:
                loop.call_soon_threadsafe(self._wake)
            except RuntimeError:  # it has ended since
                self._loop = None

    async def newer(self, than: int) -> Snapshot:
        """The newest snapshot, once there is one beyond that number."""
        event = asyncio.Event()
        self._waiting.add(event)
        try:
            while self.latest is None or self.latest.number <= than:
                event.clear()
                await event.wait()
            return self.latest
        finally:
            self._waiting.discard(event)

    def _wake(self) -> None:
        self._waking = False
        for event in self._waiting:
            event.set()
