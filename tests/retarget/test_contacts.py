"""Distance to meshes against known solids and trimesh, and contacts of the real recording kept by refinement."""

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from mjx_hand.capture.load import load_motion
from mjx_hand.errors import InputError
from mjx_hand.hand.load import load_hand
from mjx_hand.objects.mesh_distance import signed_distance
from mjx_hand.projection import project
from mjx_hand.retarget.contacts import TOUCHING, contact_normals
from mjx_hand.retarget.refine import recorded_places, refine_angles
from mjx_hand.retarget.sequence import rigid_hand_of
from mjx_hand.rigid.rigid_hand import finger_tips


def test_a_box_has_the_distances_of_a_box():
    half = np.array([0.02, 0.03, 0.05])
    box = trimesh.creation.box(2 * half)
    points = np.random.default_rng(0).uniform(-0.08, 0.08, (300, 3))
    outside = np.abs(points) - half
    expected = np.linalg.norm(np.maximum(outside, 0), axis=1) + np.minimum(outside.max(axis=1), 0)
    found, direction = signed_distance(points, np.array(box.vertices), np.array(box.faces))
    np.testing.assert_allclose(found, expected, atol=1e-6)
    np.testing.assert_allclose(np.linalg.norm(direction, axis=1), 1, atol=1e-4)
    ahead = signed_distance(points + 1e-4 * direction, np.array(box.vertices), np.array(box.faces))[0]
    assert np.quantile(np.abs(ahead - found - 1e-4), 0.95) < 2e-6  # but where two faces are equally near


def test_a_hollow_curved_mesh_is_as_trimesh_has_it():
    ring = trimesh.creation.torus(0.04, 0.015, major_sections=24, minor_sections=12)
    points = np.random.default_rng(1).uniform(-0.06, 0.06, (120, 3)) * [1, 1, 0.4]
    _, distance, _ = trimesh.proximity.closest_point(ring, points)
    found, _ = signed_distance(points, np.array(ring.vertices), np.array(ring.faces))
    np.testing.assert_allclose(np.abs(found), distance, atol=1e-6)
    np.testing.assert_array_equal(found < 0, ring.contains(points))


@pytest.mark.parametrize(
    ("vertices", "faces", "message"),
    [
        (np.zeros((3, 3)), np.zeros((0, 3), int), "0 triangles"),
        (np.full((3, 3), np.nan), np.array([[0, 1, 2]]), "finite"),
        (np.zeros((3, 3)), np.array([[0, 1, 7]]), "name vertex 7; it has 3"),
    ],
)
def test_meshes_that_are_none_are_refused(vertices, faces, message):
    with pytest.raises(InputError, match=message):
        signed_distance(np.zeros((2, 3)), vertices, faces)


def test_frames_that_do_not_pair_and_nan_are_refused():
    box = trimesh.creation.box([0.1, 0.1, 0.1])
    mesh = np.array(box.vertices), np.array(box.faces)
    with pytest.raises(InputError, match="4 frames of tips and 3 of object poses"):
        contact_normals(np.zeros((4, 5, 3)), np.tile(np.eye(4), (3, 1, 1)), *mesh)
    with pytest.raises(InputError, match="NaN"):
        contact_normals(np.full((3, 5, 3), np.nan), np.tile(np.eye(4), (3, 1, 1)), *mesh)


@pytest.mark.slow
def test_contacts_of_the_real_grasp_stay(recordings):
    """Where the recording's tips touch the bottle, the refined hand's do, to half a millimetre."""
    folder = recordings / "dexmv_mustard"
    motion = load_motion(folder / "sequence.npz")
    own = rigid_hand_of(motion, load_hand())
    mesh = trimesh.load_mesh(folder / "mustard_bottle.stl")
    mesh = np.array(mesh.vertices), np.array(mesh.faces)
    with np.load(folder / "sequence.npz") as file:
        poses = np.tile(np.eye(4), (motion.num_frames, 1, 1))
        poses[:, :3] = file["object_pose_objcam"][: motion.num_frames]
        poses = np.linalg.inv(file["hand_cam_to_object_cam"]) @ poses
    wrist = np.tile(np.eye(4), (motion.num_frames, 1, 1))
    wrist[:, :3, :3] = Rotation.from_quat(motion.wrist_quaternion, scalar_first=True).as_matrix()
    wrist[:, :3, 3] = motion.wrist_position
    wrist_from_object = np.linalg.inv(wrist) @ poses
    rotations = motion.rotations.astype(np.float32)
    places = np.asarray(recorded_places(rotations, own))
    contact, recorded = contact_normals(places[:, :, 2], wrist_from_object, *mesh)
    touching = np.abs(recorded) <= TOUCHING
    assert touching.mean() > 0.1
    angles = project(rotations, own)
    distances = [
        contact_normals(np.asarray(finger_tips(a, own)), wrist_from_object, *mesh)[1]
        for a in (angles, refine_angles(angles, places, own, contact))
    ]
    before, after = (np.abs(d - recorded)[touching] for d in distances)
    assert before.mean() > 1e-3
    assert after.mean() < 2e-4
    assert after.max() < 5e-4
