"""A population of adult hands: random MakeHuman bodies, seen only at the right hand.

MakeHuman mixes its macro targets piecewise linearly: each target's name lists the levels it stands for
("female-young-averagemuscle-maxweight"), and its weight is the product of the body's share of each level
(`targets/macrodetails/macro.json` of the source).
"""

import numpy as np

from tools.open_hand.makehuman import Body, MakeHuman

SAMPLES = 2000
SEED = 2512_07359
RACES = ("african", "asian", "caucasian")
# Standard deviations of the macro parameters, which run from 0 to 1 with the average at 0.5.
MACRO_SPREAD = {"muscle": 0.08, "weight": 0.08, "height": 0.08, "proportions": 0.08}
# Local targets by their (decreasing, increasing) names. `fingers-distance` is a pose, so it is left out.
LOCAL_SPREAD = {
    ("hands/r-hand-fingers-length-decr", "hands/r-hand-fingers-length-incr"): 0.15,
    ("hands/r-hand-fingers-diameter-decr", "hands/r-hand-fingers-diameter-incr"): 0.25,
    ("hands/r-hand-scale-decr", "hands/r-hand-scale-incr"): 0.05,
    ("hands/measure-wrist-circ-decr", "hands/measure-wrist-circ-incr"): 0.3,
}

Shares = dict[str, np.ndarray]


def sample_hands(source: MakeHuman, body: Body, vertices: np.ndarray, samples: int = SAMPLES) -> np.ndarray:
    """Positions (samples, len(vertices), 3), metres, of the given body vertices for random adults.

    The first sample is the average adult. Deterministic: the generator is seeded with `SEED`.
    """
    rng = np.random.default_rng(SEED)
    shares = _macro_shares(rng, samples)
    hands = np.repeat(body.vertices[vertices][None], samples, axis=0)

    def add(weight: np.ndarray, target: str) -> None:
        if weight.any():
            hands.__iadd__(weight[:, None, None] * source.target(target, vertices))

    for name in source.macro_targets():
        add(_target_weight(name, shares, samples), name)
    for (decrease, increase), spread in LOCAL_SPREAD.items():
        amount = _first_average(rng.normal(0, spread, samples), 0.0)
        add(np.maximum(-amount, 0), decrease)
        add(np.maximum(amount, 0), increase)
    return hands


def _first_average(values: np.ndarray, average: float) -> np.ndarray:
    return np.concatenate([[average], values[1:]])


def _macro_shares(rng: np.random.Generator, samples: int) -> Shares:
    """Each sample's share of every level that a target's name can mention; children have none."""
    race = rng.dirichlet([1, 1, 1], samples)
    race[0] = 1 / 3
    shares = dict(zip(RACES, race.T, strict=True))
    male = _first_average(rng.uniform(0, 1, samples), 0.5)
    old = _first_average(rng.uniform(0, 1, samples), 0.0)
    shares |= {"female": 1 - male, "male": male, "young": 1 - old, "old": old, "universal": np.ones(samples)}
    for name, spread in MACRO_SPREAD.items():
        value = _first_average(np.clip(rng.normal(0.5, spread, samples), 0, 1), 0.5)
        low, high = np.maximum(1 - 2 * value, 0), np.maximum(2 * value - 1, 0)
        below, above = ("uncommon", "ideal") if name == "proportions" else ("min", "max")
        shares |= {below + name: low, above + name: high, "average" + name: 1 - low - high}
    return shares


def _target_weight(name: str, shares: Shares, samples: int) -> np.ndarray:
    levels = name.rsplit("/", 1)[-1].split("-")
    weight = np.ones(samples)
    for level in levels:
        weight = weight * shares.get(level, 0.0)  # a level of childhood is no adult's
    return weight
