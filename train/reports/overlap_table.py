"""How deep policies put fingers into each other and the hand into the ground, as a table."""

from collections.abc import Mapping, Sequence

import numpy as np

from envs.evaluation.overlap import DEEP, Overlap
from mjx_hand.view.report import Table

_NOTE = (
    "Of all frames of all demonstrations; of fingers beyond what their shapes overlap by at rest. What the twin's hand "
    "meets besides the object, and is stopped by, is `task.contacts`."
)


def overlap_scores(overlaps: Sequence[Overlap]) -> dict[str, float]:
    """Shares of frames past `DEEP`, and the deepest (mm), over all counted frames of all seeds."""
    told = {}
    for name in ("fingers", "ground"):
        frames = np.concatenate([getattr(overlap, name)[overlap.counted] for overlap in overlaps])
        told |= {f"{name}_share": float((frames >= DEEP).mean()), f"{name}_deepest_mm": float(1e3 * frames.max())}
    return told


def overlap_table(overlaps: Mapping[str, Sequence[Overlap]]) -> Table:
    """A row a kind of overlap, a column a policy."""
    scores = {title: overlap_scores(each) for title, each in overlaps.items()}
    kinds = {"fingers": "fingers in each other", "ground": "hand in table or support"}
    rows = [
        (
            f"{words}: {1e3 * DEEP:g} mm and more, share of frames; deepest",
            *(f"{100 * s[f'{name}_share']:.1f} %; {s[f'{name}_deepest_mm']:.1f} mm" for s in scores.values()),
        )
        for name, words in kinds.items()
    ]
    return Table(("", *overlaps), rows, _NOTE)
