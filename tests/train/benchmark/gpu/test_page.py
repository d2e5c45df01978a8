import json

import numpy as np
import pytest
from PIL import Image

from mjx_hand.errors import InputError
from mjx_hand.view.figures import plots
from train.benchmark.gpu.page import Pages, markdown, shown, text
from train.benchmark.gpu.record import Record, Table


@pytest.fixture
def records():
    done = Record("physics", "Physics of warp", "done", seconds=12.4, notes=["Worlds follow a script."])
    table = done.table("grasp", "worlds", "physics steps/s", "in use, MiB")
    table.add("pinch", 8192, 2_345_678.9, None)
    table.add("pinch", 512, 0.01234, None)
    done.figures["physics-warp"] = plots.throughput({"pinch": {"warp": np.array([[1.0, 2, 1, 3]])}}, label="steps/s")
    cut = Record("learn", "Until pinch is learned", "cut short", left_out=["512 worlds", "more steps"], notes=["n"])
    skipped = Record("peer", "A peer's scene", "skipped", "needs about 45 s, 3 s were left")
    return [done, cut, skipped, Record("long", "On")]


def test_the_page_tells_how_each_stage_ended_and_has_its_figures(records):
    lines = text(records)
    assert "| physics | Physics of warp | 12 | done |" in lines
    assert "| peer | A peer's scene | – | skipped: needs about 45 s, 3 s were left |" in lines
    assert "| long | On | – | not reached |" in lines
    assert "| pinch | 8,192 | 2,345,679 | – |" in lines
    assert "| pinch | 512 | 0.0123 | – |" in lines
    assert "|---|---:|---:|---|" in lines
    assert "- Left out for want of time: 512 worlds, more steps." in lines
    assert "![physics-warp](physics-warp.png)" in lines
    assert "*cut short*" in lines
    assert "### A peer's scene" not in lines  # it has nothing to show


def test_files_hold_the_same_as_the_page_and_numbers_in_full(records, tmp_path):
    pages = Pages(tmp_path, {"minutes": 9})
    pages(records, ("peer", "Traceback\nof it"))
    assert (tmp_path / "gpu.md").read_text().splitlines() == text(records)
    content = json.loads((tmp_path / "gpu.json").read_text())
    assert content["schema"] == "mjx-hand/benchmark-gpu/1"
    assert content["options"] == {"minutes": 9}
    assert [stage["status"] for stage in content["stages"]] == ["done", "cut short", "skipped", "not reached"]
    assert content["stages"][0]["tables"][0]["rows"][0] == ["pinch", 8192, 2_345_678.9, None]
    assert content["versions"]["mujoco"]
    assert (tmp_path / "peer-error.txt").read_text() == "Traceback\nof it"
    with Image.open(tmp_path / "physics-warp.png") as image:
        assert image.format == "PNG"
    assert not [path for path in tmp_path.iterdir() if path.name.startswith(".")]


def test_files_grow_with_the_records(records, tmp_path):
    pages = Pages(tmp_path, {})
    pages(records)
    records[3].status = "done"
    records[3].table("steps").add(10)
    pages(records)
    assert "### On" in (tmp_path / "gpu.md").read_text()


def test_a_folder_that_cannot_be_written_is_named(records, tmp_path):
    (tmp_path / "file").touch()
    with pytest.raises(InputError, match="file"):
        Pages(tmp_path / "file" / "out", {})(records)


def test_cells_are_short_and_keep_the_table_whole():
    assert [shown(cell) for cell in (None, "a|b", 12345, 1234.5, 0.123456, 12.3456, 0)] == [
        *("–", "a/b", "12,345", "1,234", "0.123", "12.3", "0")
    ]
    table = Table(("a", "b"))
    assert markdown(table) == ["| a | b |", "|---|---|"]
    with pytest.raises(ValueError, match="1 cells for 2 columns"):
        table.add(1)
