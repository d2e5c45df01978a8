"""Variations of one recorded demonstration: what another capture of the same act by the same person might have been."""

import dataclasses
import math

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from mjx_hand.errors import InputError
from mjx_hand.motion.demonstration import Demonstration
from mjx_hand.motion.resample import interpolation_index, matrix_quaternions, quaternion_matrices, slerp
from mjx_hand.motion.smooth import CUTOFF, smooth_rows
from mjx_hand.pytree import replace

_DRIFT = 0.5  # Hz: errors of capture that a filter leaves are slow


@dataclasses.dataclass(frozen=True)
class RecordingSettings:
    """A real recording in the place of simulated capture, and how to vary it.

    Attributes:
        path: folder of a DexMV recording: its `.npz` and the object's mesh, `.stl`; empty for simulated capture.
        train, heldout: demonstrations in each part. The first held-out one is the recording itself, not varied.
        mass, friction: of the object as it was recorded (kg).
        masses, frictions: between which variations draw them.
        force: with which the hand must be able to carry the object as it was recorded (N).
        speeds: between which the pace is drawn, as a multiple of the recorded one.
        wrist_error: standard deviation of the wrist's slow error, m; of its orientation, ten times as many rad.
        angle_error: of the hinges' slow error, rad.
        start_error: of where the wrist starts, m; gone when the hand is at the object.
        pieces: convex pieces at most that the object's mesh becomes.
        rate: of the demonstrations, 1/s.
        cutoff: of the low-pass filter on the recorded angles and poses, Hz.
    """

    path: str = ""
    train: int = 64
    heldout: int = 32
    mass: float = 0.6
    friction: float = 0.8
    masses: tuple[float, float] = (0.3, 0.65)
    frictions: tuple[float, float] = (0.7, 1.0)
    force: float = 32.0
    speeds: tuple[float, float] = (0.9, 1.1)
    wrist_error: float = 0.001
    angle_error: float = 0.02
    start_error: float = 0.01
    pieces: int = 3
    rate: float = 50.0
    cutoff: float = CUTOFF

    def __post_init__(self):
        for name in ("train", "heldout", "pieces"):
            if getattr(self, name) < 1:
                raise InputError(f"data.recording.{name} is {getattr(self, name)}; it must be at least 1")
        for name in ("mass", "friction", "force", "rate", "cutoff"):
            if not 0 < getattr(self, name) < math.inf:
                raise InputError(f"data.recording.{name} is {getattr(self, name)}; it must be a positive number")
        for name in ("masses", "frictions", "speeds"):
            limits = getattr(self, name)
            if len(limits) != 2 or not 0 < limits[0] <= limits[1] < math.inf:
                raise InputError(
                    f"data.recording.{name} is {list(limits)}; give the lowest and the highest, both above 0"
                )
        for name in ("wrist_error", "angle_error", "start_error"):
            if not 0 <= getattr(self, name) < math.inf:
                raise InputError(f"data.recording.{name} is {getattr(self, name)}; it must be a number of 0 or more")
        if self.cutoff >= self.rate / 2:
            raise InputError(
                f"data.recording.cutoff is {self.cutoff} Hz; it must be below half of data.recording.rate ({self.rate})"
            )


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
    varied = replace(
        d.object, mass=float(rng.uniform(*settings.masses)), friction=float(rng.uniform(*settings.frictions))
    )
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
