"""The twin's state as JSON, for robots' bridges, game engines and whoever else follows it (`docs/live.md`)."""

import json

import numpy as np
from jaxtyping import Float

from envs.live.service.snapshot import Snapshot
from mjx_hand.hand.joints import HINGES

SCHEMA = "mjx-hand/live-state/1"


def state_message(snapshot: Snapshot, name: str, side: str) -> str:
    """One line of JSON.

    Args:
        snapshot: the twin.
        name: of the object.
        side: of the hand.
    """
    state = {
        "schema": SCHEMA,
        "number": snapshot.number,
        "time": round(snapshot.time, 6),
        "side": side,
        "tracked": snapshot.tracked,
        "wrist": _pose(snapshot.poses[0]),
        "angles": {hinge: round(float(angle), 5) for hinge, angle in zip(HINGES, snapshot.angles, strict=True)},
        "objects": [{"name": name, **_pose(snapshot.poses[-1])}],
        "contacts": [
            {"link": touch.link, "object": name, "position": _rounded(touch.position), "force": _rounded(touch.force)}
            for touch in snapshot.touches
        ],
    }
    return json.dumps(state)


def _pose(row: Float[np.ndarray, "7"]) -> dict[str, list[float]]:
    return {"position": _rounded(row[:3]), "quaternion": _rounded(row[3:])}


def _rounded(values: Float[np.ndarray, "n"]) -> list[float]:
    return [round(float(value), 6) for value in values]
