"""Cut the right hand out of the body's skin and close it at the wrist."""

from dataclasses import dataclass

import numpy as np

from tools.open_hand.makehuman import Body
from tools.open_hand.pose import to_hand_frame
from tools.open_hand.skeleton import ARM, bone_weights, joint_positions

# The skin ends this far (m) behind the wrist joint, where the body has a ring of vertices that is planar to 0.6 mm.
FOREARM_LENGTH = 0.018


@dataclass(frozen=True)
class Cut:
    """The hand as indices into the body.

    Attributes:
        vertices: (v,) body vertex of each hand vertex.
        quads: (q, 4) skin quads, as hand vertex indices.
        loop: (n,) the wrist's boundary, ordered so that a cap of this winding faces outward.
    """

    vertices: np.ndarray
    quads: np.ndarray
    loop: np.ndarray


def cut_hand(body: Body) -> Cut:
    """The skin of the right arm beyond the wrist's cutting plane."""
    on_arm = bone_weights(body, ARM).sum(axis=1) > 0.5
    joints = joint_positions(body, body.vertices)
    beyond = to_hand_frame(body.vertices, joints)[:, 0] < to_hand_frame(joints, joints)[0, 0] + FOREARM_LENGTH
    chosen = (on_arm & beyond)[body.quads].all(axis=1)
    vertices, quads = np.unique(body.quads[chosen], return_inverse=True)
    quads = quads.reshape(-1, 4)
    return Cut(vertices, quads, _boundary(quads))


def _boundary(quads: np.ndarray) -> np.ndarray:
    """The single boundary loop, against the direction of the faces' own edges along it."""
    edges = np.concatenate([quads[:, [k, (k + 1) % 4]] for k in range(4)])
    present = {(a, b) for a, b in edges.tolist()}
    following = {b: a for a, b in present if (b, a) not in present}
    start = min(following)
    loop = [start]
    while (vertex := following[loop[-1]]) != start:
        loop.append(vertex)
    if len(loop) != len(following):
        raise AssertionError(f"the cut has more than one boundary: {len(loop)} of {len(following)} edges in the first")
    return np.array(loop)


def triangulate(cut: Cut, vertices: np.ndarray) -> np.ndarray:
    """Outward triangles of the closed hand: each quad split along its shorter diagonal, and the wrist cap.

    Args:
        cut: the hand's quads and wrist loop.
        vertices: (v, 3) positions that decide the diagonals.
    """
    q = cut.quads
    first = np.linalg.norm(vertices[q[:, 0]] - vertices[q[:, 2]], axis=1)
    second = np.linalg.norm(vertices[q[:, 1]] - vertices[q[:, 3]], axis=1)
    q = np.where((first <= second)[:, None], q, np.roll(q, -1, axis=1))
    skin = np.stack([q[:, [0, 1, 2]], q[:, [0, 2, 3]]], axis=1).reshape(-1, 3)
    return np.concatenate([skin, _cap(cut.loop, vertices)])


def _cap(loop: np.ndarray, vertices: np.ndarray) -> np.ndarray:
    """Triangles that close the loop without a new vertex: a strip along its long side, which avoids slivers."""
    points = vertices[loop] - vertices[loop].mean(axis=0)
    wide = np.linalg.svd(points, full_matrices=False)[2][0]
    loop = np.roll(loop, -int(np.argmax(points @ wide)))
    near, far = 0, len(loop)  # positions on the strip's two sides, which meet at the other end
    faces = []
    while far - near > 2:
        faces.append([near, near + 1, far - 1])
        near += 1
        if far - near > 2:
            faces.append([near, far - 2, far - 1])
        far -= 1
    return loop[np.array(faces) % len(loop)]
