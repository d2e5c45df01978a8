import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from mjx_hand.capture.load import load_motion
from mjx_hand.capture.load_scene import load_scene
from mjx_hand.errors import InputError
from mjx_hand.motion.scene_notes import scene_notes
from tests.capture.datasets.subjects import joints_of, licensed_file, licensed_hand, posed_joints, rest_joints, take
from tests.files.torch_layout import Tensor, dumps

TAKES = {"right": take(seed=12), "left": take(seed=13)}
TRIPLET, SEQUENCE = "(stir, spoon, bowl)", "20231105_019"


def frames(side: str) -> dict:
    """A frame's pose and translation, by its name."""
    own = TAKES[side]
    rows = zip(own.pose.reshape(-1, 48), own.translation, strict=True)
    return {f"{k:05d}": {"hand_pose": pose, "hand_trans": place} for k, (pose, place) in enumerate(rows, start=1)}


def write(root, sides=("right", "left"), tensors: bool = True, shapes: bool = True, objects=None, **changes):
    """A sequence in the data set's folders; tensors as PyTorch pickles them, or plain arrays."""
    folder = root / "Hand_Poses" / TRIPLET / SEQUENCE
    folder.mkdir(parents=True)
    for side in sides:
        told = changes.get(side, frames(side))
        shape = {"hand_shape": TAKES[side].shape[None]}
        if tensors:
            told = {
                name: {key: Tensor(np.asarray(value, np.float32)) for key, value in one.items()}
                for name, one in told.items()
            }
            shape = {"hand_shape": Tensor(shape["hand_shape"].astype(np.float32))}
        (folder / f"{side}_hand.pkl").write_bytes(dumps(told))
        if shapes:
            (folder / f"{side}_hand_shape.pkl").write_bytes(dumps(shape))
    poses = root / "Object_Poses" / TRIPLET / SEQUENCE
    for name, matrices in (objects or {}).items():
        poses.mkdir(parents=True, exist_ok=True)
        np.save(poses / f"{name}.npy", matrices)
    return folder


def mesh(root, name: str, extents, folder: str = "Object_Models"):
    path = root / folder / f"{name}_cm.obj"
    path.parent.mkdir(exist_ok=True)
    trimesh.creation.box(extents=extents).export(path)


@pytest.mark.parametrize("tensors", [True, False])
@pytest.mark.parametrize("side", ["right", "left"])
def test_joints_are_where_the_tools_put_them(tmp_path, side, tensors):
    motion = load_motion(write(tmp_path, tensors=tensors), side=side, mano=licensed_file(tmp_path, side))
    rest = rest_joints(licensed_hand(side), TAKES[side].shape)
    expected = posed_joints(rest - rest[0], TAKES[side].pose) + TAKES[side].translation[:, None]
    np.testing.assert_allclose(joints_of(motion), expected[:, :16], atol=1e-5)
    assert (motion.fps, motion.side) == (30.0, side)


@pytest.mark.parametrize("side", ["right", "left"])
def test_the_pose_and_the_wrist_need_no_licence(tmp_path, side):
    motion = load_motion(write(tmp_path, sides=[side], shapes=False))
    expected = Rotation.from_rotvec(TAKES[side].pose[:, 1:].reshape(-1, 3)).as_matrix().reshape(6, 15, 3, 3)
    np.testing.assert_allclose(motion.rotations, expected, atol=1e-6)
    np.testing.assert_allclose(motion.wrist_position, TAKES[side].translation, atol=1e-6)
    assert motion.source == f"TACO {TRIPLET}/{SEQUENCE}, {side} hand"


def test_frames_come_in_the_order_of_their_names_and_numbers_that_are_none_are_gaps(tmp_path):
    told = frames("right")
    told["00003"]["hand_trans"] = np.full(3, np.nan)
    shuffled = {name: told[name] for name in sorted(told, reverse=True)}
    motion = load_motion(write(tmp_path, sides=["right"], right=shuffled))
    assert motion.valid.tolist() == [True, True, False, True, True, True]
    np.testing.assert_allclose(motion.wrist_position[0], TAKES["right"].translation[0], atol=1e-6)


def test_a_scene_without_meshes_is_poses_alone_and_says_so(tmp_path):
    poses = np.tile(np.eye(4), (6, 1, 1))
    poses[1], poses[2, :3] = np.nan, 0.0
    scene = load_scene(write(tmp_path, objects={"tool_051": poses, "target_017": np.zeros((6, 4, 4))}))
    assert [hand.side for hand in scene.hands] == ["right", "left"]
    (tool,) = scene.objects  # the target is never there
    assert (tool.name, tool.kind) == ("tool_051", "none")
    assert np.flatnonzero(~tool.seen).tolist() == [1, 2]
    assert "tool_051: poses without a mesh" in scene_notes(scene)
    assert load_scene(write(tmp_path / "alone", sides=["left"])).objects == ()


def test_a_link_of_another_name_finds_the_objects(tmp_path):
    folder = write(tmp_path / "disk", objects={"tool_051": np.tile(np.eye(4), (6, 1, 1))})
    mesh(tmp_path / "disk", "051", [4.0, 6.0, 9.0], "object_models_released")
    (tmp_path / "way").symlink_to(folder)
    (found,) = load_scene(tmp_path / "way").objects
    np.testing.assert_allclose(np.ptp(found.vertices, axis=0), [0.04, 0.06, 0.09], atol=1e-6)


