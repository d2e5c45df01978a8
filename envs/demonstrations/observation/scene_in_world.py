"""One hand and one object of a recorded scene, in a world with z up: what the hand does with it."""

import dataclasses
from collections.abc import Sequence

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from envs.demonstrations.observation.gravity import estimate_up
from envs.demonstrations.observation.handling import (
    AT_HAND,
    Manipulation,
    distances,
    hand_points,
    labelled,
    longest_manipulation,
)
from envs.demonstrations.observation.rigid_objects import rigid_objects
from envs.demonstrations.observation.solids import Solid, samples, solid_of
from envs.demonstrations.observation.stillness import ObjectPath, object_path
from mjx_hand.errors import InputError
from mjx_hand.motion.make_scene import up_vector
from mjx_hand.motion.motion import Motion
from mjx_hand.motion.scene import NO_SURFACE, RecordedScene
from mjx_hand.retarget.hands import KinematicHands

FOUND, TOLD = "found: what stands shows it", "as the recording says"


@dataclasses.dataclass(frozen=True)
class Handled:
    """What one hand does with one object.

    Attributes:
        motion: the hand's.
        name: of the object.
        solid: the object's surface.
        path: of the object, in the world's axes, all frames of the recording.
        distance: of the hand's nearest point from its surface (m).
        act: the frames that the hand can be asked to repeat.
        world: from the recording's axes, z up.
        up: how up was known.
        frames: of the recording.
    """

    motion: Motion
    name: str
    solid: Solid
    path: ObjectPath
    distance: Float[np.ndarray, "t"]
    act: Manipulation
    world: Float[np.ndarray, "3 3"]
    up: str
    frames: int


def handled_object(
    scene: RecordedScene, where: str, hands: KinematicHands, *, side: str = "", name: str = "", up: str = ""
) -> Handled:
    """The hand and the object that the hand moves longest, and when.

    Args:
        scene: as recorded.
        where: the recording, for messages.
        hands: to know where fingers are.
        side, name: of the hand and the object to take, where not those.
        up: as `up_vector` takes it, where the scene does not say it or says it wrongly.

    Raises:
        InputError: no hand or no object; of that side or name there is none; meshes cannot be used; up is not found;
            no hand moves an object that was seen at rest before.
    """
    if not scene.hands:
        raise InputError(f"{where}: objects without a hand; give a recording that has the hand that moves them")
    if not scene.objects:
        raise InputError(f"{where}: a hand without an object; add what it holds, mjx-hand scene --object NAME=mesh.stl")
    if side:
        scene.hand(side)
    scene = rigid_objects(scene)
    if name:
        scene.object(name)
    objects = [o for o in scene.objects if o.name == name or (not name and o.kind != NO_SURFACE)] or list(scene.objects)
    solids = [solid_of(each, where) for each in objects]
    paths = [object_path(each, scene.fps) for each in objects]
    surfaces = [samples(solid) for solid in solids]
    seen = {
        motion.side: (motion, hand_points(motion, hands.of(motion))) for motion in scene.hands if motion.valid.any()
    }
    away = {
        (s, k): distances(points, path, surface)
        for s, (_, points) in seen.items()
        for k, (path, surface) in enumerate(zip(paths, surfaces, strict=True))
    }
    chosen = _most_moved(away, paths, [side] if side else list(seen))
    world, how = _world(scene, up, list(zip(solids, paths, strict=True)), chosen[0][1], seen, away, where)
    why = ""
    for s, k in chosen:
        path = _turned(paths[k], world)
        height = path.position[:, 2] + solids[k].lowest(path.rotation, np.eye(3)[2])
        told = [(away[each, k], seen[each][0].valid, seen[each][1]) for each in sorted(seen, key=lambda e: e != s)]
        told = [(d, v, p @ world.T) for d, v, p in told]
        labels = labelled(path, height, told, scene.fps)
        act = longest_manipulation(labels, path.position, away[s, k], scene.fps)
        if isinstance(act, Manipulation):
            return Handled(seen[s][0], objects[k].name, solids[k], path, away[s, k], act, world, how, scene.num_frames)
        nearest = 100 * float(away[s, k].min())
        why = why or f"object {objects[k].name!r}, {s} hand: {act} (nearest {nearest:.1f} cm)"
    raise InputError(
        f"{where}: no demonstration is in it: {why}; give a recording in which a hand takes an object from where it "
        "rests"
    )


def _most_moved(
    away: dict[tuple[str, int], np.ndarray], paths: Sequence[ObjectPath], sides: Sequence[str]
) -> list[tuple[str, int]]:
    """Sides and objects, first those in which the hand is at the object longest while that is not still."""
    pairs = [pair for pair in away if pair[0] in sides]
    return sorted(pairs, key=lambda pair: -int(((away[pair] < AT_HAND) & ~paths[pair[1]].still).sum()))


def _world(
    scene: RecordedScene,
    up: str,
    objects: Sequence[tuple[Solid, ObjectPath]],
    moved: int,
    seen: dict[str, tuple[Motion, np.ndarray]],
    away: dict[tuple[str, int], np.ndarray],
    where: str,
) -> tuple[np.ndarray, str]:
    given = up_vector(up or None)
    direction = scene.up if given is None else given
    if direction is None:
        free = np.min([away[side, moved] for side in seen], axis=0) > AT_HAND
        nearest = min(seen, key=lambda side: float(away[side, moved].min()))
        wrists = seen[nearest][1][:, 0]
        direction = estimate_up(objects, moved, free, wrists, where)
        return world_from_up(direction), FOUND
    return world_from_up(np.asarray(direction, float)), TOLD if given is None else f"given: {up}"


def world_from_up(up: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3 3"]:
    """The rotation to a world with z up; its x lies as near as it can to the recording's, or to its y."""
    x = np.eye(3)[0] - up * up[0]
    if np.linalg.norm(x) < 0.3:
        x = np.eye(3)[1] - up * up[1]
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(up, x), up])


def _turned(path: ObjectPath, world: Float[np.ndarray, "3 3"]) -> ObjectPath:
    rotation = Rotation.from_matrix(world @ path.rotation).as_matrix()
    return dataclasses.replace(path, position=path.position @ world.T, rotation=rotation)
