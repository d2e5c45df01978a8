"""The subject's hand behind MANO parameters: its joints at rest, and the pose space of the licensed file."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float

from mjx_hand.capture.datasets.dataset_format import Request
from mjx_hand.errors import InputError
from mjx_hand.files.checked_arrays import numbers
from mjx_hand.files.contents import plain, read_contents
from mjx_hand.hand.joints import PARENTS, TIP_LINKS
from mjx_hand.hand.load import load_hand
from mjx_hand.hand.mano_file import load_mano_file

Array = np.ndarray

_LARGEST = 1000.0  # of a shape coefficient, in standard deviations


@dataclass(frozen=True)
class Subject:
    """One person's hand, as far as it is known.

    Attributes:
        shape: MANO shape coefficients; zeros where nothing here knows their meaning.
        wrist: the wrist joint at rest, in the hand model's own frame (m). MANO turns the hand about this point, so
            a translated hand has its wrist at this place plus the translation.
        link_offset: joint centres at rest relative to each parent's (m), or None.
        tip_offset: finger tips in the last links' frames (m), or None.
        known: whether `wrist` is the subject's own and not the open hand's.
    """

    shape: Float[Array, "s"]
    wrist: Float[Array, "3"]
    link_offset: Float[Array, "16 3"] | None = None
    tip_offset: Float[Array, "5 3"] | None = None
    known: bool = True


def subject_of(
    request: Request, side: str, shape: Float[Array, "s"], *, as_shipped: bool = True, template: Array | None = None
) -> Subject:
    """The hand with these shape coefficients, from the licensed file if the request names one.

    Shape coefficients are directions in the licensed model, which the open hand does not share. Without a file its mean
    hand therefore stands in: rotations are not touched by that, but positions are off by one constant vector, the
    distance between the two models' wrist joints (some centimetres), and the coefficients are left out.

    Args:
        request: names the file, or none.
        side: of the hand.
        shape: the coefficients.
        as_shipped: use a left file's shape directions as they stand in the file, which are the right hand's. Most
            datasets' own tools do, so their coefficients mean that.
        template: (778, 3) the subject's own rest vertices (m), in place of coefficients.

    Raises:
        InputError: the file cannot be used, or has fewer coefficients or other vertices.
    """
    if not (np.abs(shape) < _LARGEST).all():
        raise InputError(f"shape coefficients are {float(np.abs(shape).max())} at most; a hand's are below ten")
    if request.mano is None:
        hand = load_hand(None, side)
        wrist = hand.joint_regressor[0] @ hand.template
        return Subject(np.zeros(hand.num_shape), wrist.astype(float), known=False)
    hand = load_mano_file(request.mano, side)
    directions = hand.shapedirs.astype(float)
    if side == "left" and as_shipped:
        directions = directions * np.array([-1.0, 1, 1])[:, None]
    if len(shape) > directions.shape[-1]:
        raise InputError(f"{request.mano}: has {directions.shape[-1]} shape components, the recording {len(shape)}")
    if template is not None and template.shape != hand.template.shape:
        raise InputError(f"{request.mano}: has {len(hand.template)} vertices, the subject's mesh {len(template)}")
    rest = hand.template + directions[..., : len(shape)] @ shape if template is None else template
    centres = hand.joint_regressor.astype(float) @ rest
    offset = np.zeros_like(centres)
    offset[1:] = centres[1:] - centres[list(PARENTS[1:])]
    tips = rest[hand.tip_vertices] - centres[list(TIP_LINKS)]
    return Subject(shape, centres[0], link_offset=offset, tip_offset=tips)


def one_shape(shapes: Float[Array, "*t s"], valid: Bool[Array, "t"]) -> Float[Array, "s"]:
    """One set of coefficients: those given once, or medians over the valid frames, which wild frames do not move."""
    return shapes.astype(float) if shapes.ndim == 1 else np.median(shapes[valid].astype(float), axis=0)


def full_pose(
    path: Path, request: Request, side: str, pose: Float[Array, "t n"], *, components: bool, mean: bool
) -> Float[Array, "t 15 3"]:
    """Axis-angles about the flat hand, from coefficients or axis-angles of MANO's pose space.

    Args:
        path: of the recording, for messages.
        request: names the licensed MANO file.
        side: of the hand.
        pose: coefficients of the first n `hands_components`, or 45 axis-angle values.
        components: whether they are coefficients.
        mean: whether they are relative to the mean pose (`hands_mean`), which is then added.

    Raises:
        InputError: no licensed file is named, or it is of the other side or lacks what is needed.
    """
    what = "PCA poses need" if components else "poses relative to MANO's mean pose need"
    if request.mano is None:
        name = f"MANO_{side.upper()}.pkl"
        raise InputError(f"{path}: {what} {name}: give mano='.../{name}' (https://mano.is.tue.mpg.de)")
    hand = load_mano_file(request.mano, side)
    values = read_contents(request.mano)
    if components:
        if "hands_components" not in values:
            raise InputError(f"{request.mano}: has no 'hands_components', which PCA poses need; give the official file")
        basis = {"hands_components": plain(request.mano, "hands_components", values["hands_components"])}
        basis = numbers(request.mano, basis, {"hands_components": ("n", 45)})["hands_components"]
        if pose.shape[1] > len(basis):
            raise InputError(
                f"{path}: {pose.shape[1]} PCA coefficients, but {request.mano} has {len(basis)} components"
            )
        pose = pose @ basis[: pose.shape[1]].astype(float)
    return (pose + hand.pose_mean.reshape(45) if mean else pose).reshape(-1, 15, 3)
