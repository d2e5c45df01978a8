"""The table of what robot hands can do: a pinch on an Allegro, and how reasons are counted."""

import json

from tests.robots.urdfs import urdf_of
from train.robots import Possible, main, table


def test_a_cell_tells_how_many_are_done_and_why_not_the_others():
    reason = {0: ("out of reach", "a"), 3: ("no force closure", "b"), 4: ("out of reach", "c")}
    rows = [Possible("one", "pinch", 8, reason), Possible("one", "power", 2, {}), Possible("two", "pinch", 8, {})]
    rows.append(Possible("two", "power", 2, {0: ("no finger for it", "d"), 1: ("no finger for it", "e")}))
    made = table(rows, "heldout")
    assert made.columns == ("hand", "pinch", "power")
    assert made.rows == (
        ("one", "5 of 8; out of reach 2; no force closure 1", "2 of 2"),
        ("two", "8 of 8", "0 of 2; no finger for it 2"),
    )


def test_the_command_counts_a_sets_demonstrations(tiny, tmp_path, capsys):
    assert urdf_of("allegro").is_file()  # skips without the package that carries it
    data = tiny.data
    counts = ("people", "trials", "heldout_people", "heldout_trials")
    options = [f"data.{name}={getattr(data, name)}" for name in counts]
    given = [*options, f"demonstrations={tiny.demonstrations}", f"out={tmp_path}", "first=1", "hands=[allegro]"]
    assert main(["config=pinch", *given]) == 0
    (row,) = json.loads((tmp_path / "robots.json").read_text())
    assert (row["hand"], row["grasp"], row["of"], row["done"], row["left out"]) == ("allegro", "pinch", 1, 1, {})
    assert "1 of 1" in capsys.readouterr().out


def test_what_cannot_be_used_ends_in_one_line(tmp_path, capsys):
    assert main(["hands=[]", f"out={tmp_path}"]) == 2
    assert main(["hands=[allegro]", "first=none", f"out={tmp_path}"]) == 2
    nothing, none = capsys.readouterr().err.splitlines()
    assert "hands=[] names nothing; give for example hands=[allegro]" in nothing
    assert "first=none: give how many of each type to take, as in first=8" in none
