import os
import pickle
import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.sparse import coo_array, coo_matrix, csc_array, csc_matrix, csr_array, csr_matrix

from mjx_hand.errors import InputError
from mjx_hand.hand.load import load_hand
from mjx_hand.hand.mano_file import MANO_TIPS, load_mano_file
from mjx_hand.hand.mirror import mirrored
from mjx_hand.hand.model import HandModel
from mjx_hand.hand.open_hand import load_open_hand
from mjx_hand.pytree import replace
from tests.hand.mano_layout import layout, official, write_npz


def example(vertices: int | None = None) -> HandModel:
    """The open hand with pose correctives and a pose mean; optionally some of its vertices only."""
    hand, rng = load_open_hand(), np.random.default_rng(0)
    keep = np.arange(hand.num_vertices)
    if vertices is not None:
        keep = np.sort(rng.choice(np.setdiff1d(keep, hand.tip_vertices), vertices - 5, replace=False))
        keep = np.append(keep, hand.tip_vertices)
    regressor = hand.joint_regressor[:, keep] + 1e-6
    return replace(
        hand,
        template=hand.template[keep],
        faces=rng.integers(0, len(keep), (40, 3)).astype(np.int32),
        weights=hand.weights[keep],
        shapedirs=hand.shapedirs[keep],
        posedirs=rng.normal(scale=1e-3, size=(len(keep), 3, 135)).astype(np.float32),
        joint_regressor=regressor / regressor.sum(axis=1, keepdims=True),
        pose_mean=rng.normal(size=(15, 3)).astype(np.float32),
    )


HAND = example(200)


def assert_same(found: HandModel, expected: HandModel) -> None:
    for name in ("template", "faces", "weights", "shapedirs", "posedirs", "joint_regressor", "pose_mean"):
        np.testing.assert_allclose(getattr(found, name), getattr(expected, name), atol=1e-7, err_msg=name)
        assert getattr(found, name).dtype == (np.int32 if name == "faces" else np.float32)
    assert found.side == expected.side


def write(path: Path, data: bytes) -> Path:
    path.write_bytes(data)
    return path


@pytest.mark.parametrize("protocol", [None, 0, 1, 2, 3, 4, 5])
def test_official_layout_loads(tmp_path: Path, protocol: int | None) -> None:
    hand = load_hand(write(tmp_path / "MANO_RIGHT.pkl", official(HAND, protocol)))
    assert_same(hand, HAND)
    assert hand.name == "MANO_RIGHT.pkl"


def test_reading_a_file_needs_and_leaves_no_chumpy(tmp_path: Path) -> None:
    load_hand(write(tmp_path / "MANO_RIGHT.pkl", official(HAND)))
    assert not [name for name in sys.modules if name.startswith("chumpy")]


def test_npz_of_the_same_keys_loads(tmp_path: Path) -> None:
    assert_same(load_hand(write_npz(HAND, tmp_path / "MANO_RIGHT.npz")), HAND)


@pytest.mark.filterwarnings("ignore:the matrix subclass:PendingDeprecationWarning")
@pytest.mark.parametrize("form", [np.asmatrix, csr_matrix, csc_array], ids=["matrix", "csr", "csc_array"])
def test_other_forms_of_the_regressor_load(tmp_path: Path, form) -> None:
    values = layout(HAND)
    values["J_regressor"] = form(values["J_regressor"])
    assert_same(load_hand(write(tmp_path / "m.pkl", pickle.dumps(values))), HAND)


SPARSE = [csr_matrix, csc_matrix, coo_matrix, csr_array, csc_array, coo_array]


@pytest.mark.parametrize("form", SPARSE, ids=[form.__name__ for form in SPARSE])
def test_a_file_saved_from_the_pickle_as_it_is_loads(tmp_path: Path, form) -> None:
    values = layout(HAND)
    values["J_regressor"] = form(values["J_regressor"])
    np.savez(tmp_path / "m.npz", **values)
    assert_same(load_hand(tmp_path / "m.npz"), HAND)
    assert_same(load_hand(write(tmp_path / "m.pkl", pickle.dumps(values))), HAND)


def test_code_in_an_npz_is_refused_and_not_run(tmp_path: Path) -> None:
    class Evil:
        def __reduce__(self):
            return os.mkdir, (str(tmp_path / "made"),)

    with pytest.raises(InputError, match="nothing was run"):
        load_hand(write_npz(HAND, tmp_path / "m.npz", J_regressor=np.array(Evil(), dtype=object)))
    assert not (tmp_path / "made").exists()


