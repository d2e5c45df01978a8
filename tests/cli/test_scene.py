"""`mjx-hand scene`, and what `info` and `view` make of scenes."""

import json

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from mjx_hand.capture.load_scene import load_scene
from mjx_hand.capture.markers.marker_recording import MarkerRecording, save_recording
from mjx_hand.cli import view as view_command
from mjx_hand.cli.main import main
from mjx_hand.motion import load_scene_file, save_motion, save_scene
from mjx_hand.pytree import replace
from mjx_hand.view.browser.scene import MeshLayer, check_scene
from tests.motion.scenes import FPS, FRAMES, poses, scene, still_hand

COLUMNS = "time,x,y,z,qw,qx,qy,qz"


@pytest.fixture
def folder(tmp_path):
    """A motion, a box's mesh, and its poses as a table at 60/s with a gap."""
    save_motion(still_hand(), tmp_path / "hand.npz")
    trimesh.creation.box(extents=[0.04, 0.06, 0.08]).export(tmp_path / "box.stl")
    rows = poses(2 * FRAMES, 2 * FPS)
    lines = [",".join(map(str, [100 + k / (2 * FPS), *row])) for k, row in enumerate(rows)]
    lines[11] = f"{100 + 11 / (2 * FPS)}" + "," * 7
    lines[12] = f"{100 + 12 / (2 * FPS)}" + "," * 7
    (tmp_path / "poses.csv").write_text("\n".join([COLUMNS, *lines]))
    np.save(tmp_path / "poses.npy", poses())
    return tmp_path


def run(folder, *options: str) -> int:
    return main(["scene", str(folder / "hand.npz"), "--out", str(folder / "scene.npz"), *options])


def test_a_motion_a_mesh_and_poses_make_a_scene(folder, capsys):
    given = ("--object", f"cup={folder / 'box.stl'}", "--poses", str(folder / "poses.csv"), "--up", "+y")
    assert run(folder, *given) == 0
    out = capsys.readouterr().out
    assert "mesh of 12 triangles, 40 x 60 x 80 mm" in out
    assert "not seen in 1 frames" in out
    assert "look at it with: mjx-hand view" in out
    found = load_scene_file(folder / "scene.npz")
    cup = found.object("cup")
    assert np.flatnonzero(~cup.seen).tolist() == [6]
    np.testing.assert_allclose(cup.position[cup.seen], poses()[cup.seen, :3], atol=1e-9)
    np.testing.assert_allclose(cup.quaternion[cup.seen], poses()[cup.seen, 3:], atol=1e-9)
    np.testing.assert_array_equal(found.up, [0, 1, 0])
    assert main(["scene", str(folder / "scene.npz"), "--out", str(folder / "scene.json")]) == 0
    assert json.loads((folder / "scene.json").read_text())["objects"] == ["cup"]
    assert load_scene(folder / "scene.json").object("cup").kind == "mesh"


def test_two_hands_and_two_objects(folder, capsys):
    save_motion(still_hand("left", frames=2 * FRAMES, fps=2 * FPS), folder / "other.npz")
    given = ["--object", "can=cylinder:0.03,0.05", "ball=sphere:0.02"]
    given += ["--poses", f"can={folder / 'poses.npy'}", f"ball={folder / 'poses.npy'}"]
    given += ["--left", str(folder / "other.npz")]
    assert run(folder, *given) == 0
    found = load_scene_file(folder / "scene.npz")
    assert [hand.side for hand in found.hands] == ["right", "left"]
    assert [(each.name, each.kind) for each in found.objects] == [("can", "cylinder"), ("ball", "sphere")]
    np.testing.assert_array_equal(found.object("can").size, [0.03, 0.05, 0])
    assert "it is not said where up is" in capsys.readouterr().out


