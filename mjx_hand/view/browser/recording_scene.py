"""Recordings as scenes: what `mjx-hand view` shows of each kind of file."""

from collections.abc import Mapping

import numpy as np
from jaxtyping import Float
from scipy.spatial import KDTree

from mjx_hand.capture.keypoints.skeleton import BONES
from mjx_hand.capture.markers.marker_recording import MarkerRecording
from mjx_hand.errors import InputError
from mjx_hand.hand.model import HandModel
from mjx_hand.motion import Demonstration, JointMotion, Motion, RecordedScene
from mjx_hand.motion.scene_notes import wrist_distance
from mjx_hand.pytree import replace
from mjx_hand.retarget.sequence import retarget_errors, retarget_sequence, rigid_hand_of
from mjx_hand.rigid.build import build_rigid_hand
from mjx_hand.rigid.own_hinges import with_hinges_of
from mjx_hand.view.browser.hand_scene import object_layers, skin_layer, skin_vertices, skinned_motion, twin_layer
from mjx_hand.view.browser.object_layer import object_layer, turned_layers
from mjx_hand.view.browser.scene import Colour, Curve, Layer, PointLayer, Scene, SkinLayer

MARKER: Colour = (46, 107, 186)
KEYPOINT: Colour = (38, 130, 120)
GLASS = 0.55
_CURVES = 4  # of a scene: more are no figure
NEAR = 0.03  # m from the skin, in the usual frame, up to which a marker is one of the hand's


def motion_scene(motion: Motion, hand: HandModel, up: str = "+z") -> Scene:
    """The hand of a motion, its rigid twin beside it in the list, and how far the twin's finger tips are from it."""
    rigid = rigid_hand_of(motion, hand)
    angles = retarget_sequence(motion, rigid)
    tips = retarget_errors(motion, angles, rigid).tip_position.mean(axis=1)
    curve = Curve("finger tips of the twin", np.where(motion.valid, 1e3 * tips, np.nan), "mm")
    layers = (skin_layer(motion, hand), twin_layer(angles, rigid, shown=False))
    return Scene(title=motion.source or "motion", fps=motion.fps, layers=layers, curves=(curve,), up=up)


def recorded_scene(scene: RecordedScene, hands: Mapping[str, HandModel], up: str | None = None) -> Scene:
    """Hands with the objects that they hold, and how far each wrist is from each object.

    Args:
        scene: what was recorded.
        hands: the model of each side.
        up: an axis; None takes the scene's own, turned to +z, or +z.
    """
    layers: list[Layer] = [skin_layer(motion, hands[motion.side], name=f"{motion.side} hand") for motion in scene.hands]
    layers += [object_layer(found) for found in scene.objects]
    if up is None and scene.up is not None:
        layers = turned_layers(layers, scene.up)
    curves = [
        Curve(f"{motion.side} wrist from {found.name}", 1e3 * wrist_distance(motion, found), "mm")
        for motion in scene.hands
        for found in scene.objects
        if (motion.valid & found.seen).any()
    ]
    nearest = sorted(curves, key=lambda curve: float(np.nanmin(curve.values)))[:_CURVES]
    title = scene.source or "scene"
    return Scene(title=title, fps=scene.fps, layers=tuple(layers), curves=tuple(nearest), up=up or "+z")


def joint_motion_scene(motion: JointMotion, hand: HandModel, up: str = "+z") -> Scene:
    """The rigid twin of a joint motion, of the mean shape, which such a file does not hold."""
    rigid = build_rigid_hand(hand)
    skin = skin_layer(skinned_motion(motion, np.zeros(1), rigid), hand, shown=False)
    return Scene(title=motion.source or "joint motion", fps=motion.fps, layers=(twin_layer(motion, rigid), skin), up=up)


def demonstration_scene(demonstration: Demonstration, hand: HandModel) -> Scene:
    """The twin and the object of a demonstration, above its table."""
    rigid = with_hinges_of(demonstration, build_rigid_hand(hand, demonstration.shape))
    motion = demonstration.motion
    skin = skin_layer(skinned_motion(motion, demonstration.shape, rigid), hand)
    layers = (skin, twin_layer(motion, rigid, shown=False), *object_layers(demonstration))
    title = f"{demonstration.grasp}: {demonstration.source or 'demonstration'}"
    return Scene(title=title, fps=motion.fps, layers=layers, ground=0.0)


def with_markers(scene: Scene, recording: MarkerRecording) -> Scene:
    """The scene with the markers that a hand was fitted to, and how far the hand's own are from its skin.

    Raises:
        InputError: the recording has another number of frames, or the scene has no skin.
    """
    name = recording.source or "markers"
    if recording.num_frames != scene.num_frames:
        raise InputError(
            f"{name}: has {recording.num_frames} frames, the motion {scene.num_frames}; give the pair that belongs"
        )
    points = np.where(recording.visible[..., None], recording.positions, np.nan)
    away = distance_from_skin(_skin(scene), points)
    usual = [np.median(column[np.isfinite(column)]) if np.isfinite(column).any() else np.inf for column in away.T]
    away = away[:, np.array(usual) < NEAR]  # the others are on the arm, the body, an object
    curve = Curve("markers from the skin", 1e3 * _mean(away), "mm")
    layer = PointLayer("markers", points, MARKER, radius=0.0035)
    return replace(scene, layers=(*_see_through(scene), layer), curves=(curve, *scene.curves))


def with_keypoints(scene: Scene, seen: Float[np.ndarray, "t 21 3"], fitted: Float[np.ndarray, "t 21 3"]) -> Scene:
    """The scene with the keypoints that its hand was fitted to, and how far (m) the hand's own are from them."""
    mean = _mean(np.linalg.norm(fitted - seen, axis=-1))
    layer = PointLayer("keypoints", seen, KEYPOINT, lines=BONES.reshape(-1, 2))
    curve = Curve("keypoints from the hand's", 1e3 * mean, "mm")
    return replace(scene, layers=(*_see_through(scene), layer), curves=(curve, *scene.curves))


def distance_from_skin(skin: SkinLayer, points: Float[np.ndarray, "t m 3"]) -> Float[np.ndarray, "t m"]:
    """Distance (m) of each point from the nearest vertex in each frame; NaN where it is not seen."""
    out = np.full(points.shape[:2], np.nan)
    for frame, row in enumerate(points):
        seen = np.asarray(np.isfinite(row).all(axis=1))
        if seen.any():
            out[frame, seen] = KDTree(skin_vertices(skin, frame)).query(row[seen])[0]
    return out


def _mean(away: Float[np.ndarray, "t m"]) -> Float[np.ndarray, "t"]:
    """The mean of each row's numbers; NaN where it has none."""
    count = np.isfinite(away).sum(axis=1)
    return np.where(count > 0, np.nansum(away, axis=1) / np.maximum(count, 1), np.nan)


def _see_through(scene: Scene) -> tuple[Layer, ...]:
    """The scene's layers, its hands like glass: what was recorded is on them or in them."""
    return tuple(layer if isinstance(layer, PointLayer) else replace(layer, opacity=GLASS) for layer in scene.layers)


def _skin(scene: Scene) -> SkinLayer:
    skins = [layer for layer in scene.layers if isinstance(layer, SkinLayer)]
    if not skins:
        raise InputError(f"{scene.title}: shows no skinned hand to compare with")
    return skins[0]
