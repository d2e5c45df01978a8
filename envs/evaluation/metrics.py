"""The field's metrics, one function each over `Rollouts`; frames that are not counted never matter.

Success metrics give one bool a rollout, errors one number. Thresholds are passed by what is strictly below them.
Sources: ManipTrans (Li et al. 2025, https://arxiv.org/abs/2503.21860), SPIDER (Pan et al. 2025,
https://arxiv.org/abs/2511.09484), CHORD as FlashCHORD scores it, ADD-AUC (Xiang et al. 2018,
https://arxiv.org/abs/1711.00199, with the thresholds used for dexterous tracking).
"""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool, Float

from envs.evaluation.rollout import Rollouts
from mjx_hand.bodies.human_body import HUMAN_PALM
from mjx_hand.errors import InputError
from mjx_hand.objects.description import ObjectDescription
from mjx_hand.objects.surface_points import surface_points

MANIP_TRANS = {"rotation": np.deg2rad(30.0), "translation": 0.03, "joints": 0.08, "tips": 0.06}  # rad, m
SPIDER = {"rotation": 0.5, "translation": 0.10}
CHORD = {"rotation": 0.5, "translation": 0.10, "wrist": 0.15}
# What ManipTrans' code (`failed_execute` in https://github.com/ManipTrans/ManipTrans) asks in each frame from the ninth
# on, at the end of its training (s = 0.7 in 2 cm s³/0.343, 30° s³/0.343, 4 to 8 cm s/0.7), but for contacts.
MANIP_TRANS_FRAME = {"rotation": np.deg2rad(30.0), "translation": 0.02, "first": 0.07, "others": 0.08}
MANIP_TRANS_TIPS = np.array([0.045, 0.05, 0.06, 0.06, 0.04])  # m, in the order of `hand.joints.FINGERS`
MANIP_TRANS_GRACE = 8  # frames
MOVED, TURNED = 0.005, np.deg2rad(5.0)  # of the demonstrated object, from which on it counts as moving
ADD_THRESHOLDS = np.arange(1, 10) / 100  # m
ADD_POINTS = 500
HOLD_SECONDS, HOLD_SLIP = 5.0, 0.02
RAISED = 0.02  # m above its start from which an object counts as lifted

_FIRST = [1, 4, 7, 10, 13]  # the fingers' first joints; the others are those beyond
_BEYOND = [2, 3, 5, 6, 8, 9, 11, 12, 14, 15]


def position_error(rollouts: Rollouts) -> Float[np.ndarray, "n t"]:
    """Distance (m) of the object's centre from the demonstrated one, frame by frame."""
    return np.linalg.norm(rollouts.object_pose[..., :3] - rollouts.object_reference[..., :3], axis=-1)


def rotation_error(rollouts: Rollouts) -> Float[np.ndarray, "n t"]:
    """Angle (rad) between the object's orientation and the demonstrated one, frame by frame."""
    return _angle(rollouts.object_pose[..., 3:], rollouts.object_reference[..., 3:])


def joint_error(rollouts: Rollouts) -> Float[np.ndarray, "n t"]:
    """Mean distance (m) of the joint centres from the demonstrated ones, frame by frame."""
    return np.linalg.norm(rollouts.joints - rollouts.joints_reference, axis=-1).mean(axis=-1)


def tip_error(rollouts: Rollouts) -> Float[np.ndarray, "n t"]:
    """Mean distance (m) of the finger tips from the demonstrated ones, frame by frame."""
    return np.linalg.norm(rollouts.tips - rollouts.tips_reference, axis=-1).mean(axis=-1)


def grip_force(rollouts: Rollouts) -> Float[np.ndarray, "n t"]:
    """Sum (N) of the magnitudes of the links' forces on the object, frame by frame."""
    return np.linalg.norm(rollouts.contact[..., :3], axis=-1).sum(axis=-1)


def moving(rollouts: Rollouts) -> Bool[np.ndarray, "n t"]:
    """Counted frames from the first on in which the demonstrated object is 5 mm or 5° from where it began.

    All counted frames where it never is.
    """
    rows = np.arange(len(rollouts.counted))
    reference = np.where(rollouts.counted[..., None], rollouts.object_reference, 0.0)
    start = reference[rows, np.argmax(rollouts.counted, axis=1)][:, None]
    off = np.linalg.norm(reference[..., :3] - start[..., :3], axis=-1) >= MOVED
    off |= _angle(reference[..., 3:], start[..., 3:]) >= TURNED
    begun = np.logical_or.accumulate(off & rollouts.counted, axis=1)
    return rollouts.counted & (begun | ~begun.any(axis=1, keepdims=True))


def over(values: Float[np.ndarray, "n t"], frames: Bool[np.ndarray, "n t"]) -> Float[np.ndarray, "n"]:
    """Mean over those frames of each rollout, which has one at least."""
    return np.where(frames, values, 0.0).sum(axis=1) / frames.sum(axis=1)


