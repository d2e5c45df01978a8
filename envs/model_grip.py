"""Grip offsets of any body, by MuJoCo's own distances and Jacobians; as `envs.grip` has them for a human hand."""

import itertools
from collections.abc import Iterator, Sequence

import mujoco
import numpy as np
from jaxtyping import Float
from scipy.special import expit

from envs.grip_force import GRIP_RAMP, closing_ramp
from envs.scene import NUM_WRIST, OBJECT, demonstration_spec
from mjx_hand.bodies.body import Body
from mjx_hand.bodies.closing import closing_directions
from mjx_hand.bodies.coordinates import coordinates_per_target, hand_coordinates
from mjx_hand.motion.demonstration import Demonstration
from mjx_hand.rigid.gains import Gains

NEAR = 0.007  # m: a link nearer than this is taken to touch
HOVER = 0.02  # m that recorded objects stand above their table at most
ANYWHERE = 10.0  # m: however far
_SHARP = 0.001  # m, over which that fades
_FAR = 0.02  # m, beyond which nobody asks how far
_DAMPING = 0.01  # m/rad, of the step that closes gaps
# Fingers besides those that oppose: with three that touch with two links each a hand wraps, a pinch has two of them. A
# hand with fewer wraps with all of them.
WRAPS, SURE = 2.5, 0.03
_SIDES = 32  # of a cylinder's rim
_APART = 1e-4  # m that a link is moved out to see which way the surface faces where it just touches


