"""`Task`: the numbers that define the tracking problem: actions, rewards, resets, termination."""

import dataclasses
import math

import jax.numpy as jnp
from jaxtyping import Array, Float

from mjx_hand.errors import InputError

_STIFFEST = 600.0  # 1/s^2: a control step of 20 ms follows no stiffer spring


@dataclasses.dataclass(frozen=True)
class Task:
    """How a twin tracks a demonstration. Metres, radians, seconds.

    Attributes:
        substeps: physics steps (4 ms) a control step.
        wrist_move, wrist_turn, finger: how far a residual of 1 moves the wrist's slides, its turns and the hinges.
        smoothing: tau of the residual's filter, residual <- tau residual + (1 - tau) scale action.
        position_sharpness, rotation_sharpness: alpha_p (1/m) and alpha_r (1/rad) of the paper's reward
            exp(-alpha_p |p - p_ref|) + exp(-alpha_r angle) - action_cost |a|^2.
        action_cost: weight of the last term.
        lost_at: an episode ends when the object is this far from its reference.
        lost_at_last: what that distance has shrunk to, linearly, at the end of training; null leaves it.
        assist: stiffness (1/s^2) of a virtual controller that pulls the object along its reference at the beginning of
            training, critically damped, with forces in proportion to mass and inertia; 0 has none.
        assist_until: share of the training over which it fades to nothing, linearly.
        mid_start: share of training episodes that start in the middle of a demonstration, at a state from its own
            assisted replay (reference-state initialisation); the rest start at frame 0.
        grip_force: force (N) with which the reference presses fingers that touch; 0 leaves demonstrations as they are,
            null takes that of each demonstration's grasp type.
        ahead: how many frames ahead the policy sees the reference.
    """

    substeps: int = 5
    wrist_move: float = 0.02
    wrist_turn: float = 0.10
    finger: float = 0.35
    smoothing: float = 0.9
    position_sharpness: float = 30.0
    rotation_sharpness: float = 2.0
    action_cost: float = 0.002
    lost_at: float = 0.08
    lost_at_last: float | None = None
    assist: float = 0.0
    assist_until: float = 0.5
    mid_start: float = 0.7
    grip_force: float | None = None
    ahead: tuple[int, ...] = (1, 4, 12)

    def __post_init__(self):
        positive = ("substeps", "wrist_move", "wrist_turn", "finger", "position_sharpness", "rotation_sharpness")
        for name in (*positive, "lost_at", "lost_at_last", "assist_until"):
            value = getattr(self, name)
            if value is not None and not (math.isfinite(value) and value > 0):
                raise InputError(f"task.{name} is {value}; it must be a positive number")
        for name, low, high in (("smoothing", 0.0, 1.0), ("mid_start", 0.0, 1.0)):
            if not low <= getattr(self, name) <= high:
                raise InputError(f"task.{name} is {getattr(self, name)}; it must lie between {low:g} and {high:g}")
        if self.smoothing == 1.0:
            raise InputError("task.smoothing is 1, which would ignore every action; give less, such as 0.9")
        if not 0 <= self.assist <= _STIFFEST:
            raise InputError(
                f"task.assist is {self.assist}; it must lie between 0 and {_STIFFEST:g}, more shakes the object"
            )
        for name, value in (("action_cost", self.action_cost), ("grip_force", self.grip_force or 0.0)):
            if not value >= 0:
                raise InputError(f"task.{name} is {value}; it must not be negative")
        if not self.ahead or any(k < 1 for k in self.ahead):
            raise InputError(
                f"task.ahead is {self.ahead}; it must list frames ahead, each at least 1, such as [1,4,12]"
            )

    def lost_distance(self, progress: Float[Array, ""]) -> Float[Array, ""]:
        """How far (m) from its reference the object may be at this share of the training."""
        last = self.lost_at if self.lost_at_last is None else self.lost_at_last
        return self.lost_at + (last - self.lost_at) * progress

    def assist_stiffness(self, progress: Float[Array, ""]) -> Float[Array, ""]:
        """Stiffness (1/s^2) of the virtual object controller at this share of the training."""
        return self.assist * jnp.clip(1 - progress / self.assist_until, 0.0, 1.0)
