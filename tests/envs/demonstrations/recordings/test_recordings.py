"""Which recordings a path stands for, how they are divided, and whole roads to a demonstration."""

import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest

from envs.demonstrations.dataset import make_set
from envs.demonstrations.load_set import PARTS, load_part
from envs.demonstrations.observation.scene_in_world import FOUND, handled_object
from envs.demonstrations.recordings.recorded_set import PLAIN
from envs.demonstrations.recordings.recording_files import recording_digest, recordings_of
from envs.demonstrations.recordings.recording_page import RECORDINGS
from envs.demonstrations.recordings.recording_settings import RecordingSettings
from envs.demonstrations.recordings.variations import divided, held_out, vary
from envs.demonstrations.set_settings import SetSettings, set_folder
from mjx_hand.capture.load_scene import load_scene
from mjx_hand.errors import InputError
from mjx_hand.motion.demonstration import Demonstration
from mjx_hand.motion.joint_motion import JointMotion
from mjx_hand.motion.make_scene import make_scene, recorded_object
from mjx_hand.motion.motion import load_motion_file
from mjx_hand.motion.scene_file import save_scene
from mjx_hand.objects.description import ObjectDescription
from mjx_hand.retarget.hands import KinematicHands
from tests.envs.demonstrations.observation.acts import BOX, FACES, HALF

FOLDER = Path(__file__).resolve().parents[5] / "shared/data/dexmv_mustard"


def reach(frames: int = 150) -> Demonstration:
    wrist = np.stack([np.linspace(-0.3, -0.1, frames), np.zeros(frames), np.full(frames, 0.1)], axis=1)
    wrist[frames // 2 :] = wrist[frames // 2]
    return Demonstration(
        motion=JointMotion(
            fps=50.0,
            angles=np.zeros((frames, 20)),
            wrist_position=wrist,
            wrist_quaternion=np.tile([1.0, 0, 0, 0], (frames, 1)),
            valid=np.ones(frames, bool),
        ),
        object_pose=np.tile([0.0, 0, 0.05, 1, 0, 0, 0], (frames, 1)),
        object=ObjectDescription(kind="box", size=np.array([0.03, 0.03, 0.05]), mass=0.6, friction=0.8),
        support=np.zeros((0, 3)),
        support_position=np.zeros((0, 3)),
        shape=np.zeros(10),
        grasp="recorded",
    )


def test_variations_draw_what_is_said_and_no_more():
    settings, rng = RecordingSettings(path="x", masses=(0.3, 0.65)), np.random.default_rng(0)
    made = [vary(reach(), settings, rng) for _ in range(24)]
    masses, frictions = [d.object.mass for d in made], [d.object.friction for d in made]
    assert 0.3 <= min(masses) < 0.4 < 0.55 < max(masses) <= 0.65
    assert 0.7 <= min(frictions) < max(frictions) <= 1.0
    lengths = [d.num_frames for d in made]
    assert 149 / 1.1 - 1 <= min(lengths) < 145 < 155 < max(lengths) <= 149 / 0.9 + 2
    for d in made:
        assert d.motion.angles.shape[0] == d.object_pose.shape[0] == len(d.motion.valid)
        np.testing.assert_allclose(np.linalg.norm(d.motion.wrist_quaternion, axis=1), 1, atol=1e-9)
    spread = np.concatenate([d.motion.angles for d in made]).std()
    assert 0.5 * settings.angle_error < spread < 1.5 * settings.angle_error
    quiet = dataclasses.replace(settings, wrist_error=0.0, angle_error=0.0, start_error=0.0, speeds=(1.0, 1.0))
    same = vary(reach(), quiet, rng)
    np.testing.assert_allclose(same.motion.wrist_position, reach().motion.wrist_position, atol=1e-9)
    np.testing.assert_allclose(same.object_pose, reach().object_pose, atol=1e-9)
    drawn = [vary(reach(), RecordingSettings(path="x"), rng).object.mass for _ in range(24)]
    assert 0.6 / 1.25 <= min(drawn) < 0.55 < 0.65 < max(drawn) <= 0.6 * 1.25


def test_recordings_are_held_out_whole_or_by_variation():
    recordings = [reach(100 + 10 * k) for k in range(5)]
    rng, settings = np.random.default_rng(0), RecordingSettings(path="x", train=9, heldout=7)
    both = [divided(recordings, settings, heldout, rng) for heldout in (False, True)]
    assert [len(part) for part in both] == [9, 7]
    assert all(d is one for d, one in zip(both[1][:5], recordings, strict=True))
    assert not any(d is one for d in both[0] for one in recordings)
    apart = dataclasses.replace(settings, hold_out="recording")
    assert held_out(5, apart) == [False, False, False, True, False]
    assert held_out(2, apart) == [False, True]
    (first, *others) = divided(recordings, apart, True, rng)
    assert first is recordings[3]
    assert len(others) == 6
    with pytest.raises(InputError, match="one recording cannot be held out"):
        held_out(1, apart)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"masses": (0.5, 0.3)}, r"data\.recording\.masses"),
        ({"up": "z"}, r"up is 'z'"),
        ({"side": "both"}, r"data\.recording\.side is 'both'"),
        ({"hold_out": "none"}, r"data\.recording\.hold_out is 'none'; valid: variation, recording"),
        ({"mass": 0.3, "density": 200.0}, "give one of them"),
        ({"density": -1.0}, r"data\.recording\.density is -1"),
    ],
)
def test_settings_that_cannot_be_are_refused(given, words):
    with pytest.raises(InputError, match=words) as caught:
        RecordingSettings(path="x", **given)
    assert "\n" not in str(caught.value)


