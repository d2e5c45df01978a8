"""The DexMV importer, on the real recording and on damaged copies of it."""

from pathlib import Path

import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mjx_hand.capture.datasets.dexmv import link_offsets_by_frame, ordered_transforms
from mjx_hand.capture.load import load_motion
from mjx_hand.errors import InputError
from mjx_hand.hand.joints import FINGERS
from mjx_hand.rigid.rigid_hand import chain


@pytest.fixture(scope="module")
def file(recordings) -> Path:
    return recordings / "dexmv_mustard" / "sequence.npz"


@pytest.fixture(scope="module")
def arrays(file) -> dict[str, np.ndarray]:
    with np.load(file, allow_pickle=False) as archive:
        return {name: archive[name] for name in archive.files}


def joint_centres(arrays) -> np.ndarray:
    """The file's own joint positions in MANO's order, metres, camera frame."""
    order = [str(name) for name in arrays["joint_order"]]
    return arrays["joints"][:, [order.index("wrist"), *(order.index(f"{f}_{k}") for f in FINGERS for k in (1, 2, 3))]]


def in_camera(motion, position) -> np.ndarray:
    wrist = Rotation.from_quat(motion.wrist_quaternion, scalar_first=True).as_matrix()
    return motion.wrist_position[:, None] + np.einsum("tij,tlj->tli", wrist, position)


def test_rotations_and_each_frames_bones_reproduce_the_files_joints(file, arrays):
    motion = load_motion(file)
    offsets = link_offsets_by_frame(ordered_transforms(file, arrays))
    frames = [
        chain(jnp.asarray(r), jnp.asarray(o))[1] for r, o in zip(motion.rotations[::20], offsets[::20], strict=True)
    ]
    position = in_camera(motion, np.zeros((motion.num_frames, 1, 3)))  # all wrists
    np.testing.assert_allclose(position[:, 0], joint_centres(arrays)[:, 0], atol=1e-4)
    wrist = Rotation.from_quat(motion.wrist_quaternion[::20], scalar_first=True).as_matrix()
    found = motion.wrist_position[::20, None] + np.einsum("tij,tlj->tli", wrist, np.stack(frames))
    np.testing.assert_allclose(found, joint_centres(arrays)[::20], atol=1e-4)


def test_one_set_of_bones_stays_within_the_recordings_own_jitter(file, arrays):
    """The bones' lengths jitter from frame to frame (up to 0.5 mm SD): one median set is off by no more than that."""
    motion = load_motion(file)
    assert motion.link_offset is not None
    position = chain(jnp.asarray(motion.rotations), jnp.asarray(motion.link_offset))[1]
    off = np.linalg.norm(in_camera(motion, np.asarray(position)) - joint_centres(arrays), axis=-1)
    assert off.mean() < 5e-4
    assert off.max() < 2e-3


def test_what_the_motion_says_of_itself(file):
    motion = load_motion(file)
    assert (motion.num_frames, motion.fps, motion.side, motion.valid.all()) == (122, 25.0, "right", True)
    assert motion.shape.shape == (10,)
    assert "DexMV" in motion.source
    assert motion.link_offset is not None
    # MANO's hand frame: fingers along -x, little finger to thumb along +z, whatever the camera sees.
    knuckles = dict(zip(FINGERS, motion.link_offset[1::3], strict=True))
    assert all(knuckles[f][0] < -0.05 for f in FINGERS if f != "thumb")
    assert knuckles["index"][2] > knuckles["middle"][2] > knuckles["ring"][2] > knuckles["pinky"][2]


def test_medians_resist_a_wild_frame(file, arrays, tmp_path):
    wild = {name: value.copy() for name, value in arrays.items()}
    wild["mano"][5, 48:58] = 50.0
    wild["joint_transforms"][5, 4, :3, 3] += 1.0
    np.savez(tmp_path / "wild.npz", **wild)
    motion, sound = load_motion(tmp_path / "wild.npz"), load_motion(file)
    np.testing.assert_allclose(motion.shape, sound.shape, atol=0.02)
    assert motion.link_offset is not None
    assert sound.link_offset is not None
    np.testing.assert_allclose(motion.link_offset, sound.link_offset, atol=1e-4)


def test_frames_that_are_not_finite_become_gaps(arrays, tmp_path):
    holed = {name: value.copy() for name, value in arrays.items()}
    holed["mano"][3:6, 10] = np.nan
    holed["joint_transforms"][9] = np.inf
    np.savez(tmp_path / "holed.npz", **holed)
    motion = load_motion(tmp_path / "holed.npz")
    assert np.flatnonzero(~motion.valid).tolist() == [3, 4, 5, 9]
    np.testing.assert_array_equal(motion.rotations[4], np.tile(np.eye(3), (15, 1, 1)))
    assert np.isfinite(motion.wrist_position).all()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"mano": np.zeros((122, 51), np.float32)}, r"mano has shape \(122, 51\)"),
        (
            {"mano": np.zeros((0, 61), np.float32), "joint_transforms": np.zeros((0, 16, 4, 4))},
            "the recording has no frames",
        ),
        ({"mano": np.full((122, 61), np.nan)}, "none of its 122 frames is finite"),
        ({"mano": np.zeros((9, 61), np.float32)}, r"mano has shape \(9, 61\), expected \(122, 61\)"),
        ({"mano": np.full((122, 61), "a")}, "mano holds <U1, expected numbers"),
        ({"joint_transforms": np.zeros((122, 15, 4, 4))}, "joint_transforms has shape"),
        ({"joint_transform_order": np.array(["a"] * 16)}, "joint_transform_order names a, a"),
        ({"mano": np.zeros((122, 61), np.float32)}, "pose and joint_transforms differ"),
    ],
)
def test_unsound_files_are_refused(arrays, tmp_path, change, message):
    np.savez(tmp_path / "bad.npz", **(arrays | change))
    with pytest.raises(InputError, match=message):
        load_motion(tmp_path / "bad.npz")


def test_the_subjects_finger_tips_are_read(file, arrays):
    """The tips jitter by 0.2-0.3 mm in their links' frames; one median set must stay near that, and the bones' own."""
    motion = load_motion(file)
    assert motion.tip_offset is not None
    links, places = chain(jnp.asarray(motion.rotations), jnp.asarray(motion.link_offset))
    last = [3, 6, 9, 12, 15]
    tips = np.asarray(places)[:, last] + np.einsum("tfij,fj->tfi", np.asarray(links)[:, last], motion.tip_offset)
    order = [str(name) for name in arrays["joint_order"]]
    recorded = arrays["joints"][:, [order.index(f"{f}_tip") for f in FINGERS]]
    off = np.linalg.norm(in_camera(motion, tips) - recorded, axis=-1)
    assert off.mean() < 1e-3


def test_a_recording_without_tips_has_none_and_wrong_names_are_refused(arrays, tmp_path):
    without = {k: v for k, v in arrays.items() if k not in ("joints", "joint_order")}
    np.savez(tmp_path / "without.npz", **without)
    assert load_motion(tmp_path / "without.npz").tip_offset is None
    np.savez(tmp_path / "wrong.npz", **(arrays | {"joint_order": np.array([f"j{k}" for k in range(21)])}))
    with pytest.raises(InputError, match="joint_order names j0"):
        load_motion(tmp_path / "wrong.npz")
