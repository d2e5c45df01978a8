"""Following keypoints: recovery of known motions, limits, gaps, and another program's objective."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from mjx_hand.errors import InputError
from mjx_hand.pytree import replace
from mjx_hand.robots.robot_hand import RobotHand, load_robot, robot_objective
from mjx_hand.robots.solver.keypoint_stream import KeypointStream
from mjx_hand.robots.solver.kinematic_tree import KinematicTree, joint_values, tree_points
from mjx_hand.robots.solver.normal_equations import Posture, linearise
from mjx_hand.robots.solver.objectives import Objective, human_vectors, targets_of
from mjx_hand.robots.solver.retarget_keypoints import retarget_keypoints
from tests.robots.urdfs import urdf_of

FRAMES = 200


@pytest.fixture(scope="module")
def inspire() -> tuple[RobotHand, KinematicTree, Objective]:
    """Six degrees of freedom that drive twelve joints."""
    robot = load_robot("inspire")
    return robot, *robot_objective(robot, urdf_of("inspire"))


def smooth_dofs(tree: KinematicTree, frames: int = FRAMES, seed: int = 0) -> np.ndarray:
    """Degrees of freedom that swing within their limits, touching none."""
    rng = np.random.default_rng(seed)
    phase, speed = rng.uniform(0, 2 * np.pi, tree.num_dofs), rng.uniform(0.5, 2.0, tree.num_dofs)
    swing = 0.5 + 0.45 * np.sin(np.linspace(0, 2 * np.pi, frames)[:, None] * speed + phase)
    return np.asarray(tree.lower) + swing * (np.asarray(tree.upper) - np.asarray(tree.lower))


def keypoints_of(dofs: np.ndarray, tree: KinematicTree, objective: Objective) -> np.ndarray:
    """Keypoints that an objective of kind vector can follow exactly; those that it does not ask for are missing."""
    points = np.asarray(tree_points(dofs.astype(np.float32), tree), float) / float(objective.scaling)
    keypoints = np.full((len(dofs), 21, 3), np.nan)
    keypoints[:, 0] = 0.0
    for origin, task, k in zip(objective.origins, objective.tasks, objective.human_tasks, strict=True):
        keypoints[:, k] = points[:, task] - points[:, origin]
    return keypoints


def test_known_postures_come_back_and_limits_hold(inspire):
    _, tree, objective = inspire
    dofs = smooth_dofs(tree)
    found = retarget_keypoints(keypoints_of(dofs, tree, objective), tree, replace(objective, smoothness=0.0))
    np.testing.assert_allclose(found.dofs, dofs, atol=1e-3)
    assert found.valid.all()
    assert found.value.max() < 1e-7


def test_recordings_side_by_side_and_chunks_change_nothing(inspire):
    """Frames hold their neighbours: what a chunk sees of the next one must be all that matters."""
    _, tree, objective = inspire
    dofs = smooth_dofs(tree, 600, seed=1)
    noisy = keypoints_of(dofs, tree, objective) + np.random.default_rng(2).normal(0, 0.004, (600, 21, 3))
    whole = retarget_keypoints(noisy, tree, objective)
    apart = retarget_keypoints(noisy.reshape(2, 300, 21, 3), tree, objective)
    assert apart.dofs.shape == (2, 300, 6)
    first = retarget_keypoints(noisy[:300], tree, objective)
    np.testing.assert_allclose(apart.dofs[0], first.dofs, atol=1e-3)
    far = slice(0, 250)  # from the cut, which one recording does not have
    np.testing.assert_allclose(whole.dofs[far], first.dofs[far], atol=5e-3)


def test_limits_are_never_left_whatever_is_asked(inspire):
    _, tree, objective = inspire
    wild = np.random.default_rng(3).normal(0, 0.3, (FRAMES, 21, 3))
    found = retarget_keypoints(wild, tree, objective)
    assert (found.dofs >= np.asarray(tree.lower) - 1e-6).all()
    assert (found.dofs <= np.asarray(tree.upper) + 1e-6).all()
    values = joint_values(found.dofs, tree)
    thumb = [tree.joint_names.index(f"thumb_{name}_joint") for name in ("proximal_pitch", "intermediate", "distal")]
    np.testing.assert_allclose(values[:, thumb[1]], 1.334 * values[:, thumb[0]], atol=1e-6)  # as its URDF ties them
    np.testing.assert_allclose(values[:, thumb[2]], 0.667 * values[:, thumb[0]], atol=1e-6)
    assert np.isfinite(found.value).all()


def test_missing_points_leave_the_others_right_and_gaps_are_bridged(inspire):
    _, tree, objective = inspire
    dofs = smooth_dofs(tree)
    keypoints = keypoints_of(dofs, tree, objective)
    keypoints[50:60, 8] = np.nan  # the index tip
    keypoints[100:110] = np.nan
    found = retarget_keypoints(keypoints, tree, replace(objective, smoothness=0.0))
    np.testing.assert_array_equal(np.flatnonzero(~found.valid), np.arange(100, 110))
    index = tree.dof_names.index("index_proximal_joint")
    others = [k for k in range(tree.num_dofs) if k != index]
    seen = np.flatnonzero(found.valid)
    np.testing.assert_allclose(found.dofs[seen][:, others], dofs[seen][:, others], atol=1e-3)
    np.testing.assert_allclose(found.dofs[100:110], np.linspace(found.dofs[99], found.dofs[110], 12)[1:-1], atol=1e-6)
    assert np.isfinite(found.dofs).all()


def test_smoothness_makes_noise_smaller_and_nothing_else(inspire):
    _, tree, objective = inspire
    dofs = smooth_dofs(tree)
    noisy = keypoints_of(dofs, tree, objective) + np.random.default_rng(7).normal(0, 0.003, (FRAMES, 21, 3))
    rough = retarget_keypoints(noisy, tree, replace(objective, smoothness=0.0)).dofs
    smooth = retarget_keypoints(noisy, tree, replace(objective, smoothness=0.05)).dofs
    jitter = [np.abs(np.diff(d, n=2, axis=0)).mean() for d in (dofs, smooth, rough)]
    assert jitter[0] < jitter[1] < 0.6 * jitter[2]
    assert np.abs(smooth - dofs).mean() < np.abs(rough - dofs).mean()


def test_the_objective_is_no_higher_than_dexis(inspire, video):
    dexi = pytest.importorskip("dexi_rs", reason="dexi-rs is not installed")
    robot, tree, objective = inspire
    keypoints = video[:120]
    theirs = dexi.RetargetingConfig(
        "vector",
        str(urdf_of("inspire")),
        target_origin_link_names=[robot.palm] * 5,
        target_task_link_names=list(robot.tips),
        target_joint_names=list(tree.dof_names),
        target_link_human_indices=[[0] * 5, list(objective.human_tasks)],
        scaling_factor=robot.scaling,
        low_pass_alpha=1.0,
    ).build()
    tips = list(objective.human_tasks)
    rows = [theirs.retarget((frame[tips] - frame[0]).ravel().tolist()) for frame in keypoints]
    names = list(theirs.joint_names)
    dofs = np.array(rows)[:, [names.index(name) for name in tree.dof_names]]
    ours = retarget_keypoints(keypoints, tree, objective)
    value = value_of(dofs, keypoints, tree, objective).mean()
    assert ours.value.mean() <= value + 1e-6
    steps = [(np.diff(d, axis=0) ** 2).sum(axis=1).mean() for d in (ours.dofs, dofs)]
    smoothness = float(objective.smoothness)
    assert ours.value.mean() + smoothness * steps[0] <= 1.005 * (value + smoothness * steps[1])


def value_of(dofs, keypoints, tree, objective) -> np.ndarray:
    vectors = human_vectors(jnp.asarray(keypoints, jnp.float32), objective)
    targets = targets_of(vectors, objective, jnp.zeros((0, len(dofs)), bool))
    rotation = jnp.broadcast_to(jnp.eye(3)[..., None], (3, 3, len(dofs)))
    posture = Posture(values=jnp.asarray(dofs.T, jnp.float32), rotation=rotation, position=jnp.zeros((3, len(dofs))))
    return np.asarray(jax.jit(linearise)(posture, targets, tree, objective).value)


def test_streaming_follows_holds_over_gaps_and_filters(inspire):
    _, tree, objective = inspire
    dofs = smooth_dofs(tree, 60)
    keypoints = keypoints_of(dofs, tree, objective)
    exact = replace(objective, smoothness=0.0)
    stream = KeypointStream(tree, exact)
    poses = [stream.step(frame) for frame in keypoints]
    np.testing.assert_allclose([p.dofs for p in poses], dofs, atol=3e-3)
    held = stream.step(np.full((21, 3), np.nan))
    assert not held.seen
    np.testing.assert_array_equal(held.dofs, poses[-1].dofs)
    stream.reset()
    assert not stream.step(np.full((21, 3), np.nan)).seen  # a gap before the first frame
    slow = KeypointStream(tree, exact, low_pass=0.5)
    first, second = slow.step(keypoints[0]).dofs, slow.step(keypoints[1]).dofs
    np.testing.assert_allclose(first, dofs[0], atol=1e-3)
    np.testing.assert_allclose(second, (first + dofs[1]) / 2, atol=2e-3)


def test_bad_keypoints_are_refused_in_one_line(inspire):
    _, tree, objective = inspire
    cases = [
        (np.zeros((4, 20, 3)), "have shape"),
        (np.zeros((0, 21, 3)), "have shape"),
        (np.full((4, 21, 3), np.inf), "kilometres away or are infinite"),
        (np.full((4, 21, 3), np.nan), "no frame of a recording"),
    ]
    for keypoints, message in cases:
        with pytest.raises(InputError, match=message) as caught:
            retarget_keypoints(keypoints, tree, objective)
        assert "\n" not in str(caught.value)
    for fps in (0, -30.0, float("nan"), float("inf")):
        with pytest.raises(InputError, match="give the frames per second"):
            retarget_keypoints(np.zeros((4, 21, 3)), tree, objective, fps=fps)
    with pytest.raises(InputError, match="low_pass"):
        KeypointStream(tree, objective, low_pass=0.0)
    with pytest.raises(InputError, match="one frame of 21 x 3"):
        KeypointStream(tree, objective).step(np.zeros((2, 21, 3), np.float32))
