import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial import KDTree

from mjx_hand.errors import InputError
from mjx_hand.hand.load import load_hand
from mjx_hand.hand.skinning import joint_centres, shaped_template
from mjx_hand.rigid.build import build_rigid_hand
from mjx_hand.rigid.rigid_hand import finger_tips, forward_kinematics
from tests.rigid.conftest import SHAPE


def test_rest_is_the_skinned_hands_rest(hand, rigid):
    rest = shaped_template(hand, jnp.asarray(SHAPE))
    centres = np.asarray(joint_centres(hand, rest))
    rest = np.asarray(rest)
    zero = np.zeros(20, np.float32)
    np.testing.assert_allclose(forward_kinematics(zero, rigid)[1] + rigid.wrist_position, centres, atol=1e-6)
    np.testing.assert_allclose(finger_tips(zero, rigid) + rigid.wrist_position, rest[hand.tip_vertices], atol=1e-6)
    # The links' meshes, put at their joints, have every vertex of the skin, each once.
    drawn = np.concatenate([vertices + centre for vertices, centre in zip(rigid.mesh_vertices, centres, strict=True)])
    near = KDTree(drawn).query_ball_point(rest, 1e-6, return_length=True)
    np.testing.assert_array_equal(near, 1)


def test_fewer_coefficients_are_padded():
    hand = load_hand()
    full = np.zeros(hand.num_shape)
    full[:2] = 1.0, -2.0
    np.testing.assert_array_equal(build_rigid_hand(hand, [1.0, -2.0]).link_mass, build_rigid_hand(hand, full).link_mass)
    np.testing.assert_array_equal(build_rigid_hand(hand).link_mass, build_rigid_hand(hand, [0.0]).link_mass)


@pytest.mark.parametrize(
    ("shape", "axes", "words"),
    [
        (np.zeros(11), "anatomical", "up to 10"),
        (np.zeros((1, 10)), "anatomical", "up to 10"),
        ([0.0, np.nan], "anatomical", "finite"),
        (["a"], "anatomical", "numbers"),
        ([-400.0], "anatomical", "inside out"),
        (None, "mano", "anatomical"),
    ],
)
def test_bad_input_is_refused_in_one_line(shape, axes, words):
    with pytest.raises(InputError, match=words) as caught:
        build_rigid_hand(load_hand(), shape, axes=axes)
    assert "\n" not in str(caught.value)
