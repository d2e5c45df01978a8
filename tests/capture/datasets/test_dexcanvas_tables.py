"""DexCanvas's tables: a trajectory a row, with objects and contacts, as the lab's own writer declares the columns."""

import importlib.util
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from mjx_hand.capture.load import load_motion
from mjx_hand.capture.load_scene import load_scene
from mjx_hand.cli.file_facts import file_facts
from mjx_hand.errors import InputError
from mjx_hand.motion.scene_notes import scene_notes
from tests.capture.datasets import test_objects
from tests.capture.datasets.subjects import joints_of, licensed_file
from tests.capture.datasets.test_dexcanvas import TAKE, fields, in_world, local_joints, write_row

# Palm, index, middle, ring, little finger, thumb, then tips from the thumb on, of MANO's joints and tips.
SIMULATED_21 = (0, 1, 2, 3, 4, 5, 6, 10, 11, 12, 7, 8, 9, 13, 14, 15, 20, 16, 17, 19, 18)
UUID = "d5bc2bc6-9458-52d0-bccc-66c9ec21bae3"


def schema() -> pa.Schema:
    """Explicit types, fixed where lengths are, in single precision."""
    texts, three = pa.list_(pa.string()), pa.list_(pa.list_(pa.float32(), 3))
    pair = pa.struct([(name, pa.list_(pa.float32(), 3)) for name in ("force_normal", "pos_world", "pos_object")])
    entry = [(name, pa.string()) for name in ("hand_name", "joint_name", "object_name")]
    hand = [
        ("hand_name", pa.string()),
        ("mano_global_pos", three),
        ("mano_global_rot_aa", three),
        ("mano_hand_pose", pa.list_(pa.list_(pa.float32(), 48))),
        ("mano_joint_pos", pa.list_(pa.list_(pa.list_(pa.float32(), 3), 21))),
        ("urdf_dof", pa.list_(pa.list_(pa.float32(), 28))),
    ]
    meta = [
        ("data_fps", pa.int64()),
        ("total_frames", pa.int64()),
        *((name, texts) for name in ("hand_names", "hand_slots", "object_names")),
        ("mano_hand_shapes", pa.list_(pa.list_(pa.float32(), 10))),
    ]
    contact = pa.struct([*entry, ("total_force_world", pa.list_(pa.float32(), 3)), ("contact_pairs", pa.list_(pair))])
    return pa.schema(
        [
            ("index", pa.struct([("uuid", pa.string()), ("is_generated", pa.bool_())])),
            ("trajectory_metadata", pa.struct(meta)),
            ("timestamp", pa.list_(pa.float64())),
            ("hands", pa.list_(pa.struct(hand))),
            ("objects", pa.list_(pa.struct([("rot_aa", three), ("pos", three)]))),
            ("contact", pa.list_(pa.list_(contact))),
        ]
    )


def hand(side: str, simulated: bool = False) -> dict[str, Any]:
    own = fields(side, hand_name=side, urdf_dof=np.zeros((6, 28)))
    if simulated:
        own["mano_joint_pos"] = in_world(local_joints(side))[:, SIMULATED_21]
    return {name: value if isinstance(value, str) else value.tolist() for name, value in own.items()}


EMPTY: dict[str, Any] = {name: [] for name in hand("right") if name != "hand_name"} | {"hand_name": None}


def row(*sides: str, simulated: bool = False, uuid: str = UUID, objects=("cube1",), **meta) -> dict[str, Any]:
    """A trajectory; the slots of hands that are not there are empty."""
    pair = {name: [0.0, 0.0, 0.5] for name in ("force_normal", "pos_world", "pos_object")}
    touch = {"hand_name": "right", "joint_name": "index_dip", "object_name": "cube1"}
    told = {
        "data_fps": 99,
        "total_frames": 6,
        "hand_names": list(sides),
        "hand_slots": ["right", "left"],
        "object_names": list(objects),
        "mano_hand_shapes": [TAKE.shape.tolist() for _ in sides],
    }
    pose = {"rot_aa": test_objects.TURN.as_rotvec().tolist(), "pos": test_objects.PLACE.tolist()}
    return {
        "index": {"uuid": uuid, "is_generated": simulated},
        "trajectory_metadata": told | meta,
        "timestamp": (np.arange(6) / 99).tolist(),
        "hands": [hand(side, simulated) if side in sides else EMPTY for side in ("right", "left")],
        "objects": [pose for _ in objects],
        "contact": [[]] * 5 + [[touch | {"total_force_world": [0.0, 0.0, 0.5], "contact_pairs": [pair]}]],
    }


