"""A robot's policy for other programs: what its contract says, Brax's actions, and the project's rollout."""

import ctypes
import dataclasses
import json
import sys
from pathlib import Path

import jax
import mujoco
import numpy as np
import pytest

from envs.evaluation.evaluate import Evaluation
from envs.evaluation.rollout import Rollouts
from envs.physics.solver import gauss_seidel
from envs.scene import demonstration_spec
from envs.tracking import TrackingEnv
from mjx_hand.bodies.named_body import named_body
from mjx_hand.errors import InputError
from mjx_hand.files.digests import digest, file_piece
from mjx_hand.player.exported_policy import load_exported_policy
from mjx_hand.player.play_policy import Player, play_policy
from mjx_hand.player.tracking_reference import load_tracking_reference
from tests.robots.test_mjcf_file import write
from tests.train.export.test_parity import compiled
from tests.train.export.test_play import EXAMPLE, LIBRARY, ROOT, WRITTEN_OTHERWISE, differing, run
from tests.train.robot_run import robot_run
from train.experiment.setup import load_env, rolled_out
from train.export.__main__ import command_line
from train.export.contract import make_contract
from train.export.export_policy import export_policy
from train.export.scene_xml import write_scene
from train.learning.checkpoint import load_checkpoint
from train.learning.policy import deterministic_policy
from train.settings.config import Config
from train.settings.options import Export

SLOPE = 0.7012345678
Own = tuple[TrackingEnv, Rollouts, Evaluation]


@pytest.fixture(scope="module")
def exported(allegro: Config) -> Path:
    return export_policy(dataclasses.replace(allegro, export=Export(to=("onnx", "npz", "c"))))


@pytest.fixture(scope="module")
def own(allegro: Config) -> Own:
    """The project's rollout of the same policy."""
    env = load_env(allegro, "heldout")
    return env, *rolled_out(allegro, env)[1:]


@pytest.fixture(scope="module")
def little(tmp_path_factory: pytest.TempPathFactory) -> Config:
    """A run of a hand from MJCF, of whose joints a third is tied to others, with a slope of many digits."""
    folder = tmp_path_factory.mktemp("little")
    return robot_run(folder, str(write(folder, lambda text: text.replace("'0 0.7 0 0 0'", f"'0 {SLOPE} 0 0 0'"))))


def test_the_contract_names_actuators_in_the_models_order(exported: Path, allegro: Config):
    contract, body = json.loads((exported / "contract.json").read_text()), named_body("allegro")
    model = mujoco.MjModel.from_xml_path(str(exported / contract["demonstrations"][0]["scene"]))
    names = [model.actuator(k).name for k in range(model.nu)]
    assert len(names) == 22
    assert [output["elements"] for output in contract["outputs"]] == [names, names]
    actuators = contract["body"]["actuators"]
    assert [actuator["name"] for actuator in actuators] == names
    assert [actuator["unit"] for actuator in actuators] == contract["outputs"][1]["unit"] == ["m"] * 3 + ["rad"] * 19
    np.testing.assert_allclose([a["stiffness"] for a in actuators], model.actuator_gainprm[:, 0], rtol=1e-12)
    np.testing.assert_allclose([a["damping"] for a in actuators], -model.actuator_biasprm[:, 2], rtol=1e-12)
    np.testing.assert_allclose([a["force_limit"] for a in actuators[6:]], model.actuator_forcerange[6:, 1], rtol=1e-12)
    assert (contract["body"]["name"], contract["body"]["hand"]) == ("allegro", ["right"])
    assert contract["body"]["fingers"] == ["index", "middle", "ring", "thumb"]
    inputs = {entry["name"]: entry for entry in contract["inputs"]}
    assert inputs["residual.hinges"]["elements"] == inputs["grip"]["elements"] == names[6:]
    assert (
        sum(entry["size"] for entry in contract["inputs"]) == load_exported_policy(exported / "policy.npz").offset.size
    )
    scale = contract["function"]["residual_scale"]
    np.testing.assert_allclose(scale[6:], body.reach * allegro.task.residual_scale_fingers, rtol=1e-6)
    page = (exported / "contract.md").read_text()
    assert page.startswith("# Policy `pinch`, hand `allegro`\n")
    assert all(f"| {name} | " in page for name in names)


