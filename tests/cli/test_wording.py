"""Messages name the command line's options."""

import pytest

from mjx_hand.cli.terminal.wording import as_options


@pytest.mark.parametrize(
    ("message", "told"),
    [
        ("choose one with side='right' or side='left'", "choose one with --side right or --side left"),
        ("give fps=, such as fps=30", "give --fps, such as --fps 30"),
        ("choose with side= or sequence=", "choose with --side or --sequence"),
        ("leave out fps=29.97; it was", "leave out --fps 29.97; it was"),
        ("/data/side=left/a.npz: no such file", "/data/side=left/a.npz: no such file"),
        ("--side left, a_side=3, data.fps=5", "--side left, a_side=3, data.fps=5"),
        ("markers='hand22' or a YAML file", "--markers hand22 or a YAML file"),
    ],
)
def test_arguments_become_options(message, told):
    assert as_options(message) == told
