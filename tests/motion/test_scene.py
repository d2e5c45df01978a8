"""`RecordedScene`: what it refuses, how rates are brought together, and its files."""

import json

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from mjx_hand.errors import InputError
from mjx_hand.motion import load_scene_file, make_scene, recorded_object, save_scene
from mjx_hand.motion.scene import Hinge, check_scene
from mjx_hand.motion.scene_file import is_scene_json
from mjx_hand.pytree import replace
from tests.motion.motions import assert_same
from tests.motion.scenes import FPS, FRAMES, TETRAHEDRON, poses, scene, still_hand, tetrahedron


def same_scene(a, b) -> None:
    assert (a.fps, a.source, len(a.hands), len(a.objects)) == (b.fps, b.source, len(b.hands), len(b.objects))
    np.testing.assert_array_equal(a.up, b.up)
    for one, other in zip((*a.hands, *a.objects), (*b.hands, *b.objects), strict=True):
        assert_same(one, other)


@pytest.mark.parametrize("suffix", ["npz", "json"])
def test_a_scene_comes_back_from_its_file(tmp_path, suffix):
    written = scene()
    save_scene(written, tmp_path / f"scene.{suffix}")
    read = load_scene_file(tmp_path / f"scene.{suffix}")
    same_scene(read, written)
    assert [hand.side for hand in read.hands] == ["right", "left"]
    assert read.object("wedge").seen.tolist() == [k not in (3, 4) for k in range(FRAMES)]
    bare = replace(written, hands=(), up=None)
    save_scene(bare, tmp_path / f"bare.{suffix}")
    assert load_scene_file(tmp_path / f"bare.{suffix}").up is None


def test_json_is_plain_and_known_by_its_schema(tmp_path):
    save_scene(scene(), tmp_path / "scene.json")
    found = json.loads((tmp_path / "scene.json").read_text())
    assert found["schema"] == "mjx-hand/scene/1"
    assert found["objects"] == ["box", "wedge"]
    np.testing.assert_allclose(found["object_0_position"], poses()[:, :3])
    assert is_scene_json(tmp_path / "scene.json")
    last = {name: value for name, value in found.items() if name != "schema"} | {"schema": found["schema"]}
    (tmp_path / "last.json").write_text(json.dumps(last))
    assert is_scene_json(tmp_path / "last.json")
    same_scene(load_scene_file(tmp_path / "last.json"), scene())
    (tmp_path / "other.json").write_text('{"schema": "mine"}')
    assert not is_scene_json(tmp_path / "other.json")


def test_matrices_and_quaternions_say_the_same():
    rows = poses()
    matrices = np.tile(np.eye(4), (FRAMES, 1, 1))
    matrices[:, :3, :3] = Rotation.from_quat(rows[:, 3:], scalar_first=True).as_matrix()
    matrices[:, :3, 3] = rows[:, :3]
    a, b = recorded_object("a", rows), recorded_object("a", matrices)
    np.testing.assert_allclose(a.rotation, b.rotation, atol=1e-12)
    np.testing.assert_allclose(b.rotation, matrices[:, :3, :3], atol=1e-12)
    np.testing.assert_allclose(a.position, b.position)
    assert a.kind == "none"
    rows[2] = 0.0
    assert recorded_object("a", rows).seen.tolist() == [k != 2 for k in range(FRAMES)]


def test_two_rates_are_brought_together():
    """Poses at 60/s under a hand at 30/s are those that were recorded at 30/s, where both neighbours were seen."""
    found = make_scene(still_hand(), tetrahedron(frames=37, fps=60.0), fps=60.0)
    assert found.num_frames == 19  # 0.6 s
    wedge = found.object("wedge")
    assert wedge.seen.tolist() == [k != 2 for k in range(19)]  # frames 3 and 4 of 60/s
    direct = recorded_object("wedge", poses())
    np.testing.assert_allclose(wedge.position[wedge.seen], direct.position[:19][wedge.seen], atol=1e-12)
    np.testing.assert_allclose(wedge.rotation[wedge.seen], direct.rotation[:19][wedge.seen], atol=1e-12)
    odd = make_scene(still_hand(), recorded_object("cup", poses(15, 25.0)), fps=25.0).object("cup")
    np.testing.assert_allclose(odd.position, poses()[: odd.num_frames, :3], atol=1e-12)
    np.testing.assert_allclose(odd.quaternion, poses()[: odd.num_frames, 3:], atol=1e-12)
    both = make_scene([still_hand(), still_hand("left", frames=2 * FRAMES, fps=2 * FPS)])
    np.testing.assert_allclose(both.hand("left").wrist_position, both.hand("right").wrist_position, atol=1e-12)