def over_counted(values: Float[np.ndarray, "n t"], rollouts: Rollouts) -> Float[np.ndarray, "n"]:
    """Mean over each rollout's counted frames."""
    return over(values, rollouts.counted)


def tracking_error(rollouts: Rollouts) -> Float[np.ndarray, "n"]:
    """Mean object position error (cm). Its mean over all rollouts, failed ones too, is the paper's tracking error."""
    return 100 * over_counted(position_error(rollouts), rollouts)


def lost(rollouts: Rollouts) -> tuple[int, ...]:
    """The first counted frame, from the first one on, in which the object is 3 cm or 30° from its way; -1 for none."""
    off = position_error(rollouts) >= MANIP_TRANS["translation"]
    off = rollouts.counted & (off | (rotation_error(rollouts) >= MANIP_TRANS["rotation"]))
    first = np.argmax(off, axis=1) - np.argmax(rollouts.counted, axis=1)
    return tuple(np.where(off.any(axis=1), first, -1).tolist())


def manip_trans_object(rollouts: Rollouts) -> Bool[np.ndarray, "n"]:
    """ManipTrans, the object's part: mean rotation error < 30 degrees and mean translation error < 3 cm."""
    turned = over_counted(rotation_error(rollouts), rollouts) < MANIP_TRANS["rotation"]
    return turned & (over_counted(position_error(rollouts), rollouts) < MANIP_TRANS["translation"])


def manip_trans_full(rollouts: Rollouts) -> Bool[np.ndarray, "n"]:
    """ManipTrans: the object's part, mean joint error < 8 cm and mean finger tip error < 6 cm."""
    joints = over_counted(joint_error(rollouts), rollouts) < MANIP_TRANS["joints"]
    tips = over_counted(tip_error(rollouts), rollouts) < MANIP_TRANS["tips"]
    return manip_trans_object(rollouts) & joints & tips


def manip_trans_frames(rollouts: Rollouts) -> Bool[np.ndarray, "n"]:
    """ManipTrans as its code scores: no counted frame from the ninth on reaches a bound (`MANIP_TRANS_FRAME`).

    Object 2 cm and 30°; tips 4 cm (thumb), 4.5, 5, 6 and 6; the five first joints 7 cm and the ten others 8 cm on
    average over them. Rollouts of eight counted frames and fewer succeed.
    """
    bound, off = MANIP_TRANS_FRAME, np.linalg.norm(rollouts.joints - rollouts.joints_reference, axis=-1)
    good = (position_error(rollouts) < bound["translation"]) & (rotation_error(rollouts) < bound["rotation"])
    good &= (np.linalg.norm(rollouts.tips - rollouts.tips_reference, axis=-1) < MANIP_TRANS_TIPS).all(axis=-1)
    good &= off[..., _FIRST].mean(axis=-1) < bound["first"]
    good &= off[..., _BEYOND].mean(axis=-1) < bound["others"]
    judged = rollouts.counted & (np.cumsum(rollouts.counted, axis=1) > MANIP_TRANS_GRACE)
    return (good | ~judged).all(axis=1)


def spider(rollouts: Rollouts) -> Bool[np.ndarray, "n"]:
    """SPIDER: mean object position error < 10 cm and mean rotation error < 0.5 rad."""
    turned = over_counted(rotation_error(rollouts), rollouts) < SPIDER["rotation"]
    return turned & (over_counted(position_error(rollouts), rollouts) < SPIDER["translation"])


def chord(rollouts: Rollouts) -> Bool[np.ndarray, "n"]:
    """CHORD: no counted frame reaches 10 cm or 0.5 rad of object error, or 15 cm of wrist error."""
    wrist = np.linalg.norm(rollouts.joints[:, :, 0] - rollouts.joints_reference[:, :, 0], axis=-1)
    good = (position_error(rollouts) < CHORD["translation"]) & (rotation_error(rollouts) < CHORD["rotation"])
    return (good & (wrist < CHORD["wrist"]) | ~rollouts.counted).all(axis=1)


def add_auc(rollouts: Rollouts, objects: Sequence[ObjectDescription]) -> Float[np.ndarray, "n"]:
    """Area (0 to 1) under the share of counted frames whose ADD is below a threshold, for thresholds 1, 2, ... 9 cm.

    ADD is the mean distance of 500 points of the object's surface from where the demonstration has them; the area is by
    the trapezoid rule, divided by its width.

    Args:
        rollouts: n rollouts.
        objects: each demonstration's object, by the numbers in `rollouts.demonstration`.
    """
    area = np.zeros(len(rollouts.demonstration))
    points = [surface_points(description, ADD_POINTS) for description in objects]
    for row, which in enumerate(rollouts.demonstration):
        frames = rollouts.counted[row]
        achieved = _placed(points[which], rollouts.object_pose[row, frames])
        reference = _placed(points[which], rollouts.object_reference[row, frames])
        add = np.linalg.norm(achieved - reference, axis=-1).mean(axis=-1)
        share = (add[:, None] < ADD_THRESHOLDS).mean(axis=0)
        area[row] = np.trapezoid(share, dx=1 / (len(ADD_THRESHOLDS) - 1))
    return area