def scene_of(set_path: Path, number: int):
    """A simulated capture of the pinch set as a scene file: its fitted motion, its object's poses, a cube's mesh."""
    motion = load_motion_file(set_path / "train" / f"{number:03d}.motion.npz")
    d = load_part(set_path, "train")[number]
    half = d.object.size
    cube = recorded_object("cube", d.object_pose, mesh=(BOX / HALF * half, FACES))
    return make_scene(motion, cube, up="+z", source=f"cube {number}")


@pytest.fixture(scope="module")
def folder(set_path, tmp_path_factory) -> Path:
    """Two captures, one hand without an object, and what is no recording."""
    made = tmp_path_factory.mktemp("recordings")
    (made / "deeper").mkdir()
    save_scene(scene_of(set_path, 0), made / "a.npz")
    save_scene(scene_of(set_path, 1), made / "deeper" / "b.json")
    bare = scene_of(set_path, 0)
    save_scene(make_scene(bare.hands), made / "c.npz")
    (made / "README.md").write_text("what these are")
    return made


def test_a_folder_stands_for_all_recordings_below_it(folder, tmp_path):
    assert [path.name for path in recordings_of(folder)] == ["a.npz", "c.npz", "b.json"]
    assert recordings_of(folder / "a.npz") == [folder / "a.npz"]
    with pytest.raises(InputError, match="no such file or folder"):
        recordings_of(tmp_path / "none")
    with pytest.raises(InputError, match="no recording with objects is there"):
        recordings_of(tmp_path)
    before = recording_digest(folder)
    (folder / "a.npz").rename(folder / "z.npz")
    assert recording_digest(folder) != before
    (folder / "z.npz").rename(folder / "a.npz")
    assert recording_digest(folder) == before
    with pytest.raises(InputError, match=r"data\.recording\.path=PATH"):
        set_folder(SetSettings("recorded", recording=RecordingSettings(path=str(tmp_path / "none"))), tmp_path)
    with pytest.raises(InputError, match=r"give both, data\.grasp=recorded"):
        SetSettings("recorded")


@pytest.mark.slow
def test_a_folder_of_captures_becomes_a_set_with_a_page_each(folder, set_path, tmp_path):
    settings = SetSettings("recorded", recording=RecordingSettings(path=str(folder), train=4, heldout=3, mass=0.2))
    made = make_set(settings, tmp_path)
    parts = {part: load_part(made, part) for part in PARTS}
    assert [len(parts[part]) for part in PARTS] == [4, 3]
    told = json.loads((made / RECORDINGS).read_text())
    assert [row["name"] for row in told["recordings"]] == ["a", "b"]
    (refused,) = told["refused"]
    assert refused["name"] == "c"
    assert "a hand without an object" in refused["why"]
    for row, d, number in zip(told["recordings"], parts["heldout"], (0, 1), strict=False):
        truth = load_part(set_path, "train")[number]
        assert row["depth"] <= 0.002
        assert row["gap"] < 0.001
        assert {"thumb", "index", "middle"} >= set(row["touching"]) >= {"thumb", "index"}
        assert row["hand_moved"] < 0.006
        assert row["road"] == PLAIN
        assert (made / row["page"]).stat().st_size > 5000
        assert d.object.mass == 0.2
        rise = d.object_pose[:, 2] - d.object_pose[0, 2]
        assert rise.max() == pytest.approx(np.ptp(truth.object_pose[:, 2]), abs=0.004)
        assert d.object_pose[0, 2] == pytest.approx(truth.object.size[2], abs=1e-3)
    assert len({d.object.hulls.shape for part in PARTS for d in parts[part]}) == 1


def test_the_real_bottle_goes_the_general_road():
    if not FOLDER.is_dir():
        pytest.skip(f"{FOLDER} is absent: the recording is not part of the project")
    (path,) = recordings_of(FOLDER)
    handled = handled_object(load_scene(path), str(path), KinematicHands())
    assert handled.up == FOUND
    assert 64 <= handled.act.begin + int(np.argmax(handled.act.labels)) <= 76  # lifted from frame 72 on
    still = handled.path.rotation[:60, 2, 2]
    assert np.median(still) > np.cos(np.deg2rad(6))
    height = handled.path.position[:, 2] + handled.solid.lowest(handled.path.rotation, np.eye(3)[2])
    height -= np.median(height[:60])
    assert height.min() > -0.02
    assert 0.1 < height.max() < 0.2
