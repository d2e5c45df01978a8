"""`Task`: the numbers that define the tracking problem: actions, rewards, resets, termination."""

import dataclasses
import math

import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from envs.hand_contacts import check_contacts
from envs.rewards import RewardWeights
from mjx_hand.errors import InputError

_STIFFEST = 600.0  # 1/s^2: a control step of 20 ms follows no stiffer spring


@dataclasses.dataclass(frozen=True)
class Task:
    """How a twin tracks a demonstration. Metres, radians, seconds.

    Attributes:
        substeps: physics steps (4 ms) a control step.
        residual_scale_wrist_position, residual_scale_wrist_rotation, residual_scale_fingers: how far a residual of 1
            moves the wrist's slides, its turns and a human hand's hinges; those of stiffer hands less (`Body.reach`).
        smoothing: tau of the residual's filter, residual <- tau residual + (1 - tau) scale action.
        rewards: weights of the reward's terms (`envs.rewards`).
        reward_position_alpha, reward_rotation_alpha: alpha_p (1/m) and alpha_r (1/rad) of the terms
            exp(-alpha_p |p - p_ref|) and exp(-alpha_r angle).
        termination_distance: an episode ends when the object is this far from its reference.
        termination_distance_last: what that distance has shrunk to, linearly, at the end of training; null leaves it.
        termination_angle: an episode also ends when the object is turned by this from its reference; null never.
        assist: stiffness (1/s^2) of a virtual controller that pulls the object along its reference at the beginning of
            training, critically damped, with forces in proportion to mass and inertia; 0 has none.
        assist_until: share of the training over which it fades to nothing, linearly.
        random_start_prob: share of training episodes that start in the middle of a demonstration, at a state from its
            own assisted replay (reference-state initialisation); the rest start at frame 0.
        grip_force: force (N) with which the reference presses fingers that touch; 0 leaves demonstrations as they are,
            null takes that of each demonstration's grasp type and of the hand (`envs.grip_table.default_grip_force`).
        wrap_torque: share of its torque limit with which each flexing joint closes where the reference's hand is around
            an object, three fingers touching it with two phalanges each; with 0, or a grip_force of 0, it does not.
        lookahead: how many frames ahead the policy sees the reference.
        follow_object: whether the wrist's path goes to where the object is seen to stand, and back to the demonstrated
            one once it is held (`mjx_hand.player.approach`).
        contacts: what the hand meets: "object" for nothing else, or also table and support ("ground"), its own links
            ("self"), or "all".
        observe_forces: whether the policy sees what each link presses the object with, as a tactile skin does.
        observe_properties: whether the policy sees the object's mass and friction, which no camera does.
        live: whether a person teleoperates the hand as it happens: what a tracker says (`data.streamed`) is commanded,
            without the controllers' lead and without a press, the policy moves the joints alone, not the wrist, and
            sees nothing of where the demonstration takes hand and object. Episodes that start in the middle start with
            the residual that presses.
    """

    substeps: int = 5
    residual_scale_wrist_position: float = 0.02
    residual_scale_wrist_rotation: float = 0.20
    residual_scale_fingers: float = 0.7  # as strong as joints are: heavy objects slip out of less
    smoothing: float = 0.9
    rewards: RewardWeights = dataclasses.field(default_factory=RewardWeights)
    reward_position_alpha: float = 30.0
    reward_rotation_alpha: float = 2.0
    termination_distance: float = 0.08
    termination_distance_last: float | None = None
    termination_angle: float | None = None
    assist: float = 0.0
    assist_until: float = 0.5
    random_start_prob: float = 0.7
    grip_force: float | None = None
    wrap_torque: float = 0.5
    lookahead: tuple[int, ...] = (1, 4, 12)
    follow_object: bool = True
    contacts: str = "all"
    observe_forces: bool = False
    observe_properties: bool = False
    live: bool = False

    def __post_init__(self):
        positive = (
            "substeps",
            "residual_scale_wrist_position",
            "residual_scale_wrist_rotation",
            "residual_scale_fingers",
            "reward_position_alpha",
            "reward_rotation_alpha",
        )
        ends = ("termination_distance", "termination_distance_last", "termination_angle")
        for name in (*positive, *ends, "assist_until"):
            value = getattr(self, name)
            if value is not None and not (math.isfinite(value) and value > 0):
                raise InputError(f"task.{name} is {value}; it must be a positive number")
        for name, low, high in (("smoothing", 0.0, 1.0), ("random_start_prob", 0.0, 1.0), ("wrap_torque", 0.0, 1.0)):
            if not low <= getattr(self, name) <= high:
                raise InputError(f"task.{name} is {getattr(self, name)}; it must lie between {low:g} and {high:g}")
        if self.smoothing == 1.0:
            raise InputError("task.smoothing is 1, which would ignore every action; give less, such as 0.9")
        if not 0 <= self.assist <= _STIFFEST:
            raise InputError(
                f"task.assist is {self.assist}; it must lie between 0 and {_STIFFEST:g}, more shakes the object"
            )
        if self.grip_force is not None and not self.grip_force >= 0:
            raise InputError(f"task.grip_force is {self.grip_force}; it must not be negative")
        check_contacts(self.contacts)
        if not self.lookahead or any(k < 1 for k in self.lookahead):
            raise InputError(
                f"task.lookahead is {self.lookahead}; it must list frames ahead, each at least 1, such as [1,4,12]"
            )

    def lost_distance(self, progress: Float[Array, ""]) -> Float[Array, ""]:
        """How far (m) from its reference the object may be at this share of the training."""
        last = self.termination_distance if self.termination_distance_last is None else self.termination_distance_last
        return self.termination_distance + (last - self.termination_distance) * progress

    def lost(
        self, position: Float[Array, ""], rotation: Float[Array, ""], progress: Float[Array, ""]
    ) -> Bool[Array, ""]:
        """Whether an object so far (m) and so turned (rad) from its reference ends the episode."""
        far = position > self.lost_distance(progress)
        return far if self.termination_angle is None else far | (rotation > self.termination_angle)

    def assist_stiffness(self, progress: Float[Array, ""]) -> Float[Array, ""]:
        """Stiffness (1/s^2) of the virtual object controller at this share of the training."""
        return self.assist * jnp.clip(1 - progress / self.assist_until, 0.0, 1.0)


def check_rate(fps: float, step: float) -> None:
    """Raises InputError for demonstrations whose frames are not one control step (s) each."""
    if abs(fps * step - 1) > 1e-3:
        raise InputError(
            f"demonstrations at {fps:g} frames/s do not fit control steps of {step * 1000:g} ms; "
            f"resample them to {1 / step:g} frames/s"
        )
