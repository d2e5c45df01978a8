"""`play_policy`: an exported policy in plain MuJoCo; JAX is not imported."""

import dataclasses
from pathlib import Path

import mujoco
import numpy as np
from jaxtyping import Float

from mjx_hand.errors import InputError
from mjx_hand.hand.joints import FINGERS
from mjx_hand.player.exported_policy import ExportedPolicy, load_exported_policy
from mjx_hand.player.features import TARGETS, Feature, Seen, feature_table
from mjx_hand.player.tracking_reference import TrackingReference, load_tracking_reference

_HAND = len(TARGETS)
_ROTATION, _TRANSLATION = np.deg2rad(30.0), 0.03  # ManipTrans' thresholds for the object


@dataclasses.dataclass(frozen=True)
class Played:
    """A rollout from a demonstration's first frame to its last, t frames; metres, radians, wxyz, world frame.

    Attributes:
        qpos: the scene's coordinates (wrist 6, hinges 20, object's free joint 7).
        object_reference: demonstrated pose of the object.
        position_error, rotation_error: the object's distance and angle from it.
        rate: frames a second.
    """

    qpos: Float[np.ndarray, "t 33"]
    object_reference: Float[np.ndarray, "t 7"]
    position_error: Float[np.ndarray, "t"]
    rotation_error: Float[np.ndarray, "t"]
    rate: float

    @property
    def object_pose(self) -> Float[np.ndarray, "t 7"]:
        """Where the object was."""
        return self.qpos[:, _HAND:]

    @property
    def success(self) -> bool:
        """ManipTrans' for the object: mean errors below 3 cm and 30 degrees."""
        return bool(self.position_error.mean() < _TRANSLATION and self.rotation_error.mean() < _ROTATION)


def play_policy(policy: str | Path | ExportedPolicy, reference: str | Path) -> Played:
    """Roll an exported policy out on one demonstration.

    Args:
        policy: `policy.npz` of an export, or what `load_exported_policy` gave.
        reference: the demonstration's `.npz` of an export; its scene's MJCF file stands beside it.

    Raises:
        InputError: a file that is missing, damaged, of another version, or does not fit the others.
    """
    exported = policy if isinstance(policy, ExportedPolicy) else load_exported_policy(policy)
    player = Player(exported, load_tracking_reference(reference), Path(reference).parent)
    path = [player.data.qpos.copy()]
    for _ in range(player.reference.num_frames - 1):
        player.step()
        path.append(player.data.qpos.copy())
    qpos, wanted = np.stack(path), player.reference.object_pose.astype(float)
    turns = np.array([_turn(a, b) for a, b in zip(qpos[:, _HAND + 3 :], wanted[:, 3:], strict=True)])
    return Played(
        qpos=qpos,
        object_reference=wanted,
        position_error=np.linalg.norm(qpos[:, _HAND : _HAND + 3] - wanted[:, :3], axis=1),
        rotation_error=np.linalg.norm(turns, axis=1),
        rate=player.reference.rate,
    )


