"""Simulated capture of performed trials: recorded with markers, noise and gaps, fitted, projected; truth kept beside.

What comes out is what a laboratory would have: the twin never sees the true angles, shape or contact forces.
"""

import dataclasses
import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import jax
import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from envs.demonstrations.scripted.trials import Trial, support_boxes
from envs.grasps import GraspType
from envs.scene import TIMESTEP
from mjx_hand.capture.marker_fit.fit import fit_many
from mjx_hand.capture.markers.marker_set import included_marker_set
from mjx_hand.capture.simulation.off_axis import add_off_axis_rotation
from mjx_hand.capture.simulation.simulate import simulate_markers
from mjx_hand.errors import InputError
from mjx_hand.files.checked_arrays import numbers
from mjx_hand.files.npz_archive import load_arrays, save_arrays
from mjx_hand.hand.model import HandModel
from mjx_hand.motion.demonstration import Demonstration
from mjx_hand.motion.joint_motion import JointMotion
from mjx_hand.motion.motion import Motion
from mjx_hand.motion.resample import matrix_quaternions, resample_motion
from mjx_hand.motion.smooth import CUTOFF, low_pass, smooth_rows
from mjx_hand.pytree import replace
from mjx_hand.retarget.hands import KinematicHands
from mjx_hand.retarget.options import RetargetOptions
from mjx_hand.retarget.sequence import retarget_sequence
from mjx_hand.rigid.rigid_hand import RigidHand, joint_rotations, without_meshes

TRUTH_SCHEMA = "mjx-hand/truth/1"
_TRUTH_LAYOUT: dict[str, tuple[int | str, ...]] = {
    "angles": ("t", 20),
    "wrist_position": ("t", 3),
    "wrist_quaternion": ("t", 4),
    "object_pose": ("t", 7),
    "shape": ("s",),
}
_PROJECTION = ("method", "axes", "refine")  # settings that concern the twin, not the recording


@dataclasses.dataclass(frozen=True)
class CaptureSettings:
    """How trials are recorded.

    Attributes:
        fps: of the marker system, 1/s.
        marker_noise: standard deviation of each marker coordinate, m.
        gap_fraction: share of frames in which a marker is hidden.
        off_axis: rotations that hinges cannot follow, as a share of what real recordings show.
        object_noise: standard deviation of the object's measured position, m; of its orientation, ten times as many
            rad.
        rate: of the demonstrations made from the recordings, 1/s.
        cutoff: of the low-pass filter on their angles and poses, Hz.
        method, refine: how rotations become hinge angles, as in `RetargetOptions`.
        axes: of the twin's hinges: "anatomical", or "functional", fitted to each recording.
    """

    fps: float = 120.0
    marker_noise: float = 0.0005
    gap_fraction: float = 0.05
    off_axis: float = 1.0
    object_noise: float = 0.0002
    rate: float = 50.0
    cutoff: float = CUTOFF
    method: str = "exact"
    axes: str = "anatomical"
    refine: str = "none"

    def __post_init__(self):
        for name in ("fps", "rate", "cutoff"):
            if not (math.isfinite(getattr(self, name)) and getattr(self, name) > 0):
                raise InputError(f"data.capture.{name} is {getattr(self, name)}; it must be a positive number")
        for name in ("marker_noise", "off_axis", "object_noise"):
            if not (math.isfinite(getattr(self, name)) and getattr(self, name) >= 0):
                raise InputError(f"data.capture.{name} is {getattr(self, name)}; it must be a number of 0 or more")
        if not 0 <= self.gap_fraction < 1:
            raise InputError(f"data.capture.gap_fraction is {self.gap_fraction}; it must be at least 0 and below 1")
        if self.cutoff >= self.rate / 2:
            raise InputError(
                f"data.capture.cutoff is {self.cutoff} Hz; it must be below half of data.capture.rate ({self.rate} Hz)"
            )
        RetargetOptions(method=self.method, refine=self.refine)
        KinematicHands(axes=self.axes)

    def projected_as_usual(self) -> "CaptureSettings":
        """The same recordings with the projection that there is unless another is asked for."""
        usual = {field.name: field.default for field in dataclasses.fields(self) if field.name in _PROJECTION}
        return dataclasses.replace(self, **usual)

    def fingerprint(self) -> dict[str, Any]:
        """What tells recordings apart: all settings, the projection's only where they are not the usual ones.

        There was one projection first, and sets from then keep their names.
        """
        usual = self.projected_as_usual()
        settings = dataclasses.asdict(self)
        return {n: v for n, v in settings.items() if n not in _PROJECTION or v != getattr(usual, n)}


