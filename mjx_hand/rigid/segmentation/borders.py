"""The borders of a patch of surface, and the outlines of the caps that close it."""

from collections import Counter

import numpy as np
from jaxtyping import Int


def border_loops(faces: Int[np.ndarray, "f 3"]) -> list[Int[np.ndarray, "_"]]:
    """Simple closed loops of the edges that only one face has, in the faces' direction.

    A vertex that the border passes twice splits it into separate loops: closing each then leaves every edge two faces.
    """
    directed = directed_edges(faces)
    following: dict[int, list[int]] = {}
    for a, b in sorted(directed):
        if (b, a) not in directed:
            following.setdefault(a, []).append(b)
    loops = []
    while following:
        path = [next(iter(following))]
        while path:
            ahead = following.get(path[-1])
            if not ahead:
                break
            step = ahead.pop()
            if not ahead:
                del following[path[-1]]
            if step in path:
                start = path.index(step)
                loops.append(np.array(path[start:]))
                path = path[: start + 1]  # a vertex passed twice may go on from here
            else:
                path.append(step)
    return loops


def cap_outlines(loop: list[int], beyond: list[int], skin_edges: set[tuple[int, int]]) -> list[Int[np.ndarray, "_"]]:
    """Split a border loop into the outlines of flat-ish caps, one for each segment on the other side.

    At a finger's base three segments meet twice, on the back and on the palm of the hand. A straight chord from one
    meeting point to the other gives each pair of segments an outline of its own, which both find: their caps coincide,
    and the segments fill the hand without gap or overlap.

    Args:
        loop: border vertices in order.
        beyond: the segment across the edge from each vertex to the next.
        skin_edges: edges that the segment's skin has, which a chord must not double.
    """
    outlines = []
    vertices, labels = list(loop), list(beyond)
    while len(set(labels)) > 1:
        while labels[0] == labels[-1]:  # begin at a change of segment
            vertices.append(vertices.pop(0))
            labels.append(labels.pop(0))
        starts = [k for k in range(len(labels)) if labels[k] != labels[k - 1]]
        runs = list(zip(starts, [*starts[1:], len(labels)], strict=True))
        times = Counter(labels[start] for start, _ in runs)
        # A segment met once lies outermost; cutting it off brings the two stretches of the one before it together.
        start, end = min(runs, key=lambda run: (times[labels[run[0]]], run[1] - run[0]))
        before, a, b = labels[start - 1], vertices[start], vertices[end % len(vertices)]
        if end - start == 1 or (a, b) in skin_edges or (b, a) in skin_edges:
            labels[start:end] = [before] * (end - start)
            continue
        outlines.append(np.array([*vertices[start:end], b]))
        del vertices[start + 1 : end]
        labels[start:end] = [before]
    if len(vertices) > 2:
        outlines.append(np.array(vertices))
    return outlines


def directed_edges(faces: Int[np.ndarray, "f 3"]) -> set[tuple[int, int]]:
    """Every triangle's three edges, each from one vertex to the next."""
    return set(map(tuple, faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2).tolist()))
