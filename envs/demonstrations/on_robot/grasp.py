"""One grasp of a robot hand, where and as a person's: damped least squares from several postures."""

import itertools
from collections.abc import Collection
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from envs.demonstrations.on_robot.least_squares import solve
from envs.demonstrations.on_robot.robot_scene import CLEAR, OFF_GROUND, RobotScene
from envs.scene import NUM_WRIST

ALONG = 0.004  # m that weighs 1 along the object's surface
_ON, _INSIDE = 0.0005, 0.001  # m that weigh 1: off the surface, and of another link inside
_TURNED, _POSED = 0.6, 1.5  # rad that weigh 1: of the wrist, and of a joint from its middle
_TIP = 0.05  # m that weighs 1 of a tip that touches nothing
_SAME_FACE = 0.8  # cosine between the person's way into the object and the robot's
_ALONG_WRAP, _AROUND = 0.02, 0.01  # m that weigh 1 of a hand that wraps: along the surface, and of further links off it
_BENT = (0.15, 0.3, 0.45, 0.6)  # of the joints' ranges, at which a search begins
_OPPOSING_BENT = (0.2, 0.5, 0.8)  # of those of fingers that oppose the others
_IDLE_BENT = (0.3, 0.9)  # of those of fingers that touch nothing
_STEPS = 60
_SAME = 0.02  # m, rad between all targets of two grasps that are one


@dataclass(frozen=True)
class Grasp:
    """A grasp and how good it is.

    Attributes:
        targets: of wrist and actuated joints.
        off: how far each finger that touches is from where the person's touched (m).
        depth: how deep any link is inside the object (m).
        gap: how far each finger that touches is off the surface (m).
        sunk: how deep any link is inside table or support, where the object is taken from (m).
    """

    targets: Float[np.ndarray, "u"]
    off: Float[np.ndarray, "f"]
    depth: float
    gap: Float[np.ndarray, "f"]
    sunk: float


def find_grasps(scene: RobotScene) -> list[Grasp]:
    """Grasps from several beginnings, the best first."""
    frame, pads = scene.pads.grasp, scene.pads
    places = pads.surface
    wrist = scene.wrist[frame]
    wanted = [scene.last[finger] for finger in pads.fingers]
    along = _ALONG_WRAP if pads.wraps else ALONG
    around = ("", *pads.fingers) if pads.wraps else ()  # phalanges and the palm of a hand that wraps
    closing = [k for k, finger in enumerate(scene.touch.fingers) if finger in around and k not in wanted]

    def equations(targets: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        scene.place(targets, frame)
        near = scene.near()
        rows, values = [], []
        for link, place, inward in zip(wanted, places, pads.inward, strict=True):
            gap, point, way = near[link]
            if not pads.wraps and way @ inward < _SAME_FACE:
                # As around a corner: what would touch, were it on this face.
                point, way = scene.touch.foremost(link, inward), inward
                gap = float(inward @ (place - point))
            jacobian = scene.jacobian(link, point)
            aside = np.eye(3) - np.outer(inward, inward)
            rows += [-(way @ jacobian)[None] / _ON, aside @ jacobian / along]
            values += [np.array([gap / _ON]), aside @ (point - place) / along]
        for link, (gap, point, way) in near.items():
            if link not in wanted and gap < CLEAR:
                rows.append((way @ scene.jacobian(link, point))[None] / _INSIDE)
                values.append(np.array([(CLEAR - gap) / _INSIDE]))
            elif link in closing:
                rows.append(-(way @ scene.jacobian(link, point))[None] / _AROUND)
                values.append(np.array([(gap - CLEAR) / _AROUND]))
        off_ground, slopes = scene.off_ground(_INSIDE)
        values += off_ground
        rows += slopes
        for finger, site in scene.sites.items():
            if finger not in pads.fingers and finger in pads.tips:
                link = scene.last[finger]
                point = scene.touch.data.site_xpos[site].copy()
                rows.append(scene.jacobian(link, point) / _TIP)
                values.append((point - pads.tips[finger][frame]) / _TIP)
        unit = np.eye(scene.count)
        rows += [unit[3:NUM_WRIST] / _TURNED, unit[NUM_WRIST:] / _POSED]
        values += [(targets - np.pad(wrist, (0, scene.count - NUM_WRIST)))[3:NUM_WRIST] / _TURNED]
        values += [(targets - scene.middle)[NUM_WRIST:] / _POSED]
        return np.concatenate(values), np.concatenate(rows)

    scene.put_ground(frame)
    found: list[tuple[float, np.ndarray]] = []
    idle, opposing = still_targets(scene, scene.pads.fingers), ~still_targets(scene, scene.body.opposing)
    bents = itertools.product(_BENT, _OPPOSING_BENT, _IDLE_BENT if idle.any() else (0.0,))
    for bent, opposing_bent, idle_bent in bents:
        share = np.where(idle, idle_bent, np.where(opposing, opposing_bent, bent))
        start = scene.low + share * (scene.high - scene.low)
        start[:NUM_WRIST] = wrist
        scene.place(start, frame)
        tips = np.mean([scene.touch.data.site_xpos[scene.sites[finger]] for finger in pads.fingers], axis=0)
        start[:3] += scene.base.T @ (places.mean(axis=0) - tips)
        targets, cost = solve(equations, start, scene.low, scene.high, _STEPS)
        found.append((cost, targets))
    grasps: list[Grasp] = []
    for _, targets in sorted(found, key=lambda each: each[0]):
        if any(np.abs(targets - grasp.targets).max() < _SAME for grasp in grasps):
            continue  # many searches end in the same grasp
        scene.place(targets, frame)
        near = scene.near()
        off = np.array([np.linalg.norm(near[k][1] - place) for k, place in zip(wanted, places, strict=True)])
        gap = np.array([near[k][0] for k in wanted])
        depth = max(0.0, -min(rest[0] for rest in near.values()))
        sunk = max([0.0, *(-to_ground for _, to_ground, _, _ in scene.touch.nearest(OFF_GROUND, scene.touch.ground))])
        grasps.append(Grasp(targets, off, depth, np.maximum(gap, 0.0), sunk))
    scene.put_ground(0)
    return grasps


def still_targets(scene: RobotScene, fingers: Collection[str]) -> Bool[np.ndarray, "u"]:
    """Which targets move none of these fingers: the joints of the others."""
    scene.place(scene.middle, scene.pads.grasp)
    ends = [(scene.last[finger], scene.touch.data.site_xpos[scene.sites[finger]]) for finger in fingers]
    return ~np.any(np.abs([scene.jacobian(link, tip) for link, tip in ends]) > 1e-9, axis=(0, 1))
