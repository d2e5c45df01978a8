"""`ObservedState`: what features are worked out from, and `HandNames`: what a hand's numbers are called."""

import dataclasses
from typing import Any

from mjx_hand.hand.joints import FINGERS, HINGES, LINKS, WRIST_SLIDES, WRIST_TURNS

WRIST = (*WRIST_SLIDES, *WRIST_TURNS)


@dataclasses.dataclass(frozen=True)
class HandNames:
    """What a hand's numbers are called, in order: its actuated joints, without the wrist's, its fingers, and its links
    that touch."""

    joints: tuple[str, ...] = HINGES
    fingers: tuple[str, ...] = FINGERS
    links: tuple[str, ...] = LINKS

    @property
    def targets(self) -> tuple[str, ...]:
        """What is commanded: the wrist's slides and turns, then the joints."""
        return (*WRIST, *self.joints)


HUMAN_NAMES = HandNames()
TARGETS = HUMAN_NAMES.targets


@dataclasses.dataclass(frozen=True)
class ObservedState:
    """A world at a frame of a demonstration, and the demonstration there; metres, radians, seconds, wxyz.

    Arrays of either kind. h is the number of frames that the policy sees ahead; past its end a demonstration's last
    frame is held.

    Attributes:
        hand, hand_speed: (u,) coordinates and speeds of the wrist's slides and turns and of the actuated joints.
        residual: (u,) the filtered residual so far.
        object_pose: (7,) in the world.
        object_speed: (6,) linear in the world, angular in the object's own axes.
        object_turn: (3,) rotation vector, in the reference's own axes, that takes the reference's orientation to the
            object's.
        object_axes: (3, 3) world_from_object.
        wrist_place, wrist_axes: (3,) and (3, 3) world_from_hand.
        tips: (fingers, 3) finger tips in the world.
        forces: (links, 3) what each link presses the object with (N, world) in the last physics step.
        base: (3, 3) world_from_base of the scene's wrist.
        target, grip: (u,) demonstrated coordinates, and the share of the controls that presses.
        pose: (7,) demonstrated object.
        first_pose: (7,) of the demonstration's first frame.
        targets_ahead, poses_ahead: (h, u) and (h, 7) demonstrated some frames ahead.
        phase: (1,) share of the demonstration that is over.
        object_features: size (m), mass (kg), friction, and 1 for the kind.
    """

    hand: Any
    hand_speed: Any
    residual: Any
    object_pose: Any
    object_speed: Any
    object_turn: Any
    object_axes: Any
    wrist_place: Any
    wrist_axes: Any
    tips: Any
    forces: Any
    base: Any
    target: Any
    grip: Any
    pose: Any
    first_pose: Any
    targets_ahead: Any
    poses_ahead: Any
    phase: Any
    object_features: Any
