"""Play an exported policy in plain MuJoCo, with NumPy and mujoco alone: neither mjx-hand nor JAX is imported.

    mjx-hand export config=pinch export.folder=outputs/export
    python examples/09_play_an_export.py outputs/export

`contract.md` beside the policy says what every number is. `mjx_hand.play_policy` does the same, where it is installed.
"""

import json
import sys
from pathlib import Path

import mujoco
import numpy as np


def act(policy: dict, features: np.ndarray) -> np.ndarray:
    """The next filtered residual (m, rad) for features in physical units."""
    x = np.clip((features - policy["offset"]) * policy["scale"], -policy["limit"], policy["limit"]).astype(np.float32)
    last = sum(name.startswith("kernel") for name in policy) - 1
    for k in range(last):
        x = x @ policy[f"kernel{k}"] + policy[f"bias{k}"]
        x = x / (1 + np.exp(-x))
    action = np.clip(x @ policy[f"kernel{last}"] + policy[f"bias{last}"], -1, 1)
    before = features[policy["residual_start"] :][: len(action)]
    return policy["smoothing"] * before + (1 - policy["smoothing"]) * policy["residual_scale"] * action


def turn(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Rotation vector, in b's axes, that takes orientation b to a."""
    vector = np.zeros(3)
    mujoco.mju_subQuat(vector, a.astype(float), b.astype(float))
    return vector


def see(model, data, reference: dict, contract: dict, frame: int, residual: np.ndarray) -> np.ndarray:
    """The policy's features, in the contract's order."""
    mujoco.mj_kinematics(model, data)  # places follow the state; mj_step leaves them a step behind
    moved, lookahead = model.actuator_trnid[:, 0], np.array(contract["lookahead"])  # actuated joints: the hand's
    qpos, qvel = data.qpos[model.jnt_qposadr[moved]], data.qvel[model.jnt_dofadr[moved]]
    targets, poses, base = reference["targets"], reference["object_pose"], reference["base"]
    wrist, held = data.body("wrist"), data.body("object")
    tips = np.array([data.site(f"{finger}_tip").xpos for finger in contract["body"]["fingers"]])
    place, pose = data.qpos[-7:-4], poses[frame]  # the object's coordinates are the last
    later = np.minimum(frame + lookahead, len(targets) - 1)
    parts = (
        qpos - targets[frame],
        qvel,
        residual,
        reference["grip"][frame, 6:],
        base.T @ (place - pose[:3]),
        turn(data.qpos[-4:], pose[3:]),
        base.T @ data.qvel[-6:-3],
        data.qvel[-3:],
        wrist.xmat.reshape(3, 3).T @ (place - wrist.xpos),
        (tips - place) @ held.xmat.reshape(3, 3),
        targets[later] - targets[frame],
        (poses[later, :3] - pose[:3]) @ base,
        [frame / len(targets), place[2] - poses[0, 2]],
        np.delete(reference["object_features"], [3, 4]),  # mass and friction, which policies do not see
    )
    return np.concatenate([np.ravel(part) for part in parts])


def play(policy: dict, reference: dict, scene: Path) -> np.ndarray:
    """The object's pose in every frame (m, wxyz), from the first to the last."""
    model = mujoco.MjModel.from_xml_path(str(scene))
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:] = reference["start_qpos"], reference["start_qvel"]
    contract = json.loads(str(policy["contract"]))
    residual, path = np.zeros(model.nu), [data.qpos[-7:].copy()]
    for frame in range(len(reference["targets"]) - 1):
        residual = act(policy, see(model, data, reference, contract, frame, residual))
        data.ctrl[:] = np.clip(reference["controls"][frame + 1] + residual, reference["low"], reference["high"])
        mujoco.mj_step(model, data, nstep=int(reference["substeps"]))
        path.append(data.qpos[-7:].copy())
    return np.array(path)


def main(folder: str = "outputs/export") -> None:
    """Follow every demonstration of an export."""
    policy = dict(np.load(Path(folder) / "policy.npz"))
    for entry in json.loads(str(policy["contract"]))["demonstrations"]:
        reference = dict(np.load(Path(folder) / entry["reference"]))
        path, wanted = play(policy, reference, Path(folder) / entry["scene"]), reference["object_pose"]
        away = np.linalg.norm(path[:, :3] - wanted[:, :3], axis=1).mean()
        turned = np.rad2deg(np.mean([np.linalg.norm(turn(a[3:], b[3:])) for a, b in zip(path, wanted, strict=True)]))
        outcome = "followed" if away < 0.03 and turned < 30 else "failed"  # ManipTrans' thresholds
        print(f"{entry['reference']}: {outcome}, off by {100 * away:.2f} cm and {turned:.1f} degrees on average")


if __name__ == "__main__":
    main(*sys.argv[1:2])
