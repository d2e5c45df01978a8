"""The demonstrated path of the wrist, moved to where the object is seen to stand.

A demonstration's hand went to where its object was. Where the object stands elsewhere, the path goes there with it,
horizontally and about the vertical, until the object is held, and from then on back to the demonstrated one, which
takes the object along. Arrays of NumPy and of JAX are both taken: `xp` is the module that they belong to.
"""

from typing import Any

import numpy as np
from jaxtyping import Float

from mjx_hand.smoothstep import smoothstep

HELD_AWAY = 0.01  # m from its first place: an object that is held
_SAME = 1e-5  # m, rad: less is rounding, and leaves the path as it is to the last bit
_RAMP = 0.5  # s in which the path leaves the demonstrated one at first
_RETURN = 0.8  # s in which it goes back


def approach_weights(object_pose: Float[np.ndarray, "t 7"], rate: float) -> Float[np.ndarray, "t"]:
    """How far the path is moved at each frame of a demonstration, from 0 to 1.

    Args:
        object_pose: demonstrated (m, wxyz).
        rate: frames a second.
    """
    frames = np.arange(len(object_pose))
    away = np.linalg.norm(object_pose[:, :3] - object_pose[0, :3], axis=1) > HELD_AWAY
    held = int(away.argmax()) if away.any() else len(frames)
    ramp = max(min(_RAMP * rate, held / 2), 1.0)
    return smoothstep(frames / ramp) * (1 - smoothstep((frames - held) / (_RETURN * rate)))


def displacement(seen: Any, demonstrated: Any, xp: Any) -> Any:
    """Where the object is seen, from where the demonstration has it: x, y (m) and the turn about the vertical (rad).

    Args:
        seen, demonstrated: (7,) poses at first (m, wxyz, world).
        xp: numpy or jax.numpy.
    """
    (a, b, c, d), (w, x, y, z) = seen[3:], demonstrated[3:]
    along, real = d * w + c * x - b * y - a * z, a * w + b * x + c * y + d * z  # of seen * conjugate(demonstrated)
    turn = 2 * xp.arctan2(along, real)
    turn = turn - 2 * np.pi * xp.round(turn / (2 * np.pi))
    moved = xp.stack([seen[0] - demonstrated[0], seen[1] - demonstrated[1], turn])
    return moved * (xp.abs(moved).max() > _SAME)


def moved_wrist(wrist: Any, base: Any, centre: Any, moved: Any, xp: Any) -> Any:
    """By how much the wrist's slides and turns (m, rad) change where the path is moved.

    Args:
        wrist: (6,) slides along the base's axes, and turns, world_from_hand = base Rx Ry Rz.
        base: (3, 3) world_from_base.
        centre: (3,) where the demonstration has the object at first; turned about the vertical through it.
        moved: (3,) as of `displacement`, times a weight.
        xp: numpy or jax.numpy.
    """
    turn = _about_z(moved[2], xp)
    push = xp.stack([moved[0], moved[1], xp.zeros_like(moved[0])])
    place = centre + push + turn @ (base @ wrist[:3] - centre)
    axes = base.T @ turn @ base @ _axes(wrist[3:], xp)
    change = _turns(axes, wrist[3:], xp) - wrist[3:]
    change = change - 2 * np.pi * xp.round(change / (2 * np.pi))
    return xp.concatenate([base.T @ place - wrist[:3], change]) * xp.any(moved != 0)


def followed(target: Any, base: Any, centre: Any, moved: Any, xp: Any) -> Any:
    """What is added to demonstrated targets (m, rad) where the path is moved: as `moved_wrist`, and no joint changes.

    Args:
        target: (u,) the wrist's slides and turns, then the hand's joints.
        base, centre, moved, xp: as of `moved_wrist`.
    """
    return xp.concatenate([moved_wrist(target[:6], base, centre, moved, xp), xp.zeros_like(target[6:])])


def _about_z(angle: Any, xp: Any) -> Any:
    c, s, zero, one = xp.cos(angle), xp.sin(angle), xp.zeros_like(angle), xp.ones_like(angle)
    return xp.stack([xp.stack([c, -s, zero]), xp.stack([s, c, zero]), xp.stack([zero, zero, one])])


def _axes(turns: Any, xp: Any) -> Any:
    """Rx Ry Rz."""
    (a, b, c), (d, e, f) = xp.cos(turns), xp.sin(turns)
    return xp.stack(
        [
            xp.stack([b * c, -b * f, e]),
            xp.stack([a * f + d * e * c, a * c - d * e * f, -d * b]),
            xp.stack([d * f - a * e * c, d * c + a * e * f, a * b]),
        ]
    )


def _turns(axes: Any, near: Any, xp: Any) -> Any:
    """The turns (rad) of `_axes`; of the two triples that give the same axes the one like `near`."""
    side = xp.where(xp.cos(near[1]) < 0, -1.0, 1.0)
    return xp.stack(
        [
            xp.arctan2(-side * axes[1, 2], side * axes[2, 2]),
            xp.arctan2(axes[0, 2], side * xp.hypot(axes[0, 0], axes[0, 1])),
            xp.arctan2(-side * axes[0, 1], side * axes[0, 0]),
        ]
    )
