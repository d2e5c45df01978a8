"""Objects of data sets: recordings in each layout, written by the data set's own formula for where vertices are."""

import json
from pathlib import Path

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from mjx_hand.capture.load_scene import load_scene
from mjx_hand.errors import InputError
from mjx_hand.motion import RecordedObject
from tests.capture.datasets import test_arctic, test_dexycb, test_grab, test_hocap, test_oakink2, test_taco
from tests.capture.datasets.subjects import licensed_file

FRAMES = 6
TURN = Rotation.from_rotvec(np.random.default_rng(5).normal(size=(FRAMES, 3)))
PLACE = np.random.default_rng(6).normal(size=(FRAMES, 3))
BOX = trimesh.creation.box(extents=[0.04, 0.06, 0.09])


def vertices(found: RecordedObject, corners: np.ndarray) -> np.ndarray:
    return np.einsum("tij,vj->tvi", found.rotation, corners) + found.position[:, None]


def mesh(path: Path, scale: float = 1.0) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    trimesh.Trimesh(scale * BOX.vertices, BOX.faces).export(path)


def matrices() -> np.ndarray:
    found = np.tile(np.eye(4), (FRAMES, 1, 1))
    found[:, :3, :3], found[:, :3, 3] = TURN.as_matrix(), PLACE
    return found


def mano(folder: Path) -> Path:
    licensed_file(folder, "left")
    return licensed_file(folder, "right").parent


def same_corners(found: RecordedObject, expected: np.ndarray) -> None:
    """The mesh's own vertices, each frame's where the formula puts the box's."""
    assert found.kind == "mesh"
    np.testing.assert_allclose(np.sort(found.vertices, axis=0), np.sort(BOX.vertices, axis=0), atol=1e-6)
    np.testing.assert_allclose(vertices(found, BOX.vertices)[found.seen], expected[found.seen], atol=1e-6)


def test_objects_of_grab(tmp_path):
    """GRAB multiplies vertices as rows by the rotation's matrix: the object is turned by the inverse."""
    path = test_grab.write(tmp_path, sides=("right", "left"))
    with np.load(path, allow_pickle=True) as file:
        arrays = {name: file[name] for name in file.files}
    told = {
        "params": {"global_orient": TURN.as_rotvec(), "transl": PLACE},
        "object_mesh": "tools/object_meshes/contact_meshes/mug.ply",
    }
    np.savez(path, **arrays, object=np.array(told, dtype=object))
    mesh(tmp_path / told["object_mesh"])
    scene = load_scene(path)
    assert [hand.side for hand in scene.hands] == ["right", "left"]
    assert (scene.fps, scene.source) == (120.0, "GRAB s4/mug_pass_1")
    np.testing.assert_array_equal(scene.up, [0, 0, 1])
    (mug,) = scene.objects
    assert mug.name == "mug"
    same_corners(mug, BOX.vertices @ TURN.as_matrix() + PLACE[:, None])


def test_objects_of_arctic(tmp_path):
    """Its top part turns about (0, 0, -1) first, then both are turned and moved; all in millimetres."""
    (tmp_path / "raw_seqs").mkdir()
    path = test_arctic.write(
        tmp_path / "raw_seqs", right=test_arctic.hand_of("right"), left=test_arctic.hand_of("left")
    )
    angle = np.linspace(0, 1.5, FRAMES)
    rows = np.concatenate([angle[:, None], TURN.as_rotvec(), 1e3 * PLACE], axis=1)
    np.save(path.with_name("box_grab_01.object.npy"), rows.astype(np.float32))
    for part in ("top", "bottom"):
        mesh(tmp_path / "meta" / "object_vtemplates" / "box" / f"{part}.obj", scale=1e3)
    scene = load_scene(path, mano=mano(tmp_path))
    assert [hand.side for hand in scene.hands] == ["right", "left"]
    bottom, top = scene.object("box bottom"), scene.object("box top")
    same_corners(bottom, np.stack([turn.apply(BOX.vertices) for turn in TURN]) + PLACE[:, None])
    opened = [Rotation.from_rotvec([0, 0, -a]).apply(BOX.vertices) for a in angle]
    expected = np.stack([turn.apply(own) for turn, own in zip(TURN, opened, strict=True)]) + PLACE[:, None]
    same_corners(top, expected)
    assert top.hinge is not None
    np.testing.assert_allclose(top.hinge.angle, angle, atol=1e-6)
    assert top.hinge.parent == "box bottom"


