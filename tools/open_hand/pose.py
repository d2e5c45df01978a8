"""Bring every sampled hand into one pose: MANO's frame, the palm aligned, the fingers flat.

MakeHuman's rest pose curls the fingers by 16 to 36 degrees and varies a little from body to body; a shape space must
not contain pose. Each hand's palm is moved onto the average one, then its skin is *unposed*: the flat vertices are
those that linear blend skinning with the native pose would take to the native skin.
"""

import numpy as np

from mjx_hand.hand.joints import FINGERS, LINKS, PARENTS

# Direction of each finger's bones in the flat reference pose: degrees above the palm's plane (towards the back of the
# hand) and towards the thumb's side of straight ahead. The fingers keep the source's mean splay, which is MANO's to a
# few degrees. The thumb is raised towards the palm's plane, where MANO's flat hand has it (the source's metacarpal
# points 43 degrees below); raising it further folds the skin between thumb and index finger.
FLAT = {
    "index": ((0, 7), (0, 7), (0, 7)),
    "middle": ((0, -6), (0, -6), (0, -6)),
    "pinky": ((0, -24), (0, -24), (0, -24)),
    "ring": ((0, -16), (0, -16), (0, -16)),
    "thumb": ((-25, 58), (-22, 42), (-25, 28)),
}


def flat_directions() -> np.ndarray:
    """Unit vectors (16, 3) of each link's bone in the flat pose, hand frame; the wrist's is unused."""
    out = np.tile([-1.0, 0.0, 0.0], (len(LINKS), 1))
    for f, finger in enumerate(FINGERS):
        up, side = np.radians(np.array(FLAT[finger])).T
        out[1 + 3 * f : 4 + 3 * f] = np.stack([-np.cos(up) * np.cos(side), np.sin(up), np.cos(up) * np.sin(side)], 1)
    return out


def to_hand_frame(points: np.ndarray, joints: np.ndarray) -> np.ndarray:
    """Points (n, 3) of one body in MANO's right-hand frame, the origin halfway from wrist to middle knuckle.

    -x runs from the wrist to the middle knuckle, +z towards the index knuckle, +y out of the back of the hand.
    """
    wrist, index, middle, pinky = (joints[LINKS.index(n)] for n in ("wrist", "index1", "middle1", "pinky1"))
    x = (wrist - middle) / np.linalg.norm(wrist - middle)
    z = index - pinky
    z = z - (z @ x) * x
    z /= np.linalg.norm(z)
    return (points - (wrist + middle) / 2) @ np.stack([x, np.cross(z, x), z]).T


def align(points: np.ndarray, palm: np.ndarray, reference: np.ndarray) -> np.ndarray:
    """Move each hand (n, p, 3) rigidly so that its points `palm` fit those of `reference` (p, 3) best (Kabsch)."""
    target = reference[palm]
    centre = points[:, palm].mean(axis=1, keepdims=True)
    covariance = np.einsum("npi,pj->nij", points[:, palm] - centre, target - target.mean(axis=0))
    u, _, vt = np.linalg.svd(covariance)
    u[:, :, 2] *= np.sign(np.linalg.det(u @ vt))[:, None]
    return (points - centre) @ (u @ vt) + target.mean(axis=0)


def flatten(
    vertices: np.ndarray, joints: np.ndarray, tips: np.ndarray, weights: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Unpose aligned hands to the flat reference.

    Args:
        vertices: (n, v, 3).
        joints: (n, 16, 3).
        tips: (n, 5, 3) finger tips.
        weights: (v, 16) skinning weights.

    Returns:
        Flat vertices, joints and tips, of the same shapes.
    """
    n, target = len(joints), flat_directions()
    rotation = np.tile(np.eye(3), (n, len(LINKS), 1, 1))  # native from flat
    flat_joints, flat_tips = joints.copy(), tips.copy()
    for j in range(1, len(LINKS)):
        finger, k = divmod(j - 1, 3)
        bone = (tips[:, finger] if k == 2 else joints[:, j + 1]) - joints[:, j]
        length = np.linalg.norm(bone, axis=-1, keepdims=True)
        rotation[:, j] = shortest_rotation(target[j], bone / length)
        flat_end = flat_joints[:, j] + length * target[j]
        if k == 2:
            flat_tips[:, finger] = flat_end
        else:
            assert PARENTS[j + 1] == j
            flat_joints[:, j + 1] = flat_end
    offset = joints - np.einsum("njab,njb->nja", rotation, flat_joints)
    flat = np.empty_like(vertices)
    for i in range(n):  # one hand at a time: all the blended matrices at once would take a gigabyte
        blend = np.einsum("vj,jab->vab", weights, rotation[i])
        flat[i] = np.linalg.solve(blend, (vertices[i] - weights @ offset[i])[..., None])[..., 0]
    return flat, flat_joints, flat_tips


def shortest_rotation(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """The rotation (*n, 3, 3) without twist that takes unit vector a (3,) to unit vectors b (*n, 3)."""
    v, c = np.cross(a, b), (b @ a)[..., None, None]
    k = np.zeros((*v.shape, 3))
    k[..., 0, 1], k[..., 0, 2], k[..., 1, 2] = -v[..., 2], v[..., 1], -v[..., 0]
    k -= np.swapaxes(k, -1, -2)
    return np.eye(3) + k + k @ k / (1 + c)
