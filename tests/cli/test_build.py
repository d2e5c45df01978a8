"""`mjx-hand build`, called as a shell would, its files loaded by programs of others."""

import csv
import pickle

import matplotlib.image as mpimg
import mujoco
import numpy as np
import pytest
import yourdfpy

from mjx_hand.cli.main import main
from mjx_hand.hand.joints import HINGES, LINKS
from mjx_hand.hand.load import load_hand
from mjx_hand.rigid.build import build_rigid_hand
from tests.hand.mano_layout import layout, official


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    folder = tmp_path_factory.mktemp("build") / "hand"
    assert main(["build", "--out", str(folder), "--shape", "1.5", "-0.5"]) == 0
    return folder


def test_both_descriptions_load_and_agree(built):
    urdf = yourdfpy.URDF.load(str(built / "right_hand.urdf"))
    mjcf = mujoco.MjModel.from_xml_path(str(built / "right_hand.xml"))
    assert tuple(urdf.actuated_joint_names) == HINGES
    assert tuple(mjcf.joint(k).name for k in range(mjcf.njnt)) == HINGES
    masses = {name: (urdf.link_map[name].inertial.mass, mjcf.body(name).mass[0]) for name in LINKS}
    assert all(np.isclose(*pair, rtol=1e-4) for pair in masses.values()), masses
    assert len(list((built / "meshes").glob("*.obj"))) == 16


def test_summary_names_links_masses_and_how_to_load(tmp_path, capsys):
    assert main(["build", "--out", str(tmp_path / "left"), "--side", "left", "--wrist-joints"]) == 0
    out = capsys.readouterr().out
    assert "16 links, 20 hinges" in out
    assert "thumb3" in out
    assert f"mujoco.MjModel.from_xml_path('{tmp_path / 'left' / 'left_hand.xml'}')" in out
    assert mujoco.MjModel.from_xml_path(str(tmp_path / "left" / "left_hand.xml")).nq == 26


def test_hulls_on_request(tmp_path):
    assert main(["build", "--out", str(tmp_path / "hand"), "--collision", "hulls"]) == 0
    assert len(list((tmp_path / "hand" / "meshes").glob("*_hull.obj"))) == 16
    assert mujoco.MjModel.from_xml_path(str(tmp_path / "hand" / "right_hand.xml")).nmesh == 32


def test_report_measures_the_skin(tmp_path, capsys):
    assert main(["build", "--out", str(tmp_path / "hand"), "--shape", "1", "--report"]) == 0
    out = capsys.readouterr().out
    assert "skin on rigid links against blended skin (mm)" in out
    with (tmp_path / "hand" / "skin_error.csv").open() as file:
        rows = {(row["postures"], row["link"]): row for row in csv.DictReader(file)}
    assert {link for _, link in rows} == {"all", *LINKS}
    assert {"fist", "pinch", "spread", "mcp flexion"} <= {name for name, _ in rows}
    fist = rows["fist", "all"]
    assert 0.3 < float(fist["mean_mm"]) < float(fist["p95_mm"]) < float(fist["max_mm"])
    assert f"{float(fist['mean_mm']):.2f}" in out
    picture = mpimg.imread(tmp_path / "hand" / "skin_error.png")
    assert picture.std() > 0.05


def test_report_takes_a_recording(tmp_path, capsys, recordings):
    motion = str(recordings / "dexmv_mustard" / "sequence.npz")
    assert main(["build", "--out", str(tmp_path / "hand"), "--report", "--motion", motion]) == 0
    assert "sequence.npz (122)" in capsys.readouterr().out
    assert main(["build", "--out", str(tmp_path / "left"), "--side", "left", "--report", "--motion", motion]) == 2
    assert "holds a right hand, but the hand built is a left one" in capsys.readouterr().err
    assert not (tmp_path / "left").exists()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--shape", "nan"], "every coefficient must be finite"),
        (["--shape", *["0"] * 40], "give a list of up to"),
        (["--shape", "1", "-100"], "--shape 1 -100: no hand; stay within +-10"),
        (["--mano", "gone.pkl"], "gone.pkl"),
        (["--motion", "gone.npz"], "give --report too"),
        (["--report", "--motion", "gone.npz"], "gone.npz"),
    ],
)
def test_input_at_fault_is_one_line_status_2_and_no_output(tmp_path, capsys, arguments, message):
    assert main(["build", "--out", str(tmp_path / "hand"), *arguments]) == 2
    printed = capsys.readouterr()
    assert printed.out == ""
    assert printed.err.startswith("mjx-hand: ")
    assert message in printed.err
    assert printed.err.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("changes", "arguments", "message"),
    [
        ({}, ["--side", "left"], "holds a right hand, but side is 'left'"),
        ({"shapedirs": None}, [], "has no 'shapedirs'"),
        ({"weights": np.zeros((3, 16))}, [], "'weights' has shape (3, 16)"),
        ({"v_template": np.full((1649, 3), np.inf)}, [], "'v_template' has NaN, infinity"),
        ({}, ["--shape", *["0.1"] * 11], "up to 10"),
        ({"f": np.roll(load_hand().faces, 1, axis=0)[:, [0, 1, 1]]}, [], "surface"),
    ],
    ids=["side", "key", "shape", "infinity", "coefficients", "faces"],
)
def test_mano_files_at_fault_are_one_line_and_no_output(tmp_path, capsys, changes, arguments, message):
    values = {key: value for key, value in (layout(load_hand()) | changes).items() if value is not None}
    path = tmp_path / "MANO_RIGHT.pkl"
    path.write_bytes(pickle.dumps(values))
    assert main(["build", "--out", str(tmp_path / "hand"), "--mano", str(path), *arguments]) == 2
    printed = capsys.readouterr()
    assert printed.out == ""
    assert printed.err.startswith("mjx-hand: ")
    assert message in printed.err
    assert printed.err.count("\n") == 1
    assert [entry.name for entry in tmp_path.iterdir()] == ["MANO_RIGHT.pkl"]


def test_a_mano_file_becomes_a_hand(tmp_path, capsys):
    path = tmp_path / "MANO_LEFT.pkl"
    path.write_bytes(official(load_hand(side="left")))
    assert main(["build", "--out", str(tmp_path / "hand"), "--mano", str(path), "--side", "left", "--shape", "1"]) == 0
    assert "MANO_LEFT.pkl, left: 16 links" in capsys.readouterr().out
    found = mujoco.MjModel.from_xml_path(str(tmp_path / "hand" / "left_hand.xml"))
    own = build_rigid_hand(load_hand(side="left"), [1.0])
    np.testing.assert_allclose(found.body("wrist").mass[0], own.link_mass[0], rtol=1e-4)


def test_folder_that_cannot_be_written(tmp_path, capsys):
    (tmp_path / "file").touch()
    for out in (tmp_path / "file", tmp_path / "file" / "below"):
        assert main(["build", "--out", str(out)]) == 2
        printed = capsys.readouterr()
        assert str(out) in printed.err
        assert printed.err.count("\n") == 1
    assert [p.name for p in tmp_path.iterdir()] == ["file"]


@pytest.mark.parametrize("arguments", [["build"], ["build", "--out", "x", "--shpae", "1"], ["bild"], []])
def test_unknown_and_missing_options_exit_with_2(arguments, capsys):
    with pytest.raises(SystemExit) as stop:
        main(arguments)
    assert stop.value.code == 2
