"""`Pipeline`: source, tracking and physics, each in a thread of its own, the newest handed from one to the next."""

import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from envs.live.flow.arrival import Arrival
from envs.live.flow.newest import Newest
from envs.live.flow.timing import Timing
from envs.live.flow.urgency import hurry
from envs.live.service.feed import Feed
from envs.live.service.snapshot import Snapshot
from envs.live.service.state import state_message
from envs.live.simulation import Simulation, Target
from envs.live.sources.messages import Messages
from envs.live.sources.source import Source
from envs.live.twin.tabletop import Tabletop
from envs.live.twin.tracker import Tracker
from envs.live.twin.world import OFF, Assist
from mjx_hand.errors import InputError

_LOST = 0.25  # s without a frame after which the hand is not seen
_SWITCH = 5e-4  # s that a thread may keep others from running Python: ten times that is usual, a physics step and more


class Pipeline:
    """What runs between a source and the feed.

    Args:
        source: of frames.
        tracker: of the hand.
        table: the object.
        side: of the hand.
        folder: for recordings.
        timing: told of all that takes time.
        feed: where the twin goes.
        assist: see `World`.
    """

    def __init__(
        self,
        source: Source,
        tracker: Tracker,
        table: Tabletop,
        side: str,
        folder: Path,
        timing: Timing,
        feed: Feed,
        assist: Assist = OFF,
    ):
        self._source, self._tracker, self._table, self._side = source, tracker, table, side
        self._timing = timing
        self._simulation = Simulation(table, side, folder, timing, feed, assist)
        self._messages = Messages(side)
        self._arrivals: Newest[Arrival] = Newest()
        self._targets: Newest[Target] = Newest()
        self._stop = threading.Event()
        self._ended = threading.Event()  # the source has no more; what it gave last may not have been tracked yet
        self._state = "no hand has been seen yet"
        self._over = threading.Event()
        self._failure: Exception | None = None

    def start(self) -> None:
        """Begin; with Python's threads taking turns often enough for physics steps of 4 ms."""
        sys.setswitchinterval(_SWITCH)
        self._timing.begin()
        for name, work in (("physics", self._physics), ("tracking", self._tracking), ("source", self._frames)):
            threading.Thread(target=self._guarded, args=(work,), daemon=True, name=f"live {name}").start()

    def wait(self, seconds: float | None) -> None:
        """Return when the source's last frame has been tracked, when all is stopped, or after that time (s).

        Raises:
            InputError: the source could not be used.
        """
        self._over.wait(seconds)
        if self._failure is not None:
            raise self._failure

    def stop(self) -> None:
        """End all threads."""
        self._stop.set()
        self._over.set()

    def wish(self, what: str) -> None:
        """Somebody wants "reset" or "record"; done at the next physics step."""
        self._simulation.wish(what)

    def status(self) -> dict[str, Any]:
        """What the panel says."""
        return {
            "source": self._source.name,
            "state": self._state,
            "recording": self._simulation.recording,
            "notice": self._timing.notice,
            **self._timing.report(),
        }

    def state(self, snapshot: Snapshot) -> str:
        """A snapshot as JSON."""
        return state_message(snapshot, self._table.name, self._side)

    def _guarded(self, work: Callable[[], None]) -> None:
        """What fails in a thread is for whoever waits."""
        hurry()
        try:
            work()
        except Exception as error:
            self._failure = error
            self._over.set()

    def _physics(self) -> None:
        self._simulation.run(self._targets, self._tracker, self._stop)

    def _frames(self) -> None:
        self._source.run(self._arrivals.put, self._stop, self._timing)
        self._ended.set()

    def _tracking(self) -> None:
        heard = 0.0
        while not self._stop.is_set():
            ended = self._ended.is_set()  # asked before what is left is taken: a last frame may come in between
            arrival = self._arrivals.take(0.05)
            now = time.monotonic()
            self._timing.counts["replaced"] = self._arrivals.replaced + self._targets.replaced
            if arrival is None:
                if ended:
                    self._over.set()
                if now - heard > _LOST and self._tracker.hand is not None:
                    self._state = "no frames come"
                    self._targets.put(Target(None, now, now))
                continue
            heard = now
            self._timing.count("frames")
            keypoints = self._keypoints(arrival, now)
            if keypoints is not None:
                self._follow(keypoints, arrival)

    def _keypoints(self, arrival: Arrival, now: float) -> np.ndarray | None:
        """Of a frame; None where it says nothing."""
        self._timing.add("source", now - arrival.at - arrival.spent)
        found = arrival.content
        if isinstance(found, bytes | str):
            jumped = self._messages.jumped
            try:
                found = self._messages.keypoints(found)
            except InputError as error:
                self._timing.count("refused")
                self._timing.say(str(error))
                return None
            if self._messages.jumped > jumped:
                self._timing.say("the sender's clock jumped")
        self._timing.add("tracking", arrival.spent + time.monotonic() - now)
        return found

    def _follow(self, keypoints: np.ndarray, arrival: Arrival) -> None:
        known, start = self._tracker.hand is not None, time.monotonic()
        pose = self._tracker.pose(keypoints, arrival.at)
        ready = time.monotonic()
        if self._tracker.hand is None:
            self._state = f"measuring the hand: {100 * self._tracker.known:.0f} %; keep it open and in view"
            return
        if known:  # the first frame waited for the hand to be built
            self._timing.add("retargeting", ready - start)
        self._state = "following the hand" if pose is not None else "the hand is not seen"
        if pose is None:
            self._timing.count("lost")
        self._targets.put(Target(pose, arrival.at, ready, arrival.again))
