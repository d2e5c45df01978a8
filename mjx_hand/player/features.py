"""What the policy sees, as a table of named features: the one place for their order, units, frames and scales.

    observation = clip((features - offset) * scale, -5, 5)

The environment evaluates the table on JAX arrays, the player on NumPy's; an export's contract is written from it. To
add a feature, add a row. Its value uses operators and indexing alone, so that either kind of array does.

Features are scaled by constants, not by running statistics: some hardly vary, and dividing by their tiny deviation
makes PPO diverge.
"""

import dataclasses
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from jaxtyping import Float

from mjx_hand.player.observed_state import HUMAN_NAMES, WRIST, HandNames, ObservedState

OBSERVATION_LIMIT = 5.0  # of an observation
_NUM_WRIST = len(WRIST)
_XYZ = ("x", "y", "z")
CONTACT_FORCES = "contact_forces"  # a feature's name
# What only policies of teleoperated hands see: others know it from the demonstration.
LIVE_ONLY = frozenset({"hinges", "object_velocity_in_hand", "down_in_hand"})
_PER_LENGTH = 30.0  # 1/m, for errors of the object: 3 cm


@dataclasses.dataclass(frozen=True)
class Feature:
    """Some numbers of an observation, all of one unit and frame.

    Attributes:
        name: unlike all others.
        meaning: one line.
        unit, frame: of the value.
        elements: a name for each number, in order.
        value: of what is seen; its numbers in row-major order.
        scale: one over what it usually varies by, one number or one each.
        offset: what it usually is.
        of_demonstration: whether it tells where a demonstration takes hand and object, or is in its frames.
    """

    name: str
    meaning: str
    unit: str
    frame: str
    elements: tuple[str, ...]
    value: Callable[[ObservedState], Any]
    scale: float | Sequence[float] | Float[np.ndarray, "n"] = 1.0
    offset: float | Sequence[float] = 0.0
    of_demonstration: bool = False

    @property
    def size(self) -> int:
        """How many numbers."""
        return len(self.elements)


def feature_table(
    residual_scale: Float[np.ndarray, "u"],
    lookahead: Sequence[int],
    object_kinds: Sequence[str],
    hand: HandNames = HUMAN_NAMES,
) -> tuple[Feature, ...]:
    """The features in the observation's order.

    Args:
        residual_scale: what a residual of 1 is worth (m, rad).
        lookahead: frames ahead that are seen.
        object_kinds: names of the kinds of objects.
        hand: names of its joints and fingers.
    """
    relative_to, targets = "relative to the demonstrated", hand.targets
    per_residual = reciprocal(residual_scale)
    return (
        *_of_targets(
            targets,
            "error",
            f"coordinate {relative_to} one",
            lambda s: s.hand - s.target,
            (50.0, 5.0, 5.0),
            wrist_of_demonstration=True,
        ),
        *_of_targets(
            targets,
            "speed",
            "speed",
            lambda s: s.hand_speed,
            (5.0, 0.5, 0.2),
            per="/s",
            wrist_of_demonstration=True,
        ),
        *_of_targets(targets, "residual", "filtered residual so far", lambda s: s.residual, per_residual),
        Feature(
            "grip",
            "share of the controls that presses",
            "rad",
            "joint",
            hand.joints,
            lambda s: s.grip[_NUM_WRIST:],
            5.0,
            of_demonstration=True,
        ),
        Feature(
            "object_position_error",
            f"object's place {relative_to} one",
            "m",
            "base",
            _XYZ,
            lambda s: s.base.T @ (s.object_pose[:3] - s.pose[:3]),
            _PER_LENGTH,
            of_demonstration=True,
        ),
        Feature(
            "object_rotation_error",
            "rotation vector from the demonstrated orientation to the object's",
            "rad",
            "demonstrated object",
            _XYZ,
            lambda s: s.object_turn,
            3.0,
            of_demonstration=True,
        ),
        Feature(
            "object_velocity",
            "object's velocity",
            "m/s",
            "base",
            _XYZ,
            lambda s: s.base.T @ s.object_speed[:3],
            3.0,
            of_demonstration=True,
        ),
        Feature("object_angular_velocity", "object's", "rad/s", "object", _XYZ, lambda s: s.object_speed[3:], 0.2),
        Feature(
            "object_in_hand",
            "object's place seen from the wrist",
            "m",
            "hand",
            _XYZ,
            lambda s: s.wrist_axes.T @ (s.object_pose[:3] - s.wrist_place),
            10.0,
            (-0.1, -0.05, 0.03),  # about where a grasped object is
        ),
        Feature(
            "tips_in_object",
            "finger tips seen from the object",
            "m",
            "object",
            tuple(f"{finger}_{axis}" for finger in hand.fingers for axis in _XYZ),
            lambda s: (s.tips - s.object_pose[:3]) @ s.object_axes,
            _PER_LENGTH,
        ),
        Feature(
            CONTACT_FORCES,
            "what each link presses the object with",
            "N",
            "hand",
            tuple(f"{link}_{axis}" for link in hand.links for axis in _XYZ),
            lambda s: s.forces @ s.wrist_axes,
            0.1,
        ),
        *(feature for k, ahead in enumerate(lookahead) for feature in _of_frame_ahead(targets, k, ahead)),
        *(_of_object_ahead(k, ahead) for k, ahead in enumerate(lookahead)),
        Feature(
            "phase",
            "share of the demonstration that is over",
            "1",
            "-",
            ("share",),
            lambda s: s.phase,
            2.0,
            0.5,
            of_demonstration=True,
        ),
        Feature(
            "object_rise",
            "object's height above that of the demonstration's first frame",
            "m",
            "world",
            ("z",),
            lambda s: s.object_pose[2:3] - s.first_pose[2:3],
            10.0,
            of_demonstration=True,
        ),
        Feature(
            "object_size",
            "half extents of a box; radius, half height of a cylinder or capsule; radius of a sphere; reach of a mesh",
            "m",
            "object",
            _XYZ,
            lambda s: s.object_features[:3],
            30.0,
        ),
        Feature("object_mass", "object's mass", "kg", "-", ("mass",), lambda s: s.object_features[3:4], 5.0),
        Feature("object_friction", "sliding friction", "1", "-", ("friction",), lambda s: s.object_features[4:5]),
        Feature("object_kind", "1 for its kind", "1", "-", tuple(object_kinds), lambda s: s.object_features[5:]),
        Feature("hinges", "values of the joints", "rad", "joint", hand.joints, lambda s: s.hand[_NUM_WRIST:], 1.5, 0.5),
        Feature(
            "object_velocity_in_hand",
            "object's velocity, less that of the wrist's origin",
            "m/s",
            "hand",
            _XYZ,
            lambda s: s.wrist_axes.T @ (s.object_speed[:3] - s.base @ s.hand_speed[:3]),
            3.0,
        ),
        Feature("down_in_hand", "the direction of gravity", "1", "hand", _XYZ, lambda s: -s.wrist_axes[2]),
    )


