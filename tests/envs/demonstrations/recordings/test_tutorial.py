"""The commands of the tutorial from files to a policy, on files that a simulated camera and tracker wrote."""

import re
import shlex
from pathlib import Path

import numpy as np
import pytest
import trimesh

from envs.demonstrations.__main__ import main as demonstrations
from envs.demonstrations.load_set import load_part
from envs.demonstrations.observation.handling import hand_points
from mjx_hand.capture.keypoints.recording import KeypointRecording, save_keypoints
from mjx_hand.cli.main import main
from mjx_hand.motion.motion import load_motion_file
from mjx_hand.retarget.hands import KinematicHands
from train.settings.config import compose

PAGE = Path(__file__).resolve().parents[4] / "docs/tutorials/recordings.md"
COMMANDS = [shlex.split(line) for line in re.findall(r"^    (mjx-hand .*)$", PAGE.read_text(), flags=re.MULTILINE)]


@pytest.fixture(scope="module")
def files(set_path, tmp_path_factory) -> Path:
    """A camera's keypoints, a mesh and a table of poses of one capture of the pinch set."""
    folder = tmp_path_factory.mktemp("own")
    motion = load_motion_file(set_path / "train" / "000.motion.npz")
    demonstration = load_part(set_path, "train")[0]
    points = hand_points(motion, KinematicHands().of(motion))[:, :21]
    save_keypoints(KeypointRecording(fps=motion.fps, positions=points, side="right"), folder / "hand.npz")
    trimesh.creation.box(2 * demonstration.object.size).export(folder / "cube.stl")
    times = np.arange(motion.num_frames) / motion.fps
    rows = np.concatenate([times[:, None], demonstration.object_pose], axis=1)
    np.savetxt(folder / "poses.csv", rows, delimiter=",", header="time,x,y,z,qw,qx,qy,qz", comments="")
    return folder


@pytest.mark.slow
def test_the_tutorials_commands_lead_from_files_to_demonstrations(files, monkeypatch, capsys):
    monkeypatch.chdir(files)
    for command, *arguments in (line[1:] for line in COMMANDS):
        if command in ("info", "scene"):
            assert main([command, *arguments]) == 0
        elif command == "demonstrations":
            demonstrations(arguments)
        else:
            assert command in ("train", "evaluate", "play")
            assert compose(arguments).data.recording.path == "scene.npz"
    said = capsys.readouterr().out
    assert "cube" in said
    assert "pages:" in said
    (made,) = (files / "outputs/demonstrations").iterdir()
    assert len(load_part(made, "train")) == 8
    assert [page.name for page in (made / "pages").iterdir()] == ["000-scene.html"]
