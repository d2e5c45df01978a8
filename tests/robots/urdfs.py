"""Where the robot hands' URDFs are that the tests use: in the wheel `dexi-rs`, under the MIT licence."""

from importlib.util import find_spec
from pathlib import Path

import pytest

FOLDERS = {
    "ability": "ability_hand/ability_hand",
    "allegro": "allegro_hand/allegro_hand",
    "inspire": "inspire_hand/inspire_hand",
    "leap": "leap_hand/leap_hand",
    "schunk": "schunk_hand/schunk_svh_hand",
    "shadow": "shadow_hand/shadow_hand",
}


def urdf_of(robot: str, side: str = "right") -> Path:
    spec = find_spec("dexi_rs")
    if spec is None or spec.origin is None:
        pytest.skip("no robot hands: the wheel dexi-rs is not installed")
    return Path(spec.origin).parent / f"resources/assets/robots/hands/{FOLDERS[robot]}_{side}.urdf"
