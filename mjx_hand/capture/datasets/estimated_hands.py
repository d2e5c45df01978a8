"""The hands in one image, from the output of HaMeR, WiLoR or WiLoR-mini; `hamer` says what that is."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from mjx_hand.capture.datasets.mano_motion import refuse_wild
from mjx_hand.errors import InputError
from mjx_hand.files.checked_arrays import numbers
from mjx_hand.files.contents import plain, unwrapped

Array = np.ndarray
_PARAMETERS = ("global_orient", "hand_pose", "betas")
_NAMES = (*_PARAMETERS, "right", "is_right", "pred_cam_t_full", "pred_keypoints_3d")  # of an archive no others are read
_MIRROR = np.diag([-1.0, 1, 1])


@dataclass(frozen=True)
class EstimatedHand:
    """One hand in one image: its own rotations (wrist first), shape, translation, and joints (NaN if not there)."""

    side: str
    rotations: Float[Array, "16 3 3"]
    shape: Float[Array, "10"]
    translation: Float[Array, "3"]
    joints: Float[Array, "21 3"]

    def row(self) -> Float[Array, "220"]:
        return np.concatenate([self.rotations.ravel(), self.shape, self.translation, self.joints.ravel()])


def _parameters(entry: Any) -> Mapping[str, Any]:
    """The named values of HaMeR's dictionary, its parameters among them; nothing where it is none."""
    if not isinstance(entry, Mapping):
        return {}
    inner = unwrapped(entry.get("pred_mano_params"))
    places = [inner, entry] if isinstance(inner, dict) else [entry]
    homes = {name: place for name in _NAMES for place in reversed(places) if name in place}
    return {name: homes[name][name] for name in homes} if set(_PARAMETERS) <= homes.keys() else {}


def is_list_of_hands(entry: Any) -> bool:
    """Whether this is WiLoR-mini's form of an image's entry."""
    return isinstance(entry, list) and bool(entry) and all(isinstance(e, dict) and "is_right" in e for e in entry)


def hands_in(where: str, entry: Any) -> list[EstimatedHand]:
    """The hands that an image's entry holds; none where it is None or an empty list.

    Raises:
        InputError: the entry is not one model's output, or its numbers are not sound.
    """
    entry = unwrapped(entry)
    if entry is None or (isinstance(entry, list) and not entry):
        return []
    if is_list_of_hands(entry):
        seen = [e for e in entry if isinstance(e.get("wilor_preds"), dict)]
        return [hand for e in seen for hand in _mini(where, e)]
    values = _parameters(entry)
    if not values:
        raise InputError(f"{where}: holds no {', '.join(_PARAMETERS)}; save the model's own output")
    right = plain(where, "right", values.get("right", values.get("is_right")))
    count = right.size
    right = numbers(where, {"right": right.reshape(count)}, {"right": (count,)})["right"]
    found = _found(where, values)
    layout = {"global_orient": (count, 1, 3, 3), "hand_pose": (count, 15, 3, 3)}
    rotations = np.concatenate(list(numbers(where, found, layout, finite=False).values()), axis=1).astype(float)
    mirror = np.where(right.reshape(-1, 1, 1) > 0.5, np.eye(3), _MIRROR)
    rotations = mirror[:, None] @ rotations @ mirror[:, None]
    return _made(where, found, right, rotations, mirror)


def _mini(where: str, entry: dict[str, Any]) -> list[EstimatedHand]:
    right = plain(where, "is_right", entry["is_right"])
    if right.size != 1 or right.dtype.kind not in "fiub":
        raise InputError(f"{where}: is_right is no single number")
    found = _found(where, entry["wilor_preds"])
    layout = {"global_orient": (1, 1, 3), "hand_pose": (1, 15, 3)}
    vectors = np.concatenate(list(numbers(where, found, layout, finite=False).values()), axis=1).astype(float)
    refuse_wild(where, vectors)
    finite = np.isfinite(vectors).all()
    rotations = Rotation.from_rotvec(vectors[0]).as_matrix() if finite else np.full((16, 3, 3), np.nan)
    return _made(where, found, right, rotations[None], np.eye(3)[None])


def _found(where: str, values: Mapping[str, Any]) -> dict[str, Array]:
    names = (*_PARAMETERS, "pred_cam_t_full", "pred_keypoints_3d")
    found = {name: plain(where, name, values[name]) for name in names if name in values}
    if "pred_cam_t_full" not in found:
        raise InputError(f"{where}: has no pred_cam_t_full; save it too (pred_cam_t is of the crop, not of the image)")
    return found


def _made(where: str, found: dict[str, Array], right: Array, rotations: Array, mirror: Array) -> list[EstimatedHand]:
    count = len(rotations)
    values = numbers(where, found, {"betas": (count, 10), "pred_cam_t_full": (count, 3)}, finite=False)
    joints = np.full((count, 21, 3), np.nan)
    if "pred_keypoints_3d" in found:
        joints = (
            numbers(where, found, {"pred_keypoints_3d": (count, 21, 3)}, finite=False)["pred_keypoints_3d"] @ mirror
        )
    refuse_wild(where, rotations)
    given = rotations[np.isfinite(rotations).all(axis=(1, 2, 3))]
    off = np.abs(given @ np.swapaxes(given, -1, -2) - np.eye(3)).max(initial=0)
    if off > 0.01 or (np.linalg.det(given) < 0).any():  # half precision is off by 0.002
        raise InputError(f"{where}: global_orient or hand_pose holds matrices that are not rotations")
    return [
        EstimatedHand(
            side="right" if right.ravel()[k] > 0.5 else "left",
            rotations=rotations[k],
            shape=values["betas"][k].astype(float),
            translation=values["pred_cam_t_full"][k].astype(float),
            joints=joints[k].astype(float),
        )
        for k in range(count)
    ]


def is_entry(entry: Any) -> bool:
    """Whether this is an image's entry with hands in it, of either form."""
    entry = unwrapped(entry)
    return is_list_of_hands(entry) or bool(_parameters(entry))