def test_the_scene_is_the_engines_to_the_last_bit(exported: Path, own: Own, tmp_path: Path, little: Config):
    """With its meshes beside it, and with ties."""
    (entry,) = json.loads((exported / "contract.json").read_text())["demonstrations"]
    assert len(entry["meshes"]) == 4
    pieces = (file_piece(exported / file) for file in (entry["reference"], entry["scene"], *entry["meshes"]))
    assert entry["digest"] == digest(pieces)
    env, other = own[0], load_env(little, "heldout")
    given = other.demonstrations[0], other.hands[0], other.task.contacts
    assert write_scene(tmp_path / "little.xml", *given) == []
    for made, path in ((env, exported / entry["scene"]), (other, tmp_path / "little.xml")):
        spec = demonstration_spec(made.demonstrations[0], made.hands[0], contacts=made.task.contacts)
        (engine,) = gauss_seidel([spec.compile()])
        loaded = mujoco.MjModel.from_xml_path(str(path))
        assert set(differing(engine, loaded)) <= {*WRITTEN_OTHERWISE, "eq_objtype"}  # which no tie of joints needs
    assert loaded.neq == 4


def test_every_form_gives_braxs_actions(exported: Path, allegro: Config, tmp_path: Path):
    policy = load_exported_policy(exported / "policy.npz")
    assert policy.contract["parity"]["largest_difference"] < 1e-5
    folder = exported / "demonstrations"
    player, rows = Player(policy, load_tracking_reference(folder / "000.npz"), folder), []
    for _ in range(100):
        rows.append(player.features())
        player.step()
    spread = np.random.default_rng(0).uniform(-7, 7, (1000, policy.offset.size))
    inputs = np.concatenate([rows, policy.offset + spread / policy.scale]).astype(np.float32)
    act = deterministic_policy(allegro.ppo, policy.offset.size, 22)
    observation = np.clip((inputs - policy.offset) * policy.scale, -5, 5)
    action = np.clip(np.asarray(jax.jit(act)(load_checkpoint(f"{allegro.out}/best.npz").policy, observation)), -1, 1)
    assert np.abs(action).max() > 0.3
    task, reach = allegro.task, named_body("allegro").reach
    worth = [
        task.residual_scale_wrist_position,
        task.residual_scale_wrist_rotation,
        reach * task.residual_scale_fingers,
    ]
    before = inputs[:, policy.residual_place]
    residual = task.smoothing * before + (1 - task.smoothing) * np.repeat(worth, [3, 3, 16]) * action
    found = {"numpy": policy.step(inputs)}
    step = compiled(exported, tmp_path).policy_step
    by_c = np.zeros((2, len(inputs), 22), np.float32)
    pointer = ctypes.POINTER(ctypes.c_float)
    for k in range(len(inputs)):
        assert step(*(row[k].ctypes.data_as(pointer) for row in (inputs, *by_c))) == 0
    found["c"] = (by_c[0], by_c[1])
    runtime = pytest.importorskip("onnxruntime", reason="the package onnxruntime is not installed: make setup")
    session = runtime.InferenceSession(exported / "policy.onnx", providers=["CPUExecutionProvider"])
    found["onnx"] = session.run(["action", "residual"], {"features": inputs})
    for form, got in found.items():
        for one, wanted in zip(got, (action, residual), strict=True):
            np.testing.assert_allclose(one, wanted, rtol=0, atol=1e-5, err_msg=form)


def test_players_without_jax_take_the_projects_path(exported: Path, own: Own, tmp_path: Path):
    _, rollouts, scores = own
    (example,) = (ROOT / "examples").glob("09_*.py")
    run(LIBRARY, exported, tmp_path / "library.npz")
    said = run(EXAMPLE, exported, tmp_path / "example.npz", example)
    wanted = rollouts.object_pose[0, rollouts.counted[0]]
    assert np.ptp(wanted[:, 2]) > 0.1, "lifted"
    for name in ("library", "example"):
        path = np.load(tmp_path / f"{name}.npz")["path"]
        assert np.linalg.norm(path[:, :3] - wanted[:, :3], axis=1).max() < 1e-3, name
    played = np.load(tmp_path / "library.npz")
    assert bool(played["success"]) is bool(scores.scores["manip_trans_object"][0]) is True
    assert 100 * played["error"].mean() == pytest.approx(scores.scores["tracking_error_cm"][0], abs=0.02)
    assert "000.npz: followed, off by" in said


