"""Grasps tried in the engine: a cube between finger tips, lifted, by a hand whose recorded place is off."""

import dataclasses
import itertools

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from envs.demonstrations.from_recording import grasp_search
from envs.demonstrations.from_recording.grasp_pose import GraspPose, capsule_gaps, joined, spins, unlikeliness
from envs.demonstrations.from_recording.grasp_rollout import GraspRollout, RolloutScore
from envs.demonstrations.from_recording.grasp_search import search_grasp
from envs.demonstrations.from_recording.grasp_trajectory import Act, grasp_trajectory
from envs.demonstrations.from_recording.observed import ObservedSequence
from envs.demonstrations.from_recording.pregrasp import pregrasp
from envs.demonstrations.scripted.grasp_posture import solve_postures
from envs.grasps import grasp_type
from mjx_hand.errors import InputError
from mjx_hand.hand.load import load_hand
from mjx_hand.motion.demonstration import Demonstration
from mjx_hand.motion.joint_motion import JointMotion
from mjx_hand.motion.resample import matrix_quaternions
from mjx_hand.objects.description import ObjectDescription
from mjx_hand.objects.primitives import hull_planes
from mjx_hand.pytree import replace
from mjx_hand.rigid.build import build_rigid_hand
from tests.envs.demonstrations.from_recording.unaided import unaided

HALF, FPS, FRAMES, LIFTED = 0.017, 50.0, 110, 1.6
FORCE = 8.0


@pytest.fixture(scope="module")
def act() -> Act:
    """An open hand comes from above to a cube on the table and lifts it by 6 cm; captured 1 cm beside where it was."""
    hand = build_rigid_hand(load_hand())
    corners = HALF * np.array(list(itertools.product((-1.0, 1.0), repeat=3)))
    description = ObjectDescription(kind="mesh", size=np.full(3, HALF), mass=0.1, friction=0.9, hulls=corners[None])
    posture = solve_postures(grasp_type("pinch"), [hand], [description])
    rotation = Rotation.from_matrix(np.asarray(posture.rotation[0], float)).as_matrix()
    angles = np.asarray(posture.angles[0], float)
    wrist = np.asarray(posture.position[0], float)
    times = np.arange(FRAMES) / FPS
    height = HALF + 0.06 * np.clip((times - LIFTED) / 0.4, 0.0, 1.0)
    away = 0.1 * np.clip(1.0 - times, 0.0, 1.0)  # the reach
    position = np.stack([0 * times, 0 * times, height], axis=1)
    beside = rotation @ [0.0, 0.01, 0.0]
    held = GraspPose(angles=angles, rotation=rotation.T, position=rotation.T @ -(wrist + beside))
    observed = ObservedSequence(
        times=times,
        angles=np.tile(pregrasp(held[None], hand, hull_planes(description.hulls), 0.03).angles, (FRAMES, 1)),
        hand_rotation=np.tile(rotation, (FRAMES, 1, 1)),
        hand_position=position + wrist + beside + away[:, None] * [0.0, 0.0, 1.0],
        rotation=np.tile(np.eye(3), (FRAMES, 1, 1)),
        position=position,
    )
    return Act(observed=observed, lifted=LIFTED, held=held, hand=hand, object=description)


@pytest.fixture(scope="module")
def good(act) -> GraspPose:
    """As the cube really lay."""
    return dataclasses.replace(act.held, position=act.held.position + np.array([0.0, 0.01, 0.0]))


@pytest.fixture(scope="module")
def planes(act) -> np.ndarray:
    return hull_planes(act.object.hulls)


def test_open_fingers_are_off_the_object_and_within_limits(act, good, planes):
    wide = pregrasp(good[None], act.hand, planes, 0.01)[0]
    gaps = np.asarray(capsule_gaps(wide.angles, wide.rotation, wide.position, act.hand, planes))
    closed = np.asarray(capsule_gaps(good.angles, good.rotation, good.position, act.hand, planes))
    assert closed.min() < 0.001
    assert gaps[np.array(act.hand.capsule_links) > 0].min() > 0.008
    assert (wide.angles >= act.hand.hinge_lower - 1e-6).all()
    assert (wide.angles <= act.hand.hinge_upper + 1e-6).all()
    far = dataclasses.replace(good, position=good.position + np.array([0.0, -0.3, 0.0]))
    np.testing.assert_allclose(pregrasp(far[None], act.hand, planes, 0.01).angles[0], good.angles, atol=1e-6)


