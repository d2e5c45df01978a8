"""The picture of docs/demonstrations.md: one demonstration of each grasp type, a row each, at six moments.

`python docs/figures/grasps.py [FOLDER]` makes a small set of each type below FOLDER (outputs/demonstrations).
"""

import sys
from pathlib import Path

import numpy as np
from PIL import Image

from envs.demonstrations.contact_sheet import contact_sheet
from envs.demonstrations.dataset import make_set
from envs.demonstrations.load_set import load_part
from envs.demonstrations.set_settings import SetSettings
from envs.demonstrations.twin_hands import twins
from mjx_hand.progress import shares

TYPES = ("power", "cylindrical", "spherical", "pinch", "lateral")


def main(root: Path) -> None:
    """Write grasps.png beside this file."""
    rows = []
    for name in TYPES:
        with shares() as report:
            folder = make_set(SetSettings(name, people=1, heldout_people=1, trials=2, heldout_trials=1), root, report)
        demonstrations = load_part(folder, "train")
        rows.append(contact_sheet(demonstrations, twins(demonstrations), rows=1, size=400))  # twice what is kept
    picture = Image.fromarray(np.concatenate(rows)).reduce(2).quantize(256)
    picture.save(Path(__file__).with_name("grasps.png"), optimize=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path("outputs/demonstrations"))
