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


def test_any_damage_falls_back_to_the_state_before(tmp_path):
    """Bits of the archive's directory, cuts, and members of other shapes, whose checksums are right."""
    save_run(tmp_path, 1, tree(1.0), {"points": []})
    newest = save_run(tmp_path, 2, tree(2.0), {"points": []})
    good = newest.read_bytes()
    start = good.index(b"PK\x01\x02")
    damaged = [good[:k] for k in range(0, len(good), 97)]
    for bit in range(8 * start, 8 * len(good), 31):
        flipped = bytearray(good)
        flipped[bit // 8] ^= 1 << bit % 8
        damaged.append(bytes(flipped))
    with np.load(newest) as file:
        arrays = dict(file)
    for name, value in (("notes", arrays["notes"][None]), ("notes", np.array("{" * 100_000)), ("digest", np.zeros(2))):
        np.savez(newest, **{**arrays, name: value})
        damaged.append(newest.read_bytes())
    for content in damaged:
        newest.write_bytes(content)
        state, _ = load_run(tmp_path, TEMPLATE) or (None, {})
        assert isinstance(state, dict)
        assert state["a"][0][0, 0] in (1.0, 2.0)
        jax.tree.map(np.testing.assert_array_equal, state, tree(state["a"][0][0, 0]))


def test_a_state_that_the_caller_does_not_know_is_passed_over(tmp_path):
    def of_mine(notes):
        if notes["seed"] != 0:
            raise InputError(f"it is of seed {notes['seed']}")

    save_run(tmp_path, 1, tree(1.0), {"seed": 0})
    save_run(tmp_path, 2, tree(2.0), {"seed": 1})
    _, notes = load_run(tmp_path, TEMPLATE, of_mine) or (None, {})
    assert notes == {"seed": 0}
    (tmp_path / "000000000001.npz").unlink()
    with pytest.raises(InputError, match=r"no sound state .*it is of seed 1.*fresh=true"):
        load_run(tmp_path, TEMPLATE, of_mine)


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
