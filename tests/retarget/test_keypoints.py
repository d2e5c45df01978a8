"""Following keypoints: derivatives, recovery of known motions, limits, gaps, and another program's objective."""

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mjx_hand.errors import InputError
from mjx_hand.pytree import replace
from mjx_hand.retarget.alignment import aligned
from mjx_hand.retarget.keypoint_stream import KeypointStream
from mjx_hand.retarget.keypoints import retarget_keypoints
from mjx_hand.retarget.kinematic_tree import BASE, KinematicTree, joint_values, tree_points
from mjx_hand.retarget.normal_equations import FREE, Posture, linearise
from mjx_hand.retarget.objectives import (
    Objective,
    Targets,
    brought_together,
    dexpilot_pairs,
    human_vectors,
    num_thumb_pairs,
    targets_of,
)
from mjx_hand.retarget.palm_frame import in_palm
from mjx_hand.retarget.robot_hand import RobotHand, load_robot, robot_objective
from mjx_hand.retarget.sparse_solve import solve_definite
from mjx_hand.rotations import axis_angle_matrix
from tests.retarget.robots import urdf_of

FRAMES = 200


@pytest.fixture(scope="module")
def inspire() -> tuple[RobotHand, KinematicTree, Objective]:
    """Six degrees of freedom that drive twelve joints."""
    robot = load_robot("inspire")
    return robot, *robot_objective(robot, urdf_of("inspire"))


@pytest.fixture(scope="module")
def video(recordings) -> np.ndarray:
    return np.load(recordings / "mediapipe_video/joints.npz")["joints"]


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


def small_tree() -> KinematicTree:
    """A base with two fingers: turning, sliding and tied joints."""
    rng = np.random.default_rng(4)
    turns = Rotation.random(6, rng=rng).as_matrix()
    return KinematicTree(
        rest_rotation=turns.astype(np.float32),
        rest_position=rng.uniform(-0.04, 0.04, (6, 3)).astype(np.float32),
        slope=np.array([1, 1, -0.7, 1, 1, 1.3], np.float32),
        shift=np.array([0, 0, 0.2, 0, 0, -0.1], np.float32),
        lower=np.full(4, -2, np.float32),
        upper=np.full(4, 2, np.float32),
        point_position=rng.uniform(-0.05, 0.05, (4, 3)).astype(np.float32),
        parents=(BASE, 0, 1, BASE, 3, 4),
        dofs=(0, 1, 1, 2, 3, 3),  # two joints of a finger share one; the last, too
        slides=(False, False, False, False, True, False),
        point_joints=(BASE, 2, 5, 4),
        dof_names=("a", "b", "c", "d"),
        joint_names=tuple("uvwxyz"),
        point_names=tuple("pqrs"),
    )


@pytest.mark.parametrize("kind", ["vector", "position"])
@pytest.mark.parametrize("free_base", [True, False])
def test_gradient_and_hessian_are_those_of_automatic_differentiation(kind, free_base):
    """Huber's straight part, both sides of it, tied and sliding joints, vectors between moving points."""
    tree = small_tree()
    objective = Objective(
        kind=kind,
        origins=(BASE, 0, 3, 1),
        tasks=(1, 2, 2, 3),
        human_origins=(0,) * 4,
        human_tasks=(1, 2, 3, 4),
        free_base=free_base,
    )
    rng = np.random.default_rng(5)
    targets = Targets(
        vectors=jnp.asarray(rng.uniform(-0.06, 0.06, (4, 3, 1)), jnp.float32),
        weights=jnp.asarray([[1.0], [0.5], [2.0], [0.0]]),
    )
    turn = Rotation.random(rng=rng).as_matrix().astype(np.float32)

    def posture_at(unknowns):
        step = unknowns[:FREE] if free_base else jnp.zeros(FREE)
        # Turns about the three axes one after the other, whose second derivatives the solver takes.
        spin = jnp.eye(3)
        for k in range(3):
            spin = spin @ axis_angle_matrix(jnp.eye(3)[k], step[k])
        rotation = (spin @ turn if free_base else jnp.eye(3))[..., None]
        return Posture(values=unknowns[-4:, None], rotation=rotation, position=step[3:, None])

    def value(unknowns):
        """The objective from its definition."""
        posture = posture_at(unknowns)
        points = posture.rotation[..., 0] @ tree_points(posture.values[:, 0], tree).T + posture.position
        begin = jnp.stack([points[:, k] if k >= 0 else jnp.zeros(3) for k in objective.origins])
        error = points[:, jnp.array(objective.tasks)].T - begin - targets.vectors[..., 0]
        size = jnp.abs(error) if kind == "position" else jnp.linalg.norm(error, axis=1, keepdims=True)
        huber = jnp.where(size < 0.02, size**2 / 0.04, size - 0.01)
        return jnp.sum(targets.weights * huber)

    start = jnp.concatenate([jnp.zeros(FREE * free_base), jnp.asarray(rng.uniform(-1, 1, 4), jnp.float32)])
    found = jax.jit(lambda unknowns: linearise(posture_at(unknowns), targets, tree, objective))(start)
    gradient = jax.jit(jax.jacfwd(value))(start)
    hessian = np.asarray(jax.jit(jax.jacfwd(jax.jacfwd(value)))(start))
    np.testing.assert_allclose(found.value[0], jax.jit(value)(start), rtol=1e-5)
    np.testing.assert_allclose(np.array([g[0] for g in found.gradient]), gradient, rtol=1e-4, atol=1e-4)
    mine = np.zeros_like(hessian)
    for (row, column), entry in found.hessian.items():
        mine[row, column] = mine[column, row] = entry[0]
    np.testing.assert_allclose(mine, hessian, rtol=1e-3, atol=2e-3 * np.abs(hessian).max())


