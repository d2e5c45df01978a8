"""Which demonstrations robot hands can do: `python -m train.robots hands=[allegro,fourier.yaml] config=all`.

A table of robots x grasp types: how many of a part's demonstrations are brought onto the hand, and for what reason the
others are left out: no finger for it, a place out of reach, no force closure. Options besides `hands` and `first=N`,
which takes the first N of each type, are those of `train.evaluate`. Writes `robots.json` with every message to `out`.
"""

import json
import sys
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from envs.demonstrations.load_set import load_demonstrations
from envs.demonstrations.on_robot.bring import possible_grasps
from envs.demonstrations.on_robot.left_out import REASONS, LeftOut
from envs.demonstrations.twin_hands import twins
from mjx_hand.bodies.robot_body import robot_body
from mjx_hand.compile_cache import enable_compile_cache
from mjx_hand.errors import InputError
from mjx_hand.files.npz_archive import replacing
from mjx_hand.motion.demonstration import Demonstration
from mjx_hand.progress import counter
from mjx_hand.view.report import Table, print_table
from train.settings.config import Config, compose
from train.settings.overrides import listed

NAME = "robots"


@dataclass(frozen=True)
class Possible:
    """What of one type's demonstrations one robot can do.

    Attributes:
        hand: the robot's name.
        grasp: the type.
        total: how many there are.
        left_out: kind of reason and message, by the demonstration's number among these.
    """

    hand: str
    grasp: str
    total: int
    left_out: dict[int, tuple[str, str]]

    def told(self) -> str:
        """As in "29 of 32; out of reach 3"."""
        reasons = Counter(reason for reason, _ in self.left_out.values())
        said = [f"{reason} {reasons[reason]}" for reason in REASONS if reasons[reason]]
        return "; ".join([f"{self.total - len(self.left_out)} of {self.total}", *said])


def possible(hand: str, demonstrations: Sequence[Demonstration]) -> list[Possible]:
    """What a robot can do of people's demonstrations, type by type.

    Raises:
        InputError: as `robot_body`, or a hand of the other side.
    """
    body = robot_body(hand)
    found = []
    with counter(len(demonstrations), f"demonstrations on {body.name}") as advance:
        for grasp in dict.fromkeys(d.grasp for d in demonstrations):
            of_type = [d for d in demonstrations if d.grasp == grasp]
            told = {}
            for k, (d, person) in enumerate(zip(of_type, twins(of_type), strict=True)):
                try:
                    possible_grasps(d, person, body)
                except LeftOut as error:
                    told[k] = error.reason, str(error)
                advance(1)
            found.append(Possible(body.name, grasp, len(of_type), told))
    return found


def table(rows: Sequence[Possible], part: str) -> Table:
    """A row a robot, a column a type."""
    grasps = list(dict.fromkeys(row.grasp for row in rows))
    cells = {(row.hand, row.grasp): row.told() for row in rows}
    hands = dict.fromkeys(row.hand for row in rows)
    return Table(
        columns=("hand", *grasps),
        rows=tuple((hand, *(cells[hand, grasp] for grasp in grasps)) for hand in hands),
        note=f"{part} demonstrations that each hand can do, and why not the others",
    )


def run(hands: Sequence[str], first: int | None, config: Config) -> Path:
    """Bring every demonstration onto every hand, print the table, and write all to the `out` folder."""
    demonstrations: list[Demonstration] = []
    for single in config.data.expand_types():
        demonstrations += load_demonstrations(single, config.part, config.demonstrations)[:first]
    rows = [row for hand in hands for row in possible(hand, demonstrations)]
    print_table(table(rows, config.part))
    told = [
        {"hand": r.hand, "grasp": r.grasp, "of": r.total, "done": r.total - len(r.left_out), "left out": r.left_out}
        for r in rows
    ]
    out = Path(config.out)
    out.mkdir(parents=True, exist_ok=True)
    with replacing(out / f"{NAME}.json") as file:
        file.write_text(json.dumps(told, indent=1))
    return out / f"{NAME}.json"


def main(argv: Sequence[str] | None = None) -> int:
    """The command; its exit status: 0, or 2 for input that cannot be used."""
    argv = sys.argv[1:] if argv is None else argv
    own = {key: value for key, _, value in (argument.partition("=") for argument in argv) if key in ("hands", "first")}
    try:
        hands, first = listed(own, "hands", ("allegro",)), own.get("first", "")
        if first and not (first.isdigit() and int(first) > 0):
            raise InputError(f"first={first}: give how many of each type to take, as in first=8")
        config = compose([argument for argument in argv if argument.partition("=")[0] not in own])
        enable_compile_cache()
        written = run(hands, int(first) if first else None, config)
    except (InputError, OSError) as error:
        print(f"{NAME}: {InputError(error) if isinstance(error, OSError) else error}", file=sys.stderr)
        return 2
    print(f"written: {written.resolve()}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
