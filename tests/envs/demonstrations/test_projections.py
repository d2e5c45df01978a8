"""Sets that differ in nothing but how recordings were brought onto the twin's hinges."""

import dataclasses
from pathlib import Path
from typing import Any

import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from envs.demonstrations import dataset
from envs.demonstrations.dataset import make_set
from envs.demonstrations.load_set import PARTS, load_part
from envs.demonstrations.scripted.simulated_capture import CaptureSettings
from envs.demonstrations.set_settings import SetSettings, fingerprint, set_folder
from envs.demonstrations.twin_hands import twins
from envs.tracking import TrackingEnv
from envs.twin import twin_of
from mjx_hand.errors import InputError
from mjx_hand.hand.load import load_hand
from mjx_hand.motion.demonstration import Demonstration, load_demonstration, save_demonstration
from mjx_hand.motion.motion import Motion, load_motion_file
from mjx_hand.retarget.refine import recorded_places
from mjx_hand.rigid.rigid_hand import RigidHand, finger_tips, forward_kinematics, joint_rotations
from mjx_hand.view.browser.recording_scene import demonstration_scene
from mjx_hand.view.browser.scene import SkinLayer
from tests.envs.conftest import SETTINGS


def projected(**changes: Any) -> SetSettings:
    return dataclasses.replace(SETTINGS, capture=CaptureSettings(**changes))


@pytest.fixture(scope="module")
def functional(set_path: Path, set_root: Path) -> Path:
    return make_set(projected(axes="functional"), set_root)


def motions(folder: Path) -> list[Motion]:
    return [load_motion_file(path) for path in sorted((folder / "train").glob("*.motion.npz"))]


def rotation_error(d: Demonstration, hand: RigidHand, motion: Motion) -> float:
    """Mean angle (rad) between recorded and replayed rotations of all joints."""
    replayed = np.asarray(joint_rotations(d.motion.angles, hand), float)
    between = np.swapaxes(motion.rotations, -1, -2) @ replayed
    return float(Rotation.from_matrix(between.reshape(-1, 3, 3)).magnitude().mean())


def test_options_that_are_not_given_leave_names_of_sets_as_they_were():
    told = fingerprint(SETTINGS)["capture"]
    assert {"method", "axes", "refine"}.isdisjoint(told)
    assert told["cutoff"] == SETTINGS.capture.cutoff
    changed = fingerprint(projected(method="paper"))["capture"]
    assert changed == told | {"method": "paper"}


def test_every_projection_is_a_set_of_its_own(tmp_path):
    folders = {
        set_folder(settings, tmp_path)
        for settings in (SETTINGS, projected(method="paper"), projected(axes="functional"), projected(refine="tips"))
    }
    assert len(folders) == 4


def test_another_projection_is_of_the_same_recordings(set_path, functional, monkeypatch):
    for part in PARTS:
        assert {p.name for p in (functional / part).iterdir()} == {p.name for p in (set_path / part).iterdir()}
        for kept in (p for p in (set_path / part).iterdir() if ".truth" in p.name or ".motion" in p.name):
            assert (functional / part / kept.name).read_bytes() == kept.read_bytes()
        for first, second in zip(load_part(set_path, part), load_part(functional, part), strict=True):
            np.testing.assert_array_equal(first.object_pose, second.object_pose)
            np.testing.assert_array_equal(first.motion.wrist_position, second.motion.wrist_position)
            assert np.abs(first.motion.angles - second.motion.angles).max() > 0.01
            assert (first.hinge_axis, first.rest_rotation) == (None, None)
    assert (functional / "yield.json").read_text() == (set_path / "yield.json").read_text()