def test_objects_of_dexycb(tmp_path):
    """Quaternions xyzw in the master camera's frame; seen from the table as the hand is."""
    folder = test_dexycb.write(tmp_path, ycb_ids=[5, 2])
    rows = np.zeros((FRAMES, 2, 7), np.float32)
    rows[:, 0] = np.concatenate([TURN.as_quat(), PLACE], axis=1)
    rows[:, 1] = rows[2, 0] = [0, 0, 0, 1, 0, 0, 0]
    with np.load(folder / "pose.npz") as file:
        np.savez(folder / "pose.npz", pose_m=file["pose_m"], pose_y=rows)
    mesh(tmp_path / "models" / "006_mustard_bottle" / "textured_simple.obj")
    scene = load_scene(folder, mano=licensed_file(tmp_path))
    (bottle,) = scene.objects  # the cracker box is never there
    assert bottle.name == "006_mustard_bottle"
    assert np.flatnonzero(~bottle.seen).tolist() == [2]
    in_camera = np.stack([turn.apply(BOX.vertices) for turn in TURN]) + PLACE[:, None]
    table = test_dexycb.TABLE
    same_corners(bottle, (in_camera - table[:, 3]) @ table[:, :3])
    with pytest.raises(InputError, match="expected different numbers from 1 to 21"):
        load_scene(test_dexycb.write(tmp_path, ycb_ids=[22]), mano=licensed_file(tmp_path))


def test_objects_of_hocap(tmp_path):
    """Object by object, quaternions xyzw, in the frame of the hands."""
    folder = test_hocap.write(tmp_path, object_ids=["G01_1", "G01_2"])
    rows = np.full((2, FRAMES, 7), -1.0)
    rows[0] = np.concatenate([TURN.as_quat(), PLACE], axis=1)
    rows[1, 1:] = rows[0, 1:]
    np.save(folder / "poses_o.npy", rows)
    mesh(tmp_path / "models" / "G01_1" / "textured_mesh.obj")
    scene = load_scene(folder, mano=mano(tmp_path))
    assert [hand.side for hand in scene.hands] == ["right", "left"]
    first, second = scene.objects
    same_corners(first, np.stack([turn.apply(BOX.vertices) for turn in TURN]) + PLACE[:, None])
    assert (second.name, second.kind, second.seen.tolist()) == ("G01_2", "none", [False] + [True] * 5)
    with pytest.raises(InputError, match=r"holds both hands, and .* is the file of one"):
        load_scene(folder, mano=licensed_file(tmp_path))
    (tmp_path / "empty").mkdir()
    with pytest.raises(InputError, match=r"has no MANO_RIGHT\.pkl"):
        load_scene(folder, mano=tmp_path / "empty")


def test_objects_of_oakink2(tmp_path):
    """Matrices by the frame's number, world from object; the repaired mesh before the scanned one."""
    ids = (8, 12, 16, 28, 32, 36)  # every fourth of 120 a second, with a gap
    poses = {f"O02@0015@0000{k}": dict(zip(ids, matrices(), strict=True)) for k in range(3)}
    del poses["O02@0015@00001"][12]
    path = test_oakink2.write(tmp_path, ids, obj_list=list(poses), obj_transf=poses)
    mesh(tmp_path / "object_raw" / "align_ds" / "O02@0015@00000" / "scan.obj", scale=1.5)
    mesh(tmp_path / "object_repair" / "align_ds" / "O02@0015@00000" / "model.ply")
    mesh(tmp_path / "object_raw" / "align_ds" / "O02@0015@00001" / "scan.obj")
    called = {f"O02@0015@0000{k}": {"obj_name": name} for k, name in enumerate(("bottle", "cap", "cap"))}
    (tmp_path / "object_raw" / "obj_desc.json").write_text(json.dumps(called))
    scene = load_scene(path, mano=mano(tmp_path))
    assert [hand.side for hand in scene.hands] == ["right", "left"]
    assert (scene.fps, scene.source, scene.num_frames) == (30.0, "OakInk2 scene_01__y00z++00000", 8)
    np.testing.assert_array_equal(scene.up, [0, 1, 0])
    assert [found.name for found in scene.objects] == ["bottle", "O02@0015@00001", "O02@0015@00002"]
    expected = np.zeros((8, len(BOX.vertices), 3))
    expected[[0, 1, 2, 5, 6, 7]] = np.stack([turn.apply(BOX.vertices) for turn in TURN]) + PLACE[:, None]
    for found, seen in zip(scene.objects, ([0, 1, 2, 5, 6, 7], [0, 2, 5, 6, 7], [0, 1, 2, 5, 6, 7]), strict=True):
        assert np.flatnonzero(found.seen).tolist() == seen
        if found is not scene.objects[2]:
            same_corners(found, expected)
    assert scene.objects[2].kind == "none"


def test_objects_of_taco(tmp_path):
    """Tool and target beside the hands' folders, in the hands' world; meshes in centimetres."""
    folder = test_taco.write(tmp_path, objects={"target_017": matrices()[::-1], "tool_051": matrices()})
    for name in ("051", "017"):
        mesh(tmp_path / "Object_Models" / f"{name}_cm.obj", scale=100)
    scene = load_scene(folder, mano=mano(tmp_path))
    assert [hand.side for hand in scene.hands] == ["right", "left"]
    assert (scene.fps, scene.source) == (30.0, "TACO (stir, spoon, bowl)/20231105_019")
    np.testing.assert_array_equal(scene.up, [0, 0, 1])
    assert [found.name for found in scene.objects] == ["tool_051", "target_017"]
    expected = np.stack([turn.apply(BOX.vertices) for turn in TURN]) + PLACE[:, None]
    same_corners(scene.object("tool_051"), expected)
    same_corners(scene.object("target_017"), expected[::-1])
