"""The script of a grasp: how targets for wrist and fingers move, phase by phase, along minimum-jerk profiles."""

import dataclasses

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation, Slerp


def minimum_jerk(s: Float[np.ndarray, "t"]) -> Float[np.ndarray, "t"]:
    """How far a hand is after a share s of a movement's time: 0 before, 1 after (Flash and Hogan 1985)."""
    s = np.clip(s, 0.0, 1.0)
    return s**3 * (10 - 15 * s + 6 * s**2)


@dataclasses.dataclass(frozen=True)
class Tempo:
    """Durations (s) of the phases of a grasp."""

    rest: float = 0.1
    approach: float = 0.8
    close: float = 0.8
    squeeze: float = 0.35
    lift: float = 1.0
    carry: float = 0.9
    turn: float = 0.9
    hold: float = 0.8

    @property
    def duration(self) -> float:
        return sum(dataclasses.astuple(self))

    def end(self, phase: str) -> float:
        """When `phase` ends (s)."""
        names = [field.name for field in dataclasses.fields(self)]
        return sum(dataclasses.astuple(self)[: names.index(phase) + 1])

    def progress(self, phase: str, time: Float[np.ndarray, "t"]) -> Float[np.ndarray, "t"]:
        """0 before the phase, 1 after it, minimum jerk in between."""
        length = getattr(self, phase)
        return minimum_jerk((time - self.end(phase) + length) / length)


@dataclasses.dataclass(frozen=True)
class GraspMotion:
    """Where one scripted grasp goes; metres, radians, world frame.

    Attributes:
        open_angles, closed_angles: hinge angles before and at contact.
        squeeze_angles: added after contact, so that the fingers press.
        position, rotation: the wrist at the grasp (world_from_hand).
        approach: where the wrist starts, relative to `position`.
        travel: lift and carry as a vector; its z is lifted first.
        turn: rotation vector of the last turn.
    """

    open_angles: Float[np.ndarray, "j"]
    closed_angles: Float[np.ndarray, "j"]
    squeeze_angles: Float[np.ndarray, "j"]
    position: Float[np.ndarray, "3"]
    rotation: Float[np.ndarray, "3 3"]
    approach: Float[np.ndarray, "3"]
    travel: Float[np.ndarray, "3"]
    turn: Float[np.ndarray, "3"]
    tempo: Tempo


def scripted_targets(
    motion: GraspMotion, time: Float[np.ndarray, "t"]
) -> tuple[Float[np.ndarray, "t j"], Float[np.ndarray, "t 3"], Float[np.ndarray, "t 4"]]:
    """Target hinge angles (rad), wrist positions (m) and quaternions (wxyz) at the given times (s)."""
    stage = {name: motion.tempo.progress(name, time)[:, None] for name in Tempo.__dataclass_fields__}
    angles = (
        motion.open_angles
        + stage["close"] * (motion.closed_angles - motion.open_angles)
        + stage["squeeze"] * motion.squeeze_angles
    )
    sideways = motion.travel * [1.0, 1.0, 0.0]
    position = (
        motion.position
        + (1 - stage["approach"]) * motion.approach
        + stage["lift"] * (motion.travel - sideways)
        + stage["carry"] * sideways
    )
    start = Rotation.from_matrix(motion.rotation)
    turned = Slerp([0.0, 1.0], Rotation.concatenate([start, Rotation.from_rotvec(motion.turn) * start]))
    return angles, position, turned(stage["turn"][:, 0]).as_quat(scalar_first=True)
