"""`Task`: the numbers that define the tracking problem: actions, rewards, resets, termination."""

import dataclasses
import math

from mjx_hand.errors import InputError


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
        lost_at: a rollout ends when the object is this far from its reference.
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
    mid_start: float = 0.7
    grip_force: float | None = None
    ahead: tuple[int, ...] = (1, 4, 12)

    def __post_init__(self):
        positive = ("substeps", "wrist_move", "wrist_turn", "finger", "position_sharpness", "rotation_sharpness")
        for name in (*positive, "lost_at"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0):
                raise InputError(f"task.{name} is {value}; it must be a positive number")
        for name, low, high in (("smoothing", 0.0, 1.0), ("mid_start", 0.0, 1.0)):
            if not low <= getattr(self, name) <= high:
                raise InputError(f"task.{name} is {getattr(self, name)}; it must lie between {low:g} and {high:g}")
        if self.smoothing == 1.0:
            raise InputError("task.smoothing is 1, which would ignore every action; give less, such as 0.9")
        for name, value in (("action_cost", self.action_cost), ("grip_force", self.grip_force or 0.0)):
            if not value >= 0:
                raise InputError(f"task.{name} is {value}; it must not be negative")
        if not self.ahead or any(k < 1 for k in self.ahead):
            raise InputError(
                f"task.ahead is {self.ahead}; it must list frames ahead, each at least 1, such as [1,4,12]"
            )
