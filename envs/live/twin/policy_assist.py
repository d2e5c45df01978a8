"""`PolicyAssist`: fingers that a trained policy moves beside their tracked way, so that they hold what they reach for.

The policy is one of `task.live`: it sees the twin's hand, where its fingers are tracked, what they press, and the
object from the wrist, as `envs.observation` tells it in training, and gives residuals of the hinges.
"""

import mujoco
import numpy as np
from jaxtyping import Float

from envs.live.twin.opening import Opening
from envs.live.twin.wrist import Wrist
from envs.scene import NUM_WRIST, OBJECT
from mjx_hand.errors import InputError
from mjx_hand.hand.joints import NUM_HINGES
from mjx_hand.objects.description import OBJECT_KINDS, ObjectDescription, object_features
from mjx_hand.player.contact_force import contact_columns
from mjx_hand.player.exported_policy import ExportedPolicy
from mjx_hand.player.features_read import features_read
from mjx_hand.player.observed_state import HUMAN_NAMES, ObservedState
from mjx_hand.player.steadying import holding, steadied

_HAND = NUM_WRIST + NUM_HINGES


def check_live(policy: ExportedPolicy, name: str, side: str) -> ExportedPolicy:
    """Return a policy if it can help a teleoperated hand.

    Args:
        policy: as exported.
        name: what messages call it.
        side: of the hand.

    Raises:
        InputError: it follows demonstrations, is of another hand, or sees what this version of mjx-hand does not know.
    """
    contract = policy.contract
    if not contract.get("live", False):
        raise InputError(
            f"{name}: a policy that follows demonstrations; a live hand needs one that was trained with "
            "task.live=true, such as config=live, and exported to npz"
        )
    if policy.residual_scale.size != _HAND:
        raise InputError(
            f"{name}: moves {policy.residual_scale.size} joints; a person's hand with its wrist has {_HAND}"
        )
    if contract.get("side") != side:
        raise InputError(
            f"{name}: was trained on {contract.get('side')} hands, and the hand is a {side} one; train one with "
            f"config=live data.side={side}, or use --assist grip"
        )
    if contract["object_kinds"] != [*OBJECT_KINDS]:
        raise InputError(f"{name}: sees kinds of objects that this version of mjx-hand does not know; train it again")
    features_read(policy, name=name, live=True)
    return policy


class PolicyAssist:
    """Residuals for one hand and one object.

    Args:
        model: of a live world, with sensors of what links do to the object.
        wrist: of that world.
        description: of the object.
        policy: see `check_live`.
    """

    def __init__(self, model: mujoco.MjModel, wrist: Wrist, description: ObjectDescription, policy: ExportedPolicy):
        self._model, self._wrist, self._policy = model, wrist, policy
        self._features = features_read(policy)
        self._seconds = 1 / float(policy.contract["rate"]["control_hz"])
        self._object = object_features(description)
        self._tips = [model.site(f"{finger}_tip").id for finger in HUMAN_NAMES.fingers]
        self._forces = contact_columns(model)[:, :3]
        self._bodies = model.body("wrist").id, model.body(OBJECT).id
        self._opening = Opening(model)
        self.reset()

    def reset(self) -> None:
        """The hand is elsewhere: nothing is held."""
        self._residual = np.zeros(_HAND, np.float32)
        self._commanded: np.ndarray | None = None  # and when that was, what was tracked
        self._last = np.zeros(NUM_HINGES)
        self._opening.reset()
        self._due = 0.0

    def pressing(self, angles: Float[np.ndarray, "20"], data: mujoco.MjData, seconds: float) -> Float[np.ndarray, "20"]:
        """What to tell the hinges (rad) in place of where the fingers are tracked.

        Args:
            angles: as tracked.
            data: as the last step left it.
            seconds: since the last call.
        """
        if self._commanded is None:
            self._commanded = self._last = angles
        if self._due <= 0:
            mujoco.mj_kinematics(self._model, data)  # places follow the state; mj_step leaves them a step behind
            holds = bool(holding(data.sensordata[self._forces], np))
            self._opening.watch(angles, data, holds, self._seconds)
            seen = self._seen(self._commanded, data)
            features = np.concatenate([np.ravel(feature.value(seen)) for feature in self._features])
            _, self._residual = self._policy.step(features)
            # Fingers that their owner opens are followed, whatever they still touch.
            steady = holds & ~self._opening.open
            told = self._commanded, self._last, angles, steady, self._seconds
            self._commanded, self._last = steadied(*told, np), angles
            self._due += self._seconds
        self._due -= seconds
        return self._commanded + self._applied[NUM_WRIST:]

    @property
    def _applied(self) -> Float[np.ndarray, "26"]:
        return self._residual * np.concatenate([np.zeros(NUM_WRIST), self._opening.share])

    def _seen(self, commanded: Float[np.ndarray, "20"], data: mujoco.MjData) -> ObservedState:
        """What the policy may see of hinges that were told so without it; what only demonstrations tell is none."""
        wrist, thing = self._bodies
        return ObservedState(
            hand=data.qpos[:_HAND],
            hand_speed=data.qvel[:_HAND],
            residual=self._applied,
            object_pose=data.qpos[_HAND:],
            object_speed=data.qvel[_HAND:],
            object_turn=None,
            object_axes=data.xmat[thing].reshape(3, 3),
            wrist_place=data.xpos[wrist],
            wrist_axes=data.xmat[wrist].reshape(3, 3),
            tips=data.site_xpos[self._tips],
            forces=data.sensordata[self._forces],
            base=self._wrist.base,
            target=np.concatenate([data.qpos[:NUM_WRIST], commanded]),
            grip=None,
            pose=None,
            first_pose=None,
            targets_ahead=None,
            poses_ahead=None,
            phase=None,
            object_features=self._object,
        )