def reciprocal(scale: Float[np.ndarray, "u"]) -> Float[np.ndarray, "u"]:
    """One over each number, 0 where it is 0: of a wrist that has no residual."""
    return np.divide(1.0, scale, out=np.zeros_like(scale), where=scale > 0)


def offsets_and_scales(table: Sequence[Feature]) -> tuple[Float[np.ndarray, "o"], Float[np.ndarray, "o"]]:
    """What is taken off each number, and what the rest is multiplied by."""
    offset, scale = (
        np.concatenate([np.broadcast_to(np.asarray(getattr(f, name), float), f.size) for f in table])
        for name in ("offset", "scale")
    )
    return offset, scale


def _of_targets(
    targets: tuple[str, ...],
    name: str,
    meaning: str,
    value: Callable[[ObservedState], Any],
    scales: Sequence[float] | Float[np.ndarray, "u"],
    per: str = "",
    wrist_of_demonstration: bool = False,
    of_demonstration: bool = False,
) -> tuple[Feature, Feature, Feature]:
    """Rows for the hand's coordinates: slides along the base's axes, turns from it, joints.

    Args:
        targets: names of the coordinates.
        name, meaning: of the rows.
        value: all of them.
        scales: of the three rows, or of all.
        per: end of the unit.
        wrist_of_demonstration, of_demonstration: see `Feature.of_demonstration`, of the wrist's rows and of all.
    """
    parts = (
        ("wrist_position", f"m{per}", "base", slice(0, 3)),
        ("wrist_rotation", f"rad{per}", "joint", slice(3, 6)),
        ("hinges", f"rad{per}", "joint", slice(_NUM_WRIST, None)),
    )
    return tuple(  # type: ignore[return-value]
        Feature(
            f"{name}.{part}",
            f"{part.replace('_', ' ')}: {meaning}",
            unit,
            frame,
            targets[place],
            lambda s, place=place: value(s)[place],
            scales[k] if len(scales) == len(parts) else scales[place],
            of_demonstration=of_demonstration or (wrist_of_demonstration and part != "hinges"),
        )
        for k, (part, unit, frame, place) in enumerate(parts)
    )


def _of_frame_ahead(targets: tuple[str, ...], k: int, ahead: int) -> tuple[Feature, ...]:
    return _of_targets(
        targets,
        f"ahead_{ahead}",
        f"demonstrated coordinate {ahead} frames ahead, relative to the one now",
        lambda s: s.targets_ahead[k] - s.target,
        (50.0, 5.0, 5.0),
        of_demonstration=True,
    )


def _of_object_ahead(k: int, ahead: int) -> Feature:
    return Feature(
        f"ahead_{ahead}.object_position",
        f"demonstrated place of the object {ahead} frames ahead, relative to the one now",
        "m",
        "base",
        _XYZ,
        lambda s: s.base.T @ (s.poses_ahead[k, :3] - s.pose[:3]),
        _PER_LENGTH,
        of_demonstration=True,
    )
