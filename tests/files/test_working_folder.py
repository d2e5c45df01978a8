"""Folders that a killed process was making are cleared away, those of processes at work are not."""

import signal
import subprocess
import sys
from pathlib import Path

from mjx_hand.files.npz_archive import remove_leftovers
from mjx_hand.files.working_folder import remove_abandoned, working_folder

MAKE = """
import sys, time
from pathlib import Path
from mjx_hand.files.working_folder import working_folder
with working_folder(Path(sys.argv[1])) as folder:
    (folder / "half").touch()
    print("made", flush=True)
    time.sleep(60)
"""


def test_what_a_kill_leaves_goes_and_what_is_at_work_stays(tmp_path: Path):
    final = tmp_path / "set-1"
    with subprocess.Popen([sys.executable, "-c", MAKE, str(final)], stdout=subprocess.PIPE, text=True) as other:
        assert other.stdout is not None
        assert other.stdout.readline() == "made\n"
        with working_folder(final) as mine:
            remove_abandoned(final)
            assert mine.is_dir()
            assert len(list(tmp_path.iterdir())) == 2
            other.send_signal(signal.SIGKILL)
            other.wait()
            remove_abandoned(final)
            assert list(tmp_path.iterdir()) == [mine]
            (mine / "whole").touch()
            mine.rename(final)
    assert [path.name for path in final.iterdir()] == ["whole"]


def test_a_failure_leaves_nothing(tmp_path: Path):
    (tmp_path / ".other-abcdefgh").mkdir()
    try:
        with working_folder(tmp_path / "set") as mine:
            (mine / "half").touch()
            raise KeyError
    except KeyError:
        pass
    assert [path.name for path in tmp_path.iterdir()] == [".other-abcdefgh"]


def test_leftovers_of_files_are_known_by_their_names(tmp_path: Path):
    for name in (".best-abc_1234.npz", ".best-abcdefg.npz", ".best.npz", ".mine-abcdefgh.npz", "best-abcdefgh.npz"):
        (tmp_path / name).touch()
    remove_leftovers(tmp_path, ("best.npz",))
    assert sorted(p.name for p in tmp_path.iterdir()) == [
        ".best-abcdefg.npz",
        ".best.npz",
        ".mine-abcdefgh.npz",
        "best-abcdefgh.npz",
    ]
    remove_leftovers(tmp_path)
    assert not (tmp_path / ".mine-abcdefgh.npz").exists()