@dataclasses.dataclass(frozen=True)
class Truth:
    """What really happened in a demonstration, at its own rate; metres, radians, wxyz.

    Attributes:
        angles: the hinge angles that the performing hand had (before off-axis rotation was added).
        wrist_position, wrist_quaternion: its wrist.
        object_pose: the object.
        shape: its shape coefficients.
    """

    angles: Float[np.ndarray, "t j"]
    wrist_position: Float[np.ndarray, "t 3"]
    wrist_quaternion: Float[np.ndarray, "t 4"]
    object_pose: Float[np.ndarray, "t 7"]
    shape: Float[np.ndarray, "s"]


class Recorded(NamedTuple):
    """One recorded trial: the motion that was fitted to its markers, what the twin is to replay, and the truth."""

    motion: Motion
    demonstration: Demonstration
    truth: Truth


def record_trials(
    trials: Sequence[Trial],
    hands: Sequence[RigidHand],
    shapes: Float[np.ndarray, "p s"],
    model: HandModel,
    grasp: GraspType,
    seed: int,
    settings: CaptureSettings | None = None,
    progress: Callable[[float], None] | None = None,
) -> list[Recorded]:
    """Record, fit and project each trial.

    Args:
        trials: what was performed.
        hands, shapes: the true hand and its shape coefficients, by person.
        model: the hand model that both the people and the fit use; the open hand, of which twins are made.
        grasp: their type.
        seed: of noise, gaps and off-axis rotations.
        settings: of the capture system.
        progress: told the share of the fitting done.
    """
    settings = CaptureSettings() if settings is None else settings
    markers = included_marker_set(model)
    seeds = np.random.SeedSequence(seed).generate_state(3 * len(trials)).reshape(-1, 3).tolist()
    recordings = []
    rotations = _true_rotations(trials, hands)
    for k, trial in enumerate(trials):
        motion = _true_motion(trial, rotations[k], shapes[trial.person], model, settings, seeds[k][0])
        recordings.append(
            simulate_markers(
                model,
                motion,
                markers,
                seeds[k][1],
                noise=settings.marker_noise,
                gap_fraction=settings.gap_fraction,
            )
        )
    out = []
    support, support_position = support_boxes(grasp)
    twins = KinematicHands(axes=settings.axes)
    for k, (motion, _) in enumerate(fit_many(recordings, model, markers, progress=progress)):
        trial, fitted = trials[k], resample_motion(motion, settings.rate)
        joints, hinges = project_recording(fitted, settings, twins)
        truth = _truth(trial, shapes[trial.person], joints.num_frames, settings.rate)
        source = f"simulated {grasp.name}, person {trial.person}, seed {seed}.{k}"
        demonstration = Demonstration(
            motion=replace(joints, source=source),
            object_pose=_measured(truth.object_pose, settings, seeds[k][2]),
            object=trial.object,
            support=support,
            support_position=support_position,
            shape=fitted.shape,
            grasp=grasp.name,
            source=source,
            **hinges,
        )
        out.append(Recorded(replace(fitted, source=source), demonstration, truth))
    return out


