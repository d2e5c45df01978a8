import numpy as np
import pytest
from body_models.mano.numpy import MANO
from scipy.spatial.transform import Rotation

from mjx_hand.capture.load import load_motion
from mjx_hand.errors import InputError
from mjx_hand.hand.joints import TIP_LINKS
from tests.capture.datasets.subjects import joints_of, licensed_file, licensed_hand, posed_joints, rest_joints, take

TAKE = take()


def hand_of(side: str, **changes) -> dict:
    mean = licensed_hand(side).pose_mean.reshape(45)
    return {
        "rot": TAKE.pose[:, 0],
        "pose": TAKE.pose[:, 1:].reshape(-1, 45) - mean,
        "trans": TAKE.translation,
        "shape": TAKE.shape,
        "fitting_err": np.zeros(6),
    } | changes


def write(folder, **hands):
    path = folder / "s01" / "box_grab_01.mano.npy"
    path.parent.mkdir(exist_ok=True)
    np.save(path, np.array(hands, dtype=object))
    return path


@pytest.mark.parametrize("side", ["right", "left"])
def test_joints_are_where_the_datasets_own_formula_puts_them(tmp_path, side):
    path = write(tmp_path, right=hand_of("right"), left=hand_of("left"))
    motion = load_motion(path, side=side, mano=licensed_file(tmp_path, side))
    expected = posed_joints(rest_joints(licensed_hand(side), TAKE.shape), TAKE.pose) + TAKE.translation[:, None]
    np.testing.assert_allclose(joints_of(motion), expected[:, :16], atol=1e-5)
    np.testing.assert_allclose(
        motion.rotations.reshape(-1, 3, 3), Rotation.from_rotvec(TAKE.pose[:, 1:].reshape(-1, 3)).as_matrix(), atol=1e-6
    )
    np.testing.assert_allclose(motion.shape, TAKE.shape)
    assert (motion.fps, motion.side, motion.source) == (30.0, side, f"ARCTIC s01/box_grab_01, {side} hand")


@pytest.mark.filterwarnings("ignore")  # the oracle's own
@pytest.mark.parametrize("side", ["right", "left"])
def test_joints_are_where_another_implementation_of_mano_puts_them(tmp_path, side):
    """body-models, made as the dataset's tools make the hand: the file as it is, and not the flat mean."""
    mano = licensed_file(tmp_path, side)
    hand = hand_of(side)
    motion = load_motion(write(tmp_path, **{side: hand}), mano=mano)
    expected = MANO(model_path=mano, flat_hand_mean=False).forward_skeleton(
        hand["pose"].reshape(6, 15, 3).astype(np.float32),
        wrist_rotation=hand["rot"].astype(np.float32),
        shape=np.tile(TAKE.shape, (6, 1)).astype(np.float32),
        global_translation=hand["trans"].astype(np.float32),
    )
    np.testing.assert_allclose(joints_of(motion), expected[..., :3, 3], atol=1e-5)


def test_finger_tips_are_the_subjects_own(tmp_path):
    motion = load_motion(write(tmp_path, right=hand_of("right")), mano=licensed_file(tmp_path))
    rest = rest_joints(licensed_hand(), TAKE.shape)
    assert motion.tip_offset is not None
    apart = np.linalg.norm(motion.tip_offset - (rest[16:] - rest[list(TIP_LINKS)]), axis=1)
    assert apart.max() < 0.01  # files other than MANO's own have no agreed tip vertices: the farthest one is taken


def test_shape_may_be_given_for_each_frame_and_one_wild_one_does_not_matter(tmp_path):
    shapes = np.tile(TAKE.shape, (6, 1))
    shapes[2] += 40
    motion = load_motion(write(tmp_path, right=hand_of("right", shape=shapes)), mano=licensed_file(tmp_path))
    np.testing.assert_allclose(motion.shape, TAKE.shape)


def test_frames_that_are_not_finite_are_gaps(tmp_path):
    pose = hand_of("right")["pose"]
    pose[3, 7] = np.nan
    motion = load_motion(write(tmp_path, right=hand_of("right", pose=pose)), mano=licensed_file(tmp_path))
    assert np.flatnonzero(~motion.valid).tolist() == [3]
    np.testing.assert_array_equal(motion.rotations[3], np.tile(np.eye(3), (15, 1, 1)))


