"""The twin's hand for each demonstration, built once from the shape that was fitted to the person."""

import dataclasses
from collections.abc import Mapping, Sequence

import numpy as np

from mjx_hand.files.array_cache import cached
from mjx_hand.hand.load import load_hand
from mjx_hand.hand.model import HandModel
from mjx_hand.motion.demonstration import Demonstration
from mjx_hand.rigid.build import build_rigid_hand
from mjx_hand.rigid.own_hinges import with_hinges_of
from mjx_hand.rigid.rigid_hand import RigidHand

_FROM_MODEL = ("side", "name")


def twins(demonstrations: Sequence[Demonstration]) -> list[RigidHand]:
    """The twin's hand for each demonstration, with its own hinges; kept from one start to the next."""
    model = load_hand(side=demonstrations[0].motion.side)
    shapes = {d.shape.tobytes(): d.shape for d in demonstrations}
    built = list(shapes.values())
    arrays = cached(lambda: _arrays([build_rigid_hand(model, shape) for shape in built]), "twins", model, built)
    hands = dict(zip(shapes, _hands(arrays, model), strict=True))
    return [with_hinges_of(d, hands[d.shape.tobytes()]) for d in demonstrations]


def _arrays(hands: Sequence[RigidHand]) -> dict[str, np.ndarray]:
    """Every field, one row per hand, or a row of `field.LINK` for each link; hands of one model have the same sizes."""
    arrays = {}
    for field in dataclasses.fields(RigidHand):
        values = [getattr(hand, field.name) for hand in hands]
        if field.name in _FROM_MODEL or values[0] is None:
            continue
        if isinstance(values[0], tuple) and isinstance(values[0][0], np.ndarray):
            arrays |= {f"{field.name}.{k}": np.stack(rows) for k, rows in enumerate(zip(*values, strict=True))}
        else:
            arrays[field.name] = np.stack([np.asarray(value) for value in values])
    return arrays


def _hands(arrays: Mapping[str, np.ndarray], model: HandModel) -> list[RigidHand]:
    """The reverse of `_arrays`."""
    divided = {key.partition(".")[0] for key in arrays if "." in key}
    hands = []
    for row in range(len(arrays["link_mass"])):
        fields = {name: array[row] for name, array in arrays.items() if "." not in name}
        for name in divided:
            links = sum(key.startswith(f"{name}.") for key in arrays)
            fields[name] = tuple(arrays[f"{name}.{k}"][row] for k in range(links))
        fields["capsule_links"] = tuple(fields["capsule_links"].tolist())
        hands.append(RigidHand(**fields, **{name: getattr(model, name) for name in _FROM_MODEL}))
    return hands
