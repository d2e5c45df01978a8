"""`Tracker`: from keypoints to the pose that the twin's hand is to take."""

from collections.abc import Callable

import numpy as np
from jaxtyping import Float

from envs.live.twin.hand_solver import HandSolver
from envs.live.twin.person import FRAMES, KnownHand, Person, measured_hand
from envs.live.twin.placement import AS_IT_IS, place_hand
from envs.live.twin.pose import HandPose
from envs.live.twin.steady import Steady
from mjx_hand.capture.keypoints.skeleton import rest_keypoints
from mjx_hand.errors import InputError
from mjx_hand.hand.load import load_hand


class Tracker:
    """Measures the person's hand, then follows it.

    What building a hand compiles does so as it is made: nothing compiles while it follows.

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
        rest = rest_keypoints(load_hand(side=side))[0]
        self._solver = HandSolver(
            measured_hand(np.tile(rest, (FRAMES, 1, 1)), side).rigid
        )  # compiles what measuring needs
        self._person, self._steady = Person(side), Steady()
        self.hand: KnownHand | None = None
        self.known = 0.0
        self.placement = AS_IT_IS if up is None else None
        if hand is not None:
            self._follow(hand)

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
        found = self._solver.solve(keypoints)
        if found is None:
            self._steady.forget()
            return None
        position, quaternion, angles = found
        if self.placement is None:
            assert self._up is not None
            self.placement = place_hand(position, quaternion, self.hand.rigid, self._up, self._forward)
        place = self.placement
        pose = HandPose(place.position(position), place.quaternion(quaternion), angles)
        return self._steady.filtered(pose, at)

    def _follow(self, hand: KnownHand) -> None:
        self.hand, self.known = hand, 1.0
        self._solver = HandSolver(hand.rigid)
