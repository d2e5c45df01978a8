"""Options that name objects: `NAME=VALUE`, several of them, and what an object looks like."""

from collections.abc import Sequence
from typing import Any

from mjx_hand.errors import InputError
from mjx_hand.motion.scene import NO_SURFACE
from mjx_hand.objects.description import OBJECT_KINDS

Shape = dict[str, Any]  # what `recorded_object` takes beside poses
_SHAPES = tuple(kind for kind in OBJECT_KINDS if kind != "mesh")


def by_name(option: str, given: Sequence[str], one: str | None) -> dict[str, str]:
    """The values by the objects' names.

    Args:
        option: for messages.
        given: `NAME=VALUE` each; `VALUE` alone where there is one object.
        one: the only object's name.

    Raises:
        InputError: a name is missing, empty, or given twice.
    """
    found: dict[str, str] = {}
    for each in given:
        name, equals, value = each.partition("=")
        if not equals:
            name, value = one or "", each
        if not name or not value:
            raise InputError(f"{option} {each}: say which object it is of: {option} NAME={value or 'VALUE'}")
        if name in found:
            raise InputError(f"{option}: {name!r} is given twice; give each object a name of its own")
        found[name] = value
    return found


def shape_of(name: str, told: str | None, unit: str) -> Shape:
    """What `NAME=mesh.stl` or `NAME=box:0.02,0.03,0.04` says; nothing is poses alone.

    Raises:
        InputError: sizes that are no numbers.
    """
    if told is None:
        return {"kind": NO_SURFACE}
    kind, colon, sizes = told.partition(":")
    if not colon or kind not in _SHAPES:
        return {"mesh": told, "unit": unit}
    try:
        return {"kind": kind, "size": [float(size) for size in sizes.split(",")]}
    except ValueError:
        raise InputError(f"--object {name}={told}: sizes are numbers in metres, such as {kind}:0.02,0.03") from None