def test_functional_axes_travel_with_the_demonstration_and_follow_the_recording_better(
    demonstrations, hands, functional, tmp_path
):
    theirs = load_part(functional, "train")
    for d, hand, other, motion in zip(theirs, twins(theirs), hands, motions(functional), strict=True):
        np.testing.assert_array_equal(hand.hinge_axis, d.hinge_axis)
        np.testing.assert_array_equal(hand.rest_rotation, d.rest_rotation)
        np.testing.assert_array_equal(hand.link_offset, other.link_offset)
        assert rotation_error(d, hand, motion) < rotation_error(d, other, motion)
        save_demonstration(d, tmp_path / "again.npz")
        np.testing.assert_array_equal(load_demonstration(tmp_path / "again.npz").hinge_axis, d.hinge_axis)
    errors, usual = (
        [rotation_error(*row) for row in zip(some, twins(some), motions(functional), strict=True)]
        for some in (theirs, demonstrations)
    )
    assert np.mean(errors) < 0.9 * np.mean(usual)


def test_the_engine_turns_the_same_hinges(functional):
    theirs = load_part(functional, "train")
    hands = twins(theirs)
    env = TrackingEnv(theirs, hands, "native")
    for k, (d, hand) in enumerate(zip(theirs, hands, strict=True)):
        sensed = np.asarray(twin_of(env.start(jnp.asarray(k), jnp.asarray(0))).physics.sensordata).reshape(5, 3)
        wrist = Rotation.from_quat(d.motion.wrist_quaternion[0], scalar_first=True)
        expected = wrist.apply(np.asarray(finger_tips(d.motion.angles[0], hand))) + d.motion.wrist_position[0]
        np.testing.assert_allclose(sensed, expected, atol=1e-5)


def test_the_viewer_shows_a_demonstrations_own_hinges(functional):
    d = load_part(functional, "train")[0]
    skin = demonstration_scene(d, load_hand()).layers[0]
    assert isinstance(skin, SkinLayer)
    wrist = Rotation.from_quat(d.motion.wrist_quaternion, scalar_first=True).as_matrix()
    links, _ = forward_kinematics(d.motion.angles, twins([d])[0])
    np.testing.assert_allclose(skin.transforms[:, :, :3, :3], wrist[:, None] @ np.asarray(links), atol=1e-5)


def test_the_papers_angles_are_others_on_the_same_hinges(demonstrations, set_root):
    paper = load_part(make_set(projected(method="paper"), set_root), "train")
    for d, usual in zip(paper, demonstrations, strict=True):
        assert d.hinge_axis is None
        assert np.abs(d.motion.angles - usual.motion.angles).max() > 0.01


def test_refined_angles_bring_finger_tips_nearer(demonstrations, hands, set_path, set_root):
    refined = load_part(make_set(projected(refine="tips"), set_root), "train")

    def off(d: Demonstration, hand: RigidHand, motion: Motion) -> float:

        wanted = np.asarray(recorded_places(motion.rotations, hand))[:, :, 2]
        return float(np.linalg.norm(np.asarray(finger_tips(d.motion.angles, hand)) - wanted, axis=-1).mean())

    for d, usual, hand, motion in zip(refined, demonstrations, hands, motions(set_path), strict=True):
        assert off(d, hand, motion) < 0.5 * off(usual, hand, motion)


def test_a_projection_that_was_interrupted_leaves_nothing(set_path, set_root, monkeypatch):
    def broken(*args: object) -> None:
        raise KeyboardInterrupt

    before = sorted(set_root.iterdir())
    with monkeypatch.context() as patched:
        patched.setattr(dataset, "project_recording", broken)
        with pytest.raises(KeyboardInterrupt):
            make_set(projected(method="naive"), set_root)
    assert sorted(set_root.iterdir()) == before


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"method": "best"}, "method 'best' is unknown"),
        ({"axes": "skewed"}, "axes is 'skewed'; valid: anatomical, functional"),
        ({"refine": "palm"}, "refine is 'palm'"),
    ],
)
def test_unknown_names_are_refused(changes, said):
    with pytest.raises(InputError, match=said):
        CaptureSettings(**changes)
