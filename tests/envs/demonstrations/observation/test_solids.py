"""How objects stand: on which of their faces, on what foot, in how many pieces."""

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from envs.demonstrations.observation.solids import as_many, pieces_of, samples, solid_of, with_foot
from mjx_hand.errors import InputError
from mjx_hand.motion.make_scene import recorded_object

POSE = np.array([[0.0, 0, 0, 1, 0, 0, 0]])


def solid(kind: str, *size: float):
    return solid_of(recorded_object("it", POSE, kind=kind, size=size), "made up")


def test_a_box_stands_on_six_faces_a_can_on_its_ends_surest_first_and_a_ball_on_none():
    box = solid("box", 0.02, 0.03, 0.05)
    assert len(box.stands) == 6
    np.testing.assert_allclose(np.abs(box.stands[0]), [1, 0, 0], atol=1e-9)  # on the largest
    assert box.volume == pytest.approx(8 * 0.02 * 0.03 * 0.05)
    can = solid("cylinder", 0.03, 0.05)
    upright = [stand for stand in can.stands if abs(stand[2]) > 0.99]
    assert len(upright) == 2
    assert not len(solid("sphere", 0.03).stands)
    assert box.lowest(np.eye(3), np.array([0.0, 0, 1])) == pytest.approx(-0.05)


def test_convex_solids_are_one_piece_and_others_are_filled_up_without_touching():
    box = solid("box", 0.02, 0.03, 0.05)
    hulls = pieces_of(box, 6)
    assert len(hulls) == 1
    assert ConvexHull(np.unique(hulls[0], axis=0)).volume == pytest.approx(box.volume)
    three = as_many(hulls, 3)
    np.testing.assert_array_equal(three[0], hulls[0])
    inside = ConvexHull(np.unique(hulls[0], axis=0)).equations
    assert (three[1:].reshape(-1, 3) @ inside[:, :3].T + inside[:, 3]).max() < -0.01
    near = samples(box)
    assert (np.abs(near) <= [0.02 + 1e-9, 0.03 + 1e-9, 0.05 + 1e-9]).all()
    assert len(near) > 100


def test_a_piece_with_few_corners_gets_a_foot_that_stands():
    can = solid("cylinder", 0.03, 0.05)
    up = np.array([0.0, 0, 1])
    poor = can.outline[can.outline[:, 2] > -0.049]
    poor = np.concatenate([poor, [[0.02, 0, -0.05], [0.01, 0.01, -0.05]]])[None]
    made = with_foot(poor, can, up)[0]
    foot = made[made[:, 2] < made[:, 2].min() + 1e-9][:, :2]
    edge = ConvexHull(foot).equations
    assert edge[:, 2].max() < -0.025  # the axis is well inside the foot
    assert made[:, 2].min() == pytest.approx(-0.05)


def test_poses_without_a_surface_and_flat_meshes_are_refused():
    with pytest.raises(InputError, match="poses without a mesh"):
        solid("none")
    flat = np.array([[0, 0, 0], [0.1, 0, 0], [0, 0.1, 0], [0.1, 0.1, 0]])
    sheet = recorded_object("sheet", POSE, mesh=(flat, np.array([[0, 1, 2], [1, 3, 2]])))
    with pytest.raises(InputError, match="is flat; give a mesh with thickness"):
        solid_of(sheet, "made up")
