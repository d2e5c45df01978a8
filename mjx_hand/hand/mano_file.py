"""Licensed MANO files (`MANO_RIGHT.pkl`, `MANO_LEFT.pkl`, or `.npz` of the same keys) as hand models.

The files come from https://mano.is.tue.mpg.de under that site's licence. Nothing in a file is run (`safe_pickle`).
"""

import zipfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from mjx_hand.errors import InputError, reason_of
from mjx_hand.files import safe_pickle
from mjx_hand.files.contents import read_archive
from mjx_hand.files.input_file import refuse_pointer
from mjx_hand.hand.joints import NUM_LINKS, PARENTS, TIP_LINKS
from mjx_hand.hand.model import HandModel

LARGEST = 2**32  # the root's entry in the joint tree; no other number of a hand comes near
MAX_SHAPE = 10  # some files carry more components than the ten that recordings use
# Finger tips of MANO's own 778-vertex mesh, by the usual convention, in the order of `joints.FINGERS`.
MANO_VERTICES = 778
MANO_TIPS = (320, 443, 671, 554, 744)


def load_mano_file(path: str | Path, side: str = "right") -> HandModel:
    """The hand in a MANO file.

    Args:
        path: the official `.pkl`, or an `.npz` with the same keys.
        side: the hand that the file is expected to hold.

    Returns:
        The hand, with at most `MAX_SHAPE` shape components, and `pose_mean` from the file's `hands_mean`.

    Raises:
        InputError: the file is missing, damaged, refused, incomplete, malformed or of the other side.
    """
    path = Path(path)
    values = _values(path)

    def get(key: str) -> np.ndarray:
        if key not in values:
            raise InputError(f"{path}: has no {key!r}; a MANO file has {', '.join(_KEYS)}")
        try:
            found = safe_pickle.array(values[key])
            sound = bool((np.abs(found.astype(np.float64)) <= LARGEST).all())
        except InputError:
            raise
        except Exception as error:  # a damaged value raises anything at all
            raise InputError(f"{path}: cannot read {key!r} ({reason_of(error)}); copy the file again") from None
        if not sound:
            raise InputError(f"{path}: {key!r} has NaN, infinity or numbers beyond {LARGEST}; copy the file again")
        return found

    template = _shaped(path, "v_template", get, (None, 3)).astype(np.float32)
    v = len(template)
    faces = _shaped(path, "f", get, (None, 3))
    if not 0 <= faces.min() <= faces.max() < v:
        raise InputError(f"{path}: 'f' names vertices {faces.min()} to {faces.max()}, but there are {v}")
    weights = _shaped(path, "weights", get, (v, NUM_LINKS))
    if (weights < -1e-6).any() or np.abs(weights.sum(axis=1) - 1).max() > 1e-3:
        raise InputError(f"{path}: 'weights' has rows that are negative or do not sum to 1; copy the file again")
    regressor = _shaped(path, "J_regressor", get, (NUM_LINKS, v)).astype(np.float32)
    parents = _shaped(path, "kintree_table", get, (2, NUM_LINKS))[0]
    if tuple(parents[1:].tolist()) != PARENTS[1:]:  # the root's own entry is 2^32 - 1
        raise InputError(f"{path}: its joint tree {parents[1:].tolist()} is not MANO's {list(PARENTS[1:])}")

    joints = regressor @ template
    found = "right" if joints[list(TIP_LINKS), 0].mean() < joints[0, 0] else "left"
    if found != side:
        raise InputError(f"{path}: holds a {found} hand, but side is {side!r}; give the other file or side={found!r}")
    shapedirs = _shaped(path, "shapedirs", get, (v, 3, None))[..., :MAX_SHAPE].astype(np.float32)
    return HandModel(
        template=template,
        faces=faces.astype(np.int32),
        weights=weights.astype(np.float32),
        shapedirs=_own_shapedirs(template, shapedirs),
        posedirs=_shaped(path, "posedirs", get, (v, 3, 135)).astype(np.float32),
        joint_regressor=regressor,
        tip_vertices=_tips(template, joints, weights),
        pose_mean=_shaped(path, "hands_mean", get, (45,)).reshape(15, 3).astype(np.float32),
        side=side,
        name=path.name,
    )


_KEYS = ("v_template", "f", "weights", "J_regressor", "kintree_table", "shapedirs", "posedirs", "hands_mean")


def _values(path: Path) -> Mapping[str, Any]:
    if not path.is_file():
        what = "a folder" if path.is_dir() else "no such file"
        raise InputError(f"{path}: {what}; give a MANO .pkl or .npz, or leave it out to use the open hand")
    refuse_pointer(path)
    if zipfile.is_zipfile(path):
        return read_archive(path)
    return safe_pickle.read(path.read_bytes(), str(path))


def _shaped(path: Path, key: str, get: Callable[[str], np.ndarray], shape: tuple[int | None, ...]) -> np.ndarray:
    """The value of `key`, which must have this shape (None: any size but 0); a flat array of the right size will do."""
    found = get(key)
    if found.ndim == 1 and len(shape) > 1 and found.size:
        known = int(np.prod([n for n in shape if n is not None]))
        if found.size % known == 0:
            found = found.reshape([-1 if n is None else n for n in shape])
    fits = found.ndim == len(shape) and all(n in (None, m) for n, m in zip(shape, found.shape, strict=True))
    if not fits or not found.size:
        expected = tuple("any" if n is None else n for n in shape)
        raise InputError(f"{path}: {key!r} has shape {found.shape}, expected {expected}".replace("'any'", "any"))
    return found


def _own_shapedirs(template: Float[np.ndarray, "v 3"], shapedirs: Float[np.ndarray, "v 3 s"]) -> np.ndarray:
    """Shape directions of this hand, not of its mirror image.

    The official left file ships the right hand's directions. The first component is the hand's size: it must
    stretch x and z together, so opposite signs tell a mirrored set.
    """
    centred = template - template.mean(axis=0)
    stretch = (centred * shapedirs[..., 0]).sum(axis=0)
    return shapedirs * np.array([-1, 1, 1], np.float32)[:, None] if stretch[0] * stretch[2] < 0 else shapedirs


def _tips(
    template: Float[np.ndarray, "v 3"], joints: Float[np.ndarray, "16 3"], weights: Float[np.ndarray, "v 16"]
) -> Int[np.ndarray, "5"]:
    """The vertex at each finger tip: the convention's on MANO's own mesh, else the distal link's farthest one."""
    if len(template) == MANO_VERTICES:
        return np.array(MANO_TIPS, np.int32)
    owner = weights.argmax(axis=1)
    tips = []
    for link in TIP_LINKS:
        own = np.flatnonzero(owner == link)
        along = (template[own] - joints[link]) @ (joints[link] - joints[link - 1])
        tips.append(own[along.argmax()])
    return np.array(tips, np.int32)
