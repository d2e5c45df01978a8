import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from mjx_hand.capture.load import load_motion
from mjx_hand.errors import InputError
from mjx_hand.hand.open_hand import load_open_hand
from tests.capture.datasets.subjects import joints_of, licensed_file, licensed_hand, posed_joints, rest_joints, take

TAKE = take(seed=3)
MESH = "tools/subject_meshes/male/s4_rhand.ply"


def write(root, *, full: bool = True, sides=("right",), rate: float = 120.0, **params):
    path = root / "grab" / "s4" / "mug_pass_1.npz"
    path.parent.mkdir(parents=True)
    hands: dict = {"contact": {"body": np.zeros(3)}}
    for side in sides:
        fingers = {"hand_pose": TAKE.coefficients(side, mean=False)}
        if full:
            fingers["fullpose"] = TAKE.pose[:, 1:].reshape(-1, 45)
        given = {"global_orient": TAKE.pose[:, 0], "transl": TAKE.translation} | fingers | params
        hands[f"{side[0]}hand"] = {"params": given, "vtemp": MESH.replace("rhand", f"{side[0]}hand")}
    np.savez(path, framerate=rate, n_comps=24, gender="male", obj_name="mug", **hands)
    return path


def write_mesh(root, vertices, side: str = "right"):
    """The subject's own hand, as the dataset ships it."""
    path = root / MESH.replace("rhand", f"{side[0]}hand")
    path.parent.mkdir(parents=True)
    trimesh.Trimesh(vertices, licensed_hand(side).faces, process=False).export(path)


def test_the_full_pose_needs_no_licence_and_is_the_pose_that_went_in(tmp_path):
    motion = load_motion(write(tmp_path))
    expected = Rotation.from_rotvec(TAKE.pose[:, 1:].reshape(-1, 3)).as_matrix().reshape(6, 15, 3, 3)
    np.testing.assert_allclose(motion.rotations, expected, atol=1e-12)
    hand = load_open_hand()
    np.testing.assert_allclose(
        motion.wrist_position - TAKE.translation, np.tile(hand.joint_regressor[0] @ hand.template, (6, 1)), atol=1e-6
    )
    assert motion.fps == 120.0
    assert motion.link_offset is None
    assert motion.source == "GRAB s4/mug_pass_1, mean bones, right hand; wrist place of the open hand"


def test_coefficients_are_used_where_the_full_pose_is_not_there(tmp_path):
    motion = load_motion(write(tmp_path, full=False), mano=licensed_file(tmp_path))
    expected = Rotation.from_rotvec(TAKE.pose[:, 1:].reshape(-1, 3)).as_matrix().reshape(6, 15, 3, 3)
    np.testing.assert_allclose(motion.rotations, expected, atol=1e-6)


def test_fewer_coefficients_than_components_are_the_first_ones(tmp_path):
    first = TAKE.coefficients("right", mean=False)[:, :24]
    motion = load_motion(write(tmp_path, full=False, hand_pose=first), mano=licensed_file(tmp_path))
    rest = np.pad(first, [(0, 0), (0, 21)])
    again = load_motion(write(tmp_path / "b", full=False, hand_pose=rest), mano=licensed_file(tmp_path))
    np.testing.assert_allclose(motion.rotations, again.rotations, atol=1e-12)


@pytest.mark.parametrize("side", ["right", "left"])
def test_joints_are_those_of_the_subjects_own_mesh(tmp_path, monkeypatch, side):
    hand = licensed_hand(side)
    monkeypatch.setattr("mjx_hand.capture.datasets.grab.MANO_VERTICES", hand.num_vertices)
    own = hand.template * np.float32(1.07) + np.float32(0.004)
    write_mesh(tmp_path, own, side)
    motion = load_motion(write(tmp_path, sides=[side]), mano=licensed_file(tmp_path, side))
    rest = np.concatenate([hand.joint_regressor @ own, own[hand.tip_vertices]])
    expected = posed_joints(rest, TAKE.pose) + TAKE.translation[:, None]
    np.testing.assert_allclose(joints_of(motion), expected[:, :16], atol=1e-5)
    assert motion.source == f"GRAB s4/mug_pass_1, {side} hand"


def test_without_the_mesh_the_mean_hand_stands_in_and_the_motion_says_so(tmp_path):
    motion = load_motion(write(tmp_path), mano=licensed_file(tmp_path))
    expected = posed_joints(rest_joints(licensed_hand(), np.zeros(10)), TAKE.pose) + TAKE.translation[:, None]
    np.testing.assert_allclose(joints_of(motion), expected[:, :16], atol=1e-5)
    assert "mean bones" in motion.source


@pytest.mark.parametrize(
    ("changes", "choice", "message"),
    [
        ({"sides": ["right", "left"]}, {}, "holds both hands; choose one"),
        ({"full": False}, {}, "PCA poses need"),
        ({"fullpose": np.zeros((6, 24))}, {}, r"fullpose has shape \(6, 24\), expected \(6, 45\)"),
        ({"transl": np.zeros((5, 3))}, {}, r"transl has shape \(5, 3\), expected \(6, 3\)"),
        ({"rate": 0.0}, {}, "fps is 0.0, expected a positive number"),
    ],
)
def test_refusals(tmp_path, changes, choice, message):
    with pytest.raises(InputError, match=message) as refusal:
        load_motion(write(tmp_path, **changes), **choice)
    assert "\n" not in str(refusal.value)


def test_a_mesh_that_is_damaged_or_of_another_model_is_named(tmp_path):
    path, mano = write(tmp_path), licensed_file(tmp_path)
    write_mesh(tmp_path, licensed_hand().template)
    with pytest.raises(InputError, match=r"s4_rhand\.ply: vertices has shape \(\d+, 3\), expected \(778, 3\)"):
        load_motion(path, mano=mano)
    (tmp_path / MESH).write_text("ply")
    with pytest.raises(InputError, match=r"s4_rhand\.ply: not a readable mesh"):
        load_motion(path, mano=mano)
