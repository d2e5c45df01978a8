"""The HOT3D importer: on its own sample, against UmeTrack's forward kinematics written out here, and on made files."""

import csv
import json
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mjx_hand.capture.load import load_motion
from mjx_hand.capture.load_scene import load_scene
from mjx_hand.errors import InputError
from mjx_hand.motion import Motion
from tests.capture.datasets.subjects import TIPS, joints_of

START, STEP = 43_000_000_000_000, 33_333_333
# UmeTrack's landmarks in the order of MANO's joints, the thumb's base left out, and of its five tips.
JOINT_MARKS = (5, 8, 9, 10, 11, 12, 13, 17, 18, 19, 14, 15, 16, None, 6, 7)
TIP_MARKS = (1, 2, 4, 3, 0)


def matrix(turn: np.ndarray, point: np.ndarray) -> np.ndarray:
    out = np.eye(4)
    out[:3, :3], out[:3, 3] = turn, point - turn @ point
    return out


def marks(model: dict, hand: dict, side: str) -> np.ndarray:
    """(21, 3): the file's own forward kinematics, link by link; a right hand's wrist matrix has its x axis negated."""
    axes, points = np.array(model["joint_rotation_axes"]), np.array(model["joint_rest_positions"]) / 1e3
    parent, bone_of = model["joint_parent"], model["joint_frame_index"]
    bones, moved = {0: np.eye(4), 1: np.eye(4)}, []
    for k, angle in enumerate(hand["joint_angles"][:20]):
        own = matrix(Rotation.from_rotvec(angle * axes[k]).as_matrix(), points[k])
        moved.append(own if parent[k] == 255 else moved[int(parent[k])] @ own)
        bones[int(bone_of[k])] = moved[k]
    wrist = np.eye(4)
    wrist[:3, :3] = Rotation.from_quat(hand["wrist_xform"]["q_wxyz"], scalar_first=True).as_matrix()
    wrist[:3, :3] = wrist[:3, :3] @ np.diag([-1.0 if side == "right" else 1.0, 1, 1])
    wrist[:3, 3] = hand["wrist_xform"]["t_xyz"]
    found = []
    for place, carried, weights in zip(
        *(model[f"landmark_rest_{name}"] for name in ("positions", "bone_indices", "bone_weights")), strict=True
    ):
        at = np.append(np.array(place) / 1e3, 1.0)
        shares = {int(bone): share for bone, share in zip(carried, weights, strict=True) if share != 0}
        found.append(sum(share * (wrist @ bones[bone] @ at)[:3] for bone, share in shares.items()))
    return np.stack(found)


def off(motion: Motion, expected: np.ndarray) -> float:
    """The greatest distance (m) of any joint or tip from the landmarks (t, 21, 3) in the valid frames."""
    joints = joints_of(motion)
    links = [Rotation.from_quat(motion.wrist_quaternion, scalar_first=True).as_matrix()]
    for j in range(15):
        links.append((links[0] if j % 3 == 0 else links[-1]) @ motion.rotations[:, j])
    assert motion.tip_offset is not None
    tips = np.stack([joints[:, k] + links[k] @ motion.tip_offset[f] for f, k in enumerate(TIPS)], axis=1)
    known = [(j, mark) for j, mark in enumerate(JOINT_MARKS) if mark is not None]
    away = [np.linalg.norm(joints[:, j] - expected[:, mark], axis=1) for j, mark in known]
    away += [np.linalg.norm(tips[:, f] - expected[:, mark], axis=1) for f, mark in enumerate(TIP_MARKS)]
    return float(np.max(np.stack(away)[:, motion.valid]))


@pytest.fixture(scope="module")
def sample(recordings) -> Path:
    folder = recordings / "hot3d_sample"
    if not folder.is_dir():
        pytest.skip(f"{folder} is absent: the recording is not part of the project")
    return folder