def test_articulated_parts_follow_their_hinge(tmp_path):
    base = recorded_object("base", poses(), mesh=TETRAHEDRON)
    angle = np.linspace(0, 1, FRAMES)
    point, axis = np.array([0.0, 0.02, 0.0]), np.array([0.0, 0.0, 1.0])
    turn = Rotation.from_rotvec(np.outer(angle, axis)).as_matrix()
    matrices = np.tile(np.eye(4), (FRAMES, 1, 1))
    matrices[:, :3, :3] = base.rotation @ turn
    matrices[:, :3, 3] = base.position + np.einsum("tij,tj->ti", base.rotation, point - turn @ point)
    hinge = Hinge(point=point, axis=axis, angle=angle, parent="base")
    lid = replace(recorded_object("lid", matrices, mesh=TETRAHEDRON), hinge=hinge)
    found = make_scene(still_hand(), [base, lid])
    save_scene(found, tmp_path / "box.npz")
    assert_same(load_scene_file(tmp_path / "box.npz").object("lid"), lid)
    with pytest.raises(InputError, match="off where its hinge puts it"):
        check_scene(replace(found, objects=(base, replace(lid, hinge=replace(hinge, angle=angle + 0.2)))))
    with pytest.raises(InputError, match="'base', which is not in the scene"):
        check_scene(replace(found, objects=(lid,)))


def test_what_cannot_be_a_scene_is_said_in_one_line(tmp_path):
    box = scene().object("box")
    cases = [
        (lambda: make_scene((), fps=30.0), "neither hand nor object"),
        (lambda: make_scene((), box), "give fps"),
        (lambda: make_scene([still_hand(), still_hand()]), "right and right hands"),
        (lambda: make_scene(still_hand(), [box, box]), "a name of its own"),
        (lambda: make_scene(still_hand(frames=8), box), "numbers of frames differ .right hand 8, box 20"),
        (lambda: make_scene(still_hand(), box, up="z"), r"up is 'z'; valid: \+x"),
        (lambda: make_scene(still_hand(), box, up=[0.0, 0.0, 0.0]), "not all zero"),
        (lambda: recorded_object("cup", poses()[:, :6]), r"poses have shape \(20, 6\)"),
        (lambda: recorded_object("cup", np.full((5, 7), np.nan)), "seen in none of the 5 frames"),
        (lambda: recorded_object("cup", poses() * 2), "quaternion has length 2"),
        (lambda: recorded_object("cup", np.tile(np.diag([1.0, 1, -1, 1]), (3, 1, 1))), "no rotation"),
        (lambda: recorded_object("cup", poses(), kind="cone", size=(1.0,)), "its kind is 'cone'; valid: box"),
        (lambda: recorded_object("cup", poses(), kind="cylinder", size=(0.1,)), "2 positive sizes"),
        (lambda: recorded_object("cup", poses(), kind="box", size=(1.0, 1, 1), mesh=TETRAHEDRON), "both a mesh and"),
        (lambda: recorded_object("cup", poses(), mesh=tmp_path / "none.stl"), "no such file"),
        (lambda: save_scene(scene(), tmp_path / "scene.csv"), r"written as \.npz or \.json"),
        (lambda: scene().object("cap"), "no object 'cap'; it has box, wedge"),
        (lambda: make_scene(still_hand()).hand("left"), "no left hand; it has right"),
    ]
    for made, message in cases:
        with pytest.raises(InputError, match=message) as refusal:
            made()
        assert "\n" not in str(refusal.value)
    assert not list(tmp_path.iterdir())


def test_meshes_in_millimetres_and_of_a_million_triangles(tmp_path):
    cube = trimesh.creation.box(extents=[40.0, 60, 80])
    cube.export(tmp_path / "mm.stl")
    with pytest.raises(InputError, match=r"80 m long.*millimetres"):
        recorded_object("cup", poses(), mesh=tmp_path / "mm.stl")
    found = recorded_object("cup", poses(), mesh=tmp_path / "mm.stl", unit="mm")
    np.testing.assert_allclose(np.ptp(found.vertices, axis=0), [0.04, 0.06, 0.08])
    with pytest.raises(InputError, match="unit 'km' is not known"):
        recorded_object("cup", poses(), mesh=tmp_path / "mm.stl", unit="km")
    many = trimesh.creation.icosphere(subdivisions=7, radius=0.05)  # 327,680
    many.export(tmp_path / "many.stl")
    with pytest.raises(InputError, match="simplify the mesh first"):
        recorded_object("cup", poses(), mesh=tmp_path / "many.stl")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"hands": ["both"]}, r"hands are \('both',\)"),
        ({"hands": 3}, "hands holds int64 of shape"),
        ({"objects": ["a", "b", "c"]}, "has no 'kind'"),
        ({"fps": 0}, "fps is 0"),
        ({"right_rotations": [[1, 2], [3]]}, "different lengths"),
        ({"object_0_seen": [True]}, r"seen has shape \(1,\)"),
        ({"object_0_position": "here"}, "expected numbers"),
        ({"object_1_faces": [[0, 1, 9]]}, "names vertex 9 of 4"),
        ({"up": [0, 0, 2]}, "unit vector"),
        ({"schema": "mjx-hand/scene/0"}, "its 'schema' must be"),
    ],
)
def test_damaged_files_are_refused_in_one_line(tmp_path, change, message):
    save_scene(scene(), tmp_path / "scene.json")
    found = json.loads((tmp_path / "scene.json").read_text())
    (tmp_path / "scene.json").write_text(json.dumps(found | change))
    with pytest.raises(InputError, match=message) as refusal:
        load_scene_file(tmp_path / "scene.json")
    assert "\n" not in str(refusal.value)
