"""Round trips of every file, and what readers say to damaged ones."""

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings

from mjx_hand.errors import InputError
from mjx_hand.files.npz_archive import save_arrays
from mjx_hand.hand.joints import HINGES
from mjx_hand.motion import check_motion, load_joint_motion, load_motion_file, save_joint_motion, save_motion
from mjx_hand.motion.demonstration import Demonstration, load_demonstration, save_demonstration
from mjx_hand.motion.motion import SCHEMA
from mjx_hand.objects.description import ObjectDescription
from mjx_hand.pytree import replace
from tests.motion.motions import assert_same, joint_motions, motions

quick = settings(deadline=None, max_examples=20, suppress_health_check=[HealthCheck.function_scoped_fixture])


@quick
@given(motion=motions())
def test_motion_round_trip(tmp_path, motion):
    save_motion(motion, tmp_path / "m.npz")
    assert_same(load_motion_file(tmp_path / "m.npz"), motion)


@quick
@given(motion=joint_motions())
def test_joint_motion_round_trip(tmp_path, motion):
    save_joint_motion(motion, tmp_path / "j.npz")
    assert_same(load_joint_motion(tmp_path / "j.npz"), motion)


def demonstration(motion) -> Demonstration:
    return Demonstration(
        motion=motion,
        object_pose=np.tile([0.1, 0.2, 0.3, 1, 0, 0, 0], (motion.num_frames, 1)),
        object=ObjectDescription(
            size=np.array([0.03, 0.03, 0.03]), mass=0.1, friction=0.9, hulls=np.full((2, 5, 3), 0.03), kind="mesh"
        ),
        support=np.array([[0.1, 0.1, 0.01], [0.01, 0.01, 0.02]]),
        support_position=np.array([[0.0, 0.0, 0.01], [0.05, 0.0, 0.02]]),
        shape=np.zeros(10),
        grasp="precision_pinch",
        source=motion.source,
    )


@quick
@given(motion=joint_motions())
def test_demonstration_round_trip(tmp_path, motion):
    made = demonstration(motion)
    save_demonstration(made, tmp_path / "d.npz")
    found = load_demonstration(tmp_path / "d.npz")
    assert_same(found, made)


@pytest.fixture
def stored(tmp_path):
    """A sound motion's arrays, and a function that stores them changed and returns the path."""
    arrays = {
        "fps": 30.0,
        "rotations": np.tile(np.eye(3), (4, 15, 1, 1)),
        "wrist_position": np.zeros((4, 3)),
        "wrist_quaternion": np.tile([1.0, 0, 0, 0], (4, 1)),
        "shape": np.zeros(10),
        "valid": np.ones(4, bool),
        "side": "right",
        "source": "made",
    }

    def store(leave_out=(), schema=SCHEMA, **changed):
        kept = {k: v for k, v in (arrays | changed).items() if k not in leave_out}
        save_arrays(tmp_path / "motion.npz", schema, kept)
        return tmp_path / "motion.npz"

    return store


def mirror(frames=4):
    rotations = np.tile(np.eye(3), (frames, 15, 1, 1))
    rotations[2, 3] = np.diag([1.0, 1, -1])
    return rotations


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"rotations": mirror()}, "frame 2 holds matrices that are not rotations"),
        ({"rotations": 1.1 * np.tile(np.eye(3), (4, 15, 1, 1))}, "not rotations"),
        ({"rotations": np.full((4, 15, 3, 3), np.nan)}, r"rotations has NaN or infinity, first at \(0, 0, 0, 0\)"),
        ({"rotations": np.zeros((4, 45))}, r"rotations has shape \(4, 45\), expected \(t, 15, 3, 3\)"),
        ({"rotations": np.full((4, 15, 3, 3), "x")}, "rotations holds <U1, expected numbers"),
        ({"wrist_position": np.zeros((5, 3))}, r"wrist_position has shape \(5, 3\), expected \(4, 3\)"),
        ({"wrist_quaternion": np.zeros((4, 4))}, "wrist_quaternion has length 0, expected 1"),
        ({"shape": np.zeros((4, 10))}, r"shape has shape \(4, 10\), expected \(s\)"),
        ({"shape": np.array([np.inf])}, "shape has NaN or infinity"),
        ({"link_offset": np.zeros((15, 3))}, r"link_offset has shape \(15, 3\)"),
        ({"fps": 0.0}, "fps is 0.0, expected a positive number"),
        ({"fps": np.ones(3)}, r"fps has shape \(3,\)"),
        ({"side": "both"}, "side is 'both'"),
        ({"valid": np.zeros(4, bool)}, "all 4 frames are gaps"),
        ({"leave_out": ("valid",)}, "has no 'valid'"),
        ({"leave_out": ("side",)}, "has no 'side'"),
        ({"schema": "mjx-hand/motion/99"}, "schema mjx-hand/motion/99, expected mjx-hand/motion/1"),
        (
            {
                "rotations": np.zeros((0, 15, 3, 3)),
                "wrist_position": np.zeros((0, 3)),
                "wrist_quaternion": np.zeros((0, 4)),
                "valid": np.zeros(0, bool),
            },
            "no frames",
        ),
    ],
)
def test_unsound_motion_files_are_refused_in_one_line(stored, changed, message):
    with pytest.raises(InputError, match=message) as refusal:
        load_motion_file(stored(**changed))
    assert "\n" not in str(refusal.value)


def test_joint_motion_of_another_joint_order_is_refused(tmp_path):
    arrays = {"joint_names": np.array(HINGES[::-1]), "source": "made"}
    save_arrays(tmp_path / "j.npz", "mjx-hand/joint-motion/1", arrays)
    with pytest.raises(InputError, match="its joint names are not this version's"):
        load_joint_motion(tmp_path / "j.npz")


@settings(quick, max_examples=5)
@given(motion=joint_motions())
def test_demonstration_with_another_number_of_object_frames_is_refused(tmp_path, motion):
    made = demonstration(motion)
    save_demonstration(replace(made, object_pose=np.zeros((motion.num_frames + 1, 7))), tmp_path / "d.npz")
    with pytest.raises(InputError, match=rf"object_pose has shape .* expected \({motion.num_frames}, 7\)"):
        load_demonstration(tmp_path / "d.npz")


@quick
@given(motion=motions())
def test_well_formed_motions_pass_the_check(motion):
    assert check_motion(motion) is motion


def test_frames_that_are_not_finite_become_gaps(stored):
    rotations = np.tile(np.eye(3), (4, 15, 1, 1))
    rotations[1, 7, 0, 2] = np.nan
    position = np.ones((4, 3))
    position[3, 1] = np.inf
    motion = load_motion_file(stored(rotations=rotations, wrist_position=position))
    assert motion.valid.tolist() == [True, False, True, False]
    np.testing.assert_array_equal(motion.rotations[1], np.tile(np.eye(3), (15, 1, 1)))
    assert np.isfinite(motion.wrist_position).all()
