"""Variations of one recorded demonstration: what another capture of the same act by the same person might have been."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from envs.demonstrations.recordings.recording_settings import VARIATION, RecordingSettings
from mjx_hand.errors import InputError
from mjx_hand.motion.demonstration import Demonstration
from mjx_hand.motion.resample import interpolation_index, matrix_quaternions, quaternion_matrices, slerp
from mjx_hand.motion.smooth import smooth_rows
from mjx_hand.pytree import replace

_MASSES = 1.25  # the object's mass divided and multiplied by this, where no range is given
_ONE_OF = 4  # recordings is held out, where whole ones are
_DRIFT = 0.5  # Hz: errors of capture that a filter leaves are slow


def divided(
    demonstrations: Sequence[Demonstration], settings: RecordingSettings, heldout: bool, rng: np.random.Generator
) -> list[Demonstration]:
    """The demonstrations of one part, of all recordings in turn; the first held-out one of each is not varied.

    Raises:
        InputError: recordings are to be held out, and there is one alone.
    """
    chosen = [
        d
        for d, apart in zip(demonstrations, held_out(len(demonstrations), settings), strict=True)
        if apart is None or apart == heldout
    ]
    wanted = settings.heldout if heldout else settings.train
    count = max(wanted, len(chosen))
    return [
        chosen[k] if heldout and k < len(chosen) else vary(chosen[k % len(chosen)], settings, rng) for k in range(count)
    ]


def held_out(count: int, settings: RecordingSettings) -> list[bool | None]:
    """Whether each of `count` recordings is held out: None where its variations are in both parts.

    Raises:
        InputError: recordings are to be held out, and there is one alone.
    """
    if settings.hold_out == VARIATION:
        return [None] * count
    if count < 2:
        raise InputError(
            f"{settings.path}: one recording cannot be held out and trained on; give data.recording.hold_out=variation"
        )
    return [k % _ONE_OF == min(_ONE_OF, count) - 1 for k in range(count)]


def vary(demonstration: Demonstration, settings: RecordingSettings, rng: np.random.Generator) -> Demonstration:
    """The demonstration at another pace, with another mass and friction and other errors of capture."""
    d = _at_pace(demonstration, rng.uniform(*settings.speeds))
    fps, frames = d.motion.fps, d.num_frames
    moved = settings.wrist_error * _drift(rng, frames, 3, fps) + _start(d)[:, None] * (
        settings.start_error * rng.normal(size=3)
    )
    turned = Rotation.from_rotvec(10 * settings.wrist_error * _drift(rng, frames, 3, fps))
    wrist = turned * Rotation.from_quat(d.motion.wrist_quaternion, scalar_first=True)
    motion = replace(
        d.motion,
        angles=d.motion.angles + settings.angle_error * _drift(rng, frames, d.motion.angles.shape[1], fps),
        wrist_position=_turned_about(d, turned) + moved,
        wrist_quaternion=matrix_quaternions(wrist.as_matrix()),
    )
    low, high = settings.masses or (d.object.mass / _MASSES, d.object.mass * _MASSES)
    varied = replace(d.object, mass=float(rng.uniform(low, high)), friction=float(rng.uniform(*settings.frictions)))
    return replace(d, motion=motion, object=varied)


def _at_pace(d: Demonstration, speed: float) -> Demonstration:
    """The same at `speed` times its pace and the same rate."""
    count = int((d.num_frames - 1) / speed + 1e-9) + 1
    before, after, fraction = interpolation_index(np.arange(d.num_frames, dtype=float), np.arange(count) * speed)

    def line(rows: np.ndarray) -> np.ndarray:
        return (1 - fraction[:, None]) * rows[before] + fraction[:, None] * rows[after]

    def arc(quaternions: np.ndarray) -> np.ndarray:
        rotation = quaternion_matrices(quaternions)
        return matrix_quaternions(slerp(rotation[before], rotation[after], fraction))

    motion = replace(
        d.motion,
        angles=line(d.motion.angles),
        wrist_position=line(d.motion.wrist_position),
        wrist_quaternion=arc(d.motion.wrist_quaternion),
        valid=np.ones(count, bool),
    )
    pose = np.concatenate([line(d.object_pose[:, :3]), arc(d.object_pose[:, 3:])], axis=1)
    return replace(d, motion=motion, object_pose=pose)


def _turned_about(d: Demonstration, turned: Rotation) -> Float[np.ndarray, "t 3"]:
    """Where the wrist is when it turns about the object: capture sees fingers where they are, and errs in the wrist."""
    return d.object_pose[:, :3] + turned.apply(d.motion.wrist_position - d.object_pose[:, :3])


def _start(d: Demonstration) -> Float[np.ndarray, "t"]:
    """How far the reach is from its end, as a share of what it is at first: 1 falling to 0, and 0 from then on."""
    away = np.linalg.norm(d.motion.wrist_position - d.object_pose[:, :3], axis=1)
    left = np.clip((away - away.min()) / max(away[0] - away.min(), 1e-9) - 0.1, 0.0, None) / 0.9
    reached = int(np.argmax(left == 0)) if (left == 0).any() else len(left)
    left[reached:] = 0.0
    return left


def _drift(rng: np.random.Generator, frames: int, columns: int, fps: float) -> Float[np.ndarray, "t c"]:
    """Slow random errors of unit variance, the same in frame 0 as anywhere."""
    margin = round(2 * fps / _DRIFT)  # the filter's own start and end are cut off
    rows = smooth_rows(rng.normal(size=(frames + 2 * margin, columns)), fps, _DRIFT)
    return rows[margin : margin + frames] / rows.std(axis=0)