def test_sparse_systems_are_solved():
    rng = np.random.default_rng(6)
    tree_like = [(3, 0), (3, 2), (4, 1), (2, 0)]  # and entries that fill in
    entries = {(k, k): jnp.asarray([5.0 + k]) for k in range(5)} | {
        p: jnp.asarray(rng.normal(size=1)) for p in tree_like
    }
    dense = np.zeros((5, 5))
    for (i, j), value in entries.items():
        dense[i, j] = dense[j, i] = float(value[0])
    right = rng.normal(size=5)
    found = solve_definite(entries, [jnp.asarray([r]) for r in right], [1e-6] * 5)
    np.testing.assert_allclose(np.array(found)[:, 0], np.linalg.solve(dense, right), rtol=1e-5)


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
    np.testing.assert_allclose(apart.dofs[0], first.dofs, atol=1e-5)
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
    np.testing.assert_allclose([p.dofs for p in poses], dofs, atol=1e-3)
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
    with pytest.raises(InputError, match="coarse and fine"):
        retarget_keypoints(np.zeros((4, 21, 3)), tree, objective, fine=200)
    with pytest.raises(InputError, match="low_pass"):
        KeypointStream(tree, objective, low_pass=0.0)
    with pytest.raises(InputError, match="one frame of 21 x 3"):
        KeypointStream(tree, objective).step(np.zeros((2, 21, 3), np.float32))


def test_tips_are_together_from_pinch_to_release():
    origins, tasks = dexpilot_pairs(3)
    human = tuple(4 * k for k in range(4))
    objective = Objective(
        kind="dexpilot",
        origins=origins,
        tasks=tasks,
        human_origins=tuple(human[k] for k in origins),
        human_tasks=tuple(human[k] for k in tasks),
    )
    assert num_thumb_pairs(objective) == 2
    apart = np.array([0.10, 0.04, 0.02, 0.04, 0.06, 0.04, 0.02, np.nan, 0.04])
    keypoints = np.zeros((len(apart), 21, 3), np.float32)
    keypoints[:, 8, 0] = apart  # the index tip, from the thumb's at the origin
    keypoints[:, 12, 1] = 0.02  # the middle finger's stays near
    vectors = human_vectors(jnp.asarray(keypoints), objective)
    linked = jnp.asarray([False, *[True] * 8])
    together = np.asarray(brought_together(vectors, objective, linked, jnp.zeros(2, bool)))
    expected = [False, False, True, True, False, False, True, True, True]
    np.testing.assert_array_equal(together[0], expected)
    assert together[1].all()
    again = brought_together(vectors, objective, linked.at[5].set(False), jnp.zeros(2, bool))
    np.testing.assert_array_equal(np.asarray(again)[0], expected)
    targets = targets_of(vectors, objective, jnp.asarray(together))
    np.testing.assert_allclose(targets.weights[0, :3] * 6, [1, 1, 200])  # thumb and index
    np.testing.assert_allclose(np.linalg.norm(targets.vectors[0, :, 2]), 1e-4, rtol=1e-2)
    np.testing.assert_allclose(targets.weights[2, 2] * 6, 400)  # index and middle: both touch the thumb, and are near
    assert targets.weights[0, 7] == 0


def test_palms_are_brought_to_the_robots_axes_from_any_frame(video):
    fingers, palmar = np.array([0.0, 0, 1]), np.array([1.0, 0, 0])
    seen = in_palm(video, "right", fingers, palmar)
    turn, shift = Rotation.from_rotvec([0.3, -1.2, 2.0]).as_matrix(), np.array([0.1, 2.0, -0.4])
    np.testing.assert_allclose(in_palm(video @ turn.T + shift, "right", fingers, palmar), seen, atol=1e-6)
    middle = seen[:, 9] / np.linalg.norm(seen[:, 9], axis=-1, keepdims=True)
    np.testing.assert_allclose(middle, np.tile(fingers, (len(seen), 1)), atol=1e-6)
    assert (seen[:, 5, 1] > seen[:, 13, 1]).all()  # a right hand's index finger lies on the side of fingers × palmar
    mirrored = in_palm(video * [1, -1, 1], "left", fingers, palmar)
    np.testing.assert_allclose(mirrored, seen * [1, -1, 1], atol=1e-6)
    with pytest.raises(InputError, match="give 'right' or 'left'"):
        in_palm(video, "both", fingers, palmar)


def test_alignment_finds_where_the_base_stands():
    tree = small_tree()
    objective = Objective(
        kind="position", origins=(BASE,) * 4, tasks=(0, 1, 2, 3), human_origins=(BASE,) * 4, human_tasks=(0, 5, 9, 17)
    )
    objective = replace(objective, free_base=True)
    rng = np.random.default_rng(8)
    values = rng.uniform(-1, 1, (50, 4)).astype(np.float32)
    turn, shift = Rotation.random(50, rng=rng).as_matrix(), rng.normal(0, 0.5, (50, 3))
    points = np.einsum("tij,tkj->tki", turn, tree_points(values, tree)) + shift[:, None]
    targets = Targets(vectors=jnp.asarray(np.moveaxis(points, 0, -1), jnp.float32), weights=jnp.full((4, 50), 0.25))
    found = jax.jit(partial(aligned))(jnp.asarray(values.T), targets, tree, objective)
    np.testing.assert_allclose(np.moveaxis(found.rotation, -1, 0), turn, atol=1e-3)
    np.testing.assert_allclose(np.asarray(found.position).T, shift, atol=1e-4)
