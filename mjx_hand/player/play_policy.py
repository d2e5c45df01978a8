"""`play_policy`: an exported policy in plain MuJoCo; JAX is not imported."""

import dataclasses
from functools import cached_property
from pathlib import Path

import mujoco
import numpy as np
from jaxtyping import Float

from mjx_hand.errors import InputError
from mjx_hand.player.approach import approach_weights, displacement, followed
from mjx_hand.player.contact_force import contact_columns
from mjx_hand.player.exported_policy import ExportedPolicy, load_exported_policy
from mjx_hand.player.features import CONTACT_FORCES
from mjx_hand.player.features_read import features_read
from mjx_hand.player.observed_state import WRIST, HandNames, ObservedState
from mjx_hand.player.tracking_reference import TrackingReference, load_tracking_reference

_FREE = 7  # coordinates of the object, the last of a scene's; of its speed one less
_ROTATION, _TRANSLATION = np.deg2rad(30.0), 0.03  # ManipTrans' thresholds for the object


@dataclasses.dataclass(frozen=True)
class Played:
    """A rollout from a demonstration's first frame to its last, t frames; metres, radians, wxyz, world frame.

    Attributes:
        qpos: the scene's coordinates (the wrist's six, the hand's joints, the object's free joint).
        object_reference: demonstrated pose of the object.
        position_error, rotation_error: the object's distance and angle from it.
        rate: frames a second.
    """

    qpos: Float[np.ndarray, "t q"]
    object_reference: Float[np.ndarray, "t 7"]
    position_error: Float[np.ndarray, "t"]
    rotation_error: Float[np.ndarray, "t"]
    rate: float

    @property
    def object_pose(self) -> Float[np.ndarray, "t 7"]:
        """Where the object was."""
        return self.qpos[:, -_FREE:]

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
    turns = np.array([_turn(a, b) for a, b in zip(qpos[:, -4:], wanted[:, 3:], strict=True)])
    return Played(
        qpos=qpos,
        object_reference=wanted,
        position_error=np.linalg.norm(qpos[:, -_FREE:-4] - wanted[:, :3], axis=1),
        rotation_error=np.linalg.norm(turns, axis=1),
        rate=player.reference.rate,
    )


class Player:
    """One world of plain MuJoCo under a policy, a control step at a time.

    The object may be put elsewhere in `data.qpos` before the first step; the hand goes there.

    Attributes:
        model, data: MuJoCo's.
        frame: of the demonstration.
        residual: filtered so far (m, rad).
    """

    def __init__(self, policy: ExportedPolicy, reference: TrackingReference, folder: Path):
        if policy.contract.get("live", False):
            raise InputError(
                "this policy is of teleoperated hands and follows no demonstration; "
                "mjx-hand live --assist policy --policy FILE plays it"
            )
        self.policy, self.reference = policy, reference
        names = _hand(policy)
        self.model = _scene(folder / reference.scene, names)
        self.data = mujoco.MjData(self.model)
        self._features = features_read(policy, names)
        _check_object(policy, reference)
        self._tips = [self.model.site(f"{finger}_tip").id for finger in names.fingers]
        self._forces = contact_columns(self.model)[:, :3]
        self._wrist, self._object = self.model.body("wrist").id, self.model.body("object").id
        joints = [self.model.joint(name) for name in names.targets]
        self._qpos, self._qvel = ([int(j.qposadr[0]) for j in joints], [int(j.dofadr[0]) for j in joints])
        self._lookahead = np.array(policy.contract["lookahead"])
        self.frame, self.residual = 0, np.zeros(len(joints), np.float32)
        self.data.qpos[:], self.data.qvel[:] = reference.start_qpos, reference.start_qvel
        self._weights = approach_weights(reference.object_pose, reference.rate)

    def step(self) -> None:
        """Look, act, and let the physics run to the next frame; past the end the last frame is held."""
        reference = self.reference
        _, self.residual = self.policy.step(self.features())
        self.frame = min(self.frame + 1, reference.num_frames - 1)
        command = reference.controls[self.frame] + self._followed(self.frame) + self.residual
        self.data.ctrl[:] = np.clip(command, reference.low, reference.high)
        for _ in range(reference.substeps):
            mujoco.mj_step(self.model, self.data)

    def features(self) -> Float[np.ndarray, "n"]:
        """What the policy is given now, in physical units."""
        seen = self._seen()
        return np.concatenate([np.ravel(feature.value(seen)) for feature in self._features])

    @cached_property
    def displacement(self) -> Float[np.ndarray, "3"]:
        """Where the object was when it was first looked at, from its demonstrated place: x, y (m), turn (rad).

        Zero if the policy's task does not follow the object.
        """
        moved = displacement(self.data.qpos[-_FREE:], self.reference.object_pose[0].astype(float), np)
        return moved * bool(self.policy.contract.get("follow_object", False))

    def _followed(self, frame: int) -> Float[np.ndarray, "u"]:
        """What is added to the demonstrated targets at a frame, because the object stands elsewhere."""
        reference, moved = self.reference, self.displacement * self._weights[frame]
        return followed(reference.targets[frame].astype(float), reference.base, reference.object_pose[0, :3], moved, np)

    def _seen(self) -> ObservedState:
        reference, data, frame = self.reference, self.data, self.frame
        mujoco.mj_kinematics(self.model, data)  # places follow the state; mj_step leaves them a step behind
        later = np.minimum(frame + self._lookahead, reference.num_frames - 1)
        pose = data.qpos[-_FREE:]
        return ObservedState(
            hand=data.qpos[self._qpos],
            hand_speed=data.qvel[self._qvel],
            residual=self.residual,
            object_pose=pose,
            object_speed=data.qvel[1 - _FREE :],
            object_turn=_turn(pose[3:], reference.object_pose[frame, 3:]),
            object_axes=data.xmat[self._object].reshape(3, 3),
            wrist_place=data.xpos[self._wrist],
            wrist_axes=data.xmat[self._wrist].reshape(3, 3),
            tips=data.site_xpos[self._tips],
            forces=data.sensordata[self._forces],
            base=reference.base,
            target=reference.targets[frame] + self._followed(frame),
            grip=reference.grip[frame],
            pose=reference.object_pose[frame],
            first_pose=reference.object_pose[0],
            targets_ahead=reference.targets[later] + np.stack([self._followed(int(k)) for k in later]),
            poses_ahead=reference.object_pose[later],
            phase=np.array([frame / reference.num_frames]),
            object_features=reference.object_features,
        )