def test_a_hand_with_ties_is_played_too(little: Config, tmp_path: Path):
    """It holds the cube: the paths are the same, and until it is touched so are all coordinates."""
    folder = export_policy(dataclasses.replace(little, export=Export(folder=str(tmp_path / "export"))))
    played = play_policy(folder / "policy.npz", folder / "demonstrations/000.npz")
    _, rollouts, scores = rolled_out(little, load_env(little, "heldout"))
    wanted = rollouts.qpos[0, rollouts.counted[0]]
    assert played.qpos.shape == wanted.shape == (len(wanted), 6 + 12 + 7)
    assert played.success is bool(scores.scores["manip_trans_object"][0]) is True
    moved = np.linalg.norm(wanted[:, -7:-4] - wanted[0, -7:-4], axis=1)
    untouched = int((moved > 1e-3).argmax())
    assert untouched > 20
    np.testing.assert_allclose(played.qpos[:untouched], wanted[:untouched], atol=1e-4)
    (example,) = (ROOT / "examples").glob("09_*.py")
    run(EXAMPLE, folder, tmp_path / "example.npz", example)
    for path in (played.object_pose, np.load(tmp_path / "example.npz")["path"]):
        assert np.linalg.norm(path[:, :3] - wanted[:, -7:-4], axis=1).max() < 1e-3
    coupled = load_exported_policy(folder / "policy.npz").contract["body"]["coupled"]
    assert next((tie["joint"], tie["leader"], tie["slope"]) for tie in coupled) == ("thumb_three", "thumb_two", SLOPE)
    assert f"- thumb_three: {SLOPE:g} * thumb_two + 0" in (folder / "contract.md").read_text()


def test_fingers_that_slide_are_in_metres(exported: Path, allegro: Config, tmp_path: Path):
    body = named_body(str(write(tmp_path, lambda text: text.replace("'ring_two'", "'ring_two' type='slide'", 1))))
    policy = load_exported_policy(exported / "policy.npz")
    contract = make_contract(policy, load_checkpoint(f"{allegro.out}/best.npz"), allegro.task, body, 0.0, [], "right")
    units = dict(zip(body.names.targets, contract["outputs"][1]["unit"], strict=True))
    assert [name for name, unit in units.items() if unit == "m"] == ["wrist_x", "wrist_y", "wrist_z", "ring_two"]
    inputs = {entry["name"]: entry for entry in contract["inputs"]}
    place = body.joints.index("ring_two")
    assert (inputs["speed.hinges"]["unit"][place], inputs["speed.hinges"]["unit"][0]) == ("m/s", "rad/s")
    assert inputs["object_rotation_error"]["unit"] == "rad"


def test_a_policy_of_one_hand_is_not_exported_or_played_with_another(
    exported: Path,
    allegro: Config,
    pinch: Config,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
):
    for given in (f"out={allegro.out}", f"checkpoint={allegro.out}/best.npz"):
        monkeypatch.setattr(sys, "argv", ["export", given, "to=npz", "hand=shadow", f"export.folder={tmp_path / 'x'}"])
        with pytest.raises(SystemExit, match="2"):
            command_line()
        (line,) = capsys.readouterr().err.splitlines()
        assert "holds a training with hand=allegro, now shadow; leave out that option" in line
    assert not (tmp_path / "x").exists()
    human = export_policy(dataclasses.replace(pinch, export=Export(folder=str(tmp_path / "human"))))
    for policy, reference in ((exported, human), (human, exported)):
        with pytest.raises(InputError, match="not a scene of the hand with an object"):
            play_policy(policy / "policy.npz", reference / "demonstrations/000.npz")


def test_an_untrained_hand_is_said_before_its_files_are_read(tmp_path: Path, allegro: Config):
    config = dataclasses.replace(allegro, out=str(tmp_path / "none"))
    with pytest.raises(InputError, match=r"none/best\.npz: no such checkpoint; train one first"):
        export_policy(config)


def test_meshes_of_an_earlier_export_go(allegro: Config, pinch: Config, tmp_path: Path):
    folder = tmp_path / "export"
    export_policy(dataclasses.replace(allegro, export=Export(folder=str(folder))))
    assert len(list((folder / "demonstrations/meshes").iterdir())) == 4
    export_policy(dataclasses.replace(pinch, export=Export(folder=str(folder), demonstrations=0)))
    assert {path.name for path in folder.rglob("*") if path.is_file()} == {"contract.json", "contract.md", "policy.npz"}
