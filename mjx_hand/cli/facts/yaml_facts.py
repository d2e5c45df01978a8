"""What `mjx-hand info` says of a YAML file: a robot hand's description, or a marker set."""

import re
from pathlib import Path

from mjx_hand.capture.markers.marker_set import load_marker_set
from mjx_hand.cli.facts.facts_of import Facts
from mjx_hand.files.text_table import read_lines
from mjx_hand.hand.load import load_hand
from mjx_hand.robots.robot_hand import load_robot

_OF_A_ROBOT = re.compile(r"(tips|palm|palmar|fingers|scaling)\s*:")


def yaml_facts(path: Path) -> tuple[str, Facts] | None:
    """Kind and facts of a YAML file; None for any other.

    Raises:
        InputError: it is of neither kind, or not sound.
    """
    if path.suffix.lower() not in (".yaml", ".yml") or not path.is_file():
        return None
    if any(map(_OF_A_ROBOT.match, read_lines(path))):
        robot = load_robot(path)
        return "description of a robot hand", (
            ("palm", robot.palm),
            ("tips", ", ".join(f"{link} follows {keypoint}" for link, keypoint in robot.tips.items())),
            ("size", f"{robot.scaling:g} times a person's"),
        )
    found = load_marker_set(path, load_hand())
    return "marker set", (("markers", f"{len(found.names)}: {', '.join(found.names)}"),)
