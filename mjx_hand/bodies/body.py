"""`Body`: a hand as physics and learning have it, human or robot: everything that depends on which hand it is.

In a scene the wrist's three slides and three turns come first, then the hand's joints in the order of its tree, then
the object's free joint. Actuators are the wrist's six, then one for each joint that nothing else moves.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import TypeVar

import mujoco
import numpy as np
from jaxtyping import Array, Int

from mjx_hand.player.observed_state import WRIST, HandNames
from mjx_hand.rigid.gains import Gains
from mjx_hand.rigid.rigid_hand import RigidHand

NUM_WRIST = len(WRIST)  # of actuated joints, before the hand's in qpos and ctrl

Rows = TypeVar("Rows", np.ndarray, Array)


@dataclass(frozen=True)
class Coupling:
    """A joint that another one moves: its value is slope * (value of `leader`) + shift (rad or m)."""

    joint: str
    leader: str
    slope: float
    shift: float


@dataclass(frozen=True)
class ContactGeom:
    """A shape that touches: its name in the model, its link's, and its finger's, "" for the palm's."""

    name: str
    link: str
    finger: str


@dataclass(frozen=True, eq=False)
class Body:
    """A hand on a wrist that six actuators move.

    The body `wrist` has the axes of MANO's right hand, mirrored for a left one: fingers along -x, back of the hand +y,
    thumb side +z. Lengths metres, angles radians.

    Attributes:
        name: "human", or the robot's.
        side: "right" or "left".
        fingers: their names; rows of finger tips follow them. Sites and sensors `FINGER_tip` mark the tips.
        opposing: of these, the ones that press against the others.
        joints: those with an actuator, in the order of the tree, without the wrist's.
        coupled: those that others move.
        tree_joints: all of them, in the order of the tree and so of qpos.
        links: bodies whose origins stand for the hand's posture, the wrist's first.
        palm: three of them that span the palm: the wrist and two knuckles.
        contacts: shapes that touch.
        gains: of the position controllers of `joints` and of the wrist.
        build: makes the MuJoCo spec, on its actuated wrist, with these gains, with or without what only pictures need.
        rigid: the human hand that this is, where it is one; JAX knows its kinematics, and its capsules are its skin.
    """

    name: str
    side: str
    fingers: tuple[str, ...]
    opposing: tuple[str, ...]
    joints: tuple[str, ...]
    coupled: tuple[Coupling, ...]
    tree_joints: tuple[str, ...]
    links: tuple[str, ...]
    palm: tuple[int, int, int]
    contacts: tuple[ContactGeom, ...]
    gains: Gains
    build: Callable[[Gains, bool], mujoco.MjSpec]
    rigid: RigidHand | None = None

    @cached_property
    def names(self) -> HandNames:
        """What its numbers are called."""
        return HandNames(self.joints, self.fingers, self.touching_links)

    @cached_property
    def reach(self) -> float:
        """How far a residual moves its joints, over a human hand's: as large a share of their torque limits."""
        if self.rigid is not None:
            return 1.0
        own, human = (np.median(gains.force_limit / gains.stiffness) for gains in (self.gains, Gains()))
        return float(own / human)

    @cached_property
    def touching_links(self) -> tuple[str, ...]:
        """The bodies that have `contacts`; rows of contact forces follow them."""
        return tuple(dict.fromkeys(contact.link for contact in self.contacts))

    @property
    def num_targets(self) -> int:
        """How many numbers are commanded."""
        return NUM_WRIST + len(self.joints)

    @property
    def num_coordinates(self) -> int:
        """How many of a scene's coordinates are the hand's; what follows them is the object's free joint."""
        return NUM_WRIST + len(self.tree_joints)

    @cached_property
    def actuated(self) -> Int[np.ndarray, "u"]:
        """Where the targets stand among the hand's coordinates."""
        places = {name: k for k, name in enumerate((*WRIST, *self.tree_joints))}
        return np.array([places[name] for name in self.names.targets])

    def of_targets(self, coordinates: Rows) -> Rows:
        """The targets' share, (..., u), of a scene's positions or speeds (..., q), whose first are the hand's."""
        hand = coordinates[..., : self.num_coordinates]
        return hand[..., self.actuated] if self.coupled else hand

    def spec(self, gains: Gains | None = None, visual: bool = False) -> mujoco.MjSpec:
        """The hand's MuJoCo spec, alone in its world."""
        return self.build(self.gains if gains is None else gains, visual)
