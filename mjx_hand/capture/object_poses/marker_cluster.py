"""An object's pose from the cluster of optical markers on it: a rigid fit a frame, swapped labels put right.

Least squares gives the pose of three markers or more (Kabsch 1976). Labels that change places for a moment break the
distances between markers, or, where two markers are each other's mirror images, make the object leap; another order of
the same labels then fits, and is taken.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations, permutations

import numpy as np
from jaxtyping import Bool, Float
from scipy.spatial.transform import Rotation

from mjx_hand.capture.markers.marker_recording import MarkerRecording, select_markers
from mjx_hand.capture.pose.wrist import rigid_fit
from mjx_hand.errors import InputError

Array = np.ndarray
_FEWEST = 3
_ALL_ORDERS = 5  # markers up to which every order of labels is tried; of more, two labels that change places
_NOISE, _TIMES = 0.003, 4.0  # m, and times the usual misfit: a frame that fits worse has a wrong label
_SOFT = 0.015  # m of usual misfit beyond which the markers are on no rigid object
_LEAP, _SPEED = 0.5, 35.0  # rad, and rad/s times a frame: what is turned further than both has leapt
_MEMORY = 0.5  # s over which a leap is told from a turn
_ROUNDS = 3  # of the mean cluster


@dataclass(frozen=True)
class ClusterTrack:
    """An object's poses from its markers.

    Attributes:
        poses: position (m) and quaternion wxyz of the markers' own frame, or of the object's where the markers' places
            on it were given; NaN where the markers do not tell.
        places: of the markers in that frame (m).
        swapped: frames in which labels had changed places.
        misfit: root mean square distance (m) of the markers from the rigid cluster, the median over the frames.
    """

    poses: Float[Array, "t 7"]
    places: Float[Array, "m 3"]
    swapped: Bool[Array, "t"]
    misfit: float


def track_cluster(
    recording: MarkerRecording, names: Sequence[str], places: Float[Array, "m 3"] | None = None
) -> ClusterTrack:
    """Follow an object through a recording.

    Without `places` the object's frame is the cluster's: its origin at the markers' mean, x from the first marker to
    the second, z at right angles to the plane of the first three, towards where they go round counterclockwise.

    Args:
        recording: has the markers.
        names: three of its labels or more, all on the object.
        places: of these markers in the object's own frame (m), in the same order.

    Raises:
        InputError: too few markers, a label that is not there, markers on a line, never seen together, or not rigid.
    """
    source, told = recording.source or "recording", ", ".join(names)
    if len(names) < _FEWEST or len(set(names)) < len(names):
        raise InputError(f"{source}: an object's pose takes {_FEWEST} different markers or more; {told} are given")
    chosen = select_markers(recording, names)
    seen = np.asarray(chosen.visible)
    positions = np.where(seen[..., None], chosen.positions, 0.0)
    own = _mean_cluster(source, told, positions, seen)
    if places is None:
        places = own
    spread = np.linalg.svd(places - places.mean(axis=0), compute_uv=False)
    if spread[1] < 0.005:
        raise InputError(f"{source}: markers {told} lie on a line, so that the object's turn about it is open")
    fit = _fit(places, positions, seen)
    usual = float(np.median(fit.misfit[fit.known])) if fit.known.any() else np.inf
    if usual > _SOFT:
        raise InputError(
            f"{source}: markers {told} are {1e3 * usual:.0f} mm off one rigid cluster; are all of them on the object"
            ", and are their places in metres?"
        )
    limit = max(_NOISE, _TIMES * usual)
    orders = _orders(len(names))
    fit, swapped = _reordered(fit, places, positions, seen, orders, limit)
    fit, leapt = _without_leaps(fit, places, positions, seen, orders, limit, recording.fps)
    good = fit.known & (fit.misfit <= limit)
    poses = np.full((len(positions), 7), np.nan)
    poses[good, :3] = fit.position[good]
    poses[good, 3:] = Rotation.from_matrix(fit.rotation[good]).as_quat(scalar_first=True)
    if not good.any():
        raise InputError(f"{source}: markers {told} are never seen as one rigid cluster; check their labels")
    return ClusterTrack(poses, places, (swapped | leapt) & good, float(np.median(fit.misfit[good])))


@dataclass(frozen=True)
class _Fit:
    rotation: Float[Array, "t 3 3"]
    position: Float[Array, "t 3"]
    known: Bool[Array, "t"]
    misfit: Float[Array, "t"]

    def where(self, other: "_Fit", at: Bool[Array, "t"]) -> "_Fit":
        """`other` in the frames `at`."""
        return _Fit(
            np.where(at[:, None, None], other.rotation, self.rotation),
            np.where(at[:, None], other.position, self.position),
            np.where(at, other.known, self.known),
            np.where(at, other.misfit, self.misfit),
        )


def _fit(places: Float[Array, "m 3"], positions: Float[Array, "t m 3"], seen: Bool[Array, "t m"]) -> _Fit:
    turn, place, known = rigid_fit(places, positions, seen.astype(float))
    away = np.einsum("tij,mj->tmi", turn, places) + place[:, None] - positions
    square = (np.where(seen[..., None], away, 0.0) ** 2).sum(axis=(1, 2))
    return _Fit(turn, place, known, np.sqrt(square / np.maximum(seen.sum(axis=1), 1)))


def _mean_cluster(
    source: str, told: str, positions: Float[Array, "t m 3"], seen: Bool[Array, "t m"]
) -> Float[Array, "m 3"]:
    """The markers' places in a frame of their own, from the frames in which all are seen and none is elsewhere."""
    whole = seen.all(axis=1)
    if not whole.any():
        raise InputError(f"{source}: markers {told} are never seen all together; leave out those that are never seen")
    rows = positions[whole]
    apart = np.linalg.norm(rows[:, :, None] - rows[:, None], axis=-1)
    off = np.abs(apart - np.median(apart, axis=0)).sum(axis=(1, 2))
    mean = rows[int(np.argmin(off))]
    for _ in range(_ROUNDS):
        fit = _fit(mean, rows, np.ones(rows.shape[:2], bool))
        near = fit.misfit <= np.median(fit.misfit)
        mean = np.einsum("tji,tmj->tmi", fit.rotation[near], rows[near] - fit.position[near, None]).mean(axis=0)
    mean = mean - mean.mean(axis=0)
    x = mean[1] - mean[0]
    z = np.cross(x, mean[2] - mean[0])
    if np.linalg.norm(z) < 1e-9:
        raise InputError(f"{source}: the first three of {told} lie on a line; name them in another order")
    x, z = x / np.linalg.norm(x), z / np.linalg.norm(z)
    return mean @ np.stack([x, np.cross(z, x), z], axis=1)


