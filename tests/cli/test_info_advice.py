"""What `mjx-hand info` advises runs, and it reads what the other commands read."""

import json
import shlex
from pathlib import Path

import numpy as np
import pytest

import mjx_hand
from mjx_hand.capture.keypoints.layouts import KEYPOINTS
from mjx_hand.cli.main import main
from tests.capture.keypoints.grips import FPS, grip, keypoints_of

HAND = keypoints_of(grip())[:20]
OTHER = keypoints_of(grip("left"))[:20]
LFS = "version https://git-lfs.github.com/spec/v1\noid sha256:" + "0" * 64 + "\nsize 1689467\n"


def info(capsys, path: Path, *options: str, status: int = 0) -> str:
    assert main(["info", str(path), *options]) == status
    said = capsys.readouterr()
    return said.out if status == 0 else said.err


def advice(text: str) -> list[list[str]]:
    return [shlex.split(line.removeprefix("next: ")) for line in text.splitlines() if line.startswith("next: ")]


def without_tips(points: np.ndarray) -> list[dict]:
    """Frames by name without the finger tips."""
    return [{n: None if n.endswith("tip") else p.tolist() for n, p in zip(KEYPOINTS, at, strict=True)} for at in points]


def test_what_is_advised_for_keypoints_runs(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    straight = json.dumps([[[4000 * k, 0, 0] for k in range(21)]] * 4)
    np.savez(tmp_path / "no rate.npz", joints=HAND, side="right")
    np.savez(tmp_path / "both.npz", right=HAND, left=OTHER, fps=FPS)
    np.savez(tmp_path / "millimetres.npz", joints=1000 * HAND, fps=FPS)
    np.savez(tmp_path / "wrong_side.npz", joints=HAND, fps=FPS, side="left")
    (tmp_path / "no_tips.json").write_text(json.dumps({"fps": 30, "side": "right", "frames": without_tips(HAND)}))
    (tmp_path / "no_hand.json").write_text(straight)
    runs = {
        "no rate.npz": 1,
        "both.npz": 2,
        "millimetres.npz": 1,
        "wrong_side.npz": 1,
        "no_tips.json": 0,
        "no_hand.json": 0,
    }
    for name, count in runs.items():
        text = info(capsys, Path(name))
        commands = [words[1:] for words in advice(text) if words[1] == "keypoints"]
        assert len(commands) == count, text
        assert ("to read" in text) == (name not in ("no rate.npz",))
        for words in commands:
            assert main(words) == 0
            capsys.readouterr()
    assert "--unit mm" in info(capsys, Path("millimetres.npz"))
    assert "thumb_tip, index_tip, middle_tip, ring_tip, little_tip never seen" in info(capsys, Path("no_tips.json"))


def test_next_names_our_own_commands(tmp_path, capsys):
    (tmp_path / "arm.urdf").write_text("<robot name='arm'><link name='a'/></robot>")
    (words,) = advice(info(capsys, tmp_path / "arm.urdf"))
    assert words[:2] == ["mjx-hand", "robot"]
    assert str(tmp_path / "arm.urdf") in words
    (tmp_path / "hand.xml").write_text("<mujoco model='h'/>")
    assert not advice(info(capsys, tmp_path / "hand.xml"))


def test_yaml_of_robots_and_marker_sets(tmp_path, capsys):
    root = Path(mjx_hand.__file__).parent
    assert "description of a robot hand" in info(capsys, root / "robots" / "descriptions" / "allegro.yaml")
    assert "13: hand_top" in info(capsys, root / "capture" / "markers" / "glove13.yaml")


def test_a_folder_of_recordings(tmp_path, capsys):
    (tmp_path / "in").mkdir()
    for k in range(2):
        np.savez(tmp_path / "in" / f"{k}.npz", joints=HAND, fps=FPS)
    (words,) = advice(info(capsys, tmp_path))
    assert words == ["mjx-hand", "retarget", str(tmp_path), "--out", "angles"]
    (tmp_path / "in" / "0.npz").rename(tmp_path / "a.txt")
    (tmp_path / "in" / "1.npz").unlink()
    (tmp_path / "in" / "b.json").write_text(json.dumps({"fps": 30, "frames": HAND.tolist()}))
    assert advice(info(capsys, tmp_path))[0][-2:] == ["--pattern", "*.json"]


def test_archives_of_objects_and_tables_in_windows_code_page(tmp_path, capsys):
    hand = np.array({"params": {"global_orient": np.zeros((3, 3)), "fullpose": np.zeros((3, 45)),
                                "transl": np.zeros((3, 3))}, "vtemp": "none.ply"}, dtype=object)  # fmt: skip
    np.savez(tmp_path / "grab.npz", framerate=120.0, rhand=hand)
    assert "GRAB" in info(capsys, tmp_path / "grab.npz")
    rows = "\n".join("1.0,2.0,3.0" for _ in range(4))
    text = f"# units: mm\n# rate: 100\nMüller:a_x,Müller:a_y,Müller:a_z\n{rows}\n"
    (tmp_path / "in.csv").write_bytes(text.encode("cp1252"))
    assert "Müller:a" in info(capsys, tmp_path / "in.csv")


@pytest.mark.parametrize("suffix", ["npz", "npy", "pkl", "json", "csv", "c3d", "trc", "tsv", "urdf", "yaml", "mp4"])
def test_git_lfs_pointers_are_told(tmp_path, capsys, suffix):
    path = tmp_path / f"in.{suffix}"
    path.write_text(LFS)
    out = tmp_path / "out.npz"
    said = [info(capsys, path, status=2)]
    readers = {
        "keypoints": [path, "--out", out],
        "retarget": [path, "--out", out],
        "fit": [path, "--markers", "hand22", "--out", out],
    }
    for command, words in readers.items():
        if command == "fit" and suffix not in ("c3d", "trc", "tsv", "csv", "npz"):
            continue
        assert main([command, *map(str, words)]) == 2
        said.append(capsys.readouterr().err)
    for each in said:
        assert "a Git LFS pointer" in each
        assert each.count("\n") == 1
    assert not out.exists()


def test_hot3d_is_named(recordings, capsys):
    folder = recordings / "hot3d_sample"
    text = info(capsys, folder / "mano_hand_pose_trajectory.jsonl", status=2)
    assert "HOT3D's hand poses, which are read from its folder" in text
    assert "timestamp_ns" in text
    assert "15 objects" in text
    assert "hand_model" in info(capsys, folder / "umetrack_hand_user_profile.json", status=2)
    for path in (folder, folder / "umetrack_hand_pose_trajectory.jsonl"):
        text = info(capsys, path)
        assert "object mouse" in text
        assert f"next: mjx-hand scene {path} --out scene.npz" in text


def test_the_command_line_names_its_options(tmp_path, capsys):
    np.savez(tmp_path / "both.npz", right=HAND, left=OTHER, fps=FPS)
    assert main(["keypoints", str(tmp_path / "both.npz"), "--out", str(tmp_path / "out.npz")]) == 2
    assert "choose with --side or --sequence" in capsys.readouterr().err
    np.savez(tmp_path / "big.npz", joints=1000 * HAND, fps=FPS, side="right")
    assert main(["keypoints", str(tmp_path / "big.npz"), "--out", str(tmp_path / "out.npz")]) == 2
    assert "say --unit mm" in capsys.readouterr().err


@pytest.mark.parametrize("frames", [1, 2, 3])
def test_short_recordings_print_no_nan(tmp_path, capsys, frames):
    np.savez(tmp_path / "in.npz", joints=HAND[:frames], fps=FPS, side="right")
    assert main(["keypoints", str(tmp_path / "in.npz"), "--out", str(tmp_path / "out.npz")]) == 0
    assert "nan" not in capsys.readouterr().out
