"""The grip of demonstrations: what references add to the demonstrated joints, frame by frame, so that hands press."""

from collections.abc import Sequence

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from scipy.spatial.transform import Rotation

from envs.grasps import Pads, grasp_names, grasp_type
from envs.grip import grip_offsets
from envs.grip_force import GRIP_RAMP, RECORDED, closing_ramp, grip_force_of
from envs.model_grip import model_grips
from envs.scene import NUM_WRIST
from mjx_hand.bodies.body import Body
from mjx_hand.bodies.human_body import body_of
from mjx_hand.errors import InputError
from mjx_hand.motion.demonstration import Demonstration
from mjx_hand.objects.description import OBJECT_KINDS, ObjectDescription
from mjx_hand.objects.primitives import hull_planes
from mjx_hand.rigid.gains import Gains
from mjx_hand.rigid.rigid_hand import RigidHand, stack_hands


def grip_forces(
    demonstrations: Sequence[Demonstration], hands: Sequence[RigidHand | Body], grip_force: float | None
) -> Float[np.ndarray, "d"]:
    """The force (N) of each demonstration's grip: the one given, or else `default_grip_force`.

    Raises:
        InputError: none is given, and a demonstration is of no type and no recording.
    """
    if grip_force is not None:
        return np.full(len(demonstrations), grip_force)
    unknown = sorted({d.grasp for d in demonstrations} - {*grasp_names(), RECORDED})
    if unknown:
        raise InputError(
            f"demonstrations of {unknown[0]!r} are of no grasp type ({', '.join(grasp_names())}) that says how hard to "
            "press; give task.grip_force, in newtons"
        )
    robot = people_of(hands) is None
    return np.array([default_grip_force(d, robot=robot) for d in demonstrations])


def default_grip_force(demonstration: Demonstration, *, robot: bool) -> float:
    """The force (N) of a demonstration's grip: its type's, or where it is of none what the object's weight asks for.

    Pads of a robot press as people's did in the demonstrations, for which its grasps are tried. A person's press with
    less, and a policy adds to it.
    """
    if demonstration.grasp not in grasp_names():
        return grip_force_of(demonstration.object.mass, demonstration.object.friction)
    grasp = grasp_type(demonstration.grasp)
    return grasp.closing.force if robot and isinstance(grasp.closing, Pads) else grasp.grip_force


def grip_table(
    demonstrations: Sequence[Demonstration],
    hands: Sequence[RigidHand | Body],
    targets: Float[Array, "d t u"],
    forces: Float[np.ndarray, "d"],
    gains: Gains,
    wrap_torque: float = 0.0,
) -> Float[Array, "d t u"]:
    """The grip (m, rad) of each demonstration at a force (N); NaN leaves it as it is.

    A recorded hand that reaches along an object would knock it over if it pressed on it: there the grip begins
    shortly before the object moves. In people's demonstrations of grasp types open fingers stay off the object.
    """
    people = people_of(hands)
    if people is None:
        bodies, told = [body_of(hand) for hand in hands], np.asarray(targets, float)
        return jnp.asarray(model_grips(demonstrations, bodies, told, forces, gains, wrap_torque), jnp.float32)
    grip = _grips_of_people(demonstrations, people, targets, forces, gains, wrap_torque)
    frames = targets.shape[1]
    whole = np.ones(frames)
    ramps = [closing_ramp(d, frames, GRIP_RAMP) if d.grasp == RECORDED else whole for d in demonstrations]
    return grip * jnp.asarray(np.stack(ramps), jnp.float32)[..., None]


def _grips_of_people(
    demonstrations: Sequence[Demonstration],
    people: Sequence[RigidHand],
    targets: Float[Array, "d t u"],
    forces: Float[np.ndarray, "d"],
    gains: Gains,
    wrap_torque: float,
) -> Float[Array, "d t u"]:
    frames = targets.shape[1]
    relative = [[padded(rows, frames) for rows in object_in_hand(d)] for d in demonstrations]
    rotation = jnp.asarray(np.stack([r for r, _ in relative]), jnp.float32)
    position = jnp.asarray(np.stack([p for _, p in relative]), jnp.float32)
    grip = jnp.zeros_like(targets)
    for kind in OBJECT_KINDS:  # the shape is compiled in, so each kind's grips are worked out together
        rows = np.array([k for k, d in enumerate(demonstrations) if d.object.kind == kind and forces[k] >= 0], int)
        if rows.size:
            seen = (targets[rows, :, NUM_WRIST:], rotation[rows], position[rows])
            chosen = [demonstrations[k].object for k in rows], [people[k] for k in rows]
            grip = grip.at[rows, :, NUM_WRIST:].set(_grips(kind, *seen, *chosen, forces[rows], gains, wrap_torque))
    return grip


def _grips(
    kind: str,
    angles: Float[Array, "n t j"],
    rotation: Float[Array, "n t 3 3"],
    position: Float[Array, "n t 3"],
    objects: Sequence[ObjectDescription],
    hands: Sequence[RigidHand],
    forces: Float[np.ndarray, "n"],
    gains: Gains,
    wrap_torque: float,
) -> Float[Array, "n t j"]:
    """Grip offsets (rad) of demonstrations whose objects are of one kind; where each object is in the hand's frame."""

    @jax.jit
    @jax.vmap
    def offsets(a: Array, r: Array, p: Array, hand: RigidHand, size: Array, planes: Array, force: Array) -> Array:
        shape = planes if kind == "mesh" else None
        return grip_offsets(a, (r, p), hand, kind, size, force, gains, shape, wrap_torque)

    sizes = jnp.asarray(np.stack([description.size for description in objects]), jnp.float32)
    planes = jnp.asarray(_stacked_planes([description.hulls for description in objects]), jnp.float32)
    return offsets(angles, rotation, position, stack_hands(hands), sizes, planes, jnp.asarray(forces, jnp.float32))


def object_in_hand(demonstration: Demonstration) -> tuple[Float[np.ndarray, "t 3 3"], Float[np.ndarray, "t 3"]]:
    """The object's rotation and position (m) in the wrist's frame."""
    wrist = Rotation.from_quat(demonstration.motion.wrist_quaternion, scalar_first=True).inv()
    object_rotation = Rotation.from_quat(demonstration.object_pose[:, 3:], scalar_first=True)
    offset = demonstration.object_pose[:, :3] - demonstration.motion.wrist_position
    return (wrist * object_rotation).as_matrix(), wrist.apply(offset)


def people_of(hands: Sequence[RigidHand | Body]) -> list[RigidHand] | None:
    """The human hands that these are, whose kinematics JAX knows; None where one is another body."""
    people = [body_of(hand).rigid for hand in hands]
    return None if None in people else [person for person in people if person is not None]


def padded(rows: np.ndarray, frames: int) -> np.ndarray:
    """The rows, the last of them held up to so many frames."""
    return np.concatenate([rows, np.repeat(rows[-1:], frames - len(rows), axis=0)])


def _stacked_planes(hulls: Sequence[Float[np.ndarray, "_ _ 3"]]) -> Float[np.ndarray, "d h f 4"]:
    """The planes of each demonstration's mesh, padded to one shape by repeating faces and pieces."""
    planes = [hull_planes(pieces) for pieces in hulls]
    pieces, faces = (max(p.shape[k] for p in planes) for k in (0, 1))
    return np.stack([np.pad(p, ((0, pieces - len(p)), (0, faces - p.shape[1]), (0, 0)), mode="edge") for p in planes])