class Player:
    """One world of plain MuJoCo under a policy, a control step at a time.

    Attributes:
        model, data: MuJoCo's.
        frame: of the demonstration.
        residual: filtered so far (m, rad).
    """

    def __init__(self, policy: ExportedPolicy, reference: TrackingReference, folder: Path):
        self.policy, self.reference = policy, reference
        self.model = _scene(folder / reference.scene)
        self.data = mujoco.MjData(self.model)
        self._features = _features(policy, reference)
        self._tips = [self.model.site(f"{finger}_tip").id for finger in FINGERS]
        self._wrist, self._object = self.model.body("wrist").id, self.model.body("object").id
        self._lookahead = np.array(policy.contract["lookahead"])
        self.frame, self.residual = 0, np.zeros(_HAND, np.float32)
        self.data.qpos[:], self.data.qvel[:] = reference.start_qpos, reference.start_qvel

    def step(self) -> None:
        """Look, act, and let the physics run to the next frame; past the end the last frame is held."""
        reference = self.reference
        _, self.residual = self.policy.step(self.features())
        self.frame = min(self.frame + 1, reference.num_frames - 1)
        self.data.ctrl[:] = np.clip(reference.controls[self.frame] + self.residual, reference.low, reference.high)
        for _ in range(reference.substeps):
            mujoco.mj_step(self.model, self.data)

    def features(self) -> Float[np.ndarray, "n"]:
        """What the policy is given now, in physical units."""
        seen = self._seen()
        return np.concatenate([np.ravel(feature.value(seen)) for feature in self._features])

    def _seen(self) -> Seen:
        reference, data, frame = self.reference, self.data, self.frame
        mujoco.mj_kinematics(self.model, data)  # places follow the state; mj_step leaves them a step behind
        later = np.minimum(frame + self._lookahead, reference.num_frames - 1)
        pose = data.qpos[_HAND:]
        return Seen(
            hand=data.qpos[:_HAND],
            hand_speed=data.qvel[:_HAND],
            residual=self.residual,
            object_pose=pose,
            object_speed=data.qvel[_HAND:],
            object_turn=_turn(pose[3:], reference.object_pose[frame, 3:]),
            object_axes=data.xmat[self._object].reshape(3, 3),
            wrist_place=data.xpos[self._wrist],
            wrist_axes=data.xmat[self._wrist].reshape(3, 3),
            tips=data.site_xpos[self._tips],
            base=reference.base,
            target=reference.targets[frame],
            grip=reference.grip[frame],
            pose=reference.object_pose[frame],
            first_pose=reference.object_pose[0],
            targets_ahead=reference.targets[later],
            poses_ahead=reference.object_pose[later],
            phase=np.array([frame / reference.num_frames]),
            object_features=reference.object_features,
        )


def _turn(a: Float[np.ndarray, "4"], b: Float[np.ndarray, "4"]) -> Float[np.ndarray, "3"]:
    """Rotation vector (rad, in b's own axes) of the turn that takes orientation b to a."""
    turn = np.zeros(3)
    mujoco.mju_subQuat(turn, np.asarray(a, float), np.asarray(b, float))
    return turn


def _features(policy: ExportedPolicy, reference: TrackingReference) -> list[Feature]:
    """The features that the policy reads, in its order."""
    known = {
        feature.name: feature
        for feature in feature_table(
            policy.residual_scale, policy.contract["lookahead"], policy.contract["object_kinds"]
        )
    }
    inputs = policy.contract["inputs"]
    for entry in inputs:
        name, size = entry["name"], entry["size"]
        if name not in known or known[name].size != size:
            raise InputError(
                f"the policy reads {name!r} ({size} numbers), which this version of mjx-hand does not have; "
                "export the policy again with this version"
            )
    if sum(entry["size"] for entry in inputs) != policy.offset.size:
        raise InputError(f"the policy's contract does not list its {policy.offset.size} features; export it again")
    kinds = len(policy.contract["object_kinds"])
    if reference.object_features.size != 5 + kinds:
        raise InputError(
            f"the reference has {reference.object_features.size} features of the object, the policy reads {5 + kinds}; "
            "export both together"
        )
    return [known[entry["name"]] for entry in inputs]


def _scene(path: Path) -> mujoco.MjModel:
    """The scene, whose coordinates are the hand's 26 and the object's free joint."""
    if not path.is_file():
        raise InputError(f"{path}: no such scene; it belongs beside the reference, so export both together")
    try:
        model = mujoco.MjModel.from_xml_path(str(path))
    except ValueError as error:
        raise InputError(f"{path}: MuJoCo cannot load it ({str(error).splitlines()[0]}); export it again") from None
    names = [model.joint(k).name for k in range(model.njnt)]
    if names != [*TARGETS, "object"] or model.nu != _HAND:
        raise InputError(f"{path}: not a scene of the hand with an object; export it again")
    return model
