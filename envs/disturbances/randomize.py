"""`Randomize`: from what ranges disturbances are drawn."""

import dataclasses
import math
from typing import Any

from mjx_hand.errors import InputError

MOST_DELAY = 5  # control steps
_FACTORS = ("mass", "friction", "size", "gains")  # neutral at 1, all other ranges at 0


@dataclasses.dataclass(frozen=True)
class Randomize:
    """Ranges (least, greatest) that a disturbance is drawn from; equal ones set it to that value.

    The object's reference stays what was recorded, whatever is disturbed: where the object stands elsewhere, the hand
    has to go there and bring it back to where the recording has it. The policy sees the recording's size.

    Scenes of several masses, frictions, sizes, gains and places are compiled when an environment is made, `variants`
    for each demonstration; a reset draws one of them. All else is drawn by the reset itself.

    Attributes:
        share: how wide all ranges are, towards what is undisturbed: 1 as given, 0.5 half as wide, 0 disturbs nothing.
        variants: scenes for each demonstration.
        moved_share: share of the variants in which the object stands elsewhere or has another size; their episodes
            start at frame 0.
        move: how far object and support are moved, horizontally in any direction (m).
        turn_deg: by how much they are turned about the vertical through the object, to either side.
        mass, friction: factors, drawn evenly in their logarithm; friction is that of all contacts.
        size: factor of the object; its lowest point stays on what it stands on.
        gains: factor of the hand's stiffness, damping and force limits, drawn evenly in its logarithm.
        delay: control steps by which targets come late; drawn whole.
        seen_move, seen_turn_deg: by how much the object's observed pose is off throughout an episode, in any direction.
        seen_noise, seen_noise_deg: standard deviation of what is added to that anew in each step (m, degrees, each
            axis).
        push: force on the object (N), horizontally in any direction, once while it is held away from its place.
        push_seconds: how long that lasts.
        push_prob: share of episodes with a push.
    """

    share: float = 0.0
    variants: int = 12
    moved_share: float = 0.5
    move: tuple[float, float] = (0.0, 0.04)
    turn_deg: tuple[float, float] = (0.0, 15.0)
    mass: tuple[float, float] = (0.7, 2.0)
    friction: tuple[float, float] = (0.6, 1.2)
    size: tuple[float, float] = (0.88, 1.12)
    gains: tuple[float, float] = (0.85, 1.15)
    delay: tuple[int, int] = (0, 2)
    seen_move: tuple[float, float] = (0.0, 0.012)
    seen_turn_deg: tuple[float, float] = (0.0, 6.0)
    seen_noise: float = 0.001
    seen_noise_deg: float = 1.0
    push: tuple[float, float] = (0.0, 12.0)
    push_seconds: float = 0.2
    push_prob: float = 0.5

    def __post_init__(self):
        for name, most in (("move", 0.2), ("turn_deg", 180.0), ("seen_move", 0.2), ("seen_turn_deg", 180.0)):
            self._check_range(name, 0.0, most)
        self._check_range("push", 0.0, 1000.0)
        self._check_range("delay", 0.0, float(MOST_DELAY))
        for name in _FACTORS:
            self._check_range(name, 0.1, 10.0)
        for name in ("seen_noise", "seen_noise_deg", "push_seconds"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value >= 0):
                raise InputError(f"randomize.{name} is {value}; it must not be negative")
        for name in ("moved_share", "push_prob"):
            if not 0 <= getattr(self, name) <= 1:
                raise InputError(f"randomize.{name} is {getattr(self, name)}; it must lie between 0 and 1")
        if self.variants < 1:
            raise InputError(f"randomize.variants is {self.variants}; each demonstration needs at least 1 scene")
        if not 0 <= self.share <= 1:
            raise InputError(f"randomize.share is {self.share}; it must lie between 0 (nothing disturbed) and 1")

    @classmethod
    def only(cls, **given: Any) -> "Randomize":
        """What is given and nothing else, for every episode, in one scene a demonstration."""
        neutral: dict[str, Any] = {name: (_neutral(name),) * 2 for name in _RANGES}
        neutral["delay"] = (0, 0)
        one = {"share": 1.0, "variants": 1, "moved_share": 1.0, "push_prob": 1.0}
        return cls(**{**neutral, "seen_noise": 0.0, "seen_noise_deg": 0.0, **one, **given})

    def scaled(self) -> "Randomize":
        """The same with ranges as wide as `share` says, and a share of 1."""
        changed: dict[str, Any] = {"share": 1.0}
        for name in _RANGES:
            neutral = _neutral(name)
            low, high = (neutral + self.share * (value - neutral) for value in getattr(self, name))
            changed[name] = (round(low), round(high)) if name == "delay" else (low, high)
        for name in ("seen_noise", "seen_noise_deg"):
            changed[name] = self.share * getattr(self, name)
        return dataclasses.replace(self, **changed)

    def _check_range(self, name: str, least: float, most: float) -> None:
        given = getattr(self, name)
        if len(given) != 2 or not least <= given[0] <= given[1] <= most:
            raise InputError(
                f"randomize.{name} is {list(given)}; give the least and the greatest value, within [{least:g},{most:g}]"
            )


_RANGES = tuple(field.name for field in dataclasses.fields(Randomize) if isinstance(field.default, tuple))


def _neutral(name: str) -> float:
    return 1.0 if name in _FACTORS else 0.0
