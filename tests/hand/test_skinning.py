import pickle
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from body_models.mano.numpy import MANO
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse import csc_matrix
from scipy.spatial.transform import Rotation

from mjx_hand.hand.joints import PARENTS
from mjx_hand.hand.load import load_hand
from mjx_hand.hand.model import HandModel
from mjx_hand.hand.open_hand import load_open_hand
from mjx_hand.hand.skinning import joint_centres, shaped_template, skin
from mjx_hand.pytree import replace
from tests.hand.mano_layout import layout, write_npz

V = 60  # a thinned hand: the arithmetic is the same and the oracle's loops stay quick


def thinned(with_posedirs: bool) -> HandModel:
    hand, rng = load_open_hand(), np.random.default_rng(0)
    keep = rng.choice(hand.num_vertices, V, replace=False)
    regressor = rng.dirichlet(np.ones(V), 16).astype(np.float32)
    posedirs = rng.normal(scale=1e-3 * with_posedirs, size=(V, 3, 135)).astype(np.float32)
    return replace(
        hand,
        template=hand.template[keep],
        weights=hand.weights[keep],
        shapedirs=hand.shapedirs[keep],
        posedirs=posedirs,
        joint_regressor=regressor,
        faces=np.zeros((1, 3), np.int32),
        tip_vertices=np.zeros(5, np.int32),
    )


HANDS = {correctives: thinned(correctives) for correctives in (False, True)}
jit_skin = jax.jit(skin)


