"""`Grip`: what a hesitant hand must press with so that it holds: dq = J^T f / kp at the phalanges that touch.

A tracked hand shows where fingers are, not how hard they press. As in the references of training (`envs.grip`), the
thumb presses with a force, the fingers that touch share as much between them, and each spreads its share over its
phalanges that bear; a hand whose thumb does not touch presses against the palm; one that wraps the object closes with a
share of what its flexing joints can. Fingers that their owner opens let go, whatever they still touch. Here contacts
and derivatives are the C engine's, at the very state.
"""

from collections import Counter

import mujoco
import numpy as np
from jaxtyping import Float

from envs.grip_force import grip_force_of
from envs.live.twin.opening import Opening
from envs.scene import NUM_WRIST
from mjx_hand.hand.joints import FINGERS, FLEXES, LINKS, NUM_HINGES
from mjx_hand.player.steadying import steadied
from mjx_hand.rigid.gains import Gains

NEAR = 0.008  # m: a phalanx that is closer to the object is part of the grip, and brought to the surface
_BEARS = 0.003  # m: it presses the more the closer it is, from here on, and fully where it touches
_SAFETY = 12.0  # times the force that just holds the object's weight by friction between thumb and fingers
_LEAST = 2.0  # N
_DAMPING = 0.01  # m/rad, of the step that closes gaps
_SOON = 0.15  # s over which a grip is taken up and let go: a finger that comes near does not snap shut
_WRAP_TORQUE = 0.75  # of their torque limits, with which flexing joints close around an object
# Fingers besides the thumb that are near with two phalanges where a hand begins to wrap, and phalanges when it ends.
_WRAPS, _LETS_GO = 3, 2
_WATCHED = 0.02  # s between two looks at whether fingers open
_THUMB = FINGERS.index("thumb")
_HINGES = slice(NUM_WRIST, NUM_WRIST + NUM_HINGES)


def notice_near(model: mujoco.MjModel) -> None:
    """Have the engine list what is nearer than `NEAR` to the hand, without pushing it; changes the model in place."""
    of_hand = np.isin(model.geom_bodyid, [model.body(name).id for name in LINKS]) & (model.geom_contype > 0)
    model.geom_gap[of_hand] = NEAR


class Grip:
    """The press of one hand on one object.

    Args:
        model: after `notice_near`.
        body: the object's.
        mass, friction: of the object, kg.
        gains: of the hand's joints.
    """

    def __init__(self, model: mujoco.MjModel, body: int, mass: float, friction: float, gains: Gains):
        self._model, self._body, self._gains = model, body, gains
        self._links = {model.body(name).id: k for k, name in enumerate(LINKS)}
        self._force = max(_LEAST, grip_force_of(mass, friction, _SAFETY / 2))
        self._jacobian = np.zeros((3, model.nv))
        self._opening = Opening(model)
        self.reset()

    def reset(self) -> None:
        """The hand is elsewhere: nothing is held."""
        self._opening.reset()
        self._offsets = np.zeros(NUM_HINGES)
        self._wraps = self._holds = False
        self._unwatched = _WATCHED
        self._steady = self._tracked = np.zeros(NUM_HINGES)

    def pressing(self, angles: Float[np.ndarray, "20"], data: mujoco.MjData, seconds: float) -> Float[np.ndarray, "20"]:
        """What to tell the hinges (rad) in place of where the fingers are tracked.

        Args:
            angles: as tracked.
            data: as the last step left it.
            seconds: since the last call.
        """
        pressed = self._pressed(data, seconds)
        self._unwatched += seconds
        if self._unwatched >= _WATCHED:
            self._opening.watch(angles, data, self._holds, self._unwatched)
            self._unwatched = 0.0
        # Fingers that their owner opens are followed, whatever they still touch.
        holds = self._holds & ~self._opening.open
        self._steady = steadied(self._steady, self._tracked, angles, holds, seconds, np)
        self._tracked = angles
        return self._steady + pressed * self._opening.share

    def _pressed(self, data: mujoco.MjData, seconds: float) -> Float[np.ndarray, "20"]:
        """What to add to the hinges' targets (rad)."""
        nearest = self._nearest(data)
        phalanges = Counter((link - 1) // 3 for link in nearest if link > 0)
        others = [count for finger, count in phalanges.items() if finger != _THUMB]
        # What slips touches less: a grip that weakened with it would let go.
        around = sum(count > 1 for count in others)
        self._wraps = sum(others) > _LETS_GO if self._wraps else around >= _WRAPS
        self._holds = self._wraps or (bool(others) and _THUMB in phalanges)
        if self._wraps:
            wanted = _WRAP_TORQUE * np.array(FLEXES) * self._gains.force_limit / self._gains.stiffness
        elif others:
            wanted = self._press(data, nearest)
        else:  # a thumb alone presses nothing
            wanted = np.zeros(NUM_HINGES)
        self._offsets += min(1.0, seconds / _SOON) * (wanted - self._offsets)
        return self._offsets

    def _press(
        self, data: mujoco.MjData, nearest: dict[int, tuple[float, np.ndarray, np.ndarray]]
    ) -> Float[np.ndarray, "20"]:
        """Offsets (rad) that press with what is near: J^T f / kp, and a damped least-squares step that closes gaps."""
        links = [link for link in nearest if link > 0]  # the palm is pressed against
        gaps = np.array([nearest[link][0] for link in links])
        finger = (np.array(links) - 1) // 3
        bears = np.clip(1 - gaps / _BEARS, 0.0, 1.0)
        of_finger = np.bincount(finger, bears, len(FINGERS))
        # Fingers that are only near, and those that their owner opens, take nothing from those that press.
        presses = np.minimum(of_finger, 1.0) * self._opening.share_of_finger
        leads = np.arange(len(FINGERS)) == _THUMB
        of_hand = np.where(leads, 1.0, 1.0 / max(float(presses[~leads].sum()), 1.0))
        share = bears / np.maximum(of_finger, 1.0)[finger] * of_hand[finger]
        lever = np.stack([self._lever(data, link, *nearest[link][1:]) for link in links])
        limit, closing = self._gains.force_limit, np.maximum(gaps, 0.0)
        step = lever.T @ np.linalg.solve(lever @ lever.T + _DAMPING**2 * np.eye(len(links)), closing)
        return np.clip(self._force * share @ lever, -limit, limit) / self._gains.stiffness + step

    def _lever(
        self, data: mujoco.MjData, link: int, place: Float[np.ndarray, "3"], inward: Float[np.ndarray, "3"]
    ) -> Float[np.ndarray, "20"]:
        """How fast a link's place goes into the object with each hinge (m/rad)."""
        mujoco.mj_jac(self._model, data, self._jacobian, None, place, self._model.body(LINKS[link]).id)
        return inward @ self._jacobian[:, _HINGES]

    def _nearest(self, data: mujoco.MjData) -> dict[int, tuple[float, np.ndarray, np.ndarray]]:
        """Of each link that is near the object: the gap (m), its nearest place (m), the way into the object there."""
        found: dict[int, tuple[float, np.ndarray, np.ndarray]] = {}
        for contact in data.contact[: data.ncon]:
            first, second = (int(self._model.geom_bodyid[geom]) for geom in contact.geom)
            other = first if second == self._body else second
            link = self._links.get(other)
            if link is None or self._body not in (first, second):
                continue
            if link not in found or contact.dist < found[link][0]:
                normal = contact.frame[:3] if second == self._body else -contact.frame[:3]
                found[link] = (float(contact.dist), contact.pos.copy(), normal.copy())
        return found
