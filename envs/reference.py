"""`Reference`: a set of demonstrations as arrays that an environment can index inside jit."""

import dataclasses
from collections.abc import Sequence

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int
from scipy.spatial.transform import Rotation

from envs.grasps import grasp_names, grasp_type
from envs.grip import grip_offsets
from envs.grip_force import RECORDED, closing_ramp, grip_force_of
from envs.model_grip import model_grips
from envs.scene import NUM_WRIST, base_rotation, wrist_coordinates
from mjx_hand.bodies.body import Body
from mjx_hand.bodies.body_places import body_model, model_places
from mjx_hand.bodies.coordinates import hand_coordinates
from mjx_hand.bodies.human_body import body_of
from mjx_hand.errors import InputError
from mjx_hand.files.array_cache import cached, model_bytes
from mjx_hand.motion.demonstration import Demonstration
from mjx_hand.objects.description import OBJECT_KINDS, ObjectDescription
from mjx_hand.objects.primitives import hull_planes
from mjx_hand.player.approach import approach_weights
from mjx_hand.pytree import pytree
from mjx_hand.rigid.gains import Gains
from mjx_hand.rigid.rigid_hand import RigidHand, finger_tips, stack_hands, without_meshes

RECORDED_RAMP = 0.3  # s before a recorded object first moves, in which the grip sets in


@pytree
class Reference:
    """d demonstrations, padded to t frames by holding their last; metres, radians, quaternions wxyz.

    Attributes:
        targets: the wrist's slides and turns, and the values of actuated joints, as demonstrated.
        controls: what to command so that the controllers are at each target when its frame comes, and press.
        grip: the share of the controls that presses the fingers on the object.
        tips: finger tips in the world, as demonstrated, in the order of the hand's fingers.
        object_pose: in the world.
        approach: how far the wrist's path goes with an object that is seen elsewhere (`mjx_hand.player.approach`).
        base: world_from_base of each scene's wrist.
        features: object size (m), mass (kg), friction, and 1 for its kind among `OBJECT_KINDS`.
        length: frames of each demonstration.
    """

    targets: Float[Array, "d t u"]
    controls: Float[Array, "d t u"]
    grip: Float[Array, "d t u"]
    tips: Float[Array, "d t tips 3"]
    object_pose: Float[Array, "d t 7"]
    approach: Float[Array, "d t"]
    base: Float[Array, "d 3 3"]
    features: Float[Array, "d f"]
    length: Int[Array, "d"]


def make_reference(
    demonstrations: Sequence[Demonstration],
    hands: Sequence[RigidHand | Body],
    *,
    grip_force: float | None,
    wrap_torque: float = 0.0,
    gains: Gains,
) -> Reference:
    """Stack demonstrations and work out their controls.

    Args:
        demonstrations: in any order; kinds of object and grasp types may be mixed.
        hands: the twin's hand for each.
        grip_force: of all (N); 0 replays them as they are, None takes that of each one's grasp type, or what the weight
            of a recorded object asks for.
        wrap_torque: share of the torque limits with which human hands that wrap close (`envs.grip.grip_offsets`).
        gains: of the hand's position controllers.

    Raises:
        InputError: none given, several rates or sides, or no force for a demonstration whose grasp is no type.
    """
    _check(demonstrations)
    forces = grip_forces(demonstrations, grip_force)
    frames = max(d.num_frames for d in demonstrations)
    targets, poses, bases, approach = [], [], [], []
    for d in demonstrations:
        targets.append(padded(demonstrated_targets(d), frames))
        poses.append(padded(d.object_pose, frames))
        bases.append(base_rotation(d))
        approach.append(padded(approach_weights(np.asarray(d.object_pose), d.motion.fps), frames))
    targets = jnp.asarray(np.stack(targets), jnp.float32)
    grip = grip_table(demonstrations, hands, targets, np.where(forces > 0, forces, np.nan), gains, wrap_torque)
    features = [[*d.object.size, d.object.mass, d.object.friction, *_one_of_kinds(d)] for d in demonstrations]
    return Reference(
        targets=targets,
        controls=anticipated(targets, gains, demonstrations[0].motion.fps) + grip,
        grip=grip,
        tips=jnp.asarray(_tips(demonstrations, hands, targets), jnp.float32),
        object_pose=jnp.asarray(np.stack(poses), jnp.float32),
        approach=jnp.asarray(np.stack(approach), jnp.float32),
        base=jnp.asarray(np.stack(bases), jnp.float32),
        features=jnp.asarray(features, jnp.float32),
        length=jnp.array([d.num_frames for d in demonstrations]),
    )