def skin_by_loops(hand: HandModel, rotations: np.ndarray, shape: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """MANO's equations one vertex and one link at a time, with homogeneous 4 x 4 transforms."""
    rest = hand.template.astype(float) + hand.shapedirs.astype(float) @ shape
    centres = hand.joint_regressor.astype(float) @ rest
    feature = np.concatenate([(r - np.eye(3)).ravel() for r in rotations])
    corrected = rest + hand.posedirs.astype(float) @ feature
    world, from_rest = [], []
    for j, parent in enumerate(PARENTS):
        local = np.eye(4)
        local[:3, 3] = centres[j] - (centres[parent] if parent >= 0 else 0)
        if j:
            local[:3, :3] = rotations[j - 1]
        world.append(world[parent] @ local if parent >= 0 else local)
        back = np.eye(4)
        back[:3, 3] = -centres[j]
        from_rest.append(world[j] @ back)
    out = np.zeros((V, 3))
    for i in range(V):
        for j in range(16):
            out[i] += hand.weights[i, j] * (from_rest[j] @ np.append(corrected[i], 1))[:3]
    return out, np.array([m[:3, 3] for m in world])


@pytest.mark.parametrize("correctives", [False, True])
@settings(deadline=None, max_examples=10)
@given(seed=st.integers(0, 2**32 - 1))
def test_skin_equals_the_loops(correctives: bool, seed: int) -> None:
    rng = np.random.default_rng(seed)
    rotations, shape = Rotation.random(15, rng=rng).as_matrix(), rng.normal(size=10)
    vertices, joints = jit_skin(HANDS[correctives], jnp.float32(rotations), jnp.float32(shape))
    expected_vertices, expected_joints = skin_by_loops(HANDS[correctives], rotations, shape)
    np.testing.assert_allclose(vertices, expected_vertices, atol=2e-6)
    np.testing.assert_allclose(joints, expected_joints, atol=2e-6)


@pytest.mark.filterwarnings("ignore")  # the oracle's own
@pytest.mark.parametrize("form", ["npz", "pkl"])
@pytest.mark.parametrize("side", ["right", "left"])
def test_skin_equals_another_implementation_of_mano(tmp_path: Path, side: str, form: str) -> None:
    """The same file through body-models and through `load_hand`: random shapes and poses, pose correctives included."""
    rng = np.random.default_rng(5)
    made = load_open_hand(side)
    correctives = rng.normal(scale=1e-3, size=made.posedirs.shape).astype(np.float32)
    made = replace(made, posedirs=correctives, pose_mean=rng.normal(scale=0.2, size=(15, 3)).astype(np.float32))
    path = tmp_path / f"MANO_{side.upper()}.{form}"
    if form == "npz":
        write_npz(made, path)
    else:
        path.write_bytes(pickle.dumps(layout(made) | {"J_regressor": csc_matrix(layout(made)["J_regressor"])}))
    hand = load_hand(path, side)
    oracle = MANO(model_path=path, flat_hand_mean=True, rotation_type="rotmat")
    rotations = Rotation.random(60, rng=rng).as_matrix().astype(np.float32).reshape(4, 15, 3, 3)
    shape = rng.normal(size=(4, 10)).astype(np.float32)
    vertices, joints = skin(hand, jnp.asarray(rotations), jnp.asarray(shape))
    np.testing.assert_allclose(vertices, oracle.forward_vertices(rotations, shape=shape), atol=1e-5)
    np.testing.assert_allclose(joints, oracle.forward_skeleton(rotations, shape=shape)[..., :3, 3], atol=1e-5)


@pytest.mark.filterwarnings("ignore")
def test_official_left_file_is_given_its_own_shape_directions(tmp_path: Path) -> None:
    """The official left file has the right hand's: the oracle gets a mended file, `load_hand` mends it itself."""
    rng = np.random.default_rng(6)
    left = load_open_hand("left")
    official = write_npz(left, tmp_path / "MANO_LEFT.npz", shapedirs=load_open_hand().shapedirs)
    oracle = MANO(model_path=write_npz(left, tmp_path / "mended.npz"), flat_hand_mean=True, rotation_type="rotmat")
    rotations = Rotation.random(15, rng=rng).as_matrix().astype(np.float32)[None]
    shape = rng.normal(size=(1, 10)).astype(np.float32)
    vertices, _ = skin(load_hand(official, "left"), jnp.asarray(rotations), jnp.asarray(shape))
    np.testing.assert_allclose(vertices, oracle.forward_vertices(rotations, shape=shape), atol=1e-5)


@pytest.mark.filterwarnings("ignore")
def test_pose_mean_is_the_one_that_others_add(tmp_path: Path) -> None:
    """A pose that is relative to `hands_mean`, as recordings of MANO give it, has `pose_mean` added by the caller."""
    rng = np.random.default_rng(7)
    made = replace(load_open_hand(), pose_mean=rng.normal(scale=0.2, size=(15, 3)).astype(np.float32))
    path = write_npz(made, tmp_path / "MANO_RIGHT.npz")
    hand = load_hand(path)
    oracle = MANO(model_path=path, flat_hand_mean=False)
    pose = rng.normal(scale=0.3, size=(1, 15, 3)).astype(np.float32)
    turns = Rotation.from_rotvec(pose[0] + hand.pose_mean).as_matrix().astype(np.float32)[None]
    vertices, _ = skin(hand, jnp.asarray(turns), jnp.zeros((1, 10)))
    np.testing.assert_allclose(vertices, oracle.forward_vertices(pose, shape=np.zeros((1, 10), np.float32)), atol=1e-5)


def test_rest_pose_is_the_shaped_template_and_its_joints() -> None:
    hand = load_open_hand()
    shape = jnp.asarray(np.random.default_rng(1).normal(size=(3, 10)), jnp.float32)
    rest = shaped_template(hand, shape)
    vertices, joints = skin(hand, jnp.broadcast_to(jnp.eye(3), (3, 15, 3, 3)), shape)
    np.testing.assert_allclose(vertices, rest, atol=1e-6)
    np.testing.assert_allclose(joints, joint_centres(hand, rest), atol=1e-6)


def test_fewer_shape_coefficients_are_padded_with_zeros() -> None:
    hand = HANDS[False]
    short = shaped_template(hand, jnp.array([0.5, -1.0]))
    np.testing.assert_allclose(short, shaped_template(hand, jnp.array([0.5, -1.0] + [0.0] * 8)), atol=1e-7)


def test_flexion_about_z_curls_the_fingers_to_the_palm() -> None:
    """Positive about +z takes -x to -y: from straight ahead to the palm's side."""
    hand = load_open_hand()
    pose = np.tile(np.eye(3, dtype=np.float32), (15, 1, 1))
    pose[:12] = Rotation.from_rotvec([0, 0, 1.0]).as_matrix()
    vertices, _ = skin(hand, jnp.asarray(pose), jnp.zeros(10))
    tips = np.asarray(vertices)[hand.tip_vertices]
    rest = hand.template[hand.tip_vertices]
    assert (tips[:4, 1] < rest[:4, 1] - 0.02).all()
    assert (tips[:4, 0] > rest[:4, 0] + 0.03).all()
    np.testing.assert_allclose(tips[4], rest[4], atol=1e-6)  # the thumb stays


def test_left_hand_moves_as_the_mirror_image() -> None:
    right, left = load_open_hand("right"), load_open_hand("left")
    rng = np.random.default_rng(2)
    rotations = Rotation.random(15, rng=rng).as_matrix().astype(np.float32)
    mirror = np.diag([-1, 1, 1]).astype(np.float32)
    shape = jnp.asarray(rng.normal(size=10), jnp.float32)
    vertices, joints = skin(right, jnp.asarray(rotations), shape)
    mirrored_vertices, mirrored_joints = skin(left, jnp.asarray(mirror @ rotations @ mirror), shape)
    np.testing.assert_allclose(mirrored_vertices, vertices @ mirror, atol=1e-6)
    np.testing.assert_allclose(mirrored_joints, joints @ mirror, atol=1e-6)
