"""How deep fingers and ground are overlapped, by distances between capsules' axes sampled densely."""

import dataclasses

import mujoco
import numpy as np
import pytest

from envs.evaluation.overlap import hand_overlap
from envs.scene import scene_spec
from mjx_hand.hand.joints import HINGES
from mjx_hand.hand.load import load_hand
from mjx_hand.objects.description import ObjectDescription
from mjx_hand.rigid.build import build_rigid_hand
from tests.envs.lifts import lift

WHERE = np.array([0.0, 0.0, 0.4])


@pytest.fixture(scope="module")
def model() -> mujoco.MjModel:
    description = ObjectDescription(kind="sphere", size=np.array([0.01, 0, 0]), mass=0.1, friction=1.0)
    block = np.array([[0.05, 0.05, 0.02]]), np.array([[0.5, 0.0, 0.02]])
    return scene_spec(build_rigid_hand(load_hand()), description, *block, np.eye(3), spare=1).compile()


def posture(model: mujoco.MjModel, at: np.ndarray = WHERE, **hinges: float) -> np.ndarray:
    qpos = model.qpos0.copy()
    qpos[:3] += at
    for name, angle in hinges.items():
        qpos[6 + HINGES.index(name)] = angle
    return qpos


def rollouts(*postures: np.ndarray):
    made = lift(frames=len(postures))
    return dataclasses.replace(made, qpos=np.stack(postures)[None])


def sampled_depth(model: mujoco.MjModel, qpos: np.ndarray) -> float:
    """The deepest overlap of two fingers' capsules, by 200 points along each axis."""
    data = mujoco.MjData(model)
    data.qpos[:] = qpos
    mujoco.mj_kinematics(model, data)
    axes = {}
    for g in range(model.ngeom):
        body = model.body(model.geom_bodyid[g]).name
        if model.geom_type[g] == mujoco.mjtGeom.mjGEOM_CAPSULE and body[-1:].isdigit():
            radius, half = model.geom_size[g][:2]
            along = data.geom_xmat[g].reshape(3, 3)[:, 2]
            axes[body] = data.geom_xpos[g] + np.linspace(-half, half, 200)[:, None] * along, radius
    depths = [
        p[1] + q[1] - np.linalg.norm(p[0][:, None] - q[0][None], axis=-1).min()
        for a, p in axes.items()
        for b, q in axes.items()
        if a[:-1] < b[:-1]
    ]
    return max(0.0, *depths)


def test_fingers_that_cross(model):
    bent = [posture(model, middle_mcp_abduction=angle) for angle in (-0.4, 0.0, 0.4)]
    found = hand_overlap(rollouts(*bent), [model])
    expected = [sampled_depth(model, qpos) for qpos in bent]
    assert max(expected) > 0.005
    np.testing.assert_allclose(found.fingers[0], expected, atol=1e-4)
    np.testing.assert_array_equal(found.ground, 0.0)


def test_a_hand_that_sinks(model):
    down = [posture(model, WHERE * [1, 1, height]) for height in (1.0, 0.01, 0.0)]
    found = hand_overlap(rollouts(*down), [model]).ground[0]
    assert found[0] == 0.0
    assert found[2] > 0.005
    assert found[2] - found[1] == pytest.approx(0.4 * 0.01, abs=1e-5)


def test_the_support_counts_and_spare_boxes_do_not(model):
    support, spare = model.geom("support0").pos, model.geom("spare0").pos
    for at, meets in ((support + np.array([0, 0, 0.02]), True), (spare + np.array([0, 0, 0.5]), False)):
        assert (hand_overlap(rollouts(posture(model, at)), [model]).ground[0, 0] > 0.005) == meets


def test_only_counted_frames_are_looked_at(model):
    made = rollouts(posture(model, 0 * WHERE), posture(model, 0 * WHERE))
    counted = np.array([[False, True]])
    found = hand_overlap(dataclasses.replace(made, counted=counted), [model])
    assert found.ground[0, 0] == 0.0
    assert found.ground[0, 1] > 0.005
    np.testing.assert_array_equal(found.counted, counted)
