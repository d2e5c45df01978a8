import resource

import jax
import numpy as np
import pytest

from mjx_hand.errors import InputError
from train.learning.training_state import KEPT, load_run, save_run


def tree(value: float) -> dict[str, object]:
    return {"a": (np.full((3, 2), value, np.float32), np.arange(4, dtype=np.uint32)), "b": np.array(7, np.int32)}


TEMPLATE = jax.eval_shape(lambda: tree(0.0))


def test_what_goes_in_comes_out_and_old_ones_go(tmp_path):
    assert load_run(tmp_path / "state", TEMPLATE) is None
    for steps in range(KEPT + 2):
        save_run(tmp_path / "state", steps, tree(steps), {"points": [steps]})
    state, notes = load_run(tmp_path / "state", TEMPLATE) or (None, {})
    jax.tree.map(np.testing.assert_array_equal, state, tree(KEPT + 1))
    assert notes == {"points": [KEPT + 1]}
    assert len(list((tmp_path / "state").iterdir())) == KEPT


def test_another_structure_is_refused(tmp_path):
    save_run(tmp_path, 1, tree(1.0), {})
    other = dict(TEMPLATE, b=jax.ShapeDtypeStruct((2,), np.int32))
    with pytest.raises(InputError, match=r"holds int32\[\] for state\['b'\], expected int32\[2\]"):
        load_run(tmp_path, other)
    with pytest.raises(InputError, match=r"holds nothing for state\['c'\]"):
        load_run(tmp_path, dict(TEMPLATE, c=jax.ShapeDtypeStruct((), np.float32)))


def test_a_full_disk_leaves_the_state_before(tmp_path):
    save_run(tmp_path, 1, tree(1.0), {})
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (512, hard))  # fails as a full disk does: in the middle of writing
    try:
        with pytest.raises(InputError, match=r"cannot write .*000000000002.npz: .*; choose a place"):
            save_run(tmp_path, 2, tree(2.0), {"points": list(range(1000))})
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before
    state, _ = load_run(tmp_path, TEMPLATE) or (None, {})
    jax.tree.map(np.testing.assert_array_equal, state, tree(1.0))