def test_a_trajectory_begins_as_recorded_and_ends_in_the_grasp(act, good):
    trajectory = grasp_trajectory(act, good[None])
    rotation, position = (part[0] for part in trajectory.in_hand)
    closed = slice(act.closed, None)
    np.testing.assert_allclose(position[closed], np.tile(good.position, (FRAMES - act.closed, 1)), atol=1e-9)
    np.testing.assert_allclose(rotation[closed], np.tile(good.rotation, (FRAMES - act.closed, 1, 1)), atol=1e-9)
    np.testing.assert_allclose(trajectory.angles[0, closed], np.tile(good.angles, (FRAMES - act.closed, 1)), atol=1e-9)
    np.testing.assert_allclose(trajectory.wrist_position[0, :5], act.observed.hand_position[:5], atol=1e-9)
    assert act.observed.times[act.closed] < LIFTED
    assert np.linalg.norm(np.diff(trajectory.wrist_position[0], axis=0), axis=1).max() < 0.01  # 0.5 m/s


def test_a_hand_that_comes_late_is_not_led_there_early(act, good):
    """The recorded hand is where it lifts from 0.2 s before the lift: with that very grasp nothing is to be moved."""
    late = 0.25 * np.clip(LIFTED - 0.2 - act.observed.times, 0.0, 0.4)
    truth = act.observed.position - np.einsum("tij,j->ti", act.observed.hand_rotation, good.position)
    observed = dataclasses.replace(act.observed, hand_position=truth + late[:, None] * [0.0, 0.0, 1.0])
    trajectory = grasp_trajectory(dataclasses.replace(act, observed=observed, held=good), good[None])
    moved = np.linalg.norm(trajectory.wrist_position[0] - observed.hand_position, axis=1)
    assert moved.max() < 0.03
    assert moved.mean() < 0.003


def test_a_hand_turned_where_it_is_is_not_moved_and_a_turned_object_turns_alone(act, good, planes):
    """The wrist's place beside the object counts, not the object's in the wrist's frame, which any turn moves."""
    wrist, turn = good.wrist, Rotation.from_rotvec([0.3, 0.0, 0.0]).as_matrix()
    turned = good.rotation @ turn.T  # the hand, in the object's frame, by the turn
    there = GraspPose(good.angles, turned, -turned @ wrist)
    assert np.linalg.norm(there.position - good.position) > 0.02
    np.testing.assert_allclose(there.wrist, wrist, atol=1e-12)
    np.testing.assert_allclose(spins(there[None], good), 0, atol=0.05)
    spun = Rotation.from_rotvec([0.0, 0.0, 2.0]).as_matrix()
    other = GraspPose(good.angles, good.rotation @ spun, good.position)
    np.testing.assert_allclose(spins(other[None], good), 2.0, atol=1e-9)
    slab = np.array(
        [[[0.0, 0.0, 1.0, -0.001], [0.0, 0.0, -1.0, -0.001]]]
    )  # the same whichever way it is turned about z
    same, moved = unlikeliness(joined([good[None], other[None]]), good, act.hand, slab)
    assert moved == pytest.approx(np.hypot(same, 2.0 / 0.8), rel=1e-3)


