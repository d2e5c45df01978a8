"""MANO's joints in MakeHuman's skeleton: which bones they are, where they sit, which weights they have."""

import numpy as np

from mjx_hand.hand.joints import LINKS
from tools.open_hand.makehuman import Body

# MakeHuman numbers fingers from the thumb; here they are in MANO's order (index, middle, pinky, ring, thumb).
_FINGER_NUMBERS = (2, 3, 5, 4, 1)
BONES = ("wrist.R", *(f"finger{number}-{k}.R" for number in _FINGER_NUMBERS for k in (1, 2, 3)))
_TIP_BONES = BONES[3::3]
# These bones move with the wrist in a MANO hand.
WITH_WRIST = (*(f"metacarpal{k}.R" for k in (1, 2, 3, 4)), "lowerarm01.R", "lowerarm02.R")
ARM = (*BONES, *WITH_WRIST)
JOINTS = len(BONES)


# MakeHuman sets the index knuckle about 9 mm too far out: its proximal phalanx (27 mm) would be hardly longer than the
# middle one (24 mm, where anthropometry has 5 : 3, Buchholz et al. 1992, https://doi.org/10.1080/00140139208967812),
# and its metacarpal the longest of all. The knuckle is moved back by this share of the way to the wrist.
INDEX_KNUCKLE_BACK = 0.085


def helper_cubes(body: Body) -> np.ndarray:
    """(21, 8) body vertices of the cubes that mark the 16 joints (bone heads) and the 5 finger tips (bone tails)."""
    names = [body.bones[bone][0] for bone in BONES] + [body.bones[bone][1] for bone in _TIP_BONES]
    return np.stack([body.cubes[name] for name in names])


def joint_positions(body: Body, vertices: np.ndarray) -> np.ndarray:
    """(21, 3) joints, then finger tips, of a body with these vertices."""
    return joints_from_cubes(vertices[helper_cubes(body)])


def joints_from_cubes(cubes: np.ndarray) -> np.ndarray:
    """(*n, 21, 3) joints and finger tips from the corners (*n, 21, 8, 3) of their helper cubes."""
    points = cubes.mean(axis=-2)
    wrist, knuckle = points[..., 0, :], points[..., LINKS.index("index1"), :]
    points[..., LINKS.index("index1"), :] = knuckle + INDEX_KNUCKLE_BACK * (wrist - knuckle)
    return points


def bone_weights(body: Body, bones: tuple[str, ...]) -> np.ndarray:
    """(n, len(bones)) the body's skinning weights for these bones."""
    out = np.zeros((len(body.vertices), len(bones)))
    for column, bone in enumerate(bones):
        index, weight = body.weights[bone]
        out[index, column] = weight
    return out


def mano_weights(body: Body, vertices: np.ndarray) -> np.ndarray:
    """(len(vertices), 16) weights in MANO's joint order: metacarpals and forearm count for the wrist."""
    weights = bone_weights(body, BONES)
    weights[:, 0] += bone_weights(body, WITH_WRIST).sum(axis=1)
    weights = weights[vertices]
    return weights / weights.sum(axis=1, keepdims=True)