def project_recording(
    fitted: Motion, settings: CaptureSettings, twins: KinematicHands
) -> tuple[JointMotion, dict[str, Any]]:
    """A fitted motion on the twin's hinges, filtered; and `Demonstration`'s description of them, if they are its own.

    Args:
        fitted: at the demonstration's rate.
        settings: of projection and filter.
        twins: makes the hand, with the axes of the settings.
    """
    twin = twins.of(fitted)
    joints = retarget_sequence(fitted, twin, settings.method, refine=settings.refine)
    own = settings.axes != settings.projected_as_usual().axes
    hinges = {"hinge_axis": twin.hinge_axis, "rest_rotation": twin.rest_rotation} if own else {}
    return low_pass(joints, settings.cutoff), hinges


def _true_rotations(trials: Sequence[Trial], hands: Sequence[RigidHand]) -> list[Float[np.ndarray, "t 15 3 3"]]:
    """Each trial's true MANO rotations; padded to one length, so that one compilation serves all."""
    frames = max(len(trial.angles) for trial in trials)
    rotate = jax.jit(joint_rotations)
    out = []
    for trial in trials:
        missing = frames - len(trial.angles)
        angles = np.pad(trial.angles, ((0, missing), (0, 0)), mode="edge").astype(np.float32)
        hand = without_meshes(hands[trial.person])
        out.append(np.asarray(rotate(angles, hand), np.float64)[: len(trial.angles)])
    return out


def _true_motion(
    trial: Trial,
    rotations: Float[np.ndarray, "t 15 3 3"],
    shape: Float[np.ndarray, "s"],
    model: HandModel,
    settings: CaptureSettings,
    seed: int,
) -> Motion:
    """The trial as the moving skin that a marker system sees, off-axis rotations added."""
    moved = Motion(
        fps=1 / TIMESTEP,
        rotations=rotations,
        wrist_position=trial.wrist_position,
        wrist_quaternion=Rotation.from_matrix(trial.wrist_rotation).as_quat(scalar_first=True),
        shape=shape,
        valid=np.ones(len(rotations), bool),
        side=model.side,
        source="performed trial",
    )
    moved = resample_motion(moved, settings.fps)
    rotations = add_off_axis_rotation(moved.rotations, seed, settings.off_axis, settings.fps)
    return replace(moved, rotations=rotations)


def _truth(trial: Trial, shape: np.ndarray, frames: int, rate: float) -> Truth:
    rows = np.minimum(np.round(np.arange(frames) / rate / TIMESTEP).astype(int), len(trial.angles) - 1)
    return Truth(
        angles=trial.angles[rows],
        wrist_position=trial.wrist_position[rows],
        wrist_quaternion=Rotation.from_matrix(trial.wrist_rotation[rows]).as_quat(scalar_first=True),
        object_pose=trial.object_pose[rows],
        shape=shape,
    )


def _measured(pose: Float[np.ndarray, "t 7"], settings: CaptureSettings, seed: int) -> Float[np.ndarray, "t 7"]:
    """The object's pose as measured: with noise, then filtered as the hand's is."""
    rng = np.random.default_rng(seed)
    position = pose[:, :3] + rng.normal(scale=settings.object_noise, size=(len(pose), 3))
    turn = Rotation.from_rotvec(rng.normal(scale=settings.object_noise * 10, size=(len(pose), 3)))
    quaternion = matrix_quaternions((turn * Rotation.from_quat(pose[:, 3:], scalar_first=True)).as_matrix())
    rows = smooth_rows(np.concatenate([position, quaternion], axis=1), settings.rate, settings.cutoff)
    rows[:, 3:] /= np.linalg.norm(rows[:, 3:], axis=1, keepdims=True)
    return rows


def save_truth(truth: Truth, path: str | Path) -> None:
    """Write as `.npz` (schema mjx-hand/truth/1)."""
    save_arrays(path, TRUTH_SCHEMA, dataclasses.asdict(truth))


def load_truth(path: str | Path) -> Truth:
    """Read what `save_truth` wrote.

    Raises:
        InputError: not such a file, or its arrays are not sound.
    """
    return Truth(**numbers(path, load_arrays(path, TRUTH_SCHEMA), _TRUTH_LAYOUT))
