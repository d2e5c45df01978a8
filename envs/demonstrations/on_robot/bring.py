"""`on_robot`: a person's demonstration as a robot's.

The object goes its way as demonstrated. A robot's hand is larger or smaller than a person's, has other fingers and
other knuckles: wrists cannot coincide, contacts can. First one grasp is sought, by damped least squares from several
postures: each robot finger whose person's finger touches lies with its last link on the object at the same place, no
other link is inside the object, and the wrist is turned as the person's where that leaves a choice. The wrist then goes
as the person's went, from that grasp, and in each frame fingers are where the person's pads were.
"""

import dataclasses

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from envs.demonstrations.on_robot.closure import closes
from envs.demonstrations.on_robot.follow import solve
from envs.demonstrations.on_robot.left_out import NO_CLOSURE, OUT_OF_REACH, LeftOut, shared_pads
from envs.demonstrations.on_robot.pads import demonstrated_pads
from envs.demonstrations.on_robot.sticking import followed_places
from envs.model_grip import Touch
from envs.scene import NUM_WRIST, base_rotation, demonstration_spec, wrist_coordinates
from mjx_hand.bodies.body import Body
from mjx_hand.bodies.coordinates import coordinates_per_target, hand_coordinates
from mjx_hand.errors import InputError
from mjx_hand.motion.demonstration import Demonstration
from mjx_hand.motion.joint_motion import JointMotion
from mjx_hand.pytree import replace
from mjx_hand.rigid.rigid_hand import RigidHand

_ON, _ALONG, _INSIDE = 0.0005, 0.004, 0.001  # m that weigh 1: off the surface, along it, and of another link inside
_TURNED, _POSED, _TIP = (
    0.6,
    1.5,
    0.05,
)  # rad of the wrist, rad of a joint from its middle, m of a tip that touches nothing
_PAD, _WRIST_WAY, _WRIST_TURN, _CHANGE = 0.001, 0.01, 0.1, 0.15  # m, m, rad, rad a frame: of following
_BENT = (0.15, 0.3, 0.45, 0.6)  # of the joints' ranges, at which a search for a grasp begins
_DEPTH = 0.002  # m that a link may be inside the object
_OFF = 0.004  # m that a finger may be off the surface where it should touch
_CLEAR = 0.001  # m, beyond which another link is not inside
_SAME_FACE = 0.8  # cosine between the person's way into the object and the robot's
_ALONG_WRAP, _AROUND = 0.02, 0.01  # m that weigh 1 of a hand that wraps: along the surface, and of further links off it
_TOUCHES = 0.002  # m off the surface at which a link bears
_STEPS, _FEW = 60, 6
_ANYWHERE = 10.0  # m: of every link, also where a step of the search throws the hand far from the object


@dataclasses.dataclass(frozen=True)
class Brought:
    """A robot's demonstration and how good it is.

    Attributes:
        demonstration: with the robot's motion.
        fingers: of the robot that touch.
        off: how far each is from where the person's touched, at the grasp (m).
        depth: how deep any link is inside the object, at the grasp (m).
        gap: how far each is off the surface, at the grasp (m).
    """

    demonstration: Demonstration
    fingers: tuple[str, ...]
    off: Float[np.ndarray, "f"]
    depth: float
    gap: Float[np.ndarray, "f"]


def on_robot(demonstration: Demonstration, person: RigidHand, body: Body) -> Brought:
    """Bring a person's demonstration onto a robot hand.

    Raises:
        InputError: a hand of the other side.
        LeftOut: fewer than two of the fingers that touch, or no posture in which they do and hold the object.
    """
    if body.side != demonstration.motion.side:
        raise InputError(
            f"the demonstration is of a {demonstration.motion.side} hand, {body.name!r} is a {body.side} one; give a "
            f"{demonstration.motion.side} hand's description"
        )
    return _Bringing(demonstration, person, body).brought()


def moved_by(
    body: Body,
    demonstration: Demonstration,
    angles: Float[np.ndarray, "t j"],
    wrist_position: Float[np.ndarray, "t 3"],
    wrist_quaternion: Float[np.ndarray, "t 4"],
) -> Demonstration:
    """The demonstration with a robot's joints (rad, m) and wrist poses (m, wxyz) in the place of the person's."""
    motion = JointMotion(
        fps=demonstration.motion.fps,
        angles=angles,
        wrist_position=wrist_position,
        wrist_quaternion=wrist_quaternion,
        valid=np.ones(len(angles), bool),
        side=body.side,
        source=f"{demonstration.motion.source} on {body.name}",
        joint_names=body.joints,
    )
    return replace(demonstration, motion=motion, tracked=None)  # a tracker saw the person's hand