def test_the_real_sample(sample):
    scene = load_scene(sample)
    assert (scene.fps, scene.num_frames) == (30.0, 15)
    np.testing.assert_array_equal(scene.up, [0, 1, 0])
    model = json.loads((sample / "umetrack_hand_user_profile.json").read_text())["hand_model"]
    rows = [json.loads(line) for line in (sample / "umetrack_hand_pose_trajectory.jsonl").read_text().splitlines()]
    assert [hand.side for hand in scene.hands] == ["right", "left"]
    for motion, number in zip(scene.hands, "10", strict=True):
        assert motion.valid.all()
        expected = np.stack([marks(model, row["hand_poses"][number], motion.side) for row in rows])
        assert off(motion, expected) < 0.5e-3
    names = ["keyboard", "mug_white", "cellphone", "coffee_pot", "mouse", "puzzle_toy"]
    assert sorted(found.name for found in scene.objects) == sorted(names)
    mouse = scene.object("mouse")
    assert (mouse.kind, mouse.vertices.shape, mouse.faces.shape) == ("mesh", (3943, 3), (6806, 3))
    assert scene.object("keyboard").kind == "none"
    with (sample / "dynamic_objects.csv").open() as file:
        told = [row for row in csv.DictReader(file) if row["object_uid"] == "265826671143948"]
    np.testing.assert_allclose(
        mouse.position, [[float(row[f"t_wo_{a}[m]"]) for a in "xyz"] for row in told], atol=1e-12
    )
    turned = [[float(row[f"q_wo_{a}"]) for a in "wxyz"] for row in told]
    np.testing.assert_allclose(mouse.quaternion, turned, atol=1e-6)
    assert [hand.side for hand in load_scene(sample, side="left").hands] == ["left"]
    with pytest.raises(InputError, match="holds both hands"):
        load_motion(sample)


def made_model() -> dict:
    """A profile of the same form: straight fingers, hinges across and up, the thumb's crossed."""
    base = np.array([[20.0, -5, 15], [95, 0, 25], [98, 2, 3], [93, -1, -19], [82, -5, -38]])
    along = np.array([[0.7, -0.4, 0.6], [1, 0, 0.05], [1, 0, 0], [1, 0, -0.05], [1, 0, -0.1]])
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    reach = [[0.0, 25, 45, 75, 100]] + [[0.0, 0, 40, 65, 88]] * 4
    flexion = [[0.3, 0.9, 0.2]] + [[0.0, 0, -1]] * 4
    axes, points, parents, bones, tips = [], [], [], [], []
    for f in range(5):
        for k in range(4):
            axes.append(([0.4, 0.3, -1] if f == 0 else [0.0, -1, 0]) if k == 0 else flexion[f])
            points.append((base[f] + reach[f][k] * along[f]).tolist())
            parents.append(255 if k == 0 else 4 * f + k - 1)
            bones.append(255 if k == 0 else 1 + 3 * f + k)
        tips.append((base[f] + reach[f][4] * along[f]).tolist())
    axes = (np.array(axes) / np.linalg.norm(axes, axis=1, keepdims=True)).tolist()
    at = [*tips, [0.0, 0, 0], points[2], points[3]]
    carried = [4, 7, 10, 13, 16, 1, 2, 3]
    for f in range(1, 5):
        at += [points[4 * f + 1], points[4 * f + 2], points[4 * f + 3]]
        carried += [1, 2 + 3 * f, 3 + 3 * f]
    at.append([80.0, -10, 0])
    carried.append(1)
    return {
        "joint_rotation_axes": [*axes, [0, 1, 0], [0, 0, 1]],
        "joint_rest_positions": [*points, [0, 0, 0], [0, 0, 0]],
        "joint_parent": [*parents, 255, 20],
        "joint_frame_index": [*bones, 255, 0],
        "joint_limits": [[-0.4, 0.8]] * 22,
        "landmark_rest_positions": at,
        "landmark_rest_bone_indices": [[bone] * 3 for bone in carried],
        "landmark_rest_bone_weights": [[1.0, 0, 0]] * 21,
        "hand_scale": 1.0,
    }


