"""`TrackingReference`: what a player follows: one demonstration, and what to command for it, without JAX."""

import dataclasses
from pathlib import Path

import numpy as np
from jaxtyping import Float

from mjx_hand.errors import InputError
from mjx_hand.files.checked_arrays import Dimension, numbers, text
from mjx_hand.files.npz_archive import load_arrays, save_arrays

SCHEMA = "mjx-hand/tracking-reference/1"
_COORDINATES = "wrist slides along the base's axes (m), wrist turns and joints (rad)"


@dataclasses.dataclass(frozen=True)
class Field:
    """What an array of the file holds."""

    shape: tuple[Dimension, ...]
    unit: str
    frame: str
    meaning: str


FIELDS = {
    "targets": Field(("t", "u"), "m, rad", "base, joint", f"demonstrated: {_COORDINATES}"),
    "controls": Field(("t", "u"), "m, rad", "base, joint", "what to command for the step that ends at a frame"),
    "grip": Field(("t", "u"), "m, rad", "base, joint", "the share of the controls that presses the fingers"),
    "object_pose": Field(("t", 7), "m, 1", "world", "demonstrated place and quaternion (wxyz) of the object"),
    "base": Field(
        (3, 3), "1", "world", "world_from_base of the wrist, whose orientation is base Rx Ry Rz of its turns"
    ),
    "object_features": Field(("f",), "m, kg, 1", "object", "size (3), mass, sliding friction, 1 for the kind"),
    "start_qpos": Field(("q",), "m, rad, 1", "base, joint, world", "the scene's qpos at frame 0"),
    "start_qvel": Field(("v",), "m/s, rad/s", "base, joint, world", "the scene's qvel at frame 0"),
    "low": Field(("u",), "m, rad", "base, joint", "least that an actuator may be told"),
    "high": Field(("u",), "m, rad", "base, joint", "most that an actuator may be told"),
    "rate": Field((), "1/s", "-", "frames, and so control steps, a second"),
    "substeps": Field((), "1", "-", "physics steps a control step"),
}


@dataclasses.dataclass(frozen=True)
class TrackingReference:
    """A demonstration of t frames, as `FIELDS` tells; `scene` is the name of the MJCF file beside it."""

    targets: Float[np.ndarray, "t u"]
    controls: Float[np.ndarray, "t u"]
    grip: Float[np.ndarray, "t u"]
    object_pose: Float[np.ndarray, "t 7"]
    base: Float[np.ndarray, "3 3"]
    object_features: Float[np.ndarray, "f"]
    start_qpos: Float[np.ndarray, "q"]
    start_qvel: Float[np.ndarray, "v"]
    low: Float[np.ndarray, "u"]
    high: Float[np.ndarray, "u"]
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
    found = numbers(path, arrays, {name: field.shape for name, field in FIELDS.items()})
    scene = text(path, arrays, "scene")
    if Path(scene).name != scene or not scene:
        raise InputError(f"{path}: its scene is {scene!r}, expected the name of a file beside it")
    return TrackingReference(
        **{name: np.asarray(found[name]) for name, field in FIELDS.items() if field.shape},
        rate=float(found["rate"]),
        substeps=int(found["substeps"]),
        scene=scene,
    )