def demonstrated_targets(demonstration: Demonstration) -> Float[np.ndarray, "t u"]:
    """The wrist's slides and turns and the joints (m, rad) of a demonstration, in its scene."""
    motion = demonstration.motion
    wrist = wrist_coordinates(motion.wrist_position, motion.wrist_quaternion, base_rotation(demonstration))
    return np.concatenate([wrist, motion.angles], axis=1)


def cached_reference(
    demonstrations: Sequence[Demonstration],
    hands: Sequence[RigidHand | Body],
    grip_force: float | None,
    wrap_torque: float,
    gains: Gains,
) -> Reference:
    """`make_reference`, kept on disk."""

    def compute() -> dict[str, np.ndarray]:
        made = make_reference(demonstrations, hands, grip_force=grip_force, wrap_torque=wrap_torque, gains=gains)
        return {field.name: np.asarray(getattr(made, field.name)) for field in dataclasses.fields(made)}

    bare = [_ingredient(hand) for hand in hands]
    told = grip_force, wrap_torque, dataclasses.astuple(gains), RECORDED_RAMP
    arrays = cached(compute, list(demonstrations), bare, *told)
    return Reference(**{name: jnp.asarray(array) for name, array in arrays.items()})


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
    shortly before the object moves. In demonstrations of grasp types open fingers stay off the object.
    """
    people, frames = _people(hands), targets.shape[1]
    if people is None:
        bodies = [body_of(hand) for hand in hands]
        told = model_grips(demonstrations, bodies, np.asarray(targets, float), forces, gains)
        grip = jnp.asarray(told, jnp.float32)
    else:
        grip = _grips_of_people(demonstrations, people, targets, forces, gains, wrap_torque)
    whole = np.ones(frames)
    ramps = [closing_ramp(d, frames, RECORDED_RAMP) if d.grasp == RECORDED else whole for d in demonstrations]
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


def object_in_hand(demonstration: Demonstration) -> tuple[Float[np.ndarray, "t 3 3"], Float[np.ndarray, "t 3"]]:
    """The object's rotation and position (m) in the wrist's frame."""
    wrist = Rotation.from_quat(demonstration.motion.wrist_quaternion, scalar_first=True).inv()
    object_rotation = Rotation.from_quat(demonstration.object_pose[:, 3:], scalar_first=True)
    offset = demonstration.object_pose[:, :3] - demonstration.motion.wrist_position
    return (wrist * object_rotation).as_matrix(), wrist.apply(offset)


def _tips(
    demonstrations: Sequence[Demonstration],
    hands: Sequence[RigidHand | Body],
    targets: Float[Array, "d t u"],
) -> Float[np.ndarray, "d t tips 3"]:
    """Where demonstrations have their finger tips (m, world)."""
    people, frames = _people(hands), targets.shape[1]
    if people is None:
        bodies = [body_of(hand) for hand in hands]
        told = hand_coordinates(body_model(bodies[0]), np.asarray(targets, float))
        rows = zip(demonstrations, bodies, told, strict=True)
        return np.stack([model_places(body, own)[1] @ base_rotation(d).T for d, body, own in rows])
    motions = [d.motion for d in demonstrations]
    angles = jnp.asarray(np.stack([padded(m.angles, frames) for m in motions]), jnp.float32)
    tips = np.asarray(jax.jit(jax.vmap(finger_tips))(angles, stack_hands(people)))
    turns = (Rotation.from_quat(m.wrist_quaternion, scalar_first=True).as_matrix() for m in motions)
    wrist = np.stack([padded(rotation, frames) for rotation in turns])
    place = np.stack([padded(m.wrist_position, frames) for m in motions])
    return np.einsum("dtij,dtfj->dtfi", wrist, tips) + place[:, :, None]


def anticipated(targets: Float[Array, "d t u"], gains: Gains, fps: float) -> Float[Array, "d t u"]:
    """Targets led by the controllers' lag times the targets' speed.

    A position controller with damping follows a moving target kv/kp seconds late. A frame's target is commanded for the
    whole step that ends at that frame, half a step early on average, which makes up for part of it.
    """
    kp = np.concatenate([[gains.wrist_slide[0]] * 3, [gains.wrist_turn[0]] * 3, gains.stiffness])
    kv = np.concatenate([[gains.wrist_slide[1]] * 3, [gains.wrist_turn[1]] * 3, gains.damping])
    speed = jnp.asarray(jnp.gradient(targets, 1 / fps, axis=1))
    return targets + jnp.asarray(kv / kp - 0.5 / fps, jnp.float32) * speed


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


def grip_forces(demonstrations: Sequence[Demonstration], grip_force: float | None) -> Float[np.ndarray, "d"]:
    """The force (N) of each demonstration's grip."""
    if grip_force is not None:
        return np.full(len(demonstrations), grip_force)
    unknown = sorted({d.grasp for d in demonstrations} - {*grasp_names(), RECORDED})
    if unknown:
        raise InputError(
            f"demonstrations of {unknown[0]!r} are of no grasp type ({', '.join(grasp_names())}) that says how hard to "
            "press; give task.grip_force, in newtons"
        )
    return np.array(
        [
            grip_force_of(d.object.mass, d.object.friction) if d.grasp == RECORDED else grasp_type(d.grasp).grip_force
            for d in demonstrations
        ]
    )


