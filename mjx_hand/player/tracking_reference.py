"""`TrackingReference`: what a player follows: one demonstration, and what to command for it, without JAX."""

import dataclasses
from pathlib import Path

import numpy as np
from jaxtyping import Float

from mjx_hand.errors import InputError
from mjx_hand.files.checked_arrays import Dimension, numbers, text
from mjx_hand.files.npz_archive import load_arrays, save_arrays

SCHEMA = "mjx-hand/tracking-reference/1"
_LAYOUT: dict[str, tuple[Dimension, ...]] = {
    "targets": ("t", 26),
    "controls": ("t", 26),
    "grip": ("t", 26),
    "object_pose": ("t", 7),
    "base": (3, 3),
    "object_features": ("f",),
    "start_qpos": (33,),
    "start_qvel": (32,),
    "low": (26,),
    "high": (26,),
    "rate": (),
    "substeps": (),
}


@dataclasses.dataclass(frozen=True)
class TrackingReference:
    """A demonstration of t frames; metres, radians, seconds, quaternions wxyz.

    Attributes:
        targets: demonstrated coordinates: the wrist's slides along the base's axes, its turns (R = base Rx Ry Rz), and
            the hinges.
        controls: what to command so that the controllers are at each target when its frame comes, and press.
        grip: the share of the controls that presses.
        object_pose: demonstrated, in the world.
        base: world_from_base of the wrist.
        object_features: size (m), mass (kg), friction, and 1 for its kind.
        start_qpos, start_qvel: the scene's state at frame 0.
        low, high: limits of what the actuators are told.
        rate: frames, and so control steps, a second.
        substeps: physics steps a control step.
        scene: name of the MJCF file beside this one.
    """

    targets: Float[np.ndarray, "t 26"]
    controls: Float[np.ndarray, "t 26"]
    grip: Float[np.ndarray, "t 26"]
    object_pose: Float[np.ndarray, "t 7"]
    base: Float[np.ndarray, "3 3"]
    object_features: Float[np.ndarray, "f"]
    start_qpos: Float[np.ndarray, "33"]
    start_qvel: Float[np.ndarray, "32"]
    low: Float[np.ndarray, "26"]
    high: Float[np.ndarray, "26"]
    rate: float
    substeps: int
    scene: str

    @property
    def num_frames(self) -> int:
        """How many frames there are."""
        return len(self.targets)


def save_tracking_reference(reference: TrackingReference, path: str | Path) -> None:
    """Write as `.npz` (schema mjx-hand/tracking-reference/1)."""
    save_arrays(path, SCHEMA, {field.name: getattr(reference, field.name) for field in dataclasses.fields(reference)})


def load_tracking_reference(path: str | Path) -> TrackingReference:
    """Read what `save_tracking_reference` wrote.

    Raises:
        InputError: not such a file.
    """
    arrays = load_arrays(path, SCHEMA)
    found = numbers(path, arrays, _LAYOUT)
    scene = text(path, arrays, "scene")
    if Path(scene).name != scene or not scene:
        raise InputError(f"{path}: its scene is {scene!r}, expected the name of a file beside it")
    return TrackingReference(
        **{name: np.asarray(found[name]) for name, shape in _LAYOUT.items() if shape},
        rate=float(found["rate"]),
        substeps=int(found["substeps"]),
        scene=scene,
    )
