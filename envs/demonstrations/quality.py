"""How good the demonstrations of a set are: what they do, and how far capture put them from the truth."""

import dataclasses
from pathlib import Path

import numpy as np
from jaxtyping import Float

from envs.demonstrations.load_set import load_part
from envs.demonstrations.scripted.simulated_capture import load_truth
from mjx_hand.errors import InputError

LIFT = 0.095  # m that every demonstration must lift its object: 10 cm, less what soft pads give
# m that the measured object may be from the true one: the filter rounds off how a handle leaves its posts
_STRAY = 0.01


@dataclasses.dataclass(frozen=True)
class Quality:
    """Of n demonstrations.

    Attributes:
        seconds: how long each is.
        lift: highest rise of the object (m).
        angle_error: mean distance of the twin's hinges from the performer's (rad).
        wrist_error: mean distance of the wrists (m).
        object_error: largest distance of the measured object from the true one (m).
    """

    seconds: Float[np.ndarray, "n"]
    lift: Float[np.ndarray, "n"]
    angle_error: Float[np.ndarray, "n"]
    wrist_error: Float[np.ndarray, "n"]
    object_error: Float[np.ndarray, "n"]


def check_part(folder: str | Path, part: str) -> Quality:
    """Read one part of a set back, with its truths, and check it.

    Raises:
        InputError: a file is missing or damaged, a demonstration does not lift its object by `LIFT`, or shows it away
            from where it was.
    """
    rows = []
    for k, d in enumerate(load_part(folder, part)):
        truth = load_truth(Path(folder, part, f"{k:03d}.truth.npz"))
        away = np.linalg.norm(truth.object_pose[:, :3] - d.object_pose[:, :3], axis=1)
        rows.append(
            (
                d.num_frames / d.motion.fps,
                (truth.object_pose[:, 2] - truth.object_pose[0, 2]).max(),
                np.abs(truth.angles - d.motion.angles).mean(),
                np.linalg.norm(truth.wrist_position - d.motion.wrist_position, axis=1).mean(),
                away.max(),
            )
        )
    quality = Quality(*np.array(rows).T)
    for what, bad in (
        (f"lifts its object by less than {100 * LIFT:.1f} cm", quality.lift < LIFT),
        (f"shows its object more than {1000 * _STRAY:.0f} mm from where it was", quality.object_error > _STRAY),
    ):
        if bad.any():
            raise InputError(
                f"{Path(folder, part)}: demonstration {int(np.argmax(bad))} {what}; "
                "delete the folder and make the set anew, or mend the grasp type"
            )
    return quality


@dataclasses.dataclass(frozen=True)
class Tracking:
    """How far a tracker had the hands of n demonstrations from where they were.

    Attributes:
        seconds: how long each is.
        angle_error, wrist_error: mean distance of the hinges (rad) and of the wrist (m).
    """

    seconds: Float[np.ndarray, "n"]
    angle_error: Float[np.ndarray, "n"]
    wrist_error: Float[np.ndarray, "n"]


def check_streamed(folder: str | Path, part: str) -> Tracking:
    """Read one part of a streamed set back.

    Raises:
        InputError: a file is missing or damaged, or no tracker saw a demonstration.
    """
    rows = []
    for k, d in enumerate(load_part(folder, part)):
        if d.tracked is None:
            raise InputError(
                f"{Path(folder, part)}: demonstration {k} is not streamed; delete the folder, make it anew"
            )
        place, _, angles = np.split(d.tracked, [3, 7], axis=1)
        off = np.linalg.norm(place - d.motion.wrist_position, axis=1).mean()
        rows.append((d.num_frames / d.motion.fps, np.abs(angles - d.motion.angles).mean(), off))
    return Tracking(*np.array(rows).T)
