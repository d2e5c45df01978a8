"""`HandSolver`: hinges and wrist from one frame's keypoints, after another, by MuJoCo's own kinematics.

It minimises what `human_objective` says, the mean over the keypoints of h(|point - keypoint|), h being the Huber loss,
by Levenberg's steps within the hinges' limits. `KeypointStream` does that for any hand, and searches more widely where
a frame follows none; but it compiles for a minute, and its threads would take turns with those of the physics.
Derivatives here are the C engine's, so that the first frame of a person's hand is as quick as every other.

`on_robot.least_squares.solve` is for residuals over a hand's targets, whose wrist is six more joints. Here the wrist
turns freely, by a quaternion, the loss is no sum of squares, and a frame has milliseconds: the two share no line but
the linear solve.
"""

import mujoco
import numpy as np
from jaxtyping import Bool, Float

from mjx_hand.capture.keypoints.layouts import LINK_KEYPOINTS, NUM_KEYPOINTS, PALM, TIP_KEYPOINTS
from mjx_hand.capture.pose.wrist import rigid_fit
from mjx_hand.hand.joints import FINGERS, FLEXES, LINKS, NUM_HINGES, TIP_LINKS
from mjx_hand.rigid.export.mjcf import hand_spec
from mjx_hand.rigid.rigid_hand import RigidHand

HUBER = 0.02  # m: what is farther off counts by its distance, no longer by its square
UNLIKE = 0.02  # m, on average, from which on keypoints are no hand's
_HOLD = 1e-7  # m2/rad2: a hinge that no keypoint shows stays where it was
_FEWEST, _FEWEST_OF_PALM = 8, 3  # keypoints of a frame that shows a hand
_NEXT, _FIRST = 8, 20  # steps of a frame that follows another, and of one that follows none, at most
_BENDS = (0.1, 0.45, 0.8)  # shares of their range at which the hinges of such a frame begin
_SMALL = 1e-4  # m, rad: a step after which no other is made
_DAMPING, _GROWTH, _MOST = 1e-8, 10.0, 1e3
_DOFS = 6 + NUM_HINGES