def _people(hands: Sequence[RigidHand | Body]) -> list[RigidHand] | None:
    """The human hands that these are, whose kinematics JAX knows; None where one is another body."""
    people = [body_of(hand).rigid for hand in hands]
    return None if None in people else [person for person in people if person is not None]


def _ingredient(hand: RigidHand | Body) -> object:
    """What a hand's part of the reference follows from."""
    rigid = body_of(hand).rigid
    return model_bytes(body_model(body_of(hand))) if rigid is None else without_meshes(rigid)


def _one_of_kinds(demonstration: Demonstration) -> list[float]:
    return [float(demonstration.object.kind == kind) for kind in OBJECT_KINDS]


def padded(rows: np.ndarray, frames: int) -> np.ndarray:
    """The rows, the last of them held up to so many frames."""
    return np.concatenate([rows, np.repeat(rows[-1:], frames - len(rows), axis=0)])


def _stacked_planes(hulls: Sequence[Float[np.ndarray, "_ _ 3"]]) -> Float[np.ndarray, "d h f 4"]:
    """The planes of each demonstration's mesh, padded to one shape by repeating faces and pieces."""
    planes = [hull_planes(pieces) for pieces in hulls]
    pieces, faces = (max(p.shape[k] for p in planes) for k in (0, 1))
    return np.stack([np.pad(p, ((0, pieces - len(p)), (0, faces - p.shape[1]), (0, 0)), mode="edge") for p in planes])


def _check(demonstrations: Sequence[Demonstration]) -> None:
    if not demonstrations:
        raise InputError("no demonstrations given; make a set with envs.make_set")
    for what, values in (
        ("frame rates", {round(d.motion.fps, 6) for d in demonstrations}),
        ("sides", {d.motion.side for d in demonstrations}),
    ):
        if len(values) > 1:
            raise InputError(
                f"demonstrations of several {what} ({', '.join(map(str, sorted(values)))}) in one set; "
                "an environment runs one"
            )
