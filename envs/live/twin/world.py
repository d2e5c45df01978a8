"""`World`: the twin's hand with an object on a table, in MuJoCo's C engine; JAX has no part in it."""

from typing import Literal

import mujoco
import numpy as np
from jaxtyping import Float

from envs.live.twin.contacts import Touch, touches
from envs.live.twin.grip import Grip, notice_near
from envs.live.twin.policy_assist import PolicyAssist
from envs.live.twin.pose import HandPose
from envs.live.twin.tabletop import Tabletop
from envs.live.twin.wrist import Wrist
from envs.physics.native import diverged
from envs.physics.solver import gauss_seidel
from envs.scene import NUM_WRIST, OBJECT, scene_spec
from mjx_hand.hand.joints import LINKS, NUM_HINGES, PARENTS
from mjx_hand.player.exported_policy import ExportedPolicy
from mjx_hand.rigid.gains import Gains
from mjx_hand.rigid.rigid_hand import RigidHand

OFF: Literal["off"] = "off"  # fingers as they are tracked
GRIP: Literal["grip"] = "grip"  # pressing what they touch
Assist = Literal["off", "grip"] | ExportedPolicy  # a live policy moves them
_HAND = NUM_WRIST + NUM_HINGES


class World:
    """One world, stepped 4 ms at a time towards where the hand is to be.

    Args:
        rigid: the person's hand.
        table: the object and where it stands.
        start: where the hand is at first.
        assist: what helps the fingers: `OFF`, `GRIP`, or a policy (`envs.live.assistance`).

    Attributes:
        model, data: MuJoCo's.
        timestep: s.
    """

    def __init__(self, rigid: RigidHand, table: Tabletop, start: HandPose, assist: Assist = OFF):
        gains = Gains()
        told = rigid, table.object, table.support, table.support_position, np.eye(3)
        spec = scene_spec(*told, gains=gains, forces=isinstance(assist, ExportedPolicy))
        (self.model,) = gauss_seidel([spec.compile()])
        self.data = mujoco.MjData(self.model)
        self.timestep = float(self.model.opt.timestep)
        self._bodies = np.array([self.model.body(name).id for name in (*LINKS, OBJECT)])
        self._parents = self._bodies[list(PARENTS[1:])]
        self._object_start = table.pose
        self._low, self._high = self.model.actuator_ctrlrange[:_HAND].T
        self._wrist = Wrist(self.model, self.data)
        self._helper: Grip | PolicyAssist | None = None
        if isinstance(assist, ExportedPolicy):
            self._helper = PolicyAssist(self.model, self._wrist, table.object, assist)
        elif assist == GRIP:
            body = int(self._bodies[-1])
            notice_near(self.model)
            self._helper = Grip(self.model, body, float(table.object.mass), float(table.object.friction), gains)
        self.reset(start)

    def reset(self, hand: HandPose) -> None:
        """Everything at rest: the object as at first, the hand there."""
        mujoco.mj_resetData(self.model, self.data)
        self._wrist.place(hand.position, hand.quaternion)
        self.data.qpos[NUM_WRIST:_HAND] = hand.angles
        self.put_object_back()
        if self._helper is not None:
            self._helper.reset()
        mujoco.mj_kinematics(self.model, self.data)

    def put_object_back(self) -> None:
        """The object as at first, at rest; the hand stays."""
        self.data.qpos[_HAND:] = self._object_start
        self.data.qvel[_HAND:] = 0

    def step(self, target: HandPose) -> bool:
        """One physics step towards a target; False if it diverged: all is at rest then, the hand at the target."""
        self._wrist.keep_regular()
        angles = target.angles
        if self._helper is not None:
            angles = self._helper.pressing(angles, self.data, self.timestep)
        wanted = np.concatenate([self._wrist.coordinates(target.position, target.quaternion), angles])
        self.data.ctrl[:] = np.clip(wanted, self._low, self._high)
        mujoco.mj_step(self.model, self.data)
        if diverged(self.data):
            self.reset(target)
            return False
        return True

    def poses(self) -> Float[np.ndarray, "17 7"]:
        """Position (m) and quaternion (wxyz) of the hand's links, in the order of `LINKS`, and of the object."""
        mujoco.mj_kinematics(self.model, self.data)  # mj_step leaves places a step behind
        return np.concatenate([self.data.xpos[self._bodies], self.data.xquat[self._bodies]], axis=1)

    def joint_rotations(self) -> Float[np.ndarray, "15 3 3"]:
        """MANO's joint rotations, as `poses` last placed the links."""
        axes = self.data.xmat.reshape(-1, 3, 3)
        return np.swapaxes(axes[self._parents], 1, 2) @ axes[self._bodies[1:-1]]

    @property
    def angles(self) -> Float[np.ndarray, "20"]:
        """The hinges' (rad)."""
        return self.data.qpos[NUM_WRIST:_HAND].copy()

    def touches(self) -> list[Touch]:
        """The hand's contacts with the object."""
        return touches(self.model, self.data, int(self._bodies[-1]))
