"""Folders of recordings: alike to one by one, resumed after kills, changed input and settings seen, bad files told."""

import csv
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mjx_hand.errors import InputError
from mjx_hand.motion import Motion, load_joint_motion, save_motion
from mjx_hand.pytree import replace
from mjx_hand.retarget.dataset import SUMMARY, retarget_dataset
from mjx_hand.retarget.hands import KinematicHands
from mjx_hand.retarget.ledger import NAME, Ledger, key_of
from mjx_hand.retarget.options import RetargetOptions
from mjx_hand.retarget.sequence import retarget_many

PLAIN = RetargetOptions()


def made(frames: int, seed: int) -> Motion:
    rng = np.random.default_rng(seed)
    turn = np.array([0.0, 0.0, 0.3]) + 0.4 * np.sin(np.cumsum(0.05 * rng.normal(size=(frames, 15, 3)), axis=0))
    valid = rng.random(frames) > 0.1
    valid[0] = True
    rotations = Rotation.from_rotvec(turn.reshape(-1, 3)).as_matrix().reshape(frames, 15, 3, 3)
    rotations[~valid] = np.eye(3)
    return Motion(
        fps=60.0,
        rotations=rotations,
        wrist_position=np.zeros((frames, 3)),
        wrist_quaternion=np.tile([1.0, 0, 0, 0], (frames, 1)),
        shape=np.full(10, 0.2 * (seed % 5)),
        valid=valid,
        source=f"made {seed}",
    )


@pytest.fixture
def folder(tmp_path) -> Path:
    for k, (name, frames) in enumerate((("a.npz", 30), ("deep/b.npz", 200), ("deep/er/c.npz", 9000), ("d.npz", 1))):
        save_motion(made(frames, k), tmp_path / "in" / name)
    return tmp_path / "in"


def rows_of(out: Path) -> dict[str, dict[str, str]]:
    with (out / SUMMARY).open(newline="") as file:
        return {row["file"]: row for row in csv.DictReader(file)}


def stamps(out: Path) -> dict[str, int]:
    return {str(p.relative_to(out)): p.stat().st_mtime_ns for p in out.rglob("*.npz")}


def test_files_are_as_one_by_one_and_the_tree_is_the_same(folder, tmp_path):
    told: list[int] = []
    out = tmp_path / "out"
    rows = retarget_dataset(folder, out, PLAIN, began=told.append, advance=told.append)
    assert [row.file for row in rows] == ["a.npz", "d.npz", "deep/b.npz", "deep/er/c.npz"]
    assert {row.status for row in rows} == {"done"}
    assert told[0] == sum(told[1:]) == sum(p.stat().st_size for p in folder.rglob("*.npz"))
    hands = KinematicHands()
    for k, (name, frames) in enumerate((("a.npz", 30), ("deep/b.npz", 200), ("deep/er/c.npz", 9000), ("d.npz", 1))):
        motion = made(frames, k)
        (alone,) = retarget_many([motion], [hands.of(motion)], PLAIN)
        found = load_joint_motion(out / name)
        np.testing.assert_allclose(found.angles, alone.angles, atol=1e-5)
        np.testing.assert_array_equal(found.valid, motion.valid)
        row = rows_of(out)[name]
        assert (int(row["frames"]), int(row["gaps"])) == (frames, int((~motion.valid).sum()))
        assert 0 < float(row["tip_mean_mm"]) <= float(row["tip_95_mm"]) <= float(row["tip_max_mm"])


def test_what_is_done_is_not_done_again_and_what_changed_is(folder, tmp_path):
    out = tmp_path / "out"
    first = retarget_dataset(folder, out, PLAIN)
    before = stamps(out)
    assert retarget_dataset(folder, out, PLAIN) == first
    assert stamps(out) == before

    save_motion(made(31, 9), folder / "a.npz")  # another input
    (out / "d.npz").write_bytes(b"spoilt")  # an output that is not the one that was written
    (out / "deep" / "b.npz").unlink()
    again = retarget_dataset(folder, out, PLAIN)
    after = stamps(out)
    assert {name for name in after if after[name] != before[name]} == {"a.npz", "d.npz", "deep/b.npz"}
    assert again[0].frames == 31
    assert load_joint_motion(out / "d.npz").num_frames == 1

    retarget_dataset(folder, out, RetargetOptions(limits=True))  # other settings
    last = stamps(out)
    assert all(last[name] != after[name] for name in after)


