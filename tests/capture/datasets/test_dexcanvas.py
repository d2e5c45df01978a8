import pickle

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mjx_hand.capture.load import load_motion
from mjx_hand.errors import InputError
from mjx_hand.hand.joints import TIP_LINKS
from mjx_hand.hand.open_hand import load_open_hand
from tests.capture.datasets.subjects import (
    ORDER_21,
    joints_of,
    licensed_file,
    licensed_hand,
    posed_joints,
    rest_joints,
    take,
)

TAKE = take(seed=5)
WHOLE = Rotation.from_rotvec(np.random.default_rng(9).normal(size=(6, 3)))


def local_joints(side: str) -> np.ndarray:
    return posed_joints(rest_joints(licensed_hand(side), TAKE.shape), TAKE.pose)


def in_world(joints: np.ndarray) -> np.ndarray:
    """The viewer's formula: joints of the posed hand, turned about the model's origin and moved."""
    return np.einsum("tij,tkj->tki", WHOLE.as_matrix(), joints) + TAKE.translation[:, None]


def fields(side: str = "right", **changes) -> dict:
    return {
        "mano_global_pos": TAKE.translation,
        "mano_global_rot_aa": WHOLE.as_rotvec(),
        "mano_hand_pose": TAKE.pose.reshape(6, 48),
        "mano_joint_pos": local_joints(side)[:, ORDER_21],
        "urdf_dof": np.zeros((6, 26)),
    } | changes


def write_row(root, hands: dict, **more):
    row = {
        "hands": list(hands.values()),
        "objects": [{"pos": [[0.0] * 3] * 6, "rot_aa": [[0.0] * 3] * 6}],
        "trajectory_metadata": {
            "total_frames": 6,
            "hand_names": [f"{side}_hand" for side in hands],
            "mano_hand_shapes": [TAKE.shape.tolist() for _ in hands],
        },
    }
    path = root / "row.pkl"
    path.write_bytes(pickle.dumps(row | more))
    return path


@pytest.mark.parametrize("side", ["right", "left"])
def test_recorded_joints_need_no_licence_and_come_out_where_they_were(tmp_path, side):
    motion = load_motion(write_row(tmp_path, {"right": fields("right"), "left": fields("left")}), side=side)
    expected = in_world(local_joints(side))
    np.testing.assert_allclose(joints_of(motion), expected[:, :16], atol=1e-6)
    assert motion.tip_offset is not None
    tips = (
        rest_joints(licensed_hand(side), TAKE.shape)[16:]
        - rest_joints(licensed_hand(side), TAKE.shape)[list(TIP_LINKS)]
    )
    np.testing.assert_allclose(motion.tip_offset, tips, atol=1e-6)
    np.testing.assert_allclose(motion.shape, TAKE.shape)
    assert (motion.fps, motion.source) == (100.0, f"DexCanvas row, {side} hand")


def test_lists_as_a_table_gives_them_are_read(tmp_path):
    listed = {name: value.reshape(6, -1).tolist() for name, value in fields().items()}
    motion = load_motion(write_row(tmp_path, {"right": listed}, data_fps=120))
    np.testing.assert_allclose(joints_of(motion), in_world(local_joints("right"))[:, :16], atol=1e-6)
    assert motion.fps == 120.0


def test_without_joints_the_wrist_is_the_turned_place_of_the_models(tmp_path):
    hand_fields: dict = fields_without_joints() | {"hand_name": "right", "shape": TAKE.shape}
    np.savez(tmp_path / "hand.npz", allow_pickle=False, **hand_fields)
    motion = load_motion(tmp_path / "hand.npz", mano=licensed_file(tmp_path))
    np.testing.assert_allclose(joints_of(motion), in_world(local_joints("right"))[:, :16], atol=1e-5)
    again = load_motion(tmp_path / "hand.npz")
    hand = load_open_hand()
    rest = np.asarray(hand.joint_regressor[0] @ hand.template, float)
    np.testing.assert_allclose(again.wrist_position, TAKE.translation + WHOLE.apply(rest), atol=1e-6)
    assert again.source.endswith("wrist place of the open hand")


def fields_without_joints() -> dict:
    return {name: value for name, value in fields().items() if name != "mano_joint_pos"}


def test_a_pose_may_leave_out_the_wrist(tmp_path):
    np.savez(
        tmp_path / "a.npz",
        allow_pickle=False,
        **(fields_without_joints() | {"mano_hand_pose": TAKE.pose[:, 1:].reshape(6, 45)}),
    )
    motion = load_motion(tmp_path / "a.npz", side="right")
    expected = Rotation.from_rotvec(TAKE.pose[:, 1:].reshape(-1, 3)).as_matrix().reshape(6, 15, 3, 3)
    np.testing.assert_allclose(motion.rotations, expected, atol=1e-12)
    found = Rotation.from_quat(motion.wrist_quaternion, scalar_first=True)
    assert (found.inv() * WHOLE).magnitude().max() < 1e-6


@pytest.mark.parametrize(
    ("hands", "choice", "message"),
    [
        ({"right": {}, "left": {}}, {}, "holds both hands; choose one"),
        ({"right": {}}, {"side": "left"}, "holds no left hand"),
        ({"some": {}}, {}, "does not say which hand it is; give side="),
        (
            {"right": {"mano_hand_pose": np.zeros((6, 30))}},
            {},
            r"mano_hand_pose has shape \(6, 30\), expected \(6, 48\)",
        ),
        (
            {"right": {"mano_global_pos": np.zeros((5, 3))}},
            {},
            r"mano_global_rot_aa has shape \(6, 3\), expected \(5, 3\)",
        ),
        ({"right": {"mano_hand_pose": np.full((6, 48), np.nan)}}, {}, "in none of its 6 frames"),
        (
            {"right": {"mano_joint_pos": in_world(local_joints("right"))[:, ORDER_21]}},
            {},
            "do not follow from the pose",
        ),
        ({"right": {"mano_joint_pos": local_joints("right")}}, {}, "do not follow from the pose"),  # MANO's own order
        ({"right": {"mano_joint_pos": np.zeros((6, 20, 3))}}, {}, r"mano_joint_pos has shape \(6, 20, 3\)"),
    ],
)
def test_refusals(tmp_path, hands, choice, message):
    path = write_row(tmp_path, {side: fields(**changes) for side, changes in hands.items()})
    with pytest.raises(InputError, match=message) as refusal:
        load_motion(path, **choice)
    assert "\n" not in str(refusal.value)
