import io
import sys

import pytest

from mjx_hand import progress as module
from mjx_hand.progress import clock, counter, progress


@pytest.mark.parametrize(
    ("seconds", "text"),
    [(0.84, "0.8 s"), (41.6, "42 s"), (59.7, "1 min 00 s"), (185.0, "3 min 05 s"), (7620.0, "2 h 07 min")],
)
def test_clock(seconds, text):
    assert clock(seconds) == text


def test_lines_come_now_and_then_with_the_pace_after_the_first_piece(capsys, monkeypatch):
    now = [0.0]
    monkeypatch.setattr(module.time, "monotonic", lambda: now[0])

    def work():
        for took in (60.0, 4.0, 4.0, 4.0, 4.0):  # the first piece holds a minute of compilation
            now[0] += took
            yield took

    assert len(list(progress(work(), "fitting", total=5))) == 5
    lines = capsys.readouterr().out.splitlines()
    assert lines == [
        "fitting: 1/5 in 1 min 00 s",
        "fitting: 4/5 in 1 min 12 s, about 4.0 s left",
        "fitting: 5 in 1 min 16 s",
    ]


def test_an_unknown_total_is_left_out(capsys):
    assert list(progress(iter("ab"), "reading")) == ["a", "b"]
    assert capsys.readouterr().out == "reading: 2 in 0.0 s\n"


def test_a_failure_is_not_reported_as_done(capsys):
    with pytest.raises(KeyError, match="gone"), counter(3, "training"):
        raise KeyError("gone")
    assert capsys.readouterr().out == ""


def test_a_terminal_gets_a_bar(monkeypatch):
    class Terminal(io.StringIO):
        def isatty(self) -> bool:
            return True

    terminal = Terminal()
    monkeypatch.setattr(sys, "stdout", terminal)
    monkeypatch.setenv("TERM", "xterm")
    with counter(8, "training") as advance:
        advance(8)
    assert "training" in terminal.getvalue()
    assert "8/8" in terminal.getvalue()
