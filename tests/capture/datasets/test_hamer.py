import pickle

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mjx_hand.capture.load import load_motion
from mjx_hand.errors import InputError
from tests.capture.datasets.subjects import (
    ORDER_21,
    joints_of,
    licensed_file,
    licensed_hand,
    posed_joints,
    rest_joints,
    take,
)
from tests.files.torch_layout import Tensor, dumps

TAKE = take(seed=6)
FRAMES = 6
MIRROR = np.array([-1.0, 1, 1])
# What the network makes of a video: right hands only, of one shape here.
JOINTS = posed_joints(rest_joints(licensed_hand(), TAKE.shape), TAKE.pose)[:, ORDER_21]
MATRICES = Rotation.from_rotvec(TAKE.pose.reshape(-1, 3)).as_matrix().reshape(FRAMES, 16, 3, 3)


def seen(side: str) -> np.ndarray:
    """(t, 21, 3): the joints in the camera's frame; a left hand is the right one in the mirror."""
    return JOINTS * (MIRROR if side == "left" else 1) + TAKE.translation[:, None]


def output(k: int, sides=("right",), nested: bool = True, keypoints: bool = True) -> dict:
    """HaMeR's dictionary for image k, all hands in it the same one or its mirror image."""
    count = len(sides)
    parameters = {
        "global_orient": np.tile(MATRICES[k, :1], (count, 1, 1, 1)),
        "hand_pose": np.tile(MATRICES[k, 1:], (count, 1, 1, 1)),
        "betas": np.tile(TAKE.shape, (count, 1)),
    }
    values = {
        "pred_cam_t_full": np.tile(TAKE.translation[k], (count, 1)),
        "right": np.array([float(side == "right") for side in sides]),
    }
    if keypoints:
        values["pred_keypoints_3d"] = np.tile(JOINTS[k], (count, 1, 1))
    return values | ({"pred_mano_params": parameters} if nested else parameters)


def mini(k: int, side: str) -> dict:
    """One hand of WiLoR-mini's list: axis-angles, mirrored back where the hand is a left one."""
    axes = np.array([1.0, -1, -1]) if side == "left" else np.ones(3)
    joints = JOINTS[k] * (MIRROR if side == "left" else 1)
    return {
        "hand_bbox": [0.0, 0, 9, 9],
        "is_right": float(side == "right"),
        "wilor_preds": {
            "global_orient": (TAKE.pose[k, :1] * axes)[None],
            "hand_pose": (TAKE.pose[k, 1:] * axes)[None],
            "betas": TAKE.shape[None],
            "pred_cam_t_full": TAKE.translation[k][None],
            "pred_keypoints_3d": joints[None],
            "scaled_focal_length": 9000.0,
        },
    }


def as_tensors(value):
    if isinstance(value, dict):
        return {name: as_tensors(item) for name, item in value.items()}
    return Tensor(value.astype("f4"))


def write_folder(root, kind: str, sides=("right",), numbers=tuple(range(FRAMES)), **options):
    folder = root / "images"
    folder.mkdir()
    for k, number in enumerate(numbers):
        if kind == "npz":
            np.savez(folder / f"img_{number:06d}.npz", **output(k, sides, nested=False, **options))
        elif kind == "tensors":
            (folder / f"{number:06d}.pkl").write_bytes(dumps(as_tensors(output(k, sides, **options))))
        else:
            np.save(folder / f"{number}.npy", np.array([mini(k, side) for side in sides], dtype=object))
    return folder


@pytest.mark.parametrize("side", ["right", "left"])
@pytest.mark.parametrize("kind", ["npz", "tensors", "mini"])
def test_hands_come_out_where_the_camera_saw_them(tmp_path, kind, side):
    """Without a licensed file: the network's own joints place the wrist and give the bones."""
    folder = write_folder(tmp_path, kind, ("right", "left"))
    motion = load_motion(folder, side=side, fps=25)
    places = seen(side)[:, [ORDER_21.index(j) for j in range(16)]]
    np.testing.assert_allclose(joints_of(motion), places, atol=1e-5)
    assert motion.tip_offset is not None
    assert (motion.fps, motion.side) == (25.0, side)
    np.testing.assert_allclose(motion.shape, TAKE.shape, atol=1e-6)
    if side == "right":
        np.testing.assert_allclose(motion.rotations, MATRICES[:, 1:], atol=1e-6)


def test_a_list_of_images_is_a_video_and_empty_ones_are_gaps(tmp_path):
    path = tmp_path / "video.pkl"
    path.write_bytes(
        pickle.dumps([[], [mini(0, "right")], None, [mini(1, "right"), {"hand_bbox": [], "is_right": 0.0}]])
    )
    motion = load_motion(path, fps=30.0)
    assert motion.valid.tolist() == [False, True, False, True]
    np.testing.assert_allclose(motion.wrist_position[[1, 3]], seen("right")[:2, 0], atol=1e-9)


def test_images_before_the_hand_comes_are_gaps_of_a_folder_too(tmp_path):
    folder = write_folder(tmp_path, "mini", numbers=tuple(range(2, 8)))
    np.save(folder / "0.npy", np.array([], dtype=object))
    motion = load_motion(folder, fps=30)
    assert motion.valid.tolist() == [False, False, True, True, True, True, True, True]


def test_numbers_left_out_are_gaps(tmp_path):
    motion = load_motion(write_folder(tmp_path, "npz", numbers=(3, 4, 6, 7, 8, 10)), fps=30)
    assert np.flatnonzero(~motion.valid).tolist() == [2, 6]


