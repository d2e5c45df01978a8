"""A user's mesh in place of a grasp type's objects: the same grasp where the shape is the same, and clear refusals."""

from pathlib import Path

import numpy as np
import pytest
import trimesh

from envs.demonstrations.scripted.grasp_posture import solve_postures
from envs.demonstrations.scripted.own_object import own_object
from envs.demonstrations.scripted.trials import perform_trials
from envs.demonstrations.set_settings import SetSettings, set_folder
from envs.grasps import grasp_type
from mjx_hand.errors import InputError
from mjx_hand.hand.load import load_hand
from mjx_hand.objects.description import ObjectDescription
from mjx_hand.rigid.build import build_rigid_hand
from mjx_hand.rigid.rigid_hand import RigidHand


@pytest.fixture(scope="module")
def hand() -> RigidHand:
    model = load_hand()
    return build_rigid_hand(model, np.zeros(model.num_shape))


def written(mesh: trimesh.Trimesh, path: Path) -> str:
    mesh.export(path)
    return str(path)


def bottle() -> trimesh.Trimesh:
    """A bottle of 62 mm with a narrower neck, 17 cm tall, its frame at its foot."""
    outline = [[0, 0], [0.031, 0], [0.031, 0.12], [0.014, 0.145], [0.014, 0.17], [0, 0.17]]
    return trimesh.creation.revolve(np.array(outline), sections=24)


@pytest.mark.slow
def test_a_cubes_mesh_is_grasped_as_the_cube_is(hand, tmp_path):
    grasp, half = grasp_type("pinch"), 0.017
    path = written(trimesh.creation.box([2 * half] * 3), tmp_path / "cube.stl")
    mesh = own_object(path, grasp, mass=0.2).description
    box = ObjectDescription(kind="box", size=np.full(3, half), mass=0.2, friction=0.9)
    of_mesh, of_box = solve_postures(grasp, [hand], [mesh]), solve_postures(grasp, [hand], [box])
    np.testing.assert_allclose(of_mesh.contact_normal, of_box.contact_normal, atol=1e-5)
    np.testing.assert_allclose(of_mesh.contact_point, of_box.contact_point, atol=5e-4)
    np.testing.assert_allclose(of_mesh.position, of_box.position, atol=2e-3)
    assert of_mesh.touch_error[0] < 0.001


def test_a_bottle_is_held_and_stays_the_bottle(hand, tmp_path):
    grasp = grasp_type("cylindrical")
    own = own_object(written(bottle(), tmp_path / "bottle.obj"), grasp, density=500.0)
    trials, _ = perform_trials(grasp, [hand], per_person=1, seed=1, own=own)
    (trial,) = trials
    assert trial.object.kind == "mesh"
    assert trial.object.mass == pytest.approx(500 * bottle().volume, rel=1e-6)
    assert trial.object_pose[0, 2] == pytest.approx(0.085, abs=0.002)  # stands on the table: half its height
    assert trial.object_pose[:, 2].max() > 0.085 + 0.10


def test_without_a_mass_the_types_are_drawn(tmp_path):
    grasp = grasp_type("cylindrical")
    own = own_object(written(bottle(), tmp_path / "bottle.ply"), grasp)
    masses = [own.draw(grasp, np.random.default_rng(seed)).mass for seed in range(20)]
    assert min(masses) >= grasp.object_mass[0]
    assert max(masses) <= grasp.object_mass[1]
    assert len(set(masses)) == 20


@pytest.mark.parametrize(
    ("extents", "type_name", "advice"),
    [
        ([0.2, 0.07, 0.07], "cylindrical", "axes x, y, z are today's"),
        ([0.065, 0.065, 0.065], "pinch", "its size suits spherical"),
        ([0.3, 0.3, 0.3], "pinch", "scale it"),
        ([34, 34, 34], "pinch", "in millimetres"),
        ([0.034, 0.034, 0.034], "lateral", "its size suits pinch"),
    ],
)
def test_a_size_that_does_not_suit_is_told(tmp_path, extents, type_name, advice):
    path = written(trimesh.creation.box(extents), tmp_path / "block.stl")
    with pytest.raises(InputError, match=advice) as told:
        own_object(path, grasp_type(type_name), mass=0.1)
    assert path in str(told.value)


@pytest.mark.parametrize(
    ("options", "reason"),
    [
        ({"grasp": "all", "object": "x.stl"}, "one scripted type"),
        ({"grasp": "pinch", "object_mass": 0.1}, "not given"),
        ({"grasp": "pinch", "object": "x.stl", "object_mass": 0.1, "object_density": 1.0}, "give one of them"),
    ],
)
def test_settings_that_contradict_each_other(options, reason):
    with pytest.raises(InputError, match=reason):
        SetSettings(**options)


def test_another_mesh_is_another_set(tmp_path):
    usual = SetSettings("pinch")
    first = SetSettings("pinch", object=written(trimesh.creation.box([0.03] * 3), tmp_path / "a.stl"))
    moved = SetSettings("pinch", object=written(trimesh.creation.box([0.03] * 3), tmp_path / "b.stl"))
    other = SetSettings("pinch", object=written(trimesh.creation.box([0.031] * 3), tmp_path / "c.stl"))
    names = [set_folder(settings, tmp_path).name for settings in (usual, first, moved, other)]
    assert names[1] == names[2]
    assert len(set(names)) == 3
    with pytest.raises(InputError, match="No such file"):
        set_folder(SetSettings("pinch", object=str(tmp_path / "none.stl")), tmp_path)