class _Bringing:
    """One demonstration on its way onto a robot."""

    def __init__(self, demonstration: Demonstration, person: RigidHand, body: Body):
        self.demonstration, self.body = demonstration, body
        self.pads = shared_pads(demonstrated_pads(demonstration, person), body)
        self.base = base_rotation(demonstration)
        motion = demonstration.motion
        self.wrist = wrist_coordinates(motion.wrist_position, motion.wrist_quaternion, self.base)
        self.model = demonstration_spec(demonstration, body).compile()
        self.touch = Touch(self.model, body, palm=True)
        self.count = body.num_targets
        self.mix = coordinates_per_target(self.model, self.count)
        self.low, self.high = self.model.actuator_ctrlrange[: self.count].T
        self.middle = (self.low + self.high) / 2
        self.last = {finger: k for k, finger in enumerate(self.touch.fingers)}  # each finger's last link
        self.sites = {finger: self.model.site(f"{finger}_tip").id for finger in body.fingers}

    def brought(self) -> Brought:
        targets, off, depth, gap = self._grasp()
        fingers = self.pads.fingers
        name = f"{self.body.name!r} cannot grasp as demonstrated ({self.demonstration.grasp})"
        far = not self.pads.wraps and (off.max() > 2 * _ALONG + _OFF or gap.max() > _OFF)
        if far or depth > 2 * _DEPTH:
            raise LeftOut(
                OUT_OF_REACH,
                f"{name}: its {fingers[int(off.argmax())]} stays {1e3 * off.max():.0f} mm from where the person's "
                f"touches, its links are {1e3 * depth:.0f} mm inside",
            )
        contacts = [(point, way) for gap, point, way in self._near().values() if gap < _TOUCHES]
        points, ways = (np.array([contact[k] for contact in contacts]).reshape(-1, 3) for k in (0, 1))
        if not closes(points, ways, self.demonstration.object.friction):
            raise LeftOut(NO_CLOSURE, f"{name}: no posture of it has force closure, {len(points)} of its links touch")
        rows = self._follow(targets)
        turn = Rotation.from_matrix(self.base) * Rotation.from_euler("XYZ", rows[:, 3:NUM_WRIST])
        quaternion = turn.as_quat(scalar_first=True)
        made = moved_by(self.body, self.demonstration, rows[:, NUM_WRIST:], rows[:, :3] @ self.base.T, quaternion)
        return Brought(made, fingers, off, depth, gap)

    def _place(self, targets: np.ndarray, frame: int) -> None:
        self.touch.place(hand_coordinates(self.model, targets), self.demonstration.object_pose[frame])

    def _near(self) -> dict[int, tuple[float, np.ndarray, np.ndarray]]:
        """Of every link its gap, its point nearest to the object, and the way in, where they are now."""
        return {number: (gap, point, way) for number, gap, point, way in self.touch.nearest(_ANYWHERE)}

    def _jacobian(self, link: int, point: np.ndarray) -> Float[np.ndarray, "3 u"]:
        return self.touch.jacobian(link, point) @ self.mix

    def _grasp(self) -> tuple[np.ndarray, np.ndarray, float, np.ndarray]:
        """The best grasp from several beginnings: targets, and how far they are from what is wanted."""
        frame, pads = self.pads.grasp, self.pads
        places = pads.surface
        wrist = self.wrist[frame]
        wanted = [self.last[finger] for finger in pads.fingers]
        along = _ALONG_WRAP if pads.wraps else _ALONG
        around = ("", *pads.fingers) if pads.wraps else ()  # phalanges and the palm of a hand that wraps
        closing = [k for k, finger in enumerate(self.touch.fingers) if finger in around and k not in wanted]

        def equations(targets: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            self._place(targets, frame)
            near = self._near()
            rows, values = [], []
            for link, place, inward in zip(wanted, places, pads.inward, strict=True):
                gap, point, way = near[link]
                if not pads.wraps and way @ inward < _SAME_FACE:
                    # As around a corner: what would touch, were it on this face.
                    point, way = self.touch.foremost(link, inward), inward
                    gap = float(inward @ (place - point))
                jacobian = self._jacobian(link, point)
                aside = np.eye(3) - np.outer(inward, inward)
                rows += [-(way @ jacobian)[None] / _ON, aside @ jacobian / along]
                values += [np.array([gap / _ON]), aside @ (point - place) / along]
            for link, (gap, point, way) in near.items():
                if link not in wanted and gap < _CLEAR:
                    rows.append((way @ self._jacobian(link, point))[None] / _INSIDE)
                    values.append(np.array([(_CLEAR - gap) / _INSIDE]))
                elif link in closing:
                    rows.append(-(way @ self._jacobian(link, point))[None] / _AROUND)
                    values.append(np.array([(gap - _CLEAR) / _AROUND]))
            for finger, site in self.sites.items():
                if finger not in pads.fingers and finger in pads.tips:
                    link = self.last[finger]
                    point = self.touch.data.site_xpos[site].copy()
                    rows.append(self._jacobian(link, point) / _TIP)
                    values.append((point - pads.tips[finger][frame]) / _TIP)
            unit = np.eye(self.count)
            rows += [unit[3:NUM_WRIST] / _TURNED, unit[NUM_WRIST:] / _POSED]
            values += [(targets - np.pad(wrist, (0, self.count - NUM_WRIST)))[3:NUM_WRIST] / _TURNED]
            values += [(targets - self.middle)[NUM_WRIST:] / _POSED]
            return np.concatenate(values), np.concatenate(rows)

        best: tuple[float, np.ndarray] | None = None
        for bent in _BENT:
            start = self.low + bent * (self.high - self.low)
            start[:NUM_WRIST] = wrist
            self._place(start, frame)
            tips = np.mean([self.touch.data.site_xpos[self.sites[finger]] for finger in pads.fingers], axis=0)
            start[:3] += self.base.T @ (places.mean(axis=0) - tips)
            found, cost = solve(equations, start, self.low, self.high, _STEPS)
            if best is None or cost < best[0]:
                best = cost, found
        assert best is not None
        targets = best[1]
        self._place(targets, frame)
        near = self._near()
        off = np.array([np.linalg.norm(near[k][1] - place) for k, place in zip(wanted, places, strict=True)])
        gap = np.array([near[k][0] for k in wanted])
        depth = max(0.0, -min(rest[0] for rest in near.values()))
        return targets, off, depth, np.maximum(gap, 0.0)

    def _follow(self, grasp: np.ndarray) -> Float[np.ndarray, "t u"]:
        """Targets of every frame, from the grasp on and from it back."""
        frame, pads = self.pads.grasp, self.pads
        self._place(grasp, frame)
        near = self._near()
        wanted = [self.last[finger] for finger in pads.fingers]
        held = [self.touch.on_link(k, near[k][1]) for k in wanted]
        ways = followed_places(pads, np.array([near[k][1] for k in wanted]), self.demonstration)
        wrist = self._carried(grasp[:NUM_WRIST])
        unit = np.eye(self.count)
        weights = np.concatenate([np.full(3, _WRIST_WAY), np.full(3, _WRIST_TURN)])

        def equations_of(at: int, before: np.ndarray):  # type: ignore[no-untyped-def]
            def equations(targets: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
                self._place(targets, at)
                rows, values = [], []
                for k, link in enumerate(wanted):
                    point = self.touch.in_world(link, held[k])
                    rows.append(self._jacobian(link, point) / _PAD)
                    values.append((point - ways[at, k]) / _PAD)
                rows += [unit[:NUM_WRIST] / weights[:, None], unit[NUM_WRIST:] / _CHANGE]
                values += [(targets[:NUM_WRIST] - wrist[at]) / weights, (targets - before)[NUM_WRIST:] / _CHANGE]
                return np.concatenate(values), np.concatenate(rows)

            return equations

        rows = np.empty((self.demonstration.num_frames, self.count))
        rows[frame] = grasp
        for order in (range(frame + 1, len(rows)), range(frame - 1, -1, -1)):
            before = grasp
            for at in order:
                start = before.copy()
                start[:NUM_WRIST] = wrist[at]
                before, _ = solve(equations_of(at, before), start, self.low, self.high, _FEW)
                rows[at] = before
        return rows

    def _carried(self, grasp: np.ndarray) -> Float[np.ndarray, "t 6"]:
        """The wrist's coordinates if it went with the person's, from the grasp on and from it back."""
        person = Rotation.from_euler("XYZ", self.wrist[:, 3:])
        robot = Rotation.from_euler("XYZ", grasp[3:])
        held = person[self.pads.grasp].inv()
        place = held.apply(grasp[:3] - self.wrist[self.pads.grasp, :3])
        turns = np.unwrap((person * (held * robot)).as_euler("XYZ"), axis=0)
        turns += 2 * np.pi * np.round((grasp[3:] - turns[self.pads.grasp]) / (2 * np.pi))
        return np.concatenate([self.wrist[:, :3] + person.apply(place), turns], axis=1)
