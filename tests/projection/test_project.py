import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from mjx_hand.errors import InputError
from mjx_hand.projection import METHODS, project
from mjx_hand.rigid.rigid_hand import joint_rotations
from tests.projection.samples import angle_between, hand_with_axes, hinge_axes, random_rotations

ORTHOGONAL, OBLIQUE = hand_with_axes(hinge_axes(40)), hand_with_axes(hinge_axes(42, overlap=0.6))
RANDOM = random_rotations(60, 44).reshape(4, 15, 3, 3)


@settings(deadline=None, max_examples=40)
@given(angles=arrays(np.float32, 20, elements=st.floats(-3, 3, width=32)), oblique=st.booleans())
def test_recovers_the_angles_of_a_reachable_pose(angles, oblique):
    rigid = OBLIQUE if oblique else ORTHOGONAL
    np.testing.assert_allclose(project(joint_rotations(jnp.asarray(angles), rigid), rigid), angles, atol=3e-5)


def test_no_method_comes_nearer_at_any_joint_than_the_exact_one():
    for rigid in (ORTHOGONAL, OBLIQUE):
        error = {m: angle_between(RANDOM, joint_rotations(project(RANDOM, rigid, m), rigid)) for m in METHODS}
        for method in METHODS:
            assert np.all(error["exact"] <= error[method] + 1e-3), method


@pytest.mark.parametrize("method", METHODS)
def test_jit_vmap_and_leading_axes_agree(method):
    whole = project(RANDOM, ORTHOGONAL, method)
    assert whole.shape == (4, 20)
    assert whole.dtype == jnp.float32
    np.testing.assert_allclose(project(RANDOM.reshape(2, 2, 15, 3, 3), ORTHOGONAL, method)[1, 0], whole[2], atol=1e-5)
    for version in (
        jax.jit(lambda r: project(r, ORTHOGONAL, method)),
        jax.vmap(lambda r: project(r, ORTHOGONAL, method)),
    ):
        np.testing.assert_allclose(version(jnp.asarray(RANDOM)), whole, atol=1e-5)
    assert project(RANDOM[0], ORTHOGONAL, method).shape == (20,)
    assert project(RANDOM[:0], ORTHOGONAL, method).shape == (0, 20)


@pytest.mark.parametrize("method", METHODS)
def test_gradient_is_finite_at_rest(method):
    rest = jnp.tile(jnp.eye(3), (15, 1, 1))
    slope = jax.grad(lambda r: jnp.sum(project(r, ORTHOGONAL, method)))(rest)
    assert np.all(np.isfinite(slope))
    assert np.any(slope != 0)


def test_float64_in_float64_out():
    with jax.enable_x64(True):
        angles = np.random.default_rng(45).uniform(-3, 3, (4, 20))
        found = project(joint_rotations(jnp.asarray(angles), OBLIQUE), OBLIQUE)
        assert found.dtype == jnp.float64
        np.testing.assert_allclose(found, angles, atol=1e-11)


def broken(change):
    bad = RANDOM.copy()
    bad[2, 7] = change(bad[2, 7])
    return bad


@pytest.mark.parametrize(
    ("rotations", "message"),
    [
        (RANDOM[:, :14], r"shape \(4, 14, 3, 3\); the shape must be \(\.\.\., 15, 3, 3\)"),
        (np.zeros((4, 15, 3)), r"mjx_hand\.rotations\.exp"),
        (np.zeros((4, 45)), r"mjx_hand\.rotations\.exp"),
        (RANDOM.astype(str), "real numbers"),
        (broken(lambda r: r * np.nan), r"rotations\[2, 7\] is not finite"),
        (broken(lambda r: r * np.inf), r"rotations\[2, 7\] is not finite"),
        (broken(lambda r: r * 1.01), r"rotations\[2, 7\] is off a rotation by 0\.03"),
        (broken(lambda r: -r), r"rotations\[2, 7\] is off a rotation by 2"),
        (broken(lambda r: r + [[0, 0.01, 0]] * 3), r"rotations\[2, 7\] is off a rotation"),
    ],
)
def test_refuses_what_is_not_a_pose(rotations, message):
    with pytest.raises(InputError, match=message) as error:
        project(rotations, ORTHOGONAL)
    assert "\n" not in str(error.value)


def test_small_rounding_is_accepted():
    project(RANDOM + 1e-4, ORTHOGONAL)


def test_refuses_an_unknown_method():
    with pytest.raises(InputError, match="choose one of exact, paper, bch2, naive"):
        project(RANDOM, ORTHOGONAL, "fast")
