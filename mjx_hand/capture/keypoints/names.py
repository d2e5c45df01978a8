"""Which layout a file's joint names, or their mere number, are of."""

import re
from collections.abc import Sequence
from functools import lru_cache

import numpy as np
from jaxtyping import Float

from mjx_hand.capture.keypoints.layouts import LAYOUTS, NUM_KEYPOINTS, KeypointLayout, to_keypoints
from mjx_hand.capture.keypoints.orders import order_of
from mjx_hand.errors import InputError

# Bare arrays: how many points tell the layout, of 21 the bones. Leap's 26 with carpal ends must name itself.
COUNTS = {len(layout.joints): layout for name, layout in reversed(LAYOUTS.items()) if name != "leap_bones"}

_ENOUGH = 10  # joints of one layout by which a hand is recognised, even where some are missing


@lru_cache(maxsize=4096)
def plain(name: str) -> str:
    """What devices' names of a joint share: of `XR_HAND_JOINT_INDEX_TIP_EXT` and `index-finger-tip` "indextip"."""
    letters = re.sub(r"[^a-z0-9]", "", name.lower())
    letters = re.sub(r"^(xrhandjoint|xrhand|hand)|ext$|finger|phalanx", "", letters)
    return letters.replace("pinky", "little")


@lru_cache
def _plain_joints(layout: KeypointLayout) -> frozenset[str]:
    return frozenset(plain(name) for name in layout.joints)


def layout_named(names: Sequence[str]) -> KeypointLayout | None:
    """The layout whose keypoints all are among these joint names, or None."""
    given = {plain(name) for name in names}
    for layout in LAYOUTS.values():
        if {plain(name) for name in layout.keypoints if name is not None} <= given:
            return layout
    return None


def names_a_hand(names: Sequence[str]) -> bool:
    """Whether these are joints of a hand: of one layout enough that nothing else would have them all."""
    given = {plain(name) for name in names}
    return len(given) >= _ENOUGH and any(len(given & _plain_joints(known)) >= _ENOUGH for known in LAYOUTS.values())


def named_keypoints(
    path: object, names: Sequence[str], points: Float[np.ndarray, "*b n 3"]
) -> tuple[Float[np.ndarray, "*b 21 3"], str]:
    """The 21 keypoints among named points, and their layout's name.

    Raises:
        InputError: the names are not one a point, are not, or not all, of a layout, or two of them are one joint.
    """
    if len(names) != points.shape[-2]:
        raise InputError(f"{path}: has {points.shape[-2]} points per hand and {len(names)} names; give one per point")
    layout = layout_named(names)
    given = [plain(name) for name in names]
    if layout is None:
        nearest = max(LAYOUTS.values(), key=lambda known: len(_plain_joints(known) & set(given)))
        wanted = [name for name in nearest.keypoints if name is not None and plain(name) not in given]
        if len(wanted) == sum(name is not None for name in nearest.keypoints):
            raise InputError(
                f"{path}: {', '.join(list(names)[:4])}… name no hand's joints; layouts known: {', '.join(LAYOUTS)}"
            )
        raise InputError(f"{path}: lacks {', '.join(wanted)} of the layout {nearest.name!r}")
    rows = [-1 if name is None else given.index(plain(name)) for name in layout.keypoints]
    repeated = [names[row] for row in rows if row >= 0 and given.count(given[row]) > 1]
    if repeated:
        raise InputError(f"{path}: {', '.join(repeated)} name a joint twice; give each one point")
    found = np.asarray(points)[..., rows, :]
    return np.where((np.array(rows) >= 0)[:, None], found, np.nan), layout.name


def counted_keypoints(
    path: object, points: Float[np.ndarray, "*b n 3"], layout: object = None
) -> tuple[Float[np.ndarray, "*b 21 3"], str]:
    """The 21 keypoints among points without names, and the layout's name: as said, or as number and bones tell.

    Raises:
        InputError: the layout is unknown or has another number of points.
    """
    count = points.shape[-2]
    if layout is not None and (not isinstance(layout, str) or layout not in LAYOUTS):
        raise InputError(f"{path}: layout is {str(layout)[:40]!r}; known: {', '.join(LAYOUTS)}")
    known = LAYOUTS[layout] if layout is not None else COUNTS.get(count)
    if layout is None and count == NUM_KEYPOINTS:
        known = order_of(points)
    if known is None or len(known.joints) != count:
        counts = ", ".join(f"{name} {len(each.joints)}" for name, each in LAYOUTS.items())
        lack = "; MANO's 16 joints lack the finger tips, which are needed too" if count == 16 else ""
        raise InputError(f"{path}: has {count} points per hand; known layouts: {counts}{lack}")
    return to_keypoints(points, known), known.name
