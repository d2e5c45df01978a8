"""The viewer: what it draws is where kinematics has it, it plays in real time, and a browser shows a hand."""

import time
from typing import TypeVar

import jax.numpy as jnp
import numpy as np
import pytest

from mjx_hand.capture.markers.marker_recording import MarkerRecording
from mjx_hand.errors import InputError
from mjx_hand.hand.load import load_hand
from mjx_hand.hand.skinning import skin
from mjx_hand.motion import Demonstration, JointMotion, Motion, ObjectDescription
from mjx_hand.motion.resample import quaternion_matrices
from mjx_hand.pytree import replace
from mjx_hand.rigid.build import build_rigid_hand
from mjx_hand.rigid.rigid_hand import forward_kinematics
from mjx_hand.view.browser.hand_scene import object_mesh, skin_layer, skin_vertices
from mjx_hand.view.browser.recording_scene import (
    demonstration_scene,
    distance_from_skin,
    joint_motion_scene,
    motion_scene,
    with_keypoints,
    with_markers,
)
from mjx_hand.view.browser.scene import Curve, MeshLayer, PointLayer, Scene, SkinLayer, check_scene
from mjx_hand.view.browser.viewer import Viewer, serving
from tests.capture.keypoints.grips import grip, keypoints_of
from tests.view.browser.chromium import find_chromium, page

SHAPE = np.array([1.0, -1.0, 0.5, 0, 0, 0, 0, 0, 0, 0])


@pytest.fixture(scope="module")
def motion() -> Motion:
    return grip(shape=SHAPE)


@pytest.fixture(scope="module")
def angles() -> JointMotion:
    rigid = build_rigid_hand(load_hand())
    swing = np.linspace(0, 0.7, 40)[:, None] * np.asarray(rigid.hinge_upper)
    turn = np.linspace(0, 0.5, 40)
    return JointMotion(
        fps=20.0,
        angles=swing,
        wrist_position=np.linspace([0, 0, 0.2], [0.1, 0, 0.3], 40),
        wrist_quaternion=np.stack([np.cos(turn), np.sin(turn), 0 * turn, 0 * turn], axis=1),
        valid=np.ones(40, bool),
    )


@pytest.fixture(scope="module")
def motions(motion: Motion) -> Scene:
    return motion_scene(motion, load_hand())


@pytest.fixture(scope="module")
def twin(angles: JointMotion) -> Scene:
    return joint_motion_scene(angles, load_hand())


def demonstration(angles: JointMotion, kind: str = "box", boxes: int = 1) -> Demonstration:
    pose = np.zeros((40, 7))
    pose[:, :3], pose[:, 3] = angles.wrist_position, 1.0
    return Demonstration(
        motion=angles,
        object_pose=pose,
        object=ObjectDescription(size=np.array([0.02, 0.03, 0.025]), mass=0.1, friction=1.0, kind=kind),
        support=np.full((boxes, 3), 0.03),
        support_position=np.full((boxes, 3), 0.03),
        shape=SHAPE,
        grasp="pinch",
    )


L = TypeVar("L", MeshLayer, SkinLayer, PointLayer)


def named(scene: Scene, name: str, kind: type[L]) -> L:
    return next(layer for layer in scene.layers if layer.name == name and isinstance(layer, kind))


def test_skin_is_where_skinning_has_it(motion):
    hand = load_hand()
    layer = skin_layer(motion, hand)
    frame = 17
    vertices, centres = skin(hand, jnp.asarray(motion.rotations[frame], jnp.float32), jnp.asarray(SHAPE, jnp.float32))
    in_wrist = np.asarray(vertices - centres[0])
    world = in_wrist @ quaternion_matrices(motion.wrist_quaternion)[frame].T + motion.wrist_position[frame]
    np.testing.assert_allclose(skin_vertices(layer, frame), world, atol=1e-5)


