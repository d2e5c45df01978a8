"""Scenes with one thing changed, read back from what MuJoCo compiled."""

import dataclasses
import itertools
from typing import Any

import mujoco
import numpy as np
import pytest
import trimesh
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from envs.disturbances import Randomize, Variation, draw_variations, varied_pose
from envs.scene import OBJECT, SUPPORT
from envs.varied_scene import varied_model
from mjx_hand.objects.description import OBJECT_KINDS, ObjectDescription
from mjx_hand.rigid.gains import Gains

CORNERS = np.array(list(itertools.product((-0.01, 0.01), (-0.02, 0.02), (-0.03, 0.03))))


def matrix(quaternion: np.ndarray) -> np.ndarray:
    return Rotation.from_quat(quaternion, scalar_first=True).as_matrix()


@pytest.fixture(scope="module")
def model(demonstrations, hands):
    def compiled(**given: Any) -> mujoco.MjModel:
        return varied_model(demonstrations[0], hands[0], Variation(**given), Gains(), motors=True)

    return compiled


def test_mass_changes_mass_and_inertia_alone(model):
    usual, heavy = model().body(OBJECT), model(mass=1.5).body(OBJECT)
    assert_allclose(heavy.mass, 1.5 * usual.mass, rtol=1e-6)
    assert_allclose(heavy.inertia, 1.5 * usual.inertia, rtol=1e-5)
    assert_allclose(model(mass=1.5).geom_size, model().geom_size)


def test_friction_is_that_of_every_contact(model):
    usual, smooth = model(), model(friction=0.7)
    meets = (usual.geom_contype | usual.geom_conaffinity) > 0
    assert meets.sum() > 15
    assert_allclose(smooth.geom_friction[meets, 0], 0.7 * usual.geom_friction[meets, 0])


def test_a_scene_that_is_moved_and_turned_is_the_same_seen_from_the_object(model, demonstrations):
    move, turn = (0.02, -0.01), 0.2
    usual, moved = model(), model(move=move, turn=turn)
    before, after = (varied_pose(demonstrations[0], v) for v in (Variation(), Variation(move=move, turn=turn)))
    assert_allclose(after[:3] - before[:3], [*move, 0.0], atol=1e-9)

    def support(scene: mujoco.MjModel, pose: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        box, axes = scene.geom(f"{SUPPORT}0"), matrix(pose[3:])
        return axes.T @ (box.pos - pose[:3]), axes.T @ matrix(box.quat)

    for found, wanted in zip(support(moved, after), support(usual, before), strict=True):
        assert_allclose(found, wanted, atol=1e-6)


def test_gains_scale_stiffness_damping_and_limits(model):
    usual, stiff = model(), model(gains=1.2)
    count = 26
    assert_allclose(stiff.actuator_gainprm[:count, 0], 1.2 * usual.actuator_gainprm[:count, 0], rtol=1e-6)
    assert_allclose(stiff.actuator_biasprm[:count, 2], 1.2 * usual.actuator_biasprm[:count, 2], rtol=1e-6)
    limited = usual.actuator_forcelimited[:count].astype(bool)
    assert limited.sum() == 20
    assert_allclose(
        stiff.actuator_forcerange[:count][limited], 1.2 * usual.actuator_forcerange[:count][limited], rtol=1e-6
    )


@pytest.mark.parametrize("kind", OBJECT_KINDS)
@pytest.mark.parametrize("size", [0.9, 1.1])
def test_an_object_of_another_size_stands_on_the_same_ground(demonstrations, hands, kind, size):
    random = np.random.default_rng(3)
    quaternion = random.normal(size=4)
    quaternion /= np.linalg.norm(quaternion)
    sizes = {"box": (0.01, 0.02, 0.03), "sphere": (0.02, 0.0, 0.0)}.get(kind, (0.02, 0.03, 0.0))
    hulls = CORNERS[None] if kind == "mesh" else np.zeros((0, 0, 3))
    thing = ObjectDescription(kind=kind, size=np.array(sizes), mass=0.1, friction=1.0, hulls=hulls)
    pose = demonstrations[0].object_pose.copy()
    pose[:, 3:] = quaternion
    placed = dataclasses.replace(demonstrations[0], object=thing, object_pose=pose)

    shapes = {
        "box": trimesh.creation.box(2 * np.array(sizes)) if kind == "box" else None,
        "sphere": trimesh.creation.icosphere(5, sizes[0]),
        "cylinder": trimesh.creation.cylinder(sizes[0], 2 * sizes[1], 720),
        "capsule": trimesh.creation.capsule(2 * sizes[1], sizes[0], (256, 256)),
        "mesh": trimesh.Trimesh(CORNERS),
    }

    def lowest(variation: Variation) -> float:
        pose = varied_pose(placed, variation)
        points = variation.size * (shapes[kind].vertices - shapes[kind].vertices.mean(axis=0))
        return float((points @ matrix(pose[3:]).T)[:, 2].min() + pose[2])

    assert lowest(Variation(size=size)) == pytest.approx(lowest(Variation()), abs=2e-5)


def test_draws_fill_their_ranges_and_are_the_same_for_a_seed():
    ranges = Randomize(share=1.0, variants=10)
    drawn = [v for own in draw_variations(ranges, 200, 1) for v in own]
    assert drawn == [v for own in draw_variations(ranges, 200, 1) for v in own]
    moved = [v for v in drawn if v.is_elsewhere]
    assert len(moved) == 1000
    away = np.array([np.hypot(*v.move) for v in moved])
    assert 0.039 < away.max() <= 0.04
    assert away.min() < 0.001
    assert_allclose(np.mean([v.move for v in moved], axis=0), 0, atol=0.003)
    for name in ("mass", "friction", "gains"):
        values, (low, high) = np.log([getattr(v, name) for v in drawn]), np.log(getattr(ranges, name))
        assert low <= values.min() < low + 0.05 * (high - low)
        assert high >= values.max() > high - 0.05 * (high - low)
        assert values.mean() == pytest.approx((low + high) / 2, abs=0.05 * (high - low))
    assert {v.size for v in drawn if not any(v.move)} == {1.0}