def made_hand(rng: np.random.Generator) -> dict:
    angles = rng.uniform(0.0, 0.7, 20)
    angles[::4] = rng.uniform(-0.15, 0.15, 5)
    angles[:2] *= 0.5
    turn = Rotation.random(rng=rng).as_quat(scalar_first=True)
    wrist = {"t_xyz": rng.normal(size=3).tolist(), "q_wxyz": turn.tolist()}
    return {"wrist_xform": wrist, "joint_angles": [*angles, 0.0, 0.0], "hand_confidence": 1.0}


def write(folder: Path, frames: int = 8) -> list[dict]:
    """Both hands; the right one is not seen in frame 3, frame 5 is left out, the cup not seen in frame 1."""
    rng = np.random.default_rng(2)
    rows = [
        {"timestamp_ns": START + k * STEP, "hand_poses": {"0": made_hand(rng), "1": made_hand(rng)}}
        for k in range(frames)
    ]
    del rows[3]["hand_poses"]["1"]
    (folder / "umetrack_hand_pose_trajectory.jsonl").write_text(
        "\n".join(json.dumps(row) for k, row in enumerate(rows) if k != 5)
    )
    (folder / "umetrack_hand_user_profile.json").write_text(json.dumps({"hand_model": made_model()}))
    (folder / "instance.json").write_text(json.dumps({"7": {"instance_name": "cup"}}))
    lines = ["object_uid,timestamp[ns],t_wo_x[m],t_wo_y[m],t_wo_z[m],q_wo_w,q_wo_x,q_wo_y,q_wo_z"]
    lines += [f"7,{START + k * STEP + 40},{0.1 * k},1,0,1,0,0,0" for k in range(frames) if k != 1]
    (folder / "dynamic_objects.csv").write_text("\n".join(lines))
    return rows


def test_made_recordings_come_back_with_their_gaps(tmp_path):
    rows = write(tmp_path)
    scene = load_scene(tmp_path)
    for motion, number in zip(scene.hands, "10", strict=True):
        missing = {3, 5} if motion.side == "right" else {5}
        assert set(np.flatnonzero(~motion.valid)) == missing
        hands = [row["hand_poses"].get(number) for row in rows]
        expected = [np.zeros((21, 3)) if hand is None else marks(made_model(), hand, motion.side) for hand in hands]
        assert off(motion, np.stack(expected)) < 1e-3
    (cup,) = scene.objects
    assert np.flatnonzero(~cup.seen).tolist() == [1]
    np.testing.assert_allclose(cup.position[cup.seen, 0], 0.1 * np.flatnonzero(cup.seen))
    assert load_motion(tmp_path / "umetrack_hand_pose_trajectory.jsonl", side="left").side == "left"


@pytest.mark.parametrize(
    ("file", "content", "message"),
    [
        ("umetrack_hand_pose_trajectory.jsonl", "{", "not a readable .jsonl file"),
        ("umetrack_hand_pose_trajectory.jsonl", '{"timestamp_ns": 1, "hand_poses": {"1": {}}}', "1 time stamps"),
        ("umetrack_hand_user_profile.json", "[]", "has no 'hand_model'"),
        ("umetrack_hand_user_profile.json", '{"hand_model": {"joint_limits": [1, [2]]}}', "no tables of numbers"),
        ("umetrack_hand_user_profile.json", '{"hand_model": {}}', "has no 'joint_rotation_axes'"),
        ("dynamic_objects.csv", "object_uid,timestamp[ns]\n7,43000000000000", "table of object poses"),
        ("instance.json", "[1]", "list of objects"),
    ],
)
def test_refusals(tmp_path, file, content, message):
    write(tmp_path)
    (tmp_path / file).write_text(content)
    with pytest.raises(InputError, match=message) as refusal:
        load_scene(tmp_path)
    assert "\n" not in str(refusal.value)
