"""Twins' hands: what comes back from a kept file is what `build_rigid_hand` makes, and nothing is built twice."""

import jax
import numpy as np

from envs.demonstrations import twin_hands
from mjx_hand.files import array_cache
from mjx_hand.hand.load import load_hand
from mjx_hand.pytree import replace
from mjx_hand.rigid.build import build_rigid_hand


def test_kept_hands_are_the_built_ones(demonstrations, tmp_path, monkeypatch):
    monkeypatch.setattr(array_cache, "_cache", lambda: str(tmp_path))
    built = []

    def counted(model, shape):
        built.append(shape)
        return build_rigid_hand(model, shape)

    monkeypatch.setattr(twin_hands, "build_rigid_hand", counted)
    first, second = twin_hands.twins(demonstrations), twin_hands.twins(demonstrations)
    shapes = {d.shape.tobytes() for d in demonstrations}
    assert len(built) == len(shapes) > 1
    model = load_hand()
    for d, *found in zip(demonstrations, first, second, strict=True):
        wanted = build_rigid_hand(model, d.shape)
        for hand in found:
            # Statics too: a structure with other capsule links, another side or another name is another tree.
            assert jax.tree.structure(hand) == jax.tree.structure(wanted)
            for got, want in zip(jax.tree.leaves(hand), jax.tree.leaves(wanted), strict=True):
                assert got.dtype == want.dtype
                np.testing.assert_array_equal(got, want)


def test_another_person_is_another_hand(demonstrations, tmp_path, monkeypatch):
    monkeypatch.setattr(array_cache, "_cache", lambda: str(tmp_path))
    taller = [replace(d, shape=d.shape + 0.5) for d in demonstrations]
    (one, *_), (other, *_) = twin_hands.twins(demonstrations), twin_hands.twins(taller)
    assert np.abs(one.link_offset - other.link_offset).max() > 1e-4
