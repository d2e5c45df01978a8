"""Hinge axes from the joint centres of the rest pose (arXiv 2512.07359, section III-B).

The rules hold in MANO's right-hand frame only (fingers -x, back of the hand +y, thumb side +z). The paper's text can
be read in more ways than one; read as here, every axis bends its finger the way that fingers bend:

- The index finger's reference is the world's vertical, [0, 0, 1]. It must point to the thumb's side, as +z of MANO's
  frame does; in a z-up world with the hand flat on a table, flexion and abduction would change places.
- The references of middle, ring and little finger are differences of MCP joints, here all from the little finger's
  side to the thumb's; the other order turns the signs round.
- The thumb's MCP and IP axes are turned by 55 degrees about the bone, here from flexion towards abduction;
  with the other sign the thumb would bend away from the fingers.
- The thumb's CMC frame has its y for flexion (opposition) and its z for abduction, which comes first as at the fingers.
- Of the left hand nothing is said: it is mirrored in x, and its axes are mirrored back.

`projection.fit_functional_axes` fits them to a person's motion; docs/axes.md compares the two.
"""

from collections.abc import Callable

import numpy as np
from jaxtyping import Float

from mjx_hand.hand.joints import FINGERS, LINKS

THUMB_TURN = np.deg2rad(55.0)  # how far the thumb's hinge axes are turned about the thumb from the fingers' rule
_MIRROR = np.array([-1.0, 1.0, 1.0])
_RADIAL = np.array([0.0, 0.0, 1.0])


def anatomical_axes(
    centres: Float[np.ndarray, "16 3"], side: str = "right", thumb_turn: float = THUMB_TURN
) -> Float[np.ndarray, "20 3"]:
    """Unit hinge axes in hand-frame directions, in the order of `HINGES`; the paper's construction.

    Positive flexion closes the hand: a fingertip moves towards the palm, the thumb towards opposition. Positive
    *abduction*, as the formulas give it, moves a finger towards the little finger's side (ulnar) and the thumb
    away from the index finger (radial). Both hold for a left hand too. The axes at each base joint are orthogonal.

    Args:
        centres: rest joint centres (m) in the hand frame, in the order of `LINKS`.
        side: "right" or "left".
        thumb_turn: angle (rad) by which the thumb's MCP and IP axes turn about the thumb's long axis.
    """
    joint = dict(zip(LINKS, centres if side == "right" else centres * _MIRROR, strict=True))
    # Each reference points from the little finger's side to the thumb's.
    reference = {
        "index": _RADIAL,
        "middle": joint["index1"] - joint["ring1"],
        "ring": joint["middle1"] - joint["ring1"],
        "pinky": joint["ring1"] - joint["pinky1"],
    }
    rows = []
    for finger in FINGERS:
        if finger == "thumb":
            rows += _thumb_axes(joint, thumb_turn)
        else:
            flexion, abduction = _finger_frame(joint[f"{finger}2"], joint[f"{finger}3"], reference[finger])
            rows += [abduction, flexion, flexion, flexion]
    axes = np.stack(rows)
    # A mirror turns rotations round: the mirror image of a turn about a is the same turn about -(mirrored a).
    return axes if side == "right" else -axes * _MIRROR


def _finger_frame(
    proximal: Float[np.ndarray, "3"], distal: Float[np.ndarray, "3"], reference: Float[np.ndarray, "3"]
) -> tuple[Float[np.ndarray, "3"], Float[np.ndarray, "3"]]:
    """Flexion and abduction axes of a finger whose bone runs from `proximal` to `distal`."""
    z = _unit(proximal - distal)
    y = _unit(np.cross(z, reference))
    return _unit(np.cross(y, z)), y


def _thumb_axes(joint: dict[str, np.ndarray], turn: float) -> list[Float[np.ndarray, "3"]]:
    """The thumb's CMC abduction and flexion, MCP flexion and IP flexion axes."""
    mcp, ip = joint["thumb2"], joint["thumb3"]
    y = _unit(mcp - joint["index1"])
    z = _unit(np.cross(y, mcp - ip))
    # The fingers' rule, turned about the bone: in the frame (x flexion, y abduction, z bone), z cross x is y.
    flexion, abduction = _finger_frame(mcp, ip, _RADIAL)
    turned = np.cos(turn) * flexion + np.sin(turn) * abduction
    return [z, y, turned, turned]


def _unit(v: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3"]:
    return v / np.linalg.norm(v)


# How `build_rigid_hand` may find its axes; a rule is a function of the rest joint centres and the side.
AXES: dict[str, Callable[[np.ndarray, str], np.ndarray]] = {"anatomical": anatomical_axes}
