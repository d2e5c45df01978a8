import numpy as np
import pytest

from train.benchmark.__main__ import main
from train.benchmark.retarget import SCIPY

SMALL = ["retarget", "--poses", "60", "--runs", "1", "--scipy-poses", "1"]


def lines_of(text):
    return [line for line in text.splitlines() if line.startswith("|")][2:]


def rows(text, heading):
    """The table under a heading: first cell to the others."""
    lines = text.split(heading, 1)[1].split("\n## ", 1)[0].splitlines()
    cells = [[c.strip() for c in line.strip("|").split("|")] for line in lines if line.startswith("|")]
    return {row[0]: row[1:] for row in cells[2:]}


@pytest.mark.slow
def test_report_has_the_exact_projection_equal_to_scipy_and_below_the_others(capsys, recordings, tmp_path):
    recording, out = recordings / "dexmv_mustard" / "sequence.npz", tmp_path / "report.md"
    assert main([*SMALL, "--recording", str(recording), "--out", str(out)]) == 0
    text = capsys.readouterr().out
    assert text.endswith(out.read_text() + "\n")
    for heading in ("100 random anatomical poses", "dexmv_mustard/sequence.npz"):
        table = rows(text, heading)
        errors = {m: np.array([float(x) for x in row[0].split(" / ")]) for m, row in table.items() if row[0]}
        np.testing.assert_allclose(errors["exact"], errors[SCIPY], atol=2e-3)
        assert errors["exact"][0] < min(errors[m][0] for m in ("paper", "naive", "bch2"))
        np.testing.assert_allclose(errors["paper"], errors["naive"], atol=2e-3)
    chosen = text.split("what can be chosen", 1)[1].split("\n## ", 1)[0]
    tips = {tuple(row.strip("| ").split(" | ")[:2]): float(row.split("|")[4].split("/")[0]) for row in lines_of(chosen)}
    assert tips["anatomical", "refine tips"] < 1 < tips["anatomical", "projection alone"]
    assert tips["functional", "projection alone"] < 0.5 * tips["anatomical", "projection alone"]
    speed = rows(text, "One call over 60 poses")
    assert {"exact, carried", "exact, within limits"} < set(speed)
    assert any(name.startswith("tips refined, 64 people") for name in speed)
    assert all(float(speed[m][3].replace(",", "")) > 1 for m in ("exact", "paper", "naive", "bch2"))


@pytest.mark.parametrize(
    ("options", "message"),
    [(["--poses", "0"], "poses is 0; give at least 1"), (["--recording", "absent.npz"], "absent.npz: no such file")],
)
def test_bad_options_end_in_one_line_and_status_2(options, message, capsys):
    assert main([*SMALL, *options]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1