@pytest.mark.parametrize(
    ("changes", "choice", "message"),
    [
        ({}, {}, "holds both hands; choose one with side='right' or side='left'"),
        ({"sides": ["right"]}, {"side": "left"}, "holds no left hand; give side='right'"),
        (
            {"right": {}},
            {"side": "right"},
            r"right_hand\.pkl: not a dictionary of frames, by number, with hand_pose and hand_trans",
        ),
        ({"left": {"00001": {"hand_pose": np.zeros(48)}}}, {"side": "left"}, "frame 1: has no 'hand_trans'"),
        (
            {"right": {"00001": {"hand_pose": np.zeros(51), "hand_trans": np.zeros(3)}}},
            {"side": "right"},
            r"frame 1: hand_pose has shape \(51,\), expected \(48\)",
        ),
        (
            {"right": {"00001": {"hand_pose": np.full(48, np.nan), "hand_trans": np.zeros(3)}}},
            {"side": "right"},
            "the hand is in none of its 1 frames",
        ),
        (
            {"right": {"00001": {"hand_pose": np.zeros(48), "hand_trans": np.full(3, 1e6)}}},
            {"side": "right"},
            r"frame 0 holds 1e\+06, no angle",
        ),
    ],
)
def test_refusals(tmp_path, changes, choice, message):
    with pytest.raises(InputError, match=message) as refusal:
        load_motion(write(tmp_path, **changes), **choice)
    assert "\n" not in str(refusal.value)


@pytest.mark.parametrize(
    ("poses", "message"),
    [
        (np.zeros((5, 4, 4)), r"tool_051\.npy: poses has shape \(5, 4, 4\), expected \(6, 4, 4\)"),
        (np.zeros((6, 7)), r"tool_051\.npy: poses has shape \(6, 7\), expected \(6, 4, 4\)"),
        (np.full((6, 4, 4), 1e8), r"tool_051\.npy: frame 0 holds 1e\+08, no angle"),
        (np.tile(2 * np.eye(4), (6, 1, 1)), "object 'tool_051': pose 0 is no rotation"),
        (np.array([{}], dtype=object), r"tool_051\.npy: "),
    ],
)
def test_poses_of_objects_that_are_none_are_named(tmp_path, poses, message):
    with pytest.raises(InputError, match=message) as refusal:
        load_scene(write(tmp_path, objects={"tool_051": poses}))
    assert "\n" not in str(refusal.value)


def test_files_that_are_damaged_or_of_other_units_are_named(tmp_path):
    folder = write(tmp_path, objects={"tool_051": np.tile(np.eye(4), (6, 1, 1))})
    mesh(tmp_path, "051", [40.0, 60.0, 900.0])  # millimetres
    with pytest.raises(InputError, match=r"051_cm\.obj: 9 m long, but an object in a hand is 0\.005 to 1 m"):
        load_scene(folder)
    (tmp_path / "Object_Models" / "051_cm.obj").write_text("v 1")
    with pytest.raises(InputError, match=r"051_cm\.obj: "):
        load_scene(folder)
    (folder / "right_hand_shape.pkl").write_bytes(dumps({"hand_shape": Tensor(np.zeros(9, "f4"))}))
    with pytest.raises(InputError, match=r"right_hand_shape\.pkl: hand_shape has shape \(9,\), expected \(10\)"):
        load_motion(folder, side="right")
    (folder / "right_hand_shape.pkl").write_bytes(dumps({"betas": 1}))
    with pytest.raises(InputError, match=r"right_hand_shape\.pkl: has no 'hand_shape'"):
        load_motion(folder, side="right")
    hand = folder / "left_hand.pkl"
    hand.write_bytes(hand.read_bytes()[:-100])
    with pytest.raises(InputError, match=r"left_hand\.pkl: not a readable pickle"):
        load_motion(folder, side="left")
    hand.write_bytes(dumps([1, 2]))
    with pytest.raises(InputError, match=r"left_hand\.pkl: not a dictionary of frames"):
        load_motion(folder, side="left")


def test_hands_of_different_lengths_are_told(tmp_path):
    short = dict(list(frames("left").items())[:4])
    with pytest.raises(InputError, match=r"numbers of frames differ \(right hand 6, left hand 4\)"):
        load_scene(write(tmp_path, left=short))


def test_frames_that_are_left_out_or_of_another_recording(tmp_path):
    told = frames("right")
    names = list(told)
    folder = write(tmp_path / "one", right={name: told[name] for name in names if name != names[2]})
    with pytest.raises(InputError, match=r"right_hand\.pkl: 1 of the frames between its first and last are left out"):
        load_motion(folder, side="right")
    later = {f"{int(name) + 40:05d}": frame for name, frame in told.items()}
    folder = write(tmp_path / "two", right=later)
    with pytest.raises(InputError, match=r"begin of the right hand with 41, of the left hand with 1: these are of two"):
        load_scene(folder)
