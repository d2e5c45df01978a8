import pickle

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from mjx_hand.capture.load import load_motion
from mjx_hand.capture.load_scene import load_scene
from mjx_hand.errors import InputError
from tests.capture.datasets.subjects import joints_of, licensed_file, licensed_hand, posed_joints, rest_joints, take
from tests.files.torch_layout import Tensor, dumps

TAKE = take(seed=4)
QUATERNIONS = Rotation.from_rotvec(TAKE.pose.reshape(-1, 3)).as_quat(scalar_first=True).reshape(6, 1, 16, 4)
IDS = tuple(range(100, 106))


def frame(k: int, hands=("rh", "lh")) -> dict:
    return {
        f"{hand}__{name}": value[k]
        for hand in hands
        for name, value in (
            ("pose_coeffs", QUATERNIONS),
            ("tsl", TAKE.translation[:, None]),
            ("betas", np.tile(TAKE.shape, (6, 1, 1))),
        )
    }


def write(root, ids=IDS, hands=("rh", "lh"), tensors: bool = True, frames=None, **changes):
    """The annotation's dictionary; tensors as PyTorch pickles them, or plain arrays."""
    frames = {i: frame(k, hands) for k, i in enumerate(ids)} if frames is None else frames
    if tensors:
        frames = {i: {name: Tensor(value.astype("f4")) for name, value in f.items()} for i, f in frames.items()}
    path = root / "anno_preview" / "scene_01__y00z++00000.pkl"
    path.parent.mkdir(exist_ok=True)
    told = {
        "cam_def": {"104422070969": "egocentric"},
        "cam_extr": {"104422070969": {0: np.eye(4)}},
        "obj_list": ["O02@0015@00001"],
        "obj_transf": {"O02@0015@00001": {i: np.eye(4) for i in ids}},
        "mocap_frame_id_list": list(ids),
        "raw_mano": frames,
        "raw_smplx": {ids[0]: {"world_tsl": Tensor(np.zeros((1, 3), "f4"))}},
    }
    path.write_bytes(dumps(told | changes))
    return path


@pytest.mark.parametrize("tensors", [True, False])
@pytest.mark.parametrize("side", ["right", "left"])
def test_joints_are_where_the_toolkit_puts_them(tmp_path, side, tensors):
    motion = load_motion(write(tmp_path, tensors=tensors), side=side, mano=licensed_file(tmp_path, side))
    rest = rest_joints(licensed_hand(side), TAKE.shape)
    expected = posed_joints(rest - rest[0], TAKE.pose) + TAKE.translation[:, None]
    np.testing.assert_allclose(joints_of(motion), expected[:, :16], atol=1e-5)
    assert (motion.fps, motion.side) == (120.0, side)


def test_the_pose_and_the_wrist_need_no_licence(tmp_path):
    motion = load_motion(write(tmp_path, hands=["rh"]))
    expected = Rotation.from_rotvec(TAKE.pose[:, 1:].reshape(-1, 3)).as_matrix().reshape(6, 15, 3, 3)
    np.testing.assert_allclose(motion.rotations, expected, atol=1e-6)
    np.testing.assert_allclose(motion.wrist_position, TAKE.translation, atol=1e-6)
    assert motion.source == "OakInk2 scene_01__y00z++00000, right hand"
    assert not motion.shape.any()  # coefficients that the open hand does not know


def test_numbers_left_out_and_frames_without_the_hand_are_gaps(tmp_path):
    ids = (8, 12, 16, 28, 32, 36)  # every fourth of 120 a second
    frames = {i: frame(k, ["lh"] if k == 1 else ["lh", "rh"]) for k, i in enumerate(ids)}
    frames[32]["rh__pose_coeffs"] = np.zeros((1, 16, 4))
    motion = load_motion(write(tmp_path, ids, frames=frames), side="right")
    assert motion.fps == 30.0
    assert motion.valid.tolist() == [True, False, True, False, False, True, False, True]


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({}, "holds both hands; choose one"),
        ({"hands": []}, "holds no hand"),
        ({"hands": ["rh"], "ids": (3, 2, 5, 6, 7, 8)}, "mocap_frame_id_list is not a rising list"),
        ({"hands": ["rh"], "ids": (0, 1, 2, 3, 4, 10**9)}, "spans 1000000001 frames"),
        ({"frames": {i: {"rh__pose_coeffs": np.ones((1, 16, 4))} for i in IDS}}, "frame 100: has no 'tsl'"),
        (
            {"frames": {i: frame(0, ["rh"]) | {"rh__pose_coeffs": np.zeros((1, 15, 4))} for i in IDS}},
            r"frame 100: pose_coeffs has shape \(1, 15, 4\), expected \(1, 16, 4\)",
        ),
        ({"frames": {}}, "holds no hand"),
    ],
)
def test_refusals(tmp_path, changes, message):
    with pytest.raises(InputError, match=message) as refusal:
        load_motion(write(tmp_path, **changes))
    assert "\n" not in str(refusal.value)