def write(folder: Path, *rows: dict[str, Any], name: str = "part-0.parquet", **options: Any) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    pq.write_table(pa.Table.from_pylist(list(rows), schema=schema()), folder / name, **options)
    return folder / name


@pytest.mark.parametrize("simulated", [False, True])
@pytest.mark.parametrize("side", ["right", "left"])
def test_hands_come_out_where_they_were_by_both_accounts_of_the_joints(tmp_path, side, simulated):
    motion = load_motion(write(tmp_path, row(side, simulated=simulated)))
    np.testing.assert_allclose(joints_of(motion), in_world(local_joints(side))[:, :16], atol=1e-5)
    np.testing.assert_allclose(motion.shape, TAKE.shape, atol=1e-6)
    assert (motion.fps, motion.source) == (99.0, f"DexCanvas part-0, {side} hand")


@pytest.mark.parametrize("side", ["right", "left"])
def test_a_hand_that_keeps_still_is_not_taken_for_captured(tmp_path, side):
    """All bones keep their lengths then, in whatever order joints are taken; the wrist is where the table says."""
    table = row(side, simulated=True)
    for fields_of_hand in table["hands"]:
        for name, values in fields_of_hand.items():
            if isinstance(values, list) and values:
                fields_of_hand[name] = [values[2]] * len(values)
    motion = load_motion(write(tmp_path, table))
    np.testing.assert_allclose(joints_of(motion)[:, :16], in_world(local_joints(side))[[2] * 6, :16], atol=1e-5)


def test_a_scene_has_both_hands_and_the_objects_with_their_meshes(tmp_path):
    path = write(tmp_path / "tables" / "train", row("right", "left", objects=("cube1", "bowl", "bowl")))
    test_objects.mesh(tmp_path / "assets" / "objects" / "cube1" / "cube1_aligned.stl", scale=1e3)
    scene = load_scene(path)
    assert [found.side for found in scene.hands] == ["right", "left"]
    for found in scene.hands:
        np.testing.assert_allclose(joints_of(found), in_world(local_joints(found.side))[:, :16], atol=1e-5)
    np.testing.assert_array_equal(scene.up, [0, 0, 1])
    assert (scene.fps, scene.source) == (99.0, "DexCanvas part-0")
    assert [(found.name, found.kind) for found in scene.objects] == [
        ("cube1", "mesh"),
        ("bowl 1", "none"),
        ("bowl 2", "none"),
    ]
    corners = np.stack([turn.apply(test_objects.BOX.vertices) for turn in test_objects.TURN])
    test_objects.same_corners(scene.objects[0], corners + test_objects.PLACE[:, None])
    assert "bowl 1: poses without a mesh" in scene_notes(scene)
    assert [found.side for found in load_scene(path, side="left").hands] == ["left"]


def test_a_row_that_was_taken_out_has_its_objects_too(tmp_path):
    scene = load_scene(write_row(tmp_path, {"right": fields("right"), "left": fields("left")}))
    assert [found.side for found in scene.hands] == ["right", "left"]
    assert [(found.name, found.kind) for found in scene.objects] == [("object_0", "none")]
    assert (scene.fps, scene.source) == (100.0, "DexCanvas row")


def test_one_of_several_rows_by_number_or_uuid(tmp_path):
    rows = [row("right", uuid=f"uuid-{k}", data_fps=100 + k) for k in range(5)]
    path = write(tmp_path, *rows, row_group_size=2)
    for k in range(5):
        for asked in (str(k), f"uuid-{k}"):
            motion = load_motion(path, sequence=asked)
            assert (motion.fps, motion.source) == (100.0 + k, f"DexCanvas part-0 {asked}, right hand")
    for asked, what in ((None, "5 recordings"), ("5", "no recording '5'"), ("uuid-9", "no recording 'uuid-9'")):
        with pytest.raises(InputError, match=rf"holds {what}; choose one with sequence=: its row, 0 to 4, or its uuid"):
            load_scene(path, sequence=asked)
    with pytest.raises(InputError, match="holds one recording; leave out sequence='0'"):
        load_motion(write_row(tmp_path, {"right": fields()}), sequence="0")