def _turn(a: Float[np.ndarray, "4"], b: Float[np.ndarray, "4"]) -> Float[np.ndarray, "3"]:
    """Rotation vector (rad, in b's own axes) of the turn that takes orientation b to a."""
    turn = np.zeros(3)
    mujoco.mju_subQuat(turn, np.asarray(a, float), np.asarray(b, float))
    return turn


def _check_object(policy: ExportedPolicy, reference: TrackingReference) -> None:
    read = 5 + len(policy.contract["object_kinds"])
    if reference.object_features.size != read:
        raise InputError(
            f"the reference has {reference.object_features.size} features of the object, the policy reads {read}; "
            "export both together"
        )


def _hand(policy: ExportedPolicy) -> HandNames:
    """What the contract calls the hand's joints and fingers.

    Raises:
        InputError: it does not tell.
    """
    elements = {entry["name"]: entry["elements"] for entry in policy.contract["inputs"]}
    try:
        joints, places = elements["error.hinges"], elements["tips_in_object"]
    except KeyError as missing:
        raise InputError(f"the policy's contract has no input {missing}; export the policy again") from None
    fingers = dict.fromkeys(place.rpartition("_")[0] for place in places)
    links = dict.fromkeys(place.rpartition("_")[0] for place in elements.get(CONTACT_FORCES, ()))
    return HandNames(tuple(joints), tuple(fingers), tuple(links))


def _scene(path: Path, hand: HandNames) -> mujoco.MjModel:
    """The scene, whose coordinates are the wrist's six, the hand's joints and the object's free joint."""
    if not path.is_file():
        raise InputError(f"{path}: no such scene; it belongs beside the reference, so export both together")
    try:
        model = mujoco.MjModel.from_xml_path(str(path))
    except ValueError as error:
        raise InputError(f"{path}: MuJoCo cannot load it ({str(error).splitlines()[0]}); export it again") from None
    names = [model.joint(k).name for k in range(model.njnt)]
    moved = [model.actuator(k).name for k in range(model.nu)]
    if names[: len(WRIST)] != [*WRIST] or names[-1:] != ["object"] or moved != [*hand.targets]:
        raise InputError(f"{path}: not a scene of the hand with an object; export it again")
    return model
