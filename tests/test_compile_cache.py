"""The compilation cache: where it is, and that another process finds what one compiled."""

import os
import subprocess
import sys
from pathlib import Path

import jax
import pytest

from mjx_hand.compile_cache import cache_folder, enable_compile_cache
from mjx_hand.errors import InputError

COMPILE = """
from mjx_hand.compile_cache import enable_compile_cache
enable_compile_cache()
import jax, jax.numpy as jnp
hits = []
jax.monitoring.register_event_listener(lambda event, **_: hits.append(event == "/jax/compilation_cache/cache_hits"))
def many(x):
    for _ in range(400):  # well beyond the 0.2 s of compiling from which a program is kept
        x = jnp.sin(x @ x) + jnp.linalg.svd(x)[0]
    return x
jax.jit(many)(jnp.eye(3)).block_until_ready()
print("hit" if any(hits) else "miss")
"""


def test_folder_follows_the_variable_then_xdg_then_home(monkeypatch, tmp_path):
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.delenv("MJX_HAND_CACHE", raising=False)
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    assert cache_folder() == tmp_path / ".cache/mjx-hand/jax"
    monkeypatch.setenv("XDG_CACHE_HOME", "relative")
    assert cache_folder() == tmp_path / ".cache/mjx-hand/jax"
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "xdg"))
    assert cache_folder() == tmp_path / "xdg/mjx-hand/jax"
    monkeypatch.setenv("MJX_HAND_CACHE", "~/here")
    assert cache_folder() == tmp_path / "here"


def test_folder_that_cannot_be_made_is_an_input_error(monkeypatch, tmp_path):
    (tmp_path / "file").touch()
    monkeypatch.setenv("MJX_HAND_CACHE", str(tmp_path / "file" / "below"))
    with pytest.raises(InputError, match="set MJX_HAND_CACHE"):
        enable_compile_cache()


def test_jaxs_own_variable_counts(monkeypatch, tmp_path):
    monkeypatch.delenv("MJX_HAND_CACHE", raising=False)
    monkeypatch.setenv("JAX_COMPILATION_CACHE_DIR", str(tmp_path / "jax"))
    assert cache_folder() == tmp_path / "jax"
    monkeypatch.setenv("MJX_HAND_CACHE", str(tmp_path / "own"))
    assert cache_folder() == tmp_path / "own"


def test_a_home_that_cannot_be_written_is_said_and_nothing_kept(monkeypatch, tmp_path, capsys):
    (tmp_path / "file").touch()
    for name in ("MJX_HAND_CACHE", "JAX_COMPILATION_CACHE_DIR", "XDG_CACHE_HOME"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("HOME", str(tmp_path / "file" / "home"))
    before = jax.config.values["jax_compilation_cache_dir"]
    try:
        assert enable_compile_cache() is None
        assert jax.config.values["jax_compilation_cache_dir"] is None
    finally:
        jax.config.update("jax_compilation_cache_dir", before)
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert "going on without" in said


def test_second_process_reuses_what_the_first_compiled_and_says_nothing(tmp_path: Path):
    environment = os.environ | {"MJX_HAND_CACHE": str(tmp_path)}
    runs = [
        subprocess.run([sys.executable, "-c", COMPILE], env=environment, capture_output=True, text=True, check=True)
        for _ in range(2)
    ]
    assert [run.stdout.strip() for run in runs] == ["miss", "hit"]
    assert runs[1].stderr == ""