def test_frames_that_were_lost_are_gaps(tmp_path):
    told = row("right")
    told["objects"][0]["pos"] = [*told["objects"][0]["pos"][:5], [float("nan")] * 3]
    told["hands"][0]["mano_global_pos"] = [[None] * 3, *told["hands"][0]["mano_global_pos"][1:]]
    joints = told["hands"][0]["mano_joint_pos"]
    told["hands"][0]["mano_joint_pos"] = [*joints[:2], [[float("inf")] * 3] * 21, *joints[3:]]
    scene = load_scene(write(tmp_path, told))
    assert np.flatnonzero(~scene.hands[0].valid).tolist() == [0, 2]
    assert np.flatnonzero(~scene.objects[0].seen).tolist() == [5]


def test_without_joints_the_licensed_file_has_the_wrist(tmp_path):
    told = row("right")
    del told["hands"][0]["mano_joint_pos"]
    table = pa.Table.from_pylist([told])  # whatever types the rows have
    pq.write_table(table, tmp_path / "a.parquet")
    motion = load_motion(tmp_path / "a.parquet", mano=licensed_file(tmp_path))
    np.testing.assert_allclose(joints_of(motion), in_world(local_joints("right"))[:, :16], atol=1e-5)


SCATTERED = np.random.default_rng(0).normal(size=(6, 21, 3))
MILLIMETRES = [[1e5, 1e5, 1e5]] * 6  # a hundred metres away, and as metres no hand's place


def spoiled(change) -> dict[str, Any]:
    told = row("right")
    change(told)
    return told


@pytest.mark.parametrize(
    ("told", "choice", "message"),
    [
        (row("right", "left"), {}, "holds both hands; choose one"),
        (row("right"), {"side": "left"}, "holds no left hand; give side='right'"),
        (row(), {}, "holds no hand"),
        (row("right") | {"objects": None}, {"side": "left"}, "holds no left hand"),
        (spoiled(lambda told: told["objects"][0].update(pos=[[0.0] * 3] * 5)), {}, r"rot_aa has shape \(6, 3\)"),
        (
            spoiled(lambda told: told["objects"][0].update(pos=None)),
            {},
            "object cube1: has no 'pos'; it needs pos, rot_aa",
        ),
        (spoiled(lambda told: told["objects"][0].update(pos=[[1e9] * 3] * 6)), {}, r"frame 0 holds 1e\+09, no angle"),
        (row("right", object_names=["../outside"]), {}, "object_names is '../outside', expected one name"),
        (row("right", data_fps=0), {}, "fps is 0.0, expected a positive number"),
        (
            spoiled(lambda told: told["hands"][0].update(mano_joint_pos=SCATTERED.tolist())),
            {},
            "do not follow from the pose",
        ),
        (spoiled(lambda told: told["hands"][0].update(mano_global_pos=MILLIMETRES)), {}, "no place \\(m\\)"),
        (spoiled(lambda told: told["hands"][0].update(mano_hand_pose=None)), {}, "has no 'mano_hand_pose'; it needs"),
    ],
)
def test_refusals(tmp_path, told, choice, message):
    path = write(tmp_path, told)
    with pytest.raises(InputError, match=message) as refusal:
        (load_motion if len(told["trajectory_metadata"]["hand_names"]) > 1 else load_scene)(path, **choice)
    assert "\n" not in str(refusal.value)


def test_tables_of_other_columns_and_damaged_ones_are_named(tmp_path):
    path = tmp_path / "a.parquet"
    pq.write_table(pa.table({"sequence_info": [1], "contact_info": [2]}), path)
    for load in (load_motion, load_scene, file_facts):
        with pytest.raises(InputError, match="a table of 1 rows and the columns sequence_info, contact_info"):
            load(path)
    for hands, message in (([1], "a hand needs mano_global_pos"), ([[{"pose": 1}]], "mano_hand_pose; there are pose")):
        pq.write_table(pa.table({"hands": hands, "objects": [[]]}), path)
        with pytest.raises(InputError, match=message):
            load_motion(path)
    whole = write(tmp_path, row("right")).read_bytes()
    for content in (whole[:-100], whole[:100], b"PAR1", b"", b"PAR1" + bytes(200) + b"PAR1"):
        path.write_bytes(content)
        for load in (load_motion, load_scene):
            with pytest.raises(InputError, match=r"not a readable Parquet table|empty") as refusal:
                load(path)
            assert "\n" not in str(refusal.value)


def test_without_the_extra_it_is_said_how_to_get_it(tmp_path, monkeypatch):
    path = write(tmp_path, row("right"))
    found = importlib.util.find_spec
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None if name == "pyarrow" else found(name))
    for load in (load_motion, load_scene):
        with pytest.raises(InputError, match=r"needs the package pyarrow: pip install 'mjx-hand\[parquet\]'"):
            load(path)