def test_nodes_follow_forward_kinematics(angles, twin):
    rigid = build_rigid_hand(load_hand())
    turn, place = forward_kinematics(jnp.asarray(angles.angles, jnp.float32), rigid)
    wrist = quaternion_matrices(angles.wrist_quaternion)
    world = np.einsum("tij,tlj->tli", wrist, np.asarray(place)) + angles.wrist_position[:, None]
    with serving(twin, port=0) as viewer:
        for frame in (0, 23, 39):
            viewer.show(frame)
            assert viewer.frame == frame
            for link in range(16):
                node = viewer.server.scene.get_handle_by_name(f"/rigid twin/{link}")
                assert node is not None
                np.testing.assert_allclose(node.position, world[frame, link], atol=1e-6)
                facing = quaternion_matrices(np.asarray(node.wxyz)[None])[0]
                np.testing.assert_allclose(facing, wrist[frame] @ np.asarray(turn)[frame, link], atol=1e-5)


def test_missing_points_are_hidden():
    points = np.zeros((2, 3, 3))
    points[1, 2] = np.nan
    scene = Scene("points", 10.0, (PointLayer("markers", points, (0, 0, 255), lines=np.array([[0, 1], [1, 2]])),))
    with serving(scene, port=0) as viewer:
        node = viewer.server.scene.get_handle_by_name("/markers/2")
        assert node is not None
        assert node.visible
        viewer.show(1)
        assert not node.visible


def test_a_hidden_layer_is_where_it_belongs_when_it_is_shown(motions):
    with serving(motions, port=0) as viewer:
        link = viewer.server.scene.get_handle_by_name("/rigid twin/3")
        assert link is not None
        before = np.array(link.position)
        viewer.show(30)
        np.testing.assert_array_equal(link.position, before)  # nothing is sent for what nobody sees
        box = next(b for b in viewer.switches if b.label == "rigid twin")
        box.value = True
        deadline = time.monotonic() + 10
        expected = named(motions, "rigid twin", MeshLayer).transforms[30, 3, :3, 3]
        while not np.allclose(link.position, expected, atol=1e-6) and time.monotonic() < deadline:
            time.sleep(0.01)
        np.testing.assert_allclose(link.position, expected, atol=1e-6)
        root = viewer.server.scene.get_handle_by_name("/rigid twin")
        assert root is not None
        assert root.visible


def test_it_plays_in_real_time_and_stops_at_the_end(twin):
    with serving(twin, port=0) as viewer:
        viewer._loop.value = False
        began = time.monotonic()
        viewer.play(speed=2.0)  # 40 frames at 20/s: one second
        while viewer.frame < 39 and time.monotonic() - began < 20:
            time.sleep(0.01)
        assert 0.9 < time.monotonic() - began < 5.0  # a loaded machine may be late, but never early
        time.sleep(0.1)
        viewer.pause()
        viewer.show(3)
        time.sleep(0.1)
        assert viewer.frame == 3


def test_a_port_that_is_taken_is_said(twin):
    with serving(twin, port=0) as viewer:
        taken = viewer.server.get_port()
        with pytest.raises(InputError, match=f"cannot serve at 127.0.0.1:{taken}"):
            Viewer(twin, port=taken)
    with pytest.raises(InputError, match="ports are 0 to 65535"):
        Viewer(twin, port=99999)


def test_a_motion_comes_with_its_twin_and_their_difference(motion, motions):
    assert [layer.name for layer in motions.layers] == ["hand", "rigid twin"]
    assert motions.num_frames == motion.num_frames
    # The motion is of hinges alone, and so the twin follows it exactly.
    assert np.nanmax(motions.curves[0].values) < 0.5


def test_gaps_have_no_error(motion):
    valid = motion.valid.copy()
    valid[10:20] = False
    scene = motion_scene(replace(motion, valid=valid), load_hand())
    assert np.isnan(scene.curves[0].values[10:20]).all()
    assert np.isfinite(scene.curves[0].values[20:]).all()


def test_markers_on_the_skin_are_at_no_distance(motion, motions):
    skinned = named(motions, "hand", SkinLayer)
    on = np.stack([skin_vertices(skinned, k)[[10, 400, 900]] for k in range(motion.num_frames)])
    away = on + np.array([0, 0, 0.5])
    np.testing.assert_allclose(distance_from_skin(skinned, on), 0, atol=1e-9)
    assert (distance_from_skin(skinned, away) > 0.2).all()
    visible = np.ones(on.shape[:2], bool)
    visible[5] = False
    on[:, 2] += [0.0, 0.0, 0.5]  # a marker on something else
    recording = MarkerRecording(fps=motion.fps, positions=on, visible=visible, names=("a", "b", "pillow"))
    shown = with_markers(motions, recording)
    assert np.isnan(shown.curves[0].values[5])
    assert np.nanmax(shown.curves[0].values) < 1e-3
    assert np.isnan(named(shown, "markers", PointLayer).points[5]).all()
    with pytest.raises(InputError, match="give the pair that belongs"):
        with_markers(motions, replace(recording, positions=on[1:], visible=visible[1:]))