def test_a_grasp_off_the_object_is_lost_and_a_good_one_is_not(act, good):
    """Of a cube that stands on a block."""
    block = np.array([0.05, 0.05, 0.04])
    up = np.array([0.0, 0.0, 2 * block[2]])
    raised = {name: getattr(act.observed, name) + up for name in ("position", "hand_position")}
    on_block = dataclasses.replace(
        act,
        observed=dataclasses.replace(act.observed, **raised),
        support=block[None],
        support_position=np.array([[0.0, 0.0, block[2]]]),
    )
    pair = GraspPose(
        *(np.stack([a, b]) for a, b in zip(dataclasses.astuple(good), dataclasses.astuple(good), strict=True))
    )
    pair = dataclasses.replace(pair, position=pair.position + np.array([[0.0, 0.0, 0.0], [0.0, -0.04, 0.0]]))
    for fixed in (False, True):
        score = GraspRollout(on_block, FORCE, 2).carry(pair, fixed=fixed)
        assert score.held_share[0] == 1.0
        assert score.error[0] < 0.01
        assert score.held_share[1] < 0.95
        assert np.linalg.norm(score.settled.position[0] - good.position) < 0.01


@pytest.mark.parametrize("carries", [True, False])
def test_the_search_ends_when_nothing_better_comes(act, good, monkeypatch, carries):
    """With a stand-in for the engine that judges by the place alone, and nothing to compile."""
    flags = []

    class Judge:
        def __init__(self, act, force, count):
            pass

        def carry(self, grasps, *, fixed):
            flags.append(fixed)
            off = np.linalg.norm(grasps.position - good.position, axis=1)
            share = np.clip(1.0 - 10 * np.maximum(off - 0.006, 0), 0, 1 if carries else 0.5)
            return RolloutScore(held_share=share, error=0.0 * off, moved=off, settled=grasps)

    monkeypatch.setattr(grasp_search, "GraspRollout", Judge)
    monkeypatch.setattr(grasp_search, "pregrasp", lambda grasps, hand, planes, clearance: grasps)
    monkeypatch.setattr(grasp_search, "unlikeliness", lambda grasps, *rest, **options: np.zeros(len(grasps.angles)))
    if carries:
        found = search_grasp(act, act.held[None], FORCE, tried=60)
        assert (
            np.linalg.norm(found.position - good.position) < 0.006 < np.linalg.norm(act.held.position - good.position)
        )
        assert flags[0]
        assert not any(flags[-4:])
        assert len(flags) < 20
    else:
        with pytest.raises(InputError, match="the best, 50 % of the way"):
            search_grasp(act, act.held[None], FORCE, tried=60)
        assert sum(flags) == 8
        assert len(flags) < 40


@pytest.mark.slow
def test_a_grasp_is_found_that_carries_the_object_in_a_demonstration(act):
    """Independent of how it was found: the demonstration's own reference, stepped in MuJoCo from its first frame."""
    trajectory = grasp_trajectory(act, search_grasp(act, act.held[None], FORCE, tried=48)[None])
    demonstration = Demonstration(
        motion=JointMotion(
            fps=FPS,
            angles=trajectory.angles[0],
            wrist_position=trajectory.wrist_position[0],
            wrist_quaternion=matrix_quaternions(trajectory.wrist_rotation[0]),
            valid=np.ones(FRAMES, bool),
        ),
        object_pose=np.concatenate([trajectory.position, matrix_quaternions(trajectory.rotation[0])], axis=1),
        object=act.object,
        support=np.zeros((0, 3)),
        support_position=np.zeros((0, 3)),
        shape=np.zeros(10),
        grasp="recorded",
    )
    object_pose = unaided(demonstration, act.hand, FORCE)[-1]
    assert np.linalg.norm(object_pose[:3] - demonstration.object_pose[-1, :3]) < 0.015
    turn = Rotation.from_quat(object_pose[3:], scalar_first=True).magnitude()
    assert turn < np.deg2rad(30)
    rotation, position = trajectory.in_hand
    planes = hull_planes(act.object.hulls)
    gaps = capsule_gaps(trajectory.angles[0, -1], rotation[0, -1], position[0, -1], act.hand, planes)
    assert float(gaps.min()) > -0.003


@pytest.mark.slow
def test_an_object_too_heavy_for_every_one_is_refused(act, good):
    heavy = dataclasses.replace(act, object=replace(act.object, mass=20.0))
    with pytest.raises(
        InputError, match=r"no posture .* carries the object of 20 kg and friction 0.9 .* lighter object"
    ):
        search_grasp(heavy, good[None], FORCE, tried=6)
