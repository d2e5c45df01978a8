"""A rigid human hand as a `KinematicTree` whose 21 points are the keypoints."""

import numpy as np

from mjx_hand.capture.keypoints.layouts import KEYPOINTS, LINK_KEYPOINTS, TIP_KEYPOINTS
from mjx_hand.hand.joints import HINGE_LINKS, HINGES, PARENTS, TIP_LINKS
from mjx_hand.rigid.rigid_hand import RigidHand
from mjx_hand.robots.solver.kinematic_tree import BASE, KinematicTree, z_frame


def human_tree(rigid: RigidHand) -> KinematicTree:
    """The 20 hinges of `rigid` and the 21 keypoints on its links; the base is the wrist, in hand-frame directions."""
    axes, offsets = np.asarray(rigid.hinge_axis, float), np.asarray(rigid.link_offset, float)
    frames = [z_frame(axis) for axis in axes]
    rest = np.tile(np.eye(3), (len(HINGES), 1, 1))  # between a link's last hinge and the link itself
    if rigid.rest_rotation is not None:
        rest = np.asarray(rigid.rest_rotation, float)[np.array(HINGE_LINKS) - 1]
    carried = [turn.T @ frame for turn, frame in zip(rest, frames, strict=True)]
    last = {BASE: BASE, 0: BASE}  # the joint that carries each link
    parents, rotations, positions = [], [], []
    for hinge, link in enumerate(HINGE_LINKS):
        first = link not in last  # two hinges move a finger's first link, the second of them from the same place
        parent = last[PARENTS[link]] if first else last[link]
        outer = np.eye(3) if parent == BASE else carried[parent] if first else frames[parent]
        parents.append(parent)
        rotations.append(outer.T @ frames[hinge])
        positions.append(outer.T @ offsets[link] if first else np.zeros(3))
        last[link] = hinge
    tips = dict(zip(TIP_KEYPOINTS, zip(TIP_LINKS, np.asarray(rigid.tip_offset, float), strict=True), strict=True))
    places = [tips.get(k) or (LINK_KEYPOINTS.index(k), np.zeros(3)) for k in range(len(KEYPOINTS))]
    joints = [last[link] for link, _ in places]
    points = [offset if j == BASE else carried[j].T @ offset for j, (_, offset) in zip(joints, places, strict=True)]
    return KinematicTree(
        rest_rotation=np.array(rotations, np.float32),
        rest_position=np.array(positions, np.float32),
        slope=np.ones(len(HINGES), np.float32),
        shift=np.zeros(len(HINGES), np.float32),
        lower=np.asarray(rigid.hinge_lower, np.float32),
        upper=np.asarray(rigid.hinge_upper, np.float32),
        point_position=np.array(points, np.float32),
        parents=tuple(parents),
        dofs=tuple(range(len(HINGES))),
        slides=(False,) * len(HINGES),
        point_joints=tuple(joints),
        dof_names=HINGES,
        joint_names=HINGES,
        point_names=KEYPOINTS,
    )