@pytest.mark.parametrize("side", ["right", "left"])
def test_without_keypoints_the_licensed_file_places_the_wrist(tmp_path, side):
    folder = write_folder(tmp_path, "npz", (side,), keypoints=False)
    motion = load_motion(folder, fps=30, mano=licensed_file(tmp_path, side))
    places = seen(side)[:, [ORDER_21.index(j) for j in range(16)]]
    np.testing.assert_allclose(joints_of(motion), places, atol=1e-5)
    assert "open hand" in load_motion(folder, fps=30).source


def test_shape_and_bones_are_medians_that_one_wild_image_does_not_move(tmp_path):
    images = [output(k) for k in range(FRAMES)]
    images[2]["pred_mano_params"]["betas"] += 30
    images[2]["pred_keypoints_3d"] *= 1.5
    path = tmp_path / "video.pkl"
    path.write_bytes(pickle.dumps(images))
    motion = load_motion(path, fps=30)
    np.testing.assert_allclose(motion.shape, TAKE.shape, atol=1e-9)
    steady = [0, 1, 3, 4, 5]
    places = seen("right")[:, [ORDER_21.index(j) for j in range(16)]]
    np.testing.assert_allclose(joints_of(motion)[steady], places[steady], atol=1e-6)


def test_half_precision_is_near_enough(tmp_path):
    def half(value):
        return {n: half(v) for n, v in value.items()} if isinstance(value, dict) else value.astype(np.float16)

    path = tmp_path / "video.pkl"
    path.write_bytes(pickle.dumps([half(output(k)) for k in range(FRAMES)]))
    np.testing.assert_allclose(load_motion(path, fps=30).rotations, MATRICES[:, 1:], atol=2e-3)


def doubled(k: int, place: float, first: bool = False) -> dict:
    """Image k with a second right hand, `place` metres away, before or after the true one."""
    image = output(k, ("right", "right"))
    false = 0 if first else 1
    image["pred_cam_t_full"] = image["pred_cam_t_full"] + np.eye(2)[false][:, None] * place
    image["pred_mano_params"]["hand_pose"] = np.array(image["pred_mano_params"]["hand_pose"])
    image["pred_mano_params"]["hand_pose"][false] = np.eye(3)
    return image


@pytest.mark.parametrize("first", [True, False])
def test_a_false_second_detection_is_left_out_and_told(tmp_path, first):
    images = [output(k) for k in range(FRAMES)]
    images[2], images[5] = doubled(2, 0.4, first), doubled(5, 0.4, first)
    for k, image in enumerate(images):  # a hand that moves slowly, and not as a random one does
        image["pred_cam_t_full"] = image["pred_cam_t_full"] - TAKE.translation[k] + [0.01 * k, 0.0, 0.6]
    path = tmp_path / "video.pkl"
    path.write_bytes(pickle.dumps(images))
    motion = load_motion(path, fps=30)
    np.testing.assert_allclose(motion.rotations, MATRICES[:, 1:], atol=1e-6)
    assert motion.valid.all()
    assert "a second right hand left out of 2 images" in motion.source


def spoiled(change) -> list:
    images = [output(k) for k in range(FRAMES)]
    change(images[1])
    return images


@pytest.mark.parametrize(
    ("images", "message"),
    [
        ([output(k, ("right", "left")) for k in range(2)], "holds both hands; choose one"),
        ([output(k, ("right", "right")) for k in range(2)], "image 0 has 2 right hands; keep one person's"),
        (spoiled(lambda i: i.pop("pred_cam_t_full")), "image 1: has no pred_cam_t_full; save it too"),
        (spoiled(lambda i: i.pop("right")), "image 1: cannot read 'right'"),
        (spoiled(lambda i: i.pop("pred_mano_params")), "image 1: holds no global_orient, hand_pose, betas"),
        (spoiled(lambda i: i["pred_mano_params"].update(betas=np.zeros((1, 9)))), r"betas has shape \(1, 9\)"),
        (spoiled(lambda i: i["pred_mano_params"].update(hand_pose=np.ones((1, 15, 3, 3)))), "image 1: .*not rotations"),
        (spoiled(lambda i: i["pred_mano_params"].update(global_orient=np.zeros((1, 3)))), r"expected \(1, 1, 3, 3\)"),
        ([o | {"pred_keypoints_3d": o["pred_keypoints_3d"][:, ::-1]} for o in map(output, range(3))], "do not follow"),
    ],
)
def test_refusals(tmp_path, images, message):
    path = tmp_path / "video.pkl"
    path.write_bytes(pickle.dumps(images))
    with pytest.raises(InputError, match=message) as refusal:
        load_motion(path, fps=30)
    assert "\n" not in str(refusal.value)


def test_the_frame_rate_must_be_given(tmp_path):
    with pytest.raises(InputError, match="does not say its frame rate; give fps=, such as fps=30"):
        load_motion(write_folder(tmp_path, "npz"))


def test_two_files_of_one_number_are_refused(tmp_path):
    folder = write_folder(tmp_path, "npz")
    (folder / "a_3.npz").write_bytes((folder / "img_000003.npz").read_bytes())
    with pytest.raises(InputError, match="two files have one number"):
        load_motion(folder, fps=30)


def test_images_that_are_not_finite_are_gaps(tmp_path):
    images = [output(k) for k in range(FRAMES)]
    images[4]["pred_mano_params"]["hand_pose"] = np.full((1, 15, 3, 3), np.nan)
    path = tmp_path / "video.pkl"
    path.write_bytes(pickle.dumps([*images, [mini(0, "right")]]))
    broken = mini(1, "right")
    broken["wilor_preds"]["hand_pose"] = np.full((1, 15, 3), np.nan)
    path.write_bytes(pickle.dumps([*images, [broken]]))
    assert np.flatnonzero(~load_motion(path, fps=30).valid).tolist() == [4, 6]