def test_bad_files_are_told_and_their_old_outputs_go(folder, tmp_path):
    out = tmp_path / "out"
    retarget_dataset(folder, out, PLAIN)
    (folder / "a.npz").write_bytes(b"no archive")
    np.savez(folder / "other.npz", stuff=np.zeros(3))
    bad = made(20, 3)
    save_motion(replace(bad, rotations=1.1 * bad.rotations), folder / "scaled.npz")
    rows = {row.file: row for row in retarget_dataset(folder, out, PLAIN)}
    assert {name for name, row in rows.items() if row.status == "failed"} == {"a.npz", "other.npz", "scaled.npz"}
    assert not (out / "a.npz").exists()
    assert "not a readable .npz" in rows["a.npz"].message
    assert "not rotations" in rows["scaled.npz"].message
    assert all("\n" not in row.message for row in rows.values())
    assert rows_of(out)["a.npz"]["tip_mean_mm"] == ""
    assert not list(out.rglob(".*-????????.npz"))


def test_a_torn_line_costs_its_file_only(folder, tmp_path):
    out = tmp_path / "out"
    retarget_dataset(folder, out, PLAIN)
    before = stamps(out)
    lines = (out / NAME).read_text().splitlines(keepends=True)
    torn = json.loads(lines[-1])["row"]["file"]
    (out / NAME).write_text("".join(lines[:-1]) + lines[-1][: len(lines[-1]) // 2])
    (out / f".{Path(torn).stem}-abcdefgh.npz").write_bytes(b"half a file")  # beside no output of this name: stays
    (out / torn).with_name(f".{Path(torn).stem}-abc_efg1.npz").write_bytes(b"half a file")
    retarget_dataset(folder, out, PLAIN)
    after = stamps(out)
    assert {name for name in before if after[name] != before[name]} == {torn}
    assert not (out / torn).with_name(f".{Path(torn).stem}-abc_efg1.npz").exists()
    assert all(json.loads(line) for line in (out / NAME).read_text().splitlines())


def test_names_that_would_meet_and_folders_that_cannot_be_used_are_refused(folder, tmp_path):
    with pytest.raises(InputError, match="are in one folder"):
        retarget_dataset(folder, folder, PLAIN)
    with pytest.raises(InputError, match="nothing in it matches"):
        retarget_dataset(folder, tmp_path / "out", PLAIN, pattern="*.c3d")
    with pytest.raises(InputError, match="axes is 'best'"):
        retarget_dataset(folder, tmp_path / "out", PLAIN, axes="best")
    with pytest.raises(InputError, match=r"gone\.pkl: no such file"):
        retarget_dataset(folder, tmp_path / "out", PLAIN, mano=tmp_path / "gone.pkl")
    (folder / "a").write_bytes((folder / "a.npz").read_bytes())
    with pytest.raises(InputError, match="would have one output"):
        retarget_dataset(folder, tmp_path / "out", PLAIN, pattern="a*")
    (tmp_path / "file").touch()
    with pytest.raises(InputError, match="cannot write"):
        retarget_dataset(folder, tmp_path / "file" / "out", PLAIN)


def test_capitals_and_linked_folders_are_recordings_too(folder, tmp_path):
    (folder / "a.npz").rename(folder / "A.NPZ")
    (folder / "deep").rename(tmp_path / "disk")
    (folder / "deep").symlink_to(tmp_path / "disk")
    (tmp_path / "disk" / "round").symlink_to(folder)  # and in a circle
    (tmp_path / "disk" / "er" / "c.npz").unlink()
    rows = retarget_dataset(folder, tmp_path / "out", PLAIN)
    assert [(row.file, row.status) for row in rows] == [("A.NPZ", "done"), ("d.npz", "done"), ("deep/b.npz", "done")]
    assert sorted(stamps(tmp_path / "out")) == ["A.npz", "d.npz", "deep/b.npz"]
    (folder / "a.npz").write_bytes((folder / "d.npz").read_bytes())
    retarget_dataset(folder, tmp_path / "out", PLAIN)  # A and a are two names
    (folder / "A.npz").write_bytes((folder / "d.npz").read_bytes())
    with pytest.raises(InputError, match="would have one output"):
        retarget_dataset(folder, tmp_path / "out", PLAIN)


def test_outputs_inside_the_folder_are_not_taken_for_recordings(folder):
    first = retarget_dataset(folder, folder / "angles", PLAIN)
    assert len(first) == 4
    assert retarget_dataset(folder, folder / "angles", PLAIN) == first


def test_the_key_tells_folders_files_and_settings_apart(folder):
    assert key_of(folder, {}) != key_of(folder / "a.npz", {})
    assert key_of(folder / "a.npz", {"carry": True}) != key_of(folder / "a.npz", {"carry": False})
    whole = key_of(folder, {})
    os.utime(folder / "deep" / "b.npz", ns=(1, 1))
    assert key_of(folder, {}) != whole


def test_a_ledger_of_something_else_is_overlooked(tmp_path):
    row = {"file": "a.npz", "status": "done", "frames": 3}
    sound = {"row": row, "key": "k", "output": [1, 2]}
    deep: Any = []
    for _ in range(600):
        deep = [deep]
    others = ({"row": row | {"frames": deep}}, {"key": deep}, {"output": deep}, {"output": None})
    lines = [json.dumps(sound | other) for other in others]
    (tmp_path / NAME).write_text("\n".join(["[]", '{"row": 3}', "not json", *lines, ""]))
    assert not Ledger(tmp_path).knows("a.npz")
    (tmp_path / NAME).write_text(json.dumps(sound | {"more": deep}) + "\n")
    assert Ledger(tmp_path).knows("a.npz")
    assert json.loads((tmp_path / NAME).read_text())["key"] == "k"


RUN = """
import sys
from pathlib import Path
from mjx_hand.compile_cache import enable_compile_cache
from mjx_hand.retarget.dataset import retarget_dataset
from mjx_hand.retarget.options import RetargetOptions
enable_compile_cache()
retarget_dataset(Path(sys.argv[1]), Path(sys.argv[2]), RetargetOptions())
print("finished")
"""


@pytest.mark.slow
def test_killed_again_and_again_it_finishes_with_the_same_files(tmp_path):
    """Real kills (SIGKILL) while outputs appear; then one run to the end, equal to a run that was never stopped."""
    count = 20
    for k in range(count):
        save_motion(made(3000, k), tmp_path / "in" / f"{k:02d}.npz")
    out, command = tmp_path / "out", [sys.executable, "-c", RUN, str(tmp_path / "in"), str(tmp_path / "out")]
    done_before: dict[str, int] = {}
    for goal in (3, 8):
        process = subprocess.Popen(command, stdout=subprocess.PIPE)
        for _ in range(6000):
            if process.poll() is not None or len(list(out.glob("[0-9]*.npz"))) >= goal:
                break
            time.sleep(0.01)
        process.send_signal(signal.SIGKILL)
        process.communicate()
        for path in out.glob("[0-9]*.npz"):
            assert load_joint_motion(path).num_frames == 3000  # what has a name is whole
        whole_lines = [line for line in (out / NAME).read_text().splitlines(keepends=True) if line.endswith("\n")]
        noted = {json.loads(line)["row"]["file"] for line in whole_lines}
        now = stamps(out)
        assert all(now[name] == done_before[name] for name in done_before)  # nothing was done twice
        done_before = {name: now[name] for name in noted}
    assert 0 < len(done_before) < count
    finished = subprocess.run(command, capture_output=True, text=True, check=True)
    assert "finished" in finished.stdout
    now = stamps(out)
    assert all(now[name] == done_before[name] for name in done_before)
    assert sorted(p.name for p in out.iterdir()) == sorted([f"{k:02d}.npz" for k in range(count)] + [NAME, SUMMARY])
    retarget_dataset(tmp_path / "in", tmp_path / "whole", PLAIN)
    assert rows_of(out) == rows_of(tmp_path / "whole")
    for k in (0, 13, 19):
        one, other = (load_joint_motion(tmp_path / where / f"{k:02d}.npz") for where in ("out", "whole"))
        np.testing.assert_allclose(one.angles, other.angles, atol=1e-5)


def test_all_devices_share_the_frames(tmp_path):
    """On three devices, which do not divide a chunk evenly, the angles are those of one."""
    save_motion(made(500, 1), tmp_path / "in" / "a.npz")
    where = [str(tmp_path / "in"), str(tmp_path / "out")]
    program = f"{RUN}\nimport jax\nprint(len(jax.local_devices()), 'devices')"
    environment = os.environ | {"XLA_FLAGS": f"{os.environ['XLA_FLAGS']} --xla_force_host_platform_device_count=3"}
    run = subprocess.run([sys.executable, "-c", program, *where], capture_output=True, text=True, env=environment)
    assert "3 devices" in run.stdout, run.stderr
    motion = made(500, 1)
    (alone,) = retarget_many([motion], [KinematicHands().of(motion)], PLAIN)
    np.testing.assert_allclose(load_joint_motion(tmp_path / "out" / "a.npz").angles, alone.angles, atol=1e-5)
