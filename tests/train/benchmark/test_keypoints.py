import pytest

from train.benchmark.__main__ import main

pytest.importorskip("dexi_rs", reason="dexi-rs is not installed")
SMALL = ["keypoints", "--hands", "inspire", "--copies", "2", "--runs", "1", "--scipy-frames", "2"]


def test_report_has_all_contestants_and_ours_is_no_worse(capsys, recordings):
    assert main([*SMALL, "--recording", str(recordings / "mediapipe_video" / "joints.npz")]) == 0
    text = capsys.readouterr().out
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in text.splitlines() if line[:3] == "| m"]
    rows += [[cell.strip() for cell in line.strip("|").split("|")] for line in text.splitlines() if line[:3] == "| d"]
    one, many, same, dexi = rows
    assert one[3:] == many[3:]
    assert float(one[3]) <= float(dexi[3]) * 1.001
    scipy = next(line for line in text.splitlines() if line.startswith("| SciPy")).strip("|").split("|")
    assert abs(float(same[3]) - float(scipy[3])) < 0.02 * float(scipy[3])
    assert "ms at the median" in text


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--runs", "0"], "runs is 0"),
        (["--hands", "robonaut"], "hands has 'robonaut'"),
        (["--recording", "no"], "no: "),
    ],
)
def test_bad_options_end_in_one_line_and_status_2(options, message, capsys):
    assert main([*SMALL, *options]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1
