"""Which hands of a recording are the same one: those that a tracker lost and found again."""

from collections.abc import Iterable, Mapping, Sequence

import numpy as np
from jaxtyping import Bool

JOINED = "+"


def never_at_once(seen: Mapping[str, Bool[np.ndarray, "t"]], sides: Mapping[str, str]) -> list[list[str]]:
    """Names of hands in groups of one side that never are there together, each in the order of their first frames.

    Args:
        seen: of each hand, by its name, in which frames it is there.
        sides: of each hand; those of unknown side stay by themselves.
    """
    groups: list[list[str]] = []
    taken: list[np.ndarray] = []
    for name in sorted(seen, key=lambda name: int(np.argmax(seen[name]))):
        fits = (
            k
            for k, group in enumerate(groups)
            if sides[name] and sides[group[0]] == sides[name] and not (taken[k] & seen[name]).any()
        )
        k = next(fits, None)
        if k is None:
            groups.append([name])
            taken.append(seen[name].copy())
        else:
            groups[k].append(name)
            taken[k] |= seen[name]
    return groups


def with_parts(groups: Sequence[Sequence[str]]) -> list[list[str]]:
    """The groups, and after them each part of those that have several by itself."""
    parts = [[name] for group in groups if len(group) > 1 for name in group]
    return [*map(list, groups), *parts]


def name_of(group: Sequence[str]) -> str:
    """The name of a hand that was lost and found again: those of its parts."""
    return JOINED.join(group)


def whole(names: Iterable[str]) -> list[str]:
    """Of such names those that are no part of another."""
    listed = list(names)
    parts = {part for name in listed if JOINED in name for part in name.split(JOINED)}
    return [name for name in listed if name not in parts]


def found_again(group: Sequence[str]) -> tuple[str, ...]:
    """What a recording of one of these groups says of it, for people; nothing of a hand that was never lost."""
    return (
        (f"{group[0]} was lost and found again as {', '.join(group[1:])}; they are taken as one",) if group[1:] else ()
    )
