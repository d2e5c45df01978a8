import gc
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from envs.physics.host_call import HostCallback, call_host

ROOT = Path(__file__).resolve().parent.parent.parent.parent
THREE = jax.ShapeDtypeStruct((3,), jnp.float32)

PROGRAM = """
import jax, jax.numpy as jnp
from envs.physics.host_call import HostCallback
hits = []
jax.monitoring.register_event_listener(lambda event, **_: hits.append(event) if event.endswith("cache_hits") else None)
jax.config.update("jax_compilation_cache_dir", {folder!r})
jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.0)
jax.config.update("jax_persistent_cache_min_entry_size_bytes", 0)
double = HostCallback(lambda a: (2 * a,))
shapes = (jax.ShapeDtypeStruct((3,), jnp.float32),)
step = jax.jit(lambda a: jax.lax.scan(lambda a, _: (double(shapes, a)[0] + {add}, None), a, length=4)[0])
ones = jnp.ones(3)
before = len(hits)
print(step(ones).tolist(), len(hits) > before)
"""


def affine(a: Any, b: Any) -> tuple[np.ndarray, ...]:
    assert a.shape == b.shape
    return 2 * a + b, (a > b).astype(np.int32)


def calling(function: Callable[..., Any], *shapes: jax.ShapeDtypeStruct) -> Callable[..., Any]:
    called = HostCallback(function)
    return lambda *args: called(shapes, *args)


def test_it_gives_what_numpy_gives_under_nested_maps():
    call = calling(affine, THREE, jax.ShapeDtypeStruct((3,), jnp.int32))
    a, b = np.random.default_rng(0).normal(size=(2, 4, 5, 3)).astype(np.float32)
    a, b = jnp.asarray(a), jnp.asarray(b)
    double, greater = jax.jit(jax.vmap(jax.vmap(call)))(a, b)
    np.testing.assert_array_equal(double, 2 * a + b)
    np.testing.assert_array_equal(greater, a > b)
    over_one, _ = jax.vmap(call, in_axes=(0, None))(a[0], b[0, 0])
    np.testing.assert_array_equal(over_one, 2 * a[0] + b[0, 0])


def test_bits_cross_unchanged():
    bits = np.array([0, 1, 2**32 - 1, 0x7FC00001], np.uint32)
    call = calling(lambda a: (a,), jax.ShapeDtypeStruct((4,), jnp.uint32))
    np.testing.assert_array_equal(jax.jit(call)(jnp.asarray(bits))[0], bits)


def test_what_goes_wrong_is_told():
    def refuse(a: Any) -> tuple[np.ndarray, ...]:
        raise ValueError("not today")

    with pytest.raises(jax.errors.JaxRuntimeError, match="ValueError: not today"):
        jax.block_until_ready(jax.jit(calling(refuse, THREE))(jnp.ones(3)))
    with pytest.raises(jax.errors.JaxRuntimeError, match=r"expected float32\(3,\), got float64\(3,\)"):
        jax.block_until_ready(jax.jit(calling(lambda a: (a.astype(float),), THREE))(jnp.ones(3)))


def test_what_was_compiled_with_one_function_calls_another_by_its_number():
    double, negate = HostCallback(lambda a: (2 * a,)), HostCallback(lambda a: (-a,))
    call = jax.jit(jax.vmap(lambda number, a: call_host(number, (THREE,), a)[0], in_axes=(None, 0)))
    a = jnp.arange(6.0).reshape(2, 3)
    np.testing.assert_array_equal(call(jnp.int32(double.number), a), 2 * a)
    np.testing.assert_array_equal(call(jnp.int32(negate.number), a), -a)
    assert call._cache_size() == 1  # type: ignore[attr-defined]
    each = jax.jit(jax.vmap(lambda number, a: call_host(number, (THREE,), a)[0]))
    with pytest.raises(jax.errors.JaxRuntimeError, match="these elements of a batch name several"):
        jax.block_until_ready(each(jnp.array([double.number, negate.number]), a))


def test_where_arrays_live_on_an_accelerator_jax_brings_them_to_the_host(monkeypatch: pytest.MonkeyPatch):
    """The same results by JAX's own way, as native physics beside a learner on a GPU has it."""
    call = calling(affine, THREE, jax.ShapeDtypeStruct((3,), jnp.int32))
    a, b = np.random.default_rng(0).normal(size=(2, 4, 5, 3)).astype(np.float32)
    monkeypatch.setattr(jax, "default_backend", lambda: "gpu")
    double, greater = jax.jit(jax.vmap(jax.vmap(call)))(jnp.asarray(a), jnp.asarray(b))
    np.testing.assert_array_equal(double, 2 * a + b)
    np.testing.assert_array_equal(greater, a > b)


def test_it_outlives_all_that_held_it():
    compiled = jax.jit(calling(lambda a: (a + 1,), THREE)).lower(THREE).compile()
    gc.collect()
    np.testing.assert_array_equal(compiled(jnp.ones(3))[0], np.full(3, 2.0))


def test_another_process_finds_what_was_compiled(tmp_path: Path):
    def run(add: int) -> str:
        program = PROGRAM.format(folder=str(tmp_path), add=add)
        done = subprocess.run([sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True, check=True)
        return done.stdout.strip()

    assert run(1) == "[31.0, 31.0, 31.0] False"
    assert run(1) == "[31.0, 31.0, 31.0] True"
    assert run(2) == "[46.0, 46.0, 46.0] False", "another program is compiled anew"