def test_a_truncated_file_is_named(tmp_path):
    path = write(tmp_path)
    path.write_bytes(path.read_bytes()[:-200])
    for load in (load_motion, load_scene):
        with pytest.raises(InputError, match="not a readable pickle"):
            load(path)


def test_frames_that_are_no_dictionaries_are_named(tmp_path):
    path = tmp_path / "a.pkl"
    path.write_bytes(pickle.dumps({"raw_mano": [1, 2], "mocap_frame_id_list": [0]}))
    with pytest.raises(InputError, match="raw_mano is not a dictionary of frames"):
        load_motion(path)


OBJECT = "O02@0015@00001"


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"obj_transf": [1, 2]}, "obj_transf is not a dictionary of objects"),
        ({"obj_transf": {OBJECT: [np.eye(4)]}}, "obj_transf is not a dictionary of objects"),
        ({"obj_list": "O02"}, "obj_list is not a list of objects"),
        ({"obj_list": ["../outside"]}, "obj_list is '../outside', expected one name"),
        (
            {"obj_transf": {OBJECT: {100: np.eye(3)}}},
            r"frame 100: O02@0015@00001 has shape \(3, 3\), expected \(4, 4\)",
        ),
        ({"obj_transf": {OBJECT: {100: "here"}}}, "obj_transf O02@0015@00001 of frame 100"),
        ({"obj_transf": {OBJECT: {100: np.diag([1.0, 1, 1, 1e9])}}}, r"frame 0 holds 1e\+09, no angle"),
        ({"obj_transf": {OBJECT: {101: np.diag([2.0, 2, 2, 1])}}}, "pose 1 is no rotation"),
    ],
)
def test_objects_that_are_not_the_data_sets_are_named(tmp_path, changes, message):
    with pytest.raises(InputError, match=message) as refusal:
        load_scene(write(tmp_path, **changes))
    assert "\n" not in str(refusal.value)


def test_an_object_without_a_mesh_is_poses_alone_and_one_without_poses_is_left_out(tmp_path):
    poses = {OBJECT: {100: np.eye(4), 103: np.eye(4), 104: np.full((4, 4), np.nan), 105: np.zeros((4, 4))}, "other": {}}
    scene = load_scene(write(tmp_path, hands=["lh"], obj_transf=poses, obj_list=[OBJECT, "other", "unknown", OBJECT]))
    assert [hand.side for hand in scene.hands] == ["left"]
    (found,) = scene.objects
    assert (found.name, found.kind) == (OBJECT, "none")
    assert np.flatnonzero(found.seen).tolist() == [0, 3]
    with pytest.raises(InputError, match="holds no right hand; give side='left'"):
        load_scene(write(tmp_path, hands=["lh"]), side="right")


def test_a_mesh_in_other_units_and_a_damaged_list_of_names_are_named(tmp_path):
    path = write(tmp_path)
    mesh = tmp_path / "object_raw" / "align_ds" / OBJECT / "scan.ply"
    mesh.parent.mkdir(parents=True)
    trimesh.creation.box(extents=[40.0, 60.0, 90.0]).export(mesh)
    with pytest.raises(InputError, match=r"scan\.ply: 90 m long.*in millimetres\?"):
        load_scene(path)
    mesh.unlink()
    (tmp_path / "object_raw" / "obj_desc.json").write_text('["bottle"]')
    with pytest.raises(InputError, match=r"obj_desc\.json: not OakInk2's list of objects"):
        load_scene(path)