def _orders(count: int) -> list[list[int]]:
    """Other orders of the labels than their own."""
    own = list(range(count))
    if count <= _ALL_ORDERS:
        return [list(order) for order in permutations(own) if list(order) != own]
    pairs = []
    for a, b in combinations(own, 2):
        order = own.copy()
        order[a], order[b] = b, a
        pairs.append(order)
    return pairs


def _reordered(
    fit: _Fit, places: Array, positions: Array, seen: Array, orders: list[list[int]], limit: float
) -> tuple[_Fit, Bool[Array, "t"]]:
    """Frames that do not fit, in the order of labels that fits best, if one does."""
    swapped = np.zeros(len(positions), bool)
    bad = fit.known & (fit.misfit > limit)
    if not bad.any():
        return fit, swapped
    rows = np.flatnonzero(bad)
    best = fit.misfit[rows].copy()
    found = _Fit(*(np.array(part[rows]) for part in (fit.rotation, fit.position, fit.known, fit.misfit)))
    for order in orders:
        other = _fit(places, positions[rows][:, order], seen[rows][:, order])
        better = other.known & (other.misfit < best)
        found, best = found.where(other, better), np.where(better, other.misfit, best)
    mended = best <= limit
    parts = [np.array(part) for part in (fit.rotation, fit.position, fit.known, fit.misfit)]
    for part, new in zip(parts, (found.rotation, found.position, found.known, found.misfit), strict=True):
        part[rows[mended]] = new[mended]
    swapped[rows[mended]] = True
    return _Fit(*parts), swapped


def _without_leaps(
    fit: _Fit, places: Array, positions: Array, seen: Array, orders: list[list[int]], limit: float, fps: float
) -> tuple[_Fit, Bool[Array, "t"]]:
    """Frames in which the object leaps and another order of labels that fits as well does not, in that order."""
    leapt = np.zeros(len(positions), bool)
    others = [_fit(places, positions[:, order], seen[:, order]) for order in orders if _alike(places, order, limit)]
    if not others:
        return fit, leapt
    choices = [fit, *others]
    quaternions = np.stack([Rotation.from_matrix(each.rotation).as_quat() for each in choices])
    usable = np.stack([each.known & (each.misfit <= limit) for each in choices])
    choice, last = np.zeros(len(positions), int), -1
    for frame in np.flatnonzero(usable[0]):
        if last >= 0 and frame - last <= _MEMORY * fps:
            near = np.abs(quaternions[:, frame] @ quaternions[choice[last], last])
            turned = 2 * np.arccos(np.clip(near, 0.0, 1.0))
            turned[~usable[:, frame]] = np.inf
            best = int(np.argmin(turned))
            if turned[0] > max(_LEAP, _SPEED * (frame - last) / fps) and turned[best] < turned[0] / 2:
                choice[frame] = best
        last = frame
    for k, other in enumerate(others, start=1):
        fit = fit.where(other, choice == k)
    return fit, choice > 0


def _alike(places: Float[Array, "m 3"], order: list[int], limit: float) -> bool:
    """Whether the cluster looks the same when its labels change places so."""
    return bool(_fit(places, places[None, order], np.ones((1, len(places)), bool)).misfit[0] <= limit)
