"""What importers share: choosing a hand or reading both, masking frames, and the motion of MANO parameters."""

import dataclasses
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Bool, Float
from scipy.spatial.transform import Rotation

from mjx_hand.capture.datasets.dataset_format import Contents, Request
from mjx_hand.capture.datasets.subject import Subject
from mjx_hand.errors import InputError
from mjx_hand.motion import Motion, check_motion
from mjx_hand.motion.resample import matrix_quaternions

Array = np.ndarray
_FILES = (".pkl", ".npz")  # endings of licensed files
LONGEST = 10**7  # frames: a day at 120 a second; frame numbers beyond it are damage
FARTHEST = 1e4  # rad or m; no pose comes near


def chosen_side(path: Path, present: Sequence[Any], request: Request) -> str:
    """The hand to read: the one asked for, or the only one there.

    Raises:
        InputError: it is not there, or there are two and none was asked for, or what is there are no sides.
    """
    if not present:
        raise InputError(f"{path}: holds no hand")
    if any(side not in ("right", "left") for side in present):
        raise InputError(f"{path}: names hands {list(present)!r}, expected 'right' and 'left'"[:300])
    if request.side is None and len(present) > 1:
        raise InputError(f"{path}: holds both hands; choose one with side='right' or side='left'")
    side = request.side or present[0]
    if side not in present:
        raise InputError(f"{path}: holds no {side} hand; give side={present[0]!r}")
    return side


def hands_of(
    read: Callable[[Path, Contents, Request], Motion],
    path: Path,
    contents: Contents,
    request: Request,
    present: Sequence[str],
) -> tuple[Motion, ...]:
    """The hand that the request names, or all that are present.

    Args:
        read: reads one hand, which its request names.
        path, contents: of the recording.
        request: of a scene.
        present: the sides that were recorded.

    Raises:
        InputError: none is there, the one asked for is not, or a hand cannot be read.
    """
    first = dataclasses.replace(request, side=request.side or next(iter(present), None))
    one = chosen_side(path, present, first)
    sides = [one] if request.side is not None else list(dict.fromkeys(present))
    if len(sides) > 1 and request.mano is not None and not request.mano.is_dir():
        raise InputError(
            f"{path}: holds both hands, and {request.mano} is the file of one; give the folder of MANO_RIGHT.pkl and "
            "MANO_LEFT.pkl, or choose a hand with side='right' or side='left'"
        )
    asked = [dataclasses.replace(request, side=side, mano=mano_file(request.mano, side)) for side in sides]
    return tuple(read(path, contents, each) for each in asked)


def frame_rate(path: Path, request: Request) -> float:
    """The rate that the request says, for recordings that do not.

    Raises:
        InputError: it says none.
    """
    if request.fps is None:
        raise InputError(f"{path}: does not say its frame rate; give fps=, such as fps=30")
    return request.fps


def recorded(path: Path, *values: Array) -> Bool[Array, "t"]:
    """Which frames have numbers that a hand's can be in all of `values`, each (t, ...): finite, and not huge.

    Raises:
        InputError: none has, or a number is no angle and no place.
    """
    frames = len(values[0])
    refuse_wild(path, *values)
    finite = [np.isfinite(v).reshape(frames, -1).all(axis=1) for v in values]
    return some(path, np.logical_and.reduce(finite))


def refuse_wild(path: Path | str, *values: Array) -> None:
    """Look whether `values`, each (t, ...), are angles (rad) and places (m), as far as they are finite.

    Raises:
        InputError: one is none.
    """
    for value in values:
        wild = (np.abs(value) > FARTHEST) & np.isfinite(value)
        if wild.any():
            frame = int(np.argwhere(wild)[0][0])
            raise InputError(
                f"{path}: frame {frame} holds {value[wild][0]:.3g}, no angle (rad) and no place (m); "
                "get the file again, or put NaN there"
            )


def some(path: Path, valid: Bool[Array, "t"]) -> Bool[Array, "t"]:
    """`valid`, if any frame is.

    Raises:
        InputError: none is.
    """
    if not valid.any():
        raise InputError(f"{path}: the hand is in none of its {len(valid)} frames; nothing to read")
    return valid


def turns(vectors: Float[Array, "t *n 3"], valid: Bool[Array, "t"]) -> Float[Array, "t *n 3 3"]:
    """Axis-angles as matrices; the identity in frames that are not valid."""
    known = np.where(valid.reshape(-1, *(1,) * (vectors.ndim - 1)), vectors, 0.0).astype(float)
    return Rotation.from_rotvec(known.reshape(-1, 3)).as_matrix().reshape(*vectors.shape, 3)


def mano_motion(
    path: Path,
    *,
    orientation: Float[Array, "t 3 3"],
    rotations: Float[Array, "t 15 3 3"],
    wrist: Float[Array, "t 3"],
    valid: Bool[Array, "t"],
    subject: Subject,
    fps: float,
    side: str,
    source: str,
    wrist_known: bool = False,
) -> Motion:
    """The motion with these rotations about the flat hand and this place of the wrist joint (m).

    Frames that are not valid may hold anything: the identity and zero take its place. Where the place was made with
    the open hand's wrist (not `wrist_known`, not `subject.known`), the motion's source says so.

    Raises:
        InputError: the parts do not make a sound motion.
    """
    keep = valid[:, None, None]
    return check_motion(
        Motion(
            fps=float(fps),
            rotations=np.where(keep[:, None], rotations, np.eye(3)).astype(float),
            wrist_position=np.where(keep[..., 0], wrist, 0.0).astype(float),
            wrist_quaternion=matrix_quaternions(np.where(keep, orientation, np.eye(3)).astype(float)),
            shape=subject.shape,
            valid=valid,
            link_offset=subject.link_offset,
            tip_offset=subject.tip_offset,
            side=side,
            source=f"{source}, {side} hand"
            + ("" if wrist_known or subject.known else "; wrist place of the open hand"),
        ),
        name=str(path),
    )


def mano_file(mano: Path | None, side: str) -> Path | None:
    """The file of this side, where the folder of both is given."""
    if mano is None or not mano.is_dir():
        return mano
    named = [mano / f"MANO_{side.upper()}{ending}" for ending in _FILES]
    found = next((file for file in named if file.is_file()), None)
    if found is None:
        raise InputError(f"{mano}: has no {named[0].name}; put it there (https://mano.is.tue.mpg.de)")
    return found