@pytest.mark.parametrize(
    ("hands", "choice", "message"),
    [
        ({"right": {}, "left": {}}, {}, r"both hands; choose one with side='right' or side='left'"),
        ({"right": {}}, {"side": "left"}, r"no left hand; give side='right'"),
        ({"right": {}}, {}, r"relative to MANO's mean pose need MANO_RIGHT\.pkl: give mano="),
        ({"right": {"pose": np.zeros((6, 44))}}, {}, r"pose has shape \(6, 44\), expected \(6, 45\)"),
        ({"right": {"pose": np.full((6, 45), np.nan)}}, {}, "in none of its 6 frames"),
        ({"right": {"shape": np.zeros(11)}}, {}, r"shape has shape \(11,\), expected \(10\)"),
        ({"right": {"trans": "far"}}, {}, "cannot read 'right trans'"),
        ({"right": {}}, {"fps": 25.0}, "recorded at 30 frames per second; leave out fps=25"),
        ({"right": {}}, {"sequence": "a"}, "holds one recording; leave out sequence='a'"),
    ],
)
def test_refusals(tmp_path, hands, choice, message):
    path = write(tmp_path, **{side: hand_of(side, **changes) for side, changes in hands.items()})
    if "fps" in choice or "sequence" in choice:
        choice = choice | {"mano": licensed_file(tmp_path)}
    with pytest.raises(InputError, match=message) as refusal:
        load_motion(path, **choice)
    assert "\n" not in str(refusal.value)


def params() -> dict:
    hands = {"r": hand_of("right", shape=np.tile(TAKE.shape, (6, 1))), "l": hand_of("left")}
    return {f"{name}_{letter}": value for letter, hand in hands.items() for name, value in hand.items()}


def save(path, **contents):
    np.save(path, np.array(contents, dtype=object))
    return path


@pytest.mark.parametrize("side", ["right", "left"])
def test_the_same_in_processed_sequences_and_in_a_split(tmp_path, side):
    mano = licensed_file(tmp_path, side)
    raw = load_motion(write(tmp_path, **{side: hand_of(side)}), mano=mano)
    one = save(tmp_path / "box_grab_01.npy", params=params(), cam_coord={"is_valid": np.ones((6, 9))})
    split = save(tmp_path / "p1_val.npy", data_dict={"s05/box_grab_01": {"params": params()}, "s05/b": {}}, imgnames=[])
    for motion in (
        load_motion(one, side=side, mano=mano),
        load_motion(split, sequence="s05/box_grab_01", side=side, mano=mano),
    ):
        np.testing.assert_array_equal(motion.rotations, raw.rotations)
        np.testing.assert_array_equal(motion.wrist_position, raw.wrist_position)
    assert load_motion(split, sequence="s05/box_grab_01", side=side, mano=mano).source.startswith(
        "ARCTIC s05/box_grab_01"
    )


def test_a_splits_sequence_must_be_chosen(tmp_path):
    split = save(tmp_path / "p1_val.npy", data_dict={f"s05/{k}": {"params": params()} for k in range(9)})
    with pytest.raises(InputError, match=r"holds several sequences; choose one with sequence=: s05/0, .*, and more"):
        load_motion(split)
    with pytest.raises(InputError, match=r"holds no sequence 'x'; choose one with sequence=: s05/0"):
        load_motion(split, sequence="x")


def test_a_file_without_translation_is_named(tmp_path):
    hand = hand_of("right")
    del hand["trans"]
    with pytest.raises(InputError, match="has no 'trans'; it needs rot, pose, trans, shape"):
        load_motion(write(tmp_path, right=hand))


def test_the_wrong_sides_model_is_refused(tmp_path):
    with pytest.raises(InputError, match="holds a left hand, but side is 'right'"):
        load_motion(write(tmp_path, right=hand_of("right")), mano=licensed_file(tmp_path, "left"))
