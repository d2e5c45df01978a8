"""Gains of the hand's position-controlled joints: human-like stiffness and force limits."""

import dataclasses
from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from mjx_hand.errors import InputError
from mjx_hand.hand.joints import FINGERS

# N m/rad and N m for (abduction, base flexion, middle hinge, last hinge).
# Simulated grasps of five types hold with them.
_FINGER_STIFFNESS, _THUMB_STIFFNESS = (1.5, 2.0, 1.2, 0.7), (2.5, 2.5, 1.5, 1.0)
_FINGER_LIMIT, _THUMB_LIMIT = (1.2, 1.2, 0.63, 0.27), (1.2, 1.2, 0.6, 0.3)


def _by_finger(finger: tuple[float, ...], thumb: tuple[float, ...]) -> Float[np.ndarray, "20"]:
    return np.concatenate([thumb if name == "thumb" else finger for name in FINGERS])


@dataclasses.dataclass(frozen=True)
class Gains:
    """Position control of a hand's actuated joints and of the wrist's six; the default is that of the human hand.

    Attributes:
        stiffness: kp (N m/rad) of each joint; of the human hand in the order of `HINGES`.
        force_limit: largest torque (N m).
        damping_ratio: kv = damping_ratio * sqrt(kp) (N m s/rad), one number or one a joint.
        armature: reflected inertia (kg m^2); it also keeps light fingers stable at 4 ms steps.
        max_velocity: joint speed (rad/s) that the URDF states.
        wrist_slide: kp (N/m), kv (N s/m) of the wrist's three slides.
        wrist_turn: kp (N m/rad), kv (N m s/rad) of the wrist's three hinges.
        wrist_armature: inertia (kg m^2) that the forearm adds to each of them; without it a heavy handle in the fist
            buzzes at 4 ms steps.
    """

    stiffness: Float[np.ndarray, "j"] = dataclasses.field(
        default_factory=lambda: _by_finger(_FINGER_STIFFNESS, _THUMB_STIFFNESS)
    )
    force_limit: Float[np.ndarray, "j"] = dataclasses.field(
        default_factory=lambda: _by_finger(_FINGER_LIMIT, _THUMB_LIMIT)
    )
    damping_ratio: float | Float[np.ndarray, "j"] = 0.02
    armature: float = 2e-4
    max_velocity: float = 20.0
    wrist_slide: tuple[float, float] = (8000.0, 180.0)
    wrist_turn: tuple[float, float] = (150.0, 3.0)
    wrist_armature: float = 0.005

    def __post_init__(self):
        stiffness, limit = np.shape(self.stiffness), np.shape(self.force_limit)
        if len(stiffness) != 1 or stiffness != limit:
            raise InputError(
                f"gains: stiffness has shape {stiffness}, force_limit {limit}; give each one value a joint"
            )

    def check_for(self, joints: Sequence[str]) -> None:
        """Raise InputError unless there is one value for each of these joints."""
        if len(self.stiffness) != len(joints):
            raise InputError(f"gains are of {len(self.stiffness)} joints, the hand has {len(joints)} that are actuated")

    @property
    def damping(self) -> Float[np.ndarray, "j"]:
        return self.damping_ratio * np.sqrt(self.stiffness)