def test_big_endian_arrays_load(tmp_path: Path) -> None:
    values = layout(HAND)
    values["v_template"] = values["v_template"].astype(">f8")
    assert_same(load_hand(write(tmp_path / "m.pkl", pickle.dumps(values))), HAND)


def test_more_than_ten_shape_components_are_cut_to_ten(tmp_path: Path) -> None:
    more = np.concatenate([HAND.shapedirs, np.ones((200, 3, 6))], axis=2)
    assert_same(load_hand(write_npz(HAND, tmp_path / "m.npz", shapedirs=more)), HAND)


def test_tips_are_the_convention_on_778_vertices_and_found_elsewhere(tmp_path: Path) -> None:
    full = example(778)
    assert tuple(load_hand(write_npz(full, tmp_path / "a.npz")).tip_vertices) == MANO_TIPS == (320, 443, 671, 554, 744)
    whole = load_open_hand()
    found = load_hand(write_npz(whole, tmp_path / "b.npz"))
    distance = np.linalg.norm(whole.template[found.tip_vertices] - whole.template[whole.tip_vertices], axis=1)
    assert (distance < 0.006).all()


@pytest.mark.parametrize("directions", ["own", "the right hand's"])
def test_left_file_gets_its_own_shape_directions(tmp_path: Path, directions: str) -> None:
    left = mirrored(HAND)
    shapedirs = left.shapedirs if directions == "own" else HAND.shapedirs
    assert_same(load_hand(write_npz(left, tmp_path / "MANO_LEFT.npz", shapedirs=shapedirs), side="left"), left)


@pytest.mark.parametrize(("hand", "side"), [(HAND, "left"), (mirrored(HAND), "right")])
def test_the_other_side_is_refused(tmp_path: Path, hand: HandModel, side: str) -> None:
    with pytest.raises(InputError, match=f"holds a {hand.side} hand, but side is '{side}'"):
        load_hand(write_npz(hand, tmp_path / "m.npz"), side=side)


def test_missing_file() -> None:
    with pytest.raises(InputError, match=r"nowhere/MANO_RIGHT\.pkl: no such file"):
        load_hand("nowhere/MANO_RIGHT.pkl")


@pytest.mark.parametrize("key", list(layout(HAND))[:8])
def test_missing_key_is_named(tmp_path: Path, key: str) -> None:
    values = layout(HAND)
    del values[key]
    with pytest.raises(InputError, match=f"has no '{key}'; a MANO file has v_template"):
        load_mano_file(write(tmp_path / "m.pkl", pickle.dumps(values)))


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("v_template", np.zeros((200, 2)), r"'v_template' has shape \(200, 2\), expected \(any, 3\)"),
        ("v_template", np.zeros((0, 3)), r"'v_template' has shape \(0, 3\)"),
        ("v_template", np.full((200, 3), np.nan), "'v_template' has NaN"),
        ("posedirs", np.full((200, 3, 135), 1e300), "'posedirs' has NaN, infinity or numbers beyond"),
        ("weights", np.zeros((200, 24)), r"expected \(200, 16\)"),
        ("weights", np.ones((200, 16)), "do not sum to 1"),
        ("weights", "none", "cannot read 'weights' .a str, not an array"),
        ("weights", np.array([None] * 4), "cannot read 'weights' .an array of type 'O8'"),
        ("f", np.full((4, 3), 200), "names vertices 200 to 200, but there are 200"),
        ("f", np.full((4, 3), -1), "names vertices -1"),
        ("kintree_table", np.zeros((2, 16), int), "is not MANO's"),
        ("posedirs", np.zeros((200, 3, 207)), r"expected \(200, 3, 135\)"),
        ("hands_mean", np.zeros(44), r"'hands_mean' has shape \(44,\), expected \(45,\)"),
        ("J_regressor", csr_matrix(np.ones((16, 100))), r"'J_regressor' has shape \(16, 100\)"),
    ],
)
def test_malformed_values_are_named_in_one_line(tmp_path: Path, key: str, value, message: str) -> None:
    path = write(tmp_path / "m.pkl", pickle.dumps(layout(HAND) | {key: value}))
    with pytest.raises(InputError, match=message) as caught:
        load_mano_file(path)
    assert "\n" not in str(caught.value)
