"""`Tracker`: from keypoints to the pose that the twin's hand is to take."""

from collections.abc import Callable

import numpy as np
from jaxtyping import Float

from envs.live.twin.person import FRAMES, KnownHand, Person, measured_hand
from envs.live.twin.placement import AS_IT_IS, place_hand
from envs.live.twin.pose import HandPose
from mjx_hand.capture.keypoints.skeleton import rest_keypoints
from mjx_hand.errors import InputError
from mjx_hand.hand.load import load_hand
from mjx_hand.robots.human_motion import human_objective
from mjx_hand.robots.human_tree import human_tree
from mjx_hand.robots.solver.keypoint_stream import KeypointStream

_SETTLED = 5  # frames followed before it is said where the hand stands: the first may be a poor one


class Tracker:
    """Measures the person's hand, then follows it.

    All that compiles does so as it is made; a person's hand runs what the mean hand's compiled.

    Args:
        side: "right" or "left".
        up, forward: of the source; up None where its frame is the world's.
        hand: the person's, where it is known.
        say: told of what is to be known.

    Attributes:
        hand: the person's, None until it is measured.
        known: how far the measuring is, 0 to 1.
        placement: where the source's frame lies, None until it is known.
    """

    def __init__(
        self,
        side: str,
        up: str | None,
        forward: str,
        hand: KnownHand | None,
        say: Callable[[str], None],
    ):
        self._side, self._up, self._forward, self._say = side, up, forward, say
        self._objective = human_objective()
        rest = rest_keypoints(load_hand(side=side))[0]
        mean = measured_hand(np.tile(rest, (FRAMES, 1, 1)), side).rigid  # compiles what measuring needs
        self._stream = KeypointStream(human_tree(mean), self._objective)
        self._stream.warm_up()
        self._stream.reset()
        self._person = Person(side)
        self._followed = 0
        self.hand: KnownHand | None = None
        self.known = 0.0
        self.placement = AS_IT_IS if up is None else None
        if hand is not None:
            self._follow(hand)

    def forget_place(self) -> None:
        """Place the hand anew when it is next seen, unless its frame is the world's."""
        self.placement, self._followed = (AS_IT_IS if self._up is None else None), 0

    def pose(self, keypoints: Float[np.ndarray, "21 3"], at: float) -> HandPose | None:
        """Where the hand is in the world; None while it is not seen, or not yet known.

        Args:
            keypoints: of a frame (m), NaN where one is missing.
            at: when it came (s).
        """
        if self.hand is None:
            self.known = self._person.add(keypoints, at)
            if self.known < 1:
                return None
            try:
                self._follow(self._person.hand())
            except InputError as error:
                self._say(str(error))
                self._person, self.known = Person(self._side), 0.0
                return None
        assert self.hand is not None
        found = self._stream.step(keypoints)
        if not found.seen:
            return None
        position, quaternion = np.asarray(found.base_position, float), np.asarray(found.base_quaternion, float)
        if self.placement is None:
            self._followed += 1
            if self._followed < _SETTLED or self._up is None:
                return None
            self.placement = place_hand(position, quaternion, self.hand.rigid, self._up, self._forward)
        place = self.placement
        return HandPose(place.position(position), place.quaternion(quaternion), np.asarray(found.dofs, float))

    def _follow(self, hand: KnownHand) -> None:
        self.hand, self.known = hand, 1.0
        self._stream = KeypointStream(human_tree(hand.rigid), self._objective)