def hold(rollouts: Rollouts, palm: tuple[int, int, int] = HUMAN_PALM) -> Bool[np.ndarray, "n"]:
    """Whether the object stays in the hand for 5 s after the demonstration, while the last target is held on.

    In all of these frames the object's centre, seen from the palm, is less than 2 cm from where it was in the last
    counted frame. Where the demonstration ends with the object raised (2 cm above its start), the object must also end
    raised, by at least half as much: one that still lies on the table under a hand at rest has not slipped either.

    Args:
        rollouts: n rollouts.
        palm: three of their joint centres that span the palm: the wrist and two knuckles.

    Raises:
        InputError: a rollout has less than 5 s of `held` frames.
    """
    needed = round(HOLD_SECONDS * rollouts.fps)
    fewest = int(rollouts.held.sum(axis=1).min())
    if fewest < needed:
        raise InputError(
            f"rollouts go on for {fewest / rollouts.fps:.2f} s after the demonstration; "
            f"hold needs {HOLD_SECONDS:g} s, so roll out that much longer"
        )
    rows, end = np.arange(len(rollouts.held)), last_counted(rollouts)
    place = _seen_from_palm(rollouts, palm)
    judged = rollouts.held & (np.cumsum(rollouts.held, axis=1) <= needed)
    slip = np.linalg.norm(place - place[rows, end][:, None], axis=-1)
    kept = ((slip < HOLD_SLIP) | ~judged).all(axis=1)
    last = rollouts.held.shape[1] - 1 - np.argmax(judged[:, ::-1], axis=1)
    demonstrated = final_rise(rollouts)
    raised = rises(rollouts, rollouts.object_pose)[rows, last] >= demonstrated / 2
    return kept & (raised | (demonstrated < RAISED))


def final_rise(rollouts: Rollouts) -> Float[np.ndarray, "n"]:
    """How far (m) above its start each demonstration leaves the object; from `RAISED` on there is something to hold."""
    rise = rises(rollouts, rollouts.object_reference)
    return rise[np.arange(len(rise)), last_counted(rollouts)]


def last_counted(rollouts: Rollouts) -> np.ndarray:
    """Index of each rollout's last counted frame."""
    return rollouts.counted.shape[1] - 1 - np.argmax(rollouts.counted[:, ::-1], axis=1)


def rises(rollouts: Rollouts, pose: Float[np.ndarray, "n t 7"]) -> Float[np.ndarray, "n t"]:
    """Height (m) above the pose of each rollout's first counted frame."""
    first = np.argmax(rollouts.counted, axis=1)
    return pose[..., 2] - pose[np.arange(len(pose)), first, 2][:, None]


def _angle(a: Float[np.ndarray, "n t 4"], b: Float[np.ndarray, "n #t 4"]) -> Float[np.ndarray, "n t"]:
    """Angle (rad) between orientations; q and -q are one."""
    apart, together = np.linalg.norm(a - b, axis=-1), np.linalg.norm(a + b, axis=-1)
    # The arc tangent keeps its accuracy near zero; an arc cosine loses half the digits.
    return 4 * np.arctan2(np.minimum(apart, together), np.maximum(apart, together))


def _placed(points: Float[np.ndarray, "v 3"], pose: Float[np.ndarray, "t 7"]) -> Float[np.ndarray, "t v 3"]:
    w, axis = pose[:, None, 3:4], np.broadcast_to(pose[:, None, 4:], (len(pose), len(points), 3))
    cross = 2 * np.cross(axis, points)
    return points + w * cross + np.cross(axis, cross) + pose[:, None, :3]


def _seen_from_palm(rollouts: Rollouts, palm: tuple[int, int, int]) -> Float[np.ndarray, "n t 3"]:
    """The object's centre in a frame fixed to the palm, which wrist and two knuckles span."""
    rows, end = np.arange(len(rollouts.counted)), last_counted(rollouts)
    used = (rollouts.counted | rollouts.held)[..., None, None]
    joints = np.where(used, rollouts.joints, rollouts.joints[rows, end][:, None])  # padding may be zeros: no frame
    wrist, knuckle, other = (joints[:, :, k] for k in palm)
    along = knuckle - wrist
    x = along / np.linalg.norm(along, axis=-1, keepdims=True)
    normal = np.cross(x, other - wrist)
    z = normal / np.linalg.norm(normal, axis=-1, keepdims=True)
    axes = np.stack([x, np.cross(z, x), z], axis=-2)
    return np.einsum("ntij,ntj->nti", axes, rollouts.object_pose[..., :3] - wrist)
