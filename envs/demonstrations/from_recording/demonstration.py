"""A real recording as a demonstration: where up is, what the hand held, and how, at the twin's rate.

One camera recording of a hand and an object is off by centimetres where they hide each other, and more where an object
looks the same from all sides. Five facts mend it: gravity, an object that stands until it is lifted, a grasp that does
not slip, fingers that touch without sinking in, and an object that did not fall. Its way stays the recording's.
"""

from collections.abc import Callable
from pathlib import Path

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from envs.demonstrations.from_recording.grasp_pose import solve_grasp_poses
from envs.demonstrations.from_recording.grasp_search import search_grasp
from envs.demonstrations.from_recording.grasp_trajectory import Act, grasp_trajectory
from envs.demonstrations.from_recording.observed import in_world, reconstruct, resampled, start_time
from envs.demonstrations.from_recording.support_plane import estimate_support_plane, world_from_recording
from envs.demonstrations.from_recording.variations import RecordingSettings
from mjx_hand.capture.keypoints.bone_lengths import lengths, shape_of_lengths
from mjx_hand.capture.keypoints.layouts import hand_keypoints
from mjx_hand.capture.load_scene import load_scene
from mjx_hand.capture.object_poses.dexmv_object import recording_files
from mjx_hand.errors import InputError
from mjx_hand.hand.load import load_hand
from mjx_hand.hand.model import HandModel
from mjx_hand.motion.demonstration import Demonstration
from mjx_hand.motion.joint_motion import JointMotion
from mjx_hand.motion.motion import Motion
from mjx_hand.motion.resample import matrix_quaternions
from mjx_hand.motion.scene import RecordedObject
from mjx_hand.objects.convex_decomposition import convex_pieces
from mjx_hand.objects.description import ObjectDescription
from mjx_hand.retarget.refine import recorded_places, refine_angles
from mjx_hand.retarget.sequence import retarget_sequence, rigid_hand_of
from mjx_hand.rigid.build import build_rigid_hand
from mjx_hand.rigid.rigid_hand import chain, tip_positions

RECORDED = "recorded"  # what a demonstration that is of no grasp type calls its grasp
_FOOT = 0.004  # m above its lowest corner


def read_demonstration(
    settings: RecordingSettings, report: Callable[[str, float], None] = lambda what, share: None
) -> Demonstration:
    """The demonstration that a DexMV recording of a hand and an object shows.

    Raises:
        InputError: files are missing or damaged, the object is never seen standing and then lifted, or no grasp near
            the recorded one holds it.
    """
    report("reading the recording", 0.0)
    motion, recorded = _one_of_each(recording_files(settings.path)[0])
    table = estimate_support_plane(recorded)
    model = load_hand(side=motion.side)
    shape, angles = _angles(motion, model)
    hand = build_rigid_hand(model, shape)
    description = _description(recorded, settings)
    corners = description.hulls.reshape(-1, 3)
    held, observed = reconstruct(
        in_world(motion, angles, recorded, world_from_recording(table), table, -corners[:, 2].min()), table.lifted
    )
    observed = resampled(observed, start_time(observed, hand, table.lifted), settings.rate, settings.cutoff)
    lowest = np.einsum("tj,cj->tc", observed.rotation[:, 2], corners).min(axis=1) + observed.position[:, 2]
    observed.position[:, 2] += np.maximum(-lowest, 0.0)  # the filter rounds off how the object leaves the table

    act = Act(observed=observed, lifted=table.lifted / motion.fps, held=held, hand=hand, object=description)
    candidates = solve_grasp_poses(held, hand, act.planes)
    trajectory = grasp_trajectory(act, search_grasp(act, candidates, settings.force, report)[None])
    source = f"{motion.source} with {recorded.name}"
    return Demonstration(
        motion=JointMotion(
            fps=settings.rate,
            angles=trajectory.angles[0],
            wrist_position=trajectory.wrist_position[0],
            wrist_quaternion=matrix_quaternions(trajectory.wrist_rotation[0]),
            valid=np.ones(len(observed.times), bool),
            side=motion.side,
            source=source,
        ),
        object_pose=np.concatenate([trajectory.position, matrix_quaternions(trajectory.rotation[0])], axis=1),
        object=description,
        support=np.zeros((0, 3)),
        support_position=np.zeros((0, 3)),
        shape=shape,
        grasp=RECORDED,
        source=source,
    )


def _one_of_each(recording: Path) -> tuple[Motion, RecordedObject]:
    """The hand and the object of a scene, both seen in every frame.

    Raises:
        InputError: there are others, or none, or they are not seen all the time.
    """
    scene = load_scene(recording)
    if len(scene.hands) != 1 or len(scene.objects) != 1:
        raise InputError(
            f"{recording}: shows {len(scene.hands)} hands, {len(scene.objects)} objects; give a recording of one"
        )
    motion, recorded = scene.hands[0], scene.objects[0]
    for seen, what in ((motion.valid, "hand"), (recorded.seen, recorded.name)):
        if not seen.all():
            raise InputError(f"{recording}: {int((~seen).sum())} frames have no {what}; leave those out")
    if recorded.kind != "mesh":
        raise InputError(f"{recording}: the object's mesh is not there; put its .stl beside the recording")
    return motion, recorded


def _angles(motion: Motion, model: HandModel) -> tuple[Float[np.ndarray, "s"], Float[np.ndarray, "t 20"]]:
    """The shape whose bones are nearest to the subject's own, and its hinge angles: finger tips are where they were."""
    subject = rigid_hand_of(motion, model)
    rest = chain(jnp.broadcast_to(jnp.eye(3), (15, 3, 3)), jnp.asarray(subject.link_offset))
    shape = shape_of_lengths(model, lengths(np.asarray(hand_keypoints(rest[1], tip_positions(*rest, subject)))))
    hand = build_rigid_hand(model, shape)
    angles = retarget_sequence(motion, hand, limits=True).angles
    return shape, np.asarray(refine_angles(angles, recorded_places(motion.rotations, subject), hand), float)


def _description(recorded: RecordedObject, settings: RecordingSettings) -> ObjectDescription:
    hulls = convex_pieces(recorded.vertices, recorded.faces, concavity=0.03, most=settings.pieces)
    low = hulls[..., 2] < hulls[..., 2].min() + _FOOT
    hulls[low, 2] = hulls[..., 2].min()  # what stands has a flat foot, and few corners make it none
    size = np.abs(hulls).max(axis=(0, 1))
    return ObjectDescription(kind="mesh", size=size, mass=settings.mass, friction=settings.friction, hulls=hulls)