def test_keypoints_beside_the_hand(motion, motions):
    points = keypoints_of(motion)
    scene = with_keypoints(motions, points, points + np.array([0.003, 0, 0.004]))
    np.testing.assert_allclose(scene.curves[0].values, 5.0)
    lines = named(scene, "keypoints", PointLayer).lines
    assert lines is not None
    assert lines.shape == (15, 2)


@pytest.mark.parametrize(
    ("kind", "half"),
    [
        ("box", (0.02, 0.03, 0.025)),
        ("sphere", (0.02, 0.02, 0.02)),
        ("cylinder", (0.02, 0.02, 0.03)),
        ("capsule", (0.02, 0.02, 0.05)),
        ("mesh", (0.04, 0.01, 0.01)),
    ],
)
def test_objects_have_their_size(kind, half):
    cube = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * 0.01
    hulls = cube + np.array([[[-0.03, 0, 0]], [[0.03, 0, 0]]]) if kind == "mesh" else np.zeros((0, 0, 3))
    description = ObjectDescription(size=np.array([0.02, 0.03, 0.025]), mass=1.0, friction=1.0, hulls=hulls, kind=kind)
    vertices, faces = object_mesh(description)
    np.testing.assert_allclose(np.ptp(vertices, axis=0) / 2, half, rtol=0.02)
    np.testing.assert_allclose(vertices.max(axis=0), -vertices.min(axis=0), rtol=0.02)
    assert faces.max() < len(vertices)


def test_demonstrations_show_object_and_supports(angles):
    scene = demonstration_scene(demonstration(angles, boxes=2), load_hand())
    assert scene.ground == 0.0
    object_layer, support = named(scene, "object", MeshLayer), named(scene, "support", MeshLayer)
    np.testing.assert_allclose(object_layer.transforms[:, 0, :3, 3], angles.wrist_position)
    assert support.transforms.shape == (40, 2, 4, 4)
    bare = demonstration_scene(demonstration(angles, boxes=0), load_hand())
    assert [layer.name for layer in bare.layers] == ["hand", "rigid twin", "object"]


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"layers": ()}, "nothing to show"),
        ({"fps": 0.0}, "fps is 0.0"),
        ({"up": "z"}, "up is 'z'"),
        ({"layers": (PointLayer("p", np.full((2, 1, 3), np.nan), (0, 0, 0)),)}, "nothing is seen"),
        ({"curves": (Curve("error", np.zeros(3), "mm"),)}, "numbers of frames differ"),
    ],
)
def test_scenes_that_cannot_be_shown(change, says):
    scene = Scene("made", 10.0, (PointLayer("p", np.zeros((2, 1, 3)), (0, 0, 0)),))
    with pytest.raises(InputError, match=says):
        check_scene(replace(scene, **change))


def test_a_browser_shows_a_hand(angles, tmp_path):
    chromium = find_chromium()
    if chromium is None:
        pytest.skip("no Chromium to look at the page with")
    scene = demonstration_scene(demonstration(angles), load_hand())
    with serving(scene, port=0) as viewer, page(chromium, viewer.url, tmp_path) as opened:
        viewer.show(20)
        deadline = time.monotonic() + 120
        skin_share = 0.0
        while skin_share < 0.01 and time.monotonic() < deadline:
            time.sleep(0.5)
            red, green, blue = np.moveaxis(opened.picture()[:, :850].astype(int), -1, 0)
            # Skin, and the object's orange: clearly redder than blue. The page and its grid are grey.
            skin_share = ((red - blue > 30) & (red > green)).mean()
    assert skin_share > 0.01, "nothing like a hand was drawn within two minutes"