class HandSolver:
    """Follows one hand.

    Args:
        rigid: the hand.
    """

    def __init__(self, rigid: RigidHand):
        self._model = hand_spec(rigid, base="free", visual=False).compile()
        self._data = mujoco.MjData(self._model)
        self._low, self._high = self._model.jnt_range[1:].T
        bodies = [self._model.body(name).id for name in LINKS]
        tips = [bodies[link] for link in TIP_LINKS]
        order = np.argsort([*LINK_KEYPOINTS, *TIP_KEYPOINTS])
        self._bodies = np.array([*bodies, *tips])[order]
        self._links = np.array(bodies)
        self._tips = np.array([self._model.site(f"{finger}_tip").id for finger in FINGERS])
        self._order = order
        self._flexion = np.array(FLEXES)
        self._jacobian = np.zeros((NUM_KEYPOINTS, 3, _DOFS))
        self._rest = self._points(self._model.qpos0)
        self._qpos = self._model.qpos0.copy()
        self._follows = False

    def solve(
        self, keypoints: Float[np.ndarray, "21 3"]
    ) -> tuple[Float[np.ndarray, "3"], Float[np.ndarray, "4"], Float[np.ndarray, "20"]] | None:
        """Position (m) and quaternion (wxyz) of the wrist in the keypoints' frame, and hinge angles (rad).

        Args:
            keypoints: m; NaN where one is missing.

        Returns:
            None where too few are seen, or what is seen is no hand.
        """
        seen = np.asarray(np.isfinite(keypoints).all(axis=1))
        if seen.sum() < _FEWEST or seen[list(PALM)].sum() < _FEWEST_OF_PALM:
            self._follows = False
            return None
        aims = np.where(seen[:, None], keypoints, 0.0)
        if self._follows:
            found = self._improved(self._qpos, aims, seen, _NEXT)
        else:
            starts = (self._start(bend, aims, seen) for bend in _BENDS)
            found = min((self._improved(start, aims, seen, _FIRST) for start in starts), key=lambda each: each[1])
        qpos, _ = found
        off = np.linalg.norm(self._points(qpos) - aims, axis=1)[seen].mean()
        self._follows = bool(off < UNLIKE)
        if not self._follows:
            return None
        self._qpos = qpos
        return qpos[:3].copy(), qpos[3:7].copy(), qpos[7:].copy()

    def _start(
        self, bend: float, aims: Float[np.ndarray, "21 3"], seen: Bool[np.ndarray, "21"]
    ) -> Float[np.ndarray, "27"]:
        """The palm where its keypoints are, and every finger bent by a share of its range."""
        palm = list(PALM)
        turns, places, _ = rigid_fit(self._rest[palm] - self._rest[0], aims[None, palm], seen[None, palm].astype(float))
        qpos = self._qpos.copy()
        qpos[:3] = places[0]
        mujoco.mju_mat2Quat(qpos[3:7], np.ascontiguousarray(turns[0]).ravel())
        qpos[7:] = np.where(self._flexion, self._low + bend * (self._high - self._low), 0.0)
        qpos[7:] = np.clip(qpos[7:], self._low, self._high)
        return qpos

    def _improved(
        self, start: Float[np.ndarray, "27"], aims: Float[np.ndarray, "21 3"], seen: Bool[np.ndarray, "21"], steps: int
    ) -> tuple[Float[np.ndarray, "27"], float]:
        """The pose after at most so many steps, and what the objective is there."""
        qpos, held, damping = start, start[7:], _DAMPING
        value = self._value(qpos, aims, seen, held)
        for _ in range(steps):
            slope, curve = self._slope(qpos, aims, seen, held)
            free = np.ones(_DOFS, bool)  # hinges at a limit that are pulled outwards rest
            hinges = qpos[7:]
            free[6:] = ~(((hinges <= self._low) & (slope[6:] > 0)) | ((hinges >= self._high) & (slope[6:] < 0)))
            while damping < _MOST:
                step = np.zeros(_DOFS)
                damped = curve[np.ix_(free, free)] + damping * np.eye(int(free.sum()))
                step[free] = np.linalg.solve(damped, -slope[free])
                tried = qpos.copy()
                mujoco.mj_integratePos(self._model, tried, step, 1.0)
                tried[7:] = np.clip(tried[7:], self._low, self._high)
                worth = self._value(tried, aims, seen, held)
                if worth <= value:
                    break
                damping *= _GROWTH
            else:
                return qpos, value
            qpos, value, damping = tried, worth, max(damping / _GROWTH, _DAMPING)
            if np.abs(step).max() < _SMALL:
                break
        return qpos, value

    def _points(self, qpos: Float[np.ndarray, "27"]) -> Float[np.ndarray, "21 3"]:
        self._data.qpos[:] = qpos
        mujoco.mj_kinematics(self._model, self._data)
        return np.concatenate([self._data.xpos[self._links], self._data.site_xpos[self._tips]])[self._order]

    def _value(
        self,
        qpos: Float[np.ndarray, "27"],
        aims: Float[np.ndarray, "21 3"],
        seen: Bool[np.ndarray, "21"],
        held: Float[np.ndarray, "20"],
    ) -> float:
        off = np.linalg.norm(self._points(qpos) - aims, axis=1)[seen]
        loss = np.where(off < HUBER, off**2 / 2, HUBER * (off - HUBER / 2))
        return float(loss.sum() / NUM_KEYPOINTS + _HOLD / 2 * ((qpos[7:] - held) ** 2).sum())

    def _slope(
        self,
        qpos: Float[np.ndarray, "27"],
        aims: Float[np.ndarray, "21 3"],
        seen: Bool[np.ndarray, "21"],
        held: Float[np.ndarray, "20"],
    ) -> tuple[Float[np.ndarray, "26"], Float[np.ndarray, "26 26"]]:
        """Of the objective: its gradient, and Gauss and Newton's part of its second derivatives."""
        points = self._points(qpos)
        mujoco.mj_comPos(self._model, self._data)
        for k, body in enumerate(self._bodies):
            mujoco.mj_jac(self._model, self._data, self._jacobian[k], None, points[k], body)
        off = points - aims
        weight = seen / NUM_KEYPOINTS * np.minimum(1.0, HUBER / np.maximum(np.linalg.norm(off, axis=1), 1e-9))
        rows, weights = self._jacobian.reshape(-1, _DOFS), np.repeat(weight, 3)
        slope = rows.T @ (weights * off.ravel())
        slope[6:] += _HOLD * (qpos[7:] - held)
        curve = rows.T @ (weights[:, None] * rows)
        curve[6:, 6:] += _HOLD * np.eye(NUM_HINGES)
        return slope, curve
