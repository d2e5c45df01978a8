"""What became of each recording of a data set: one row per file."""

import csv
import dataclasses
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from mjx_hand.files.npz_archive import replacing
from mjx_hand.hand.joints import ONE_DOF
from mjx_hand.motion import Motion
from mjx_hand.retarget.sequence import RetargetErrors

DONE, FAILED = "done", "failed"
# A finger's first joint sits on the palm: its centre cannot be wrong, and would only dilute the mean.
OUTER_JOINTS = [1 + k for k in ONE_DOF]


@dataclasses.dataclass(frozen=True)
class Outcome:
    """A row of the summary; errors are the mean, the 95th percentile and the largest over valid frames.

    Attributes:
        file: the recording, relative to the data set's folder.
        status: "done" or "failed".
        frames, gaps, fps, seconds: of the recording.
        rotation_*: degrees, over the 15 joints. joint_*: mm, over the ten outer joints. tip_*: mm, over the five tips.
        message: why it failed.
        warnings: what is doubtful about it.
    """

    file: str
    status: str
    frames: int = 0
    gaps: int = 0
    fps: float = 0.0
    seconds: float = 0.0
    rotation_mean_deg: float = 0.0
    rotation_95_deg: float = 0.0
    rotation_max_deg: float = 0.0
    joint_mean_mm: float = 0.0
    joint_95_mm: float = 0.0
    joint_max_mm: float = 0.0
    tip_mean_mm: float = 0.0
    tip_95_mm: float = 0.0
    tip_max_mm: float = 0.0
    message: str = ""
    warnings: str = ""


def outcome_of(file: str, motion: Motion, errors: RetargetErrors, warnings: tuple[str, ...] = ()) -> Outcome:
    """The row of a recording that was retargeted."""
    good = errors.valid
    figures = {}
    for name, unit, values in (
        ("rotation", "deg", np.degrees(errors.rotation[good])),
        ("joint", "mm", 1e3 * errors.joint_position[good][:, OUTER_JOINTS]),
        ("tip", "mm", 1e3 * errors.tip_position[good]),
    ):
        figures[f"{name}_mean_{unit}"] = round(float(values.mean()), 4)
        figures[f"{name}_95_{unit}"] = round(float(np.percentile(values, 95)), 4)
        figures[f"{name}_max_{unit}"] = round(float(values.max()), 4)
    return Outcome(
        file=file,
        status=DONE,
        frames=motion.num_frames,
        gaps=motion.num_frames - int(good.sum()),
        fps=float(motion.fps),
        seconds=round(motion.num_frames / motion.fps, 3),
        warnings=" | ".join(warnings),
        **figures,
    )


def write_summary(outcomes: Sequence[Outcome], path: Path) -> None:
    """Write the rows as CSV, with the fields' names on the first line; whole or not at all."""
    names = [field.name for field in dataclasses.fields(Outcome)]
    with replacing(path) as temporary, temporary.open("w", newline="") as file:
        writer = csv.DictWriter(file, names)
        writer.writeheader()
        for outcome in outcomes:
            row = dataclasses.asdict(outcome)
            if outcome.status != DONE:  # figures that do not exist are left empty, not zero
                row = {name: row[name] if name in ("file", "status", "message") else "" for name in names}
            writer.writerow(row)