def test_objects_with_markers(folder, capsys):
    """A cluster whose places on the mesh are known gives the mesh's pose; the hand's motion is another file."""
    places = np.array([[0.02, 0.0, 0.0], [0.0, 0.03, 0.0], [0.0, 0.0, 0.04], [0.01, 0.01, -0.03]])
    turn = Rotation.from_quat(poses()[:, 3:], scalar_first=True).as_matrix()
    positions = np.einsum("tij,mj->tmi", turn, places) + poses()[:, None, :3]
    positions[5, [0, 1]] = positions[5, [1, 0]]
    visible = np.ones((FRAMES, 4), bool)
    visible[8, :2] = False
    save_recording(
        MarkerRecording(fps=FPS, positions=positions, visible=visible, names=("a", "b", "c", "d")),
        folder / "markers.npz",
    )
    (folder / "places.yaml").write_text("\n".join(f"{n}: {p.tolist()}" for n, p in zip("abcd", places, strict=True)))
    given = ["--object", f"cup={folder / 'box.stl'}", "--marker-file", str(folder / "markers.npz")]
    given += ["--object-markers", "a,b,c,d"]
    assert run(folder, *given, "--object-places", str(folder / "places.yaml")) == 0
    out = capsys.readouterr().out
    assert "labels had changed places in 1 frames, first 5" in out
    cup = load_scene_file(folder / "scene.npz").object("cup")
    assert np.flatnonzero(~cup.seen).tolist() == [8]
    np.testing.assert_allclose(cup.position[cup.seen], poses()[cup.seen, :3], atol=1e-6)
    np.testing.assert_allclose(cup.rotation[cup.seen], turn[cup.seen], atol=1e-5)
    assert run(folder, *given) == 0
    assert "its mesh is taken to lie in the markers' own frame" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--object", "cup=FOLDER/box.stl"], "give its --poses cup=FILE or its --object-markers"),
        (["--object", "FOLDER/box.stl"], "say which object it is of: --object NAME="),
        (["--object", "cup=FOLDER/none.stl", "--poses", "FOLDER/poses.npy"], "no such file"),
        (["--object", "cup=box:a", "--poses", "FOLDER/poses.npy"], "sizes are numbers"),
        (["--object", "cup=box:0.1", "--poses", "FOLDER/poses.npy"], "3 positive sizes"),
        (["--object", "cup=FOLDER/box.stl", "--poses", "FOLDER/none.csv"], "no such file; poses of an object are"),
        (["--object", "cup=FOLDER/box.stl", "--poses", "FOLDER/hand.npz"], "has no 'poses'"),
        (["--object", "cup=FOLDER/box.stl", "--poses", "FOLDER/short.npy"], "3 poses for 20 frames"),
        (["--object", "cup=FOLDER/box.stl", "--poses", "FOLDER/bad.csv"], "has columns x, y, z, qw"),
        (["--object", "cup=FOLDER/box.stl", "--object-unit", "mm", "--poses", "FOLDER/poses.npy"], "8e-05 m long"),
        (["--object", "a=box:1", "a=box:2", "--poses", "a=x"], "'a' is given twice"),
        (["--object-places", "cup=places.yaml"], "cup: is no object here"),
    ],
)
def test_what_cannot_be_is_one_line_and_nothing_is_written(folder, capsys, options, message):
    np.save(folder / "short.npy", poses()[:3])
    (folder / "bad.csv").write_text("a,b\n1,2")
    before = set(folder.iterdir())
    assert run(folder, *(option.replace("FOLDER", str(folder)) for option in options)) == 2
    said = capsys.readouterr()
    assert message in said.err
    assert said.err.count("\n") == 1
    assert said.out == ""
    assert set(folder.iterdir()) == before


def test_notes_say_what_is_missing_or_far(folder, capsys):
    rows = poses()
    rows[:, 0] += 3.0
    np.save(folder / "far.npy", rows)
    assert run(folder, "--poses", f"cup={folder / 'far.npy'}") == 0
    out = capsys.readouterr().out
    assert "cup: poses without a mesh" in out
    assert "never near a hand" in out
    box = trimesh.creation.box(extents=[0.04, 0.06, 0.08])
    trimesh.Trimesh(box.vertices, box.faces[:-1]).export(folder / "open.stl")
    assert run(folder, "--object", f"cup={folder / 'open.stl'}", "--poses", str(folder / "poses.npy")) == 0
    assert "not closed" in capsys.readouterr().out
    assert run(folder) == 0
    assert "no object: a hand alone" in capsys.readouterr().out


def test_info_and_view(tmp_path, capsys):
    path = tmp_path / "scene.json"
    save_scene(scene(), path)
    assert main(["info", str(path)]) == 0
    out = capsys.readouterr().out
    assert "mjx-hand scene" in out
    assert "object box" in out
    assert "not seen in 2 frames" in out
    assert f"next: mjx-hand scene {path} --out scene.npz" in out
    save_scene(replace(scene(), up=np.array([0.0, 1.0, 0.0])), path)
    options = {"side": None, "sequence": None, "fps": None, "up": None, "mano": None}
    shown = check_scene(view_command.recording_scene(path, **options))
    assert [layer.name for layer in shown.layers] == ["right hand", "left hand", "object box", "object wedge"]
    assert shown.up == "+z"
    box = shown.layers[2]
    assert isinstance(box, MeshLayer)
    turned = scene().object("box").position @ np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])
    np.testing.assert_allclose(box.transforms[:, 0, :3, 3], turned, atol=1e-12)  # y is up: it becomes z
    assert len(shown.curves) == 4
