"""What the hand meets besides the object: by choice table and support, its own links, or both.

MuJoCo tests two geoms where a bit of the one's contype is in the other's conaffinity. The object meets the hand and the
ground in every scene; table and support meet the hand by one more bit. The hand's own links meet as named pairs
without friction, which cost little; with friction they take 40 % of a pinch's speed.
"""

import itertools
from collections.abc import Sequence

import mujoco

from mjx_hand.errors import InputError

# What `Task.contacts` may be.
CONTACTS = ("object", "ground", "self", "all")
SOLREF = (0.01, 1.0)  # of every contact: MuJoCo's own 0.02 s costs a pinch twenty points of success

# (contype, conaffinity). Spare boxes meet nobody; without a contype MuJoCo would leave them out of its trees, whose
# sizes must agree.
_HAND, _OBJECT, _GROUND, _SPARE = (1, 0), (2, 1), (0, 2), (4, 0)
_HAND_ON_GROUND = 8


def check_contacts(contacts: str) -> None:
    """Raises InputError for what is none of `CONTACTS`."""
    if contacts not in CONTACTS:
        raise InputError(f"task.contacts is {contacts!r}; valid: {', '.join(CONTACTS)}")


def meet_as_hand(geom: mujoco.MjsGeom, contacts: str) -> None:
    """Let a geom of the hand meet the object, and the ground where `contacts` says so."""
    geom.contype, geom.conaffinity = _HAND[0] | _HAND_ON_GROUND * _with_ground(contacts), _HAND[1]


def meet_as_object(geom: mujoco.MjsGeom) -> None:
    """Let a geom of the object meet hand and ground."""
    geom.contype, geom.conaffinity = _OBJECT


def meet_as_ground(geom: mujoco.MjsGeom, contacts: str) -> None:
    """Let table or support meet the object, and the hand where `contacts` says so."""
    geom.contype, geom.conaffinity = _GROUND[0], _GROUND[1] | _HAND_ON_GROUND * _with_ground(contacts)


def meet_nobody(geom: mujoco.MjsGeom) -> None:
    """Let nothing touch a spare box."""
    geom.contype, geom.conaffinity = _SPARE


def meet_itself(spec: mujoco.MjSpec, contacts: str, coarse: bool) -> None:
    """Let the links of a hand that is alone in its spec meet each other where `contacts` says so.

    Those are links of two fingers, and the palm with links that are not joined to it.

    Args:
        spec: the hand's.
        contacts: as of `Task.contacts`.
        coarse: whether the links' shapes stand far out of the hand, as a robot's hulls do. Pairs that overlap where all
            joints are zero are then left out, which would press the hand open all the time. People's hands, which run
            side by side, have the same pairs whoever they are.
    """
    if contacts not in ("self", "all"):
        return
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    geoms = [g for g in range(model.ngeom) if model.geom_contype[g]]
    for one, other in [*_finger_pairs(model, geoms), *_palm_pairs(model, geoms)]:
        if not coarse or mujoco.mj_geomDistance(model, data, one, other, 0.001, None) > 0:
            names = {"geomname1": model.geom(one).name, "geomname2": model.geom(other).name}
            spec.add_pair(**names, condim=1, solref=SOLREF)


def _finger_pairs(model: mujoco.MjModel, geoms: Sequence[int]) -> list[tuple[int, int]]:
    """Pairs of a hand's geoms that belong to two fingers."""
    lines = {g: line for g, line in below_palm(model, geoms).items() if line}
    return [(a, b) for a, b in itertools.combinations(lines, 2) if lines[a][0] != lines[b][0]]


def _palm_pairs(model: mujoco.MjModel, geoms: Sequence[int]) -> list[tuple[int, int]]:
    """Pairs of the palm's geoms and those of links that are at least two links below it."""
    lines = below_palm(model, geoms)
    palm = [g for g, line in lines.items() if not line]
    return [(a, b) for a in palm for b, line in lines.items() if len(line) > 1]


def below_palm(model: mujoco.MjModel, geoms: Sequence[int]) -> dict[int, list[int]]:
    """For each of a hand's geoms the bodies from its finger's first to its own; none of the palm's."""
    lines = {g: _line(model, int(model.geom_bodyid[g])) for g in geoms}
    palm = len(list(itertools.takewhile(lambda level: len(set(level)) == 1, zip(*lines.values(), strict=False))))
    return {g: line[palm:] for g, line in lines.items()}


def _line(model: mujoco.MjModel, body: int) -> list[int]:
    """Bodies from below the world down to this one."""
    line = []
    while body > 0:
        line.append(body)
        body = int(model.body_parentid[body])
    return line[::-1]


def _with_ground(contacts: str) -> bool:
    return contacts in ("ground", "all")
