"""What a person should know of a scene before it is used: what is missing in it, and what looks wrong."""

import numpy as np
import trimesh
from jaxtyping import Float
from scipy.spatial import KDTree

from mjx_hand.motion.motion import Motion
from mjx_hand.motion.scene import NO_SURFACE, RecordedObject, RecordedScene

Array = np.ndarray
REACH = 0.3  # m from the wrist to what the hand may touch: a large hand is 0.2 m long
_HALF = 0.2  # m more where only an object's origin is known, not its surface
_ROOM = 3.0  # m: what is further away than this, though other objects are near, is in another unit or frame
_POINTS = 2000  # of a surface, to which distances are measured


def scene_notes(scene: RecordedScene) -> tuple[str, ...]:
    """One line each for what stands in the way of a use of the scene; none where nothing does."""
    notes = []
    if not scene.objects:
        notes.append("no object: a hand alone")
    if not scene.hands:
        notes.append("no hand: objects alone")
    if scene.up is None and scene.objects:
        notes.append("it is not said where up is")
    for found in scene.objects:
        notes += _object_notes(scene, found)
    return tuple(notes)


def wrist_distance(motion: Motion, found: RecordedObject) -> Float[Array, "t"]:
    """How far (m) the wrist is from the object's surface, or its origin where it has none; NaN in gaps of either."""
    points = _surface(found)
    seen = motion.valid & found.seen
    there = np.einsum("tji,tj->ti", found.rotation, motion.wrist_position - found.position)
    return np.where(seen, KDTree(points).query(there)[0], np.nan)


def _object_notes(scene: RecordedScene, found: RecordedObject) -> list[str]:
    notes = []
    if found.kind == NO_SURFACE:
        notes.append(f"{found.name}: poses without a mesh")
    if found.kind == "mesh" and not trimesh.Trimesh(found.vertices, found.faces).is_watertight:
        notes.append(f"{found.name}: its mesh is not closed, so that it has no volume of its own; give its mass")
    nearest = _nearest(scene, found)
    if scene.hands and not np.isfinite(nearest):
        notes.append(f"{found.name}: never seen together with a hand")
    elif scene.hands:
        touched = any(_nearest(scene, each) <= _reach(each) for each in scene.objects)  # some only lie on the table
        if nearest > (_ROOM if touched else _reach(found)):
            notes.append(
                f"{found.name}: never near a hand, the wrist stays {nearest:.2f} m away; are both in metres and in one "
                "frame?"
            )
    return notes


def _nearest(scene: RecordedScene, found: RecordedObject) -> float:
    """How near (m) a wrist comes to the object; infinite where they are never seen together."""
    distances = [wrist_distance(motion, found) for motion in scene.hands]
    return min((float(each[np.isfinite(each)].min(initial=np.inf)) for each in distances), default=np.inf)


def _reach(found: RecordedObject) -> float:
    return REACH + (_HALF if found.kind == NO_SURFACE else 0.0)


def _surface(found: RecordedObject) -> Float[Array, "n 3"]:
    if found.kind == "mesh":
        return found.vertices[:: -(-len(found.vertices) // _POINTS)]
    if found.kind == NO_SURFACE:
        return np.zeros((1, 3))
    a, b, c = found.size
    reach = {"sphere": (a, a, a), "cylinder": (a, a, b), "capsule": (a, a, a + b)}.get(found.kind, (a, b, c))
    return np.array([[x, y, z] for x in (-1, 0, 1) for y in (-1, 0, 1) for z in (-1, 0, 1)]) * reach
