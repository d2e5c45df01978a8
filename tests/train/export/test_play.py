"""An export played in plain MuJoCo, in processes without JAX, beside the project's own rollouts."""

import os
import subprocess
import sys
from pathlib import Path

import mujoco
import numpy as np
import pytest

from envs.demonstrations.twin_hands import twins
from envs.evaluation.evaluate import Evaluation
from envs.evaluation.rollout import Rollouts
from envs.physics.solver import gauss_seidel
from envs.scene import demonstration_spec
from mjx_hand.errors import InputError
from mjx_hand.motion.demonstration import load_demonstration
from mjx_hand.objects.description import ObjectDescription
from mjx_hand.player.exported_policy import load_exported_policy
from mjx_hand.player.play_policy import Player, play_policy
from mjx_hand.player.tracking_reference import load_tracking_reference
from mjx_hand.pytree import replace
from train.experiment.bundled_policies import bundled_env, demonstration_path
from train.experiment.setup import rolled_out
from train.export.scene_xml import write_scene
from train.settings.config import Config

ROOT = Path(__file__).resolve().parents[3]
LIBRARY = """
import sys, numpy as np, mjx_hand
played = mjx_hand.play_policy(sys.argv[1] + "/policy.npz", sys.argv[1] + "/demonstrations/000.npz")
np.savez(sys.argv[2], path=played.object_pose, error=played.position_error, success=played.success)
assert not {"jax", "brax", "flax"} & set(sys.modules)
"""
EXAMPLE = """
import runpy, sys, numpy as np
from pathlib import Path
example = runpy.run_path(sys.argv[3])
example["main"](sys.argv[1])
folder = Path(sys.argv[1])
files = [dict(np.load(folder / name)) for name in ("policy.npz", "demonstrations/000.npz")]
np.savez(sys.argv[2], path=example["play"](*files, folder / "demonstrations/000.xml"))
assert not {"jax", "mjx_hand", "scipy"} & set(sys.modules)
"""

WRITTEN_OTHERWISE = {"site_size", "names", "paths", "text_data", "mesh_pathadr"}  # names, and the size of points


@pytest.fixture(scope="module")
def own(included: Config) -> tuple[Rollouts, Evaluation]:
    """The project's rollout of the same policy on the same demonstration."""
    _, rollouts, scores = rolled_out(included, bundled_env(included))
    return rollouts, scores


def run(program: str, *arguments: str | Path) -> str:
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    command = [sys.executable, "-c", program, *map(str, arguments)]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_the_library_reproduces_the_rollout(exported: Path, own: tuple[Rollouts, Evaluation], tmp_path: Path):
    run(LIBRARY, exported, tmp_path / "played.npz")
    played, (rollouts, scores) = np.load(tmp_path / "played.npz"), own
    assert played["path"].shape == rollouts.object_pose[0].shape
    assert np.linalg.norm(played["path"][:, :3] - rollouts.object_pose[0, :, :3], axis=1).max() < 1e-3
    assert bool(played["success"]) is bool(scores.scores["manip_trans_object"][0]) is True
    assert 100 * played["error"].mean() == pytest.approx(scores.scores["tracking_error_cm"][0], abs=0.02)


def test_an_object_elsewhere_is_gone_to_and_brought_back(exported: Path):
    """The wrist stands to the object as recorded until that is held, and is where it was recorded at the end."""
    file = exported / "demonstrations/000.npz"
    policy, reference = load_exported_policy(exported / "policy.npz"), load_tracking_reference(file)
    usual, moved = (Player(policy, reference, file.parent) for _ in range(2))
    moved.data.qpos[-7:-5] += (0.016, -0.012)
    away = np.linalg.norm(reference.object_pose[:, :3] - reference.object_pose[0, :3], axis=1) > 0.01
    apart = []
    for _ in range(reference.num_frames - 1):
        for player in (usual, moved):
            player.step()
        apart.append(moved.data.body("wrist").xpos - usual.data.body("wrist").xpos)
    np.testing.assert_allclose(apart[int(away.argmax()) - 1], (0.016, -0.012, 0.0), atol=0.008)
    assert np.linalg.norm(apart[-1]) < 0.01
    assert np.linalg.norm(moved.data.qpos[-7:-4] - reference.object_pose[-1, :3]) < 0.02


def test_the_example_reproduces_the_rollout(exported: Path, own: tuple[Rollouts, Evaluation], tmp_path: Path):
    (example,) = (ROOT / "examples").glob("09_*.py")
    said = run(EXAMPLE, exported, tmp_path / "played.npz", example)
    path = np.load(tmp_path / "played.npz")["path"]
    assert np.linalg.norm(path[:, :3] - own[0].object_pose[0, :, :3], axis=1).max() < 1e-3
    assert said.startswith("demonstrations/000.npz: followed, off by ")
    told = float(said.split("off by ")[1].split(" cm")[0])
    assert told == pytest.approx(own[1].scores["tracking_error_cm"][0], abs=0.02)


def differing(a: mujoco.MjModel, b: mujoco.MjModel) -> list[str]:
    """Fields of two models that are not equal to the last bit."""
    names = [name for name in dir(a) if isinstance(getattr(a, name), np.ndarray) and not name.startswith("_")]
    return [name for name in names if not np.array_equal(getattr(a, name), getattr(b, name))]


def test_the_scene_is_the_engines_to_the_last_bit(tmp_path: Path):
    demonstration = load_demonstration(demonstration_path("pinch"))
    (hand,) = twins([demonstration])
    corners = 0.02 * np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1.0)]) + 1e-4 / 3
    hulls = np.stack([corners, corners + np.array([0.01 / 3, 0, 0.02])])
    mesh = ObjectDescription(size=np.full(3, 0.04), mass=1 / 7, friction=2 / 3, hulls=hulls, kind="mesh")
    for made in (demonstration, replace(demonstration, object=mesh)):
        (engine,) = gauss_seidel([demonstration_spec(made, hand).compile()])
        assert write_scene(tmp_path / "scene.xml", made, hand) == []
        loaded = mujoco.MjModel.from_xml_path(str(tmp_path / "scene.xml"))
        assert set(differing(engine, loaded)) <= WRITTEN_OTHERWISE
        for name in ("timestep", "solver", "iterations", "cone", "impratio", "integrator", "disableflags"):
            assert getattr(loaded.opt, name) == getattr(engine.opt, name)


def test_files_that_do_not_belong_together(exported: Path, tmp_path: Path):
    with pytest.raises(InputError, match=r"no such file"):
        play_policy(exported / "policy.npz", tmp_path / "000.npz")
    (tmp_path / "000.npz").write_bytes((exported / "demonstrations/000.npz").read_bytes())
    with pytest.raises(InputError, match=r"000\.xml: no such scene"):
        play_policy(exported / "policy.npz", tmp_path / "000.npz")
    for text, refusal in (("<mujoco>", "cannot load it"), ("<mujoco/>", "not a scene of the hand")):
        (tmp_path / "000.xml").write_text(text)
        with pytest.raises(InputError, match=refusal):
            play_policy(exported / "policy.npz", tmp_path / "000.npz")
    with pytest.raises(InputError, match=r"schema"):
        play_policy(exported / "demonstrations/000.npz", exported / "demonstrations/000.npz")
