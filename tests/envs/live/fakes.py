"""Snapshots without physics, and what the server asks of a pipeline."""

import time
from typing import Any

import numpy as np

from envs.live.service.snapshot import Snapshot
from envs.live.service.state import state_message
from envs.live.twin.contacts import Touch


def snapshot(number: int, touches: tuple[Touch, ...] = (), arrived: float | None = None) -> Snapshot:
    poses = np.zeros((17, 7))
    poses[:, 0], poses[:, 3] = 0.01 * np.arange(17), 1.0
    return Snapshot(
        number=number,
        time=0.004 * number,
        poses=poses,
        angles=np.linspace(0, 1, 20),
        touches=touches,
        tracked=True,
        stepped=time.monotonic(),
        arrived=arrived,
    )


class FakeLive:
    """Remembers what visitors wish."""

    def __init__(self) -> None:
        self.wishes: list[str] = []

    def wish(self, what: str) -> None:
        self.wishes.append(what)

    def status(self) -> dict[str, Any]:
        return {"source": "a test", "state": "testing"}

    def state(self, snapshot: Snapshot) -> str:
        return state_message(snapshot, "cube", "right")
