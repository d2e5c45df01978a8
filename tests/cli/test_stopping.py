"""Ctrl-C while a program starts, or where a library drops it, is one line."""

import signal
import subprocess
import sys
import time

import pytest

from mjx_hand.cli.terminal.stopping import is_program


@pytest.mark.parametrize(
    ("words", "ours"),
    [
        (["python", "-m", "train.ppo", "config=pinch"], True),
        (["python", "-um", "mjx_hand", "info"], True),
        (["python", "-X", "dev", "-m", "train"], False),
        (["python", "/usr/bin/mjx-hand", "info"], True),
        (["python", "-m", "pytest", "train"], False),
        (["python", "script.py", "-m", "train.ppo"], False),
        (["python", "-c", "import mjx_hand"], False),
        (["python"], False),
    ],
)
def test_only_programs_of_the_project_are_changed(words, ours):
    assert is_program(words) == ours


# A shell's job in the background, which these tests may be, is started with Ctrl-C ignored.
STARTING = (
    "import signal, sys; signal.signal(signal.SIGINT, signal.default_int_handler); "
    "sys.orig_argv = ['python', '-m', 'train.ppo']; import mjx_hand; {}; print('in', flush=True); {}"
)
DROPPED = "import gc, time; gc.callbacks.append(lambda phase, _: time.sleep(phase == 'start'))"


@pytest.mark.parametrize(
    ("before", "then"),
    [("import time", "time.sleep(60)"), (DROPPED, "gc.collect(); gc.callbacks.clear(); time.sleep(60)")],
    ids=["starting", "dropped"],
)
def test_one_line_and_the_end(before, then):
    code = STARTING.format(before, then)
    with subprocess.Popen(
        [sys.executable, "-c", code], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        assert process.stdout.readline() == "in\n"
        time.sleep(0.2)
        process.send_signal(signal.SIGINT)
        began = time.monotonic()
        said = process.stderr.read()
    assert time.monotonic() - began < 30
    assert said.strip() == "mjx-hand: stopped"
    assert process.returncode in (-signal.SIGINT, 130)
