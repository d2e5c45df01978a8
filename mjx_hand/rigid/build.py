"""`build_rigid_hand`: a skinned hand of a given shape, made rigid."""

import functools

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Int
from numpy.typing import ArrayLike

from mjx_hand.errors import InputError
from mjx_hand.hand.joints import NUM_LINKS, PARENTS, TIP_LINKS
from mjx_hand.hand.model import HandModel
from mjx_hand.hand.skinning import joint_centres, shaped_template
from mjx_hand.rigid.axes import AXES
from mjx_hand.rigid.collision import palm_capsules, phalanx_capsules, skin_samples
from mjx_hand.rigid.limits import active_limits, anatomical_limits
from mjx_hand.rigid.rigid_hand import RigidHand
from mjx_hand.rigid.segmentation.face_links import face_links
from mjx_hand.rigid.segmentation.pieces import Piece, close
from mjx_hand.rigid.segmentation.segments import cut, mass_properties


def build_rigid_hand(hand: HandModel, shape: ArrayLike | None = None, axes: str = "anatomical") -> RigidHand:
    """Cut a hand into 16 rigid links joined by 20 hinges (arXiv 2512.07359, section III).

    Args:
        hand: the skinned hand; its rest pose becomes the rigid hand's zero.
        shape: shape coefficients, unit variance each, at most `hand.num_shape`; None is the mean shape.
        axes: how the hinge axes are found, a name in `axes.AXES`.

    Raises:
        InputError: an unknown axis rule, or coefficients that are not valid or turn a segment inside out.
    """
    if axes not in AXES:
        raise InputError(f"axes is {axes!r}; valid: {', '.join(AXES)}")
    coefficients = _checked_shape(hand, shape)
    shaped = shaped_template(hand, jnp.asarray(coefficients))
    rest = np.asarray(shaped, dtype=float)
    centres = np.asarray(joint_centres(hand, shaped), dtype=float)
    tips = rest[np.asarray(hand.tip_vertices)]

    parts = cut(hand)
    divided = parts.skin.vertices(rest)
    solids = [segment.solid for segment in parts.segments]
    properties = [mass_properties(solid.vertices(divided), solid.faces) for solid in solids]
    mass = np.array([p[0] for p in properties])
    whole = _whole(hand)
    total = mass_properties(whole.vertices(rest), whole.faces)[0]
    if mass.min() <= 0 or total <= 0:
        raise InputError(f"shape {np.round(coefficients, 2).tolist()} turns the hand inside out; stay within +-5")
    scale = total / mass.sum()  # flat caps may overlap a little where three segments meet

    surfaces = [segment.surface(divided, centres) for segment in parts.segments]
    samples = [skin_samples(rest, faces) for faces in _skin(hand)]
    points, areas = [s[0] for s in samples], [s[1] for s in samples]
    palm_ends, palm_radii = palm_capsules(points[0], areas[0], centres)
    finger_ends, finger_radii = phalanx_capsules(points, areas, centres, tips)
    capsule_links = (0,) * len(palm_radii) + tuple(range(1, 16))
    lower, upper = anatomical_limits()
    soft_lower, soft_upper = active_limits()
    return RigidHand(
        wrist_position=centres[0],
        link_offset=np.concatenate([np.zeros((1, 3)), centres[1:] - centres[list(PARENTS[1:])]]),
        hinge_axis=AXES[axes](centres, hand.side),
        hinge_lower=lower,
        hinge_upper=upper,
        soft_lower=soft_lower,
        soft_upper=soft_upper,
        tip_offset=tips - centres[list(TIP_LINKS)],
        link_mass=mass * scale,
        link_com=np.stack([p[1] for p in properties]) - centres,
        link_inertia=np.stack([p[2] for p in properties]) * scale,
        capsule_ends=np.concatenate([palm_ends, finger_ends]) - centres[list(capsule_links)][:, None],
        capsule_radius=np.concatenate([palm_radii, finger_radii]),
        mesh_vertices=tuple(mesh - centre for (mesh, _), centre in zip(surfaces, centres, strict=True)),
        mesh_faces=tuple(faces for _, faces in surfaces),
        capsule_links=capsule_links,
        side=hand.side,
        name=hand.name,
    )


# What follows from a hand's faces alone, kept as `cut` keeps its own: by the hand's identity.
@functools.lru_cache(maxsize=4)
def _whole(hand: HandModel) -> Piece:
    """The whole skin, closed."""
    return close(np.asarray(hand.faces))


@functools.lru_cache(maxsize=4)
def _skin(hand: HandModel) -> tuple[Int[np.ndarray, "_ 3"], ...]:
    """Each link's whole triangles."""
    owners = face_links(hand)
    return tuple(np.asarray(hand.faces)[owners == link] for link in range(NUM_LINKS))


def _checked_shape(hand: HandModel, shape: ArrayLike | None) -> Float[np.ndarray, "s"]:
    """The coefficients, zero-padded to the hand's own number so that every call compiles to the same shapes."""
    full = np.zeros(hand.num_shape)
    if shape is None:
        return full
    try:
        given = np.asarray(shape, dtype=float)
    except (TypeError, ValueError):
        raise InputError(f"shape is {shape!r}; give up to {hand.num_shape} numbers") from None
    if given.ndim != 1 or len(given) > hand.num_shape:
        raise InputError(f"shape has dimensions {given.shape}; give a list of up to {hand.num_shape} coefficients")
    if not np.isfinite(given).all():
        raise InputError(f"shape is {given.tolist()}; every coefficient must be finite")
    full[: len(given)] = given
    return full