class Touch:
    """Where a hand and an object are nearest to each other, link by link, in one scene.

    Args:
        model: the scene.
        body: the hand.
        palm: with the links of no finger, too.

    Attributes:
        links: those of fingers that have a shape to touch with.
        fingers: of each of them, "" of the palm's.
        object, ground: geoms of the object, and of table and support.
    """

    def __init__(self, model: mujoco.MjModel, body: Body, *, palm: bool = False):
        self.model, self.data = model, mujoco.MjData(model)
        self.links = tuple(dict.fromkeys(c.link for c in body.contacts if c.finger or palm))
        self.fingers = tuple(next(c.finger for c in body.contacts if c.link == link) for link in self.links)
        self._hand = [[model.geom(c.name).id for c in body.contacts if c.link == link] for link in self.links]
        self._bodies = [model.body(link).id for link in self.links]
        shapes = {geom: _corners(model, geom) for geoms in self._hand for geom in geoms}
        self._corners = {geom: corners for geom, (corners, _) in shapes.items()}
        self._round = {geom: radius for geom, (_, radius) in shapes.items()}
        self.object: list[int] = np.flatnonzero(model.geom_bodyid == model.body(OBJECT).id).tolist()
        self.ground: list[int] = np.flatnonzero(model.geom_bodyid == 0).tolist()

    def place(self, coordinates: Float[np.ndarray, "m"], object_pose: Float[np.ndarray, "7"]) -> None:
        """Put hand and object somewhere."""
        self.data.qpos[: len(coordinates)], self.data.qpos[len(coordinates) :] = coordinates, object_pose
        mujoco.mj_kinematics(self.model, self.data)
        mujoco.mj_comPos(self.model, self.data)

    def object_clearance(self) -> float:
        """How far the object is off table and support (m)."""
        pairs = itertools.product(self.object, self.ground)
        return min(mujoco.mj_geomDistance(self.model, self.data, *pair, ANYWHERE, None) for pair in pairs)

    def nearest(
        self, most: float = _FAR, others: Sequence[int] | None = None
    ) -> Iterator[tuple[int, float, np.ndarray, np.ndarray]]:
        """Of each link that is nearer than `most` (m): its number, the gap, its point there, and the way in (world).

        Nearer to the object, or to these other shapes.
        """
        others = self.object if others is None else others
        ends = np.zeros(6)
        for number, geoms in enumerate(self._hand):
            best: tuple[float, np.ndarray, tuple[int, int]] | None = None
            for geom in geoms:
                for other in others:
                    gap = mujoco.mj_geomDistance(self.model, self.data, geom, other, most, ends)
                    if gap < most and (best is None or gap < best[0]):
                        best = gap, ends.copy(), (geom, other)
            if best is not None:
                gap, found, pair = best
                inward = (found[3:] - found[:3]) / gap if abs(gap) > _APART / 10 else self._inward(*pair)
                yield number, gap, found[:3], inward

    def _inward(self, geom: int, other: int) -> Float[np.ndarray, "3"]:
        """The way into the object where a geom just touches it: there the two nearest points are one and do not say."""
        here, ends = self.data.geom_xpos[geom].copy(), np.zeros(6)
        out = here - self.data.geom_xpos[other]
        if self.model.geom_type[other] == mujoco.mjtGeom.mjGEOM_PLANE:  # whose centre may be far aside
            out = self.data.geom_xmat[other].reshape(3, 3)[:, 2]
        out = out / max(float(np.linalg.norm(out)), _APART)
        self.data.geom_xpos[geom] += _APART * out
        gap = mujoco.mj_geomDistance(self.model, self.data, geom, other, 1.0, ends)
        self.data.geom_xpos[geom] = here
        return (ends[3:] - ends[:3]) / gap if gap > _APART / 10 else -out

    def foremost(self, number: int, way: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3"]:
        """A link's point (m, world) that is farthest along a unit way."""
        points = []
        for geom in self._hand[number]:
            turn, own = self.data.geom_xmat[geom].reshape(3, 3), self._corners[geom]
            corner = own[np.argmax(own @ (turn.T @ way))]
            points.append(self.data.geom_xpos[geom] + turn @ corner + self._round[geom] * way)
        return max(points, key=lambda point: float(point @ way))

    def jacobian(self, number: int, point: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3 m"]:
        """How a point (m, world) of a link moves with the hand's coordinates."""
        jacobian = np.zeros((3, self.model.nv))
        mujoco.mj_jac(self.model, self.data, jacobian, None, point, self._bodies[number])
        return jacobian[:, : self.model.nv - 6]

    def on_link(self, number: int, point: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3"]:
        """A point (m, world) in a link's own axes, where the link is now."""
        body = self._bodies[number]
        return self.data.xmat[body].reshape(3, 3).T @ (point - self.data.xpos[body])

    def in_world(self, number: int, place: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3"]:
        """The reverse of `on_link`."""
        body = self._bodies[number]
        return self.data.xpos[body] + self.data.xmat[body].reshape(3, 3) @ place


def _corners(model: mujoco.MjModel, geom: int) -> tuple[Float[np.ndarray, "c 3"], float]:
    """Corners (m, the geom's frame), and the radius around them, of which a geom is the convex hull."""
    kind, size = model.geom_type[geom], model.geom_size[geom]
    if kind == mujoco.mjtGeom.mjGEOM_MESH:
        mesh = model.geom_dataid[geom]
        first = model.mesh_vertadr[mesh]
        return model.mesh_vert[first : first + model.mesh_vertnum[mesh]].astype(float), 0.0
    signs = np.array(list(itertools.product((-1.0, 1.0), repeat=3)))
    if kind == mujoco.mjtGeom.mjGEOM_SPHERE:
        return np.zeros((1, 3)), float(size[0])
    if kind == mujoco.mjtGeom.mjGEOM_CAPSULE:
        return np.array([[0.0, 0.0, -size[1]], [0.0, 0.0, size[1]]]), float(size[0])
    if kind == mujoco.mjtGeom.mjGEOM_CYLINDER:
        angles = np.linspace(0, 2 * np.pi, _SIDES, endpoint=False)
        rim = np.stack([np.cos(angles), np.sin(angles)], 1) * size[0]
        return np.concatenate([np.insert(rim, 2, end * size[1], axis=1) for end in (-1.0, 1.0)]), 0.0
    return signs * size, 0.0  # a box


def model_grips(
    demonstrations: Sequence[Demonstration],
    bodies: Sequence[Body],
    targets: Float[np.ndarray, "d t u"],
    forces: Float[np.ndarray, "d"],
    gains: Gains,
    wrap_torque: float = 0.0,
) -> Float[np.ndarray, "d t u"]:
    """The grip (rad) of each demonstration at a force (N); NaN leaves it as it is.

    As `envs.grip.grip_offsets`: one damped step that closes the gaps of links that touch, and J^T f / kp, where the
    opposing fingers press with the force and the others share as much. A hand that wraps, three of whose other fingers
    (or all, of two) touch with two links each, closes with `wrap_torque` of its joints' limits instead.

    All this sets in in the last 0.3 s before the object moves: J^T f moves a tip that does not touch yet aside as well,
    and controllers bring it late (thumbs went 8 mm up and pressed cubes down by their edges). An object that is held in
    the air from the beginning is pressed from then on.
    """
    grips = np.zeros_like(targets)
    for k, (d, body) in enumerate(zip(demonstrations, bodies, strict=True)):
        if np.isnan(forces[k]):
            continue
        model = demonstration_spec(d, body).compile()
        press = Press(Touch(model, body), body, float(forces[k]), gains, wrap_torque)
        coordinates = hand_coordinates(model, targets[k])
        press.touch.place(coordinates[0], d.object_pose[0])
        stands = press.touch.object_clearance() < HOVER
        ramp = closing_ramp(d, targets.shape[1], GRIP_RAMP) if stands else np.ones(targets.shape[1])
        for t in np.flatnonzero(ramp[: d.num_frames]):
            press.touch.place(coordinates[t], d.object_pose[t])
            grips[k, t, NUM_WRIST:] = press.offsets()
        grips[k, d.num_frames :] = grips[k, d.num_frames - 1]
        grips[k] *= ramp[:, None]
    return grips


class Press:
    """How the fingers of one hand press on the object.

    Args:
        touch: where they are.
        body: the hand.
        force: of its pads (N).
        gains: of its joints.
        wrap_torque: see `model_grips`.
    """

    def __init__(self, touch: Touch, body: Body, force: float, gains: Gains, wrap_torque: float):
        self.touch, self._force, self._gains = touch, force, gains
        self._mix = coordinates_per_target(touch.model, body.num_targets)[:, NUM_WRIST:]
        self._closed = wrap_torque * closing_directions(body) * gains.force_limit / gains.stiffness
        self._opposing = body.opposing
        self._others = len({*touch.fingers} - {"", *body.opposing})

    def offsets(self) -> Float[np.ndarray, "j"]:
        """Of the actuated joints (rad), where hand and object are now."""
        touch, gains = self.touch, self._gains
        found = [near for near in touch.nearest() if touch.fingers[near[0]]]  # the palm is moved by no joint
        if not found:
            return np.zeros(self._mix.shape[1])
        numbers = np.array([number for number, *_ in found])
        gaps = np.array([gap for _, gap, *_ in found])
        touching = expit((NEAR - gaps) / _SHARP)
        rows = np.stack([inward @ touch.jacobian(number, point) @ self._mix for number, _, point, inward in found])
        fingers = np.array(touch.fingers)[numbers]
        names = list(dict.fromkeys(finger for finger in touch.fingers if finger))
        of_finger = (fingers[:, None] == np.array(names)).astype(float)  # (links, fingers)
        leads = np.isin(names, self._opposing)
        phalanges = touching @ of_finger  # how many of each finger touch
        touches = np.minimum(phalanges, 1.0)
        rest, ahead = (touches / max(float(touches[side].sum()), 1.0) for side in (~leads, leads))
        of_hand = np.where(leads, ahead, rest)
        share = touching * (of_finger @ (of_hand / np.maximum(phalanges, 1.0)))
        torque = (self._force * share) @ rows
        closing = rows * touching[:, None]
        square = closing @ closing.T + _DAMPING**2 * np.eye(len(rows))
        step = closing.T @ np.linalg.solve(square, gaps * touching)
        pressed = step + np.clip(torque, -gains.force_limit, gains.force_limit) / gains.stiffness
        if not self._closed.any() or self._others < 2:
            return pressed
        around = np.clip(phalanges - 1.0, 0.0, 1.0)[~leads].sum()
        wraps = expit((around - min(WRAPS, self._others - 0.5)) / SURE)
        return (1 - wraps) * pressed + wraps * self._closed
