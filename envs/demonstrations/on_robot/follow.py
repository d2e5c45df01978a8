"""A robot hand's way to its grasp, with the object, and away again.

The wrist goes as the person's went, from the grasp on and from it back, and in each frame pads are where the person's
were, and straight in front of their faces before they touch. Until then no link comes near the object: what a
controller brings late, or a thick finger beside its pad, would knock it over.
"""

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from envs.demonstrations.on_robot.least_squares import solve
from envs.demonstrations.on_robot.robot_scene import CLEAR, RobotScene
from envs.demonstrations.on_robot.sticking import followed_places, still_near
from envs.scene import NUM_WRIST

APPROACH = 0.012  # m that links keep off the object while nothing touches: beyond where the grip closes gaps
_PAD, _FREE = 0.001, 0.01  # m that weigh 1 of a pad: while it touches, and while keeping off the object goes before
_INSIDE = 0.0005  # m nearer than that, that weighs 1
_WRIST_WAY, _WRIST_TURN, _CHANGE = 0.01, 0.1, 0.05  # m, rad, rad a frame, that weigh 1
_STEPS = 12


def follow(scene: RobotScene, grasp: Float[np.ndarray, "u"]) -> Float[np.ndarray, "t u"]:
    """Targets of every frame, from the grasp on and from it back."""
    frame, pads = scene.pads.grasp, scene.pads
    scene.place(grasp, frame)
    near = scene.near()
    wanted = [scene.last[finger] for finger in pads.fingers]
    held = [scene.touch.on_link(k, near[k][1]) for k in wanted]
    ways = followed_places(pads, np.array([near[k][1] for k in wanted]), scene.demonstration)
    wrist = _carried(scene, grasp[:NUM_WRIST])
    touches = _touches(scene)
    # Of a hand that wraps nobody says which face a link meets.
    inward = np.array([near[k][2] for k in wanted]) if pads.wraps else pads.inward
    ways += _outward(scene, inward, touches)
    clear = _clearances(scene, touches)
    loose = np.stack([_FREE * (_PAD / _FREE) ** touches[finger] for finger in pads.fingers], axis=1)
    unit = np.eye(scene.count)
    weights = np.concatenate([np.full(3, _WRIST_WAY), np.full(3, _WRIST_TURN)])

    def equations_of(at: int, before: np.ndarray):  # type: ignore[no-untyped-def]
        def equations(targets: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            scene.place(targets, at)
            rows, values = [], []
            for k, link in enumerate(wanted):
                point = scene.touch.in_world(link, held[k])
                rows.append(scene.jacobian(link, point) / loose[at, k])
                values.append((point - ways[at, k]) / loose[at, k])
            for link, gap, point, way in scene.touch.nearest(APPROACH):
                if gap < clear[at, link]:
                    rows.append((way @ scene.jacobian(link, point))[None] / _INSIDE)
                    values.append(np.array([(clear[at, link] - gap) / _INSIDE]))
            off_ground, slopes = scene.off_ground(_INSIDE)
            values += off_ground
            rows += slopes
            rows += [unit[:NUM_WRIST] / weights[:, None], unit[NUM_WRIST:] / _CHANGE]
            values += [(targets[:NUM_WRIST] - wrist[at]) / weights, (targets - before)[NUM_WRIST:] / _CHANGE]
            return np.concatenate(values), np.concatenate(rows)

        return equations

    rows = np.empty((scene.demonstration.num_frames, scene.count))
    rows[frame] = grasp
    for order in (range(frame + 1, len(rows)), range(frame - 1, -1, -1)):
        before = grasp
        for at in order:
            start = before.copy()
            start[:NUM_WRIST] = wrist[at]
            before, _ = solve(equations_of(at, before), start, scene.low, scene.high, _STEPS)
            rows[at] = before
    return rows


def _touches(scene: RobotScene) -> dict[str, Float[np.ndarray, "t"]]:
    """How much each finger, and the palm (""), touches in each frame, from 0 to 1; the palm as much as any does."""
    pads, fps = scene.pads, scene.demonstration.motion.fps
    fingers = {finger: still_near(pads.touching[:, k], fps) for k, finger in enumerate(pads.fingers)}
    return fingers | {"": still_near(np.asarray(pads.touching.any(axis=1)), fps)}


def _outward(
    scene: RobotScene, inward: Float[np.ndarray, "f 3"], touches: dict[str, Float[np.ndarray, "t"]]
) -> Float[np.ndarray, "t f 3"]:
    """How far each pad is straight off its face before it touches, and after (m, world).

    The nearest way off a face may lead around an edge: thumbs that came from above were caught on it.

    Args:
        scene: the robot's.
        inward: ways into the object at the grasp (world).
        touches: how much each finger touches.
    """
    pads = scene.pads
    turn = Rotation.from_quat(scene.demonstration.object_pose[:, 3:], scalar_first=True)
    seen = turn[pads.grasp].inv().apply(-inward)
    off = np.stack([1 - touches[finger] for finger in pads.fingers], axis=1)
    return APPROACH * off[..., None] * np.stack([turn.apply(way) for way in seen], axis=1)


def _clearances(scene: RobotScene, touches: dict[str, Float[np.ndarray, "t"]]) -> Float[np.ndarray, "t l"]:
    """How far off the object each link is at least to stay in each frame (m).

    A finger that touches lies on it with its last link; its others, and the palm, just stay outside.
    """
    clear = []
    for k, finger in enumerate(scene.touch.fingers):
        least = 0.0 if finger in scene.pads.fingers and k == scene.last[finger] else CLEAR
        clear.append(least + (APPROACH - least) * (1 - touches.get(finger, touches[""])))
    return np.stack(clear, axis=1)


def _carried(scene: RobotScene, grasp: np.ndarray) -> Float[np.ndarray, "t 6"]:
    """The wrist's coordinates if it went with the person's, from the grasp on and from it back."""
    person = Rotation.from_euler("XYZ", scene.wrist[:, 3:])
    robot = Rotation.from_euler("XYZ", grasp[3:])
    held = person[scene.pads.grasp].inv()
    place = held.apply(grasp[:3] - scene.wrist[scene.pads.grasp, :3])
    turns = np.unwrap((person * (held * robot)).as_euler("XYZ"), axis=0)
    turns += 2 * np.pi * np.round((grasp[3:] - turns[scene.pads.grasp]) / (2 * np.pi))
    return np.concatenate([scene.wrist[:, :3] + person.apply(place), turns], axis=1)
