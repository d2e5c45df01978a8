import dataclasses

import numpy as np
import pytest

from envs.grasps import Pads, grasp_names, grasp_type
from mjx_hand.errors import InputError
from mjx_hand.hand.joints import HINGES, LINKS
from mjx_hand.objects.description import OBJECT_KINDS
from mjx_hand.rigid.limits import anatomical_limits


def test_a_mesh_is_no_grasp_types_object():
    with pytest.raises(InputError, match=r"'pinch': object_kind is 'mesh', .*valid: box, sphere, cylinder, capsule"):
        dataclasses.replace(grasp_type("pinch"), object_kind="mesh")


@pytest.mark.parametrize("name", grasp_names())
def test_a_grasp_type_is_complete_and_consistent(name):
    grasp = grasp_type(name)
    assert grasp.name == name
    assert grasp.object_kind in OBJECT_KINDS
    assert len(grasp.posture) == len(HINGES)
    rotation = np.array(grasp.wrist_rotation)
    np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=2e-3)
    assert np.linalg.det(rotation) == pytest.approx(1.0, abs=2e-3)
    turned = np.array(grasp.object_rotation)
    np.testing.assert_allclose(turned @ turned.T, np.eye(3), atol=1e-9)
    assert len(grasp.contacts) >= 2
    for contact in grasp.contacts:
        assert contact.link in LINKS
        assert 0 <= contact.along <= 1
    if isinstance(grasp.closing, Pads):
        normals = [np.array(contact.normal, float) for contact in grasp.contacts]
        for contact, normal in zip(grasp.contacts, normals, strict=True):
            assert np.linalg.norm(normal) == pytest.approx(1.0)
            assert np.dot(contact.aside, normal) == pytest.approx(0.0)
        # The first contact opposes the rest.
        assert all(np.dot(normals[0], normal) < 0 for normal in normals[1:])
    else:
        assert len(grasp.closing.opened) == len(HINGES)
        lower, upper = anatomical_limits()
        assert (grasp.closing.opened >= lower).all()
        assert (grasp.closing.opened <= upper).all()
    low, high = np.array(grasp.object_size)
    assert (low <= high).all()
    for box in grasp.support:
        assert min(box.half) > 0
        assert box.centre[2] - box.half[2] > -1e-9  # not in the table
        assert box.centre[2] + box.half[2] >= grasp.rest or grasp.rest == 0
    for low, high in (grasp.object_mass, grasp.object_friction, grasp.lift, grasp.carry, grasp.turn):
        assert 0 <= low <= high


def test_an_unknown_type_is_named_with_the_valid_ones():
    assert {"power", "pinch", "lateral", "cylindrical", "spherical"} <= set(grasp_names())
    assert "grasp_type" not in grasp_names()
    with pytest.raises(InputError, match=r"'fist' is not known; valid: .*pinch"):
        grasp_type("fist")
