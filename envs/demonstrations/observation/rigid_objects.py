"""Articulated objects as rigid ones: while their parts keep their angle they are one body."""

import numpy as np

from mjx_hand.motion.resample import quaternion_matrices
from mjx_hand.motion.scene import RecordedObject, RecordedScene
from mjx_hand.pytree import replace

_CONSTANT = np.deg2rad(5.0)  # a hinge that turns less is at rest


def rigid_objects(scene: RecordedScene) -> RecordedScene:
    """The scene with each articulated object as one mesh, its parts at the angle that they have longest.

    Frames in which the angle is another are gaps of the object: no rigid body does that.
    """
    parts = [part for part in scene.objects if part.hinge is not None]
    whole = {found.name: found for found in scene.objects if found.hinge is None}
    for part in parts:
        parent = whole.get(part.hinge.parent)  # type: ignore[union-attr]
        if parent is not None:  # a part of a part stays where its parent is not a body of its own
            whole[parent.name] = _joined(parent, part)
    return replace(scene, objects=tuple(whole.values()))


def _joined(parent: RecordedObject, part: RecordedObject) -> RecordedObject:
    hinge = part.hinge
    assert hinge is not None
    angle = float(np.median(hinge.angle[part.seen & parent.seen])) if (part.seen & parent.seen).any() else 0.0
    half = angle / 2
    turn = quaternion_matrices(np.array([[np.cos(half), *(np.sin(half) * hinge.axis)]]))[0]
    moved = part.vertices @ turn.T + hinge.point - turn @ hinge.point
    return replace(
        parent,
        vertices=np.concatenate([parent.vertices, moved]),
        faces=np.concatenate([parent.faces, part.faces + len(parent.vertices)]),
        seen=parent.seen & (np.abs(hinge.angle - angle) < _CONSTANT),
    )
