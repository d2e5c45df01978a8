"""`Reference`: a set of demonstrations as arrays that an environment can index inside jit."""

import dataclasses
from collections.abc import Sequence

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int
from scipy.spatial.transform import Rotation

from envs.grip_table import grip_forces, grip_table, padded, people_of
from envs.scene import NUM_WRIST, base_rotation, wrist_coordinates
from mjx_hand.bodies.body import Body
from mjx_hand.bodies.body_places import body_model, model_places
from mjx_hand.bodies.coordinates import hand_coordinates
from mjx_hand.bodies.human_body import body_of
from mjx_hand.errors import InputError
from mjx_hand.files.array_cache import cached, model_bytes
from mjx_hand.motion.demonstration import Demonstration
from mjx_hand.objects.description import object_features
from mjx_hand.player.approach import approach_weights
from mjx_hand.pytree import pytree
from mjx_hand.rigid.gains import Gains
from mjx_hand.rigid.rigid_hand import RigidHand, finger_tips, stack_hands, without_meshes


@pytree
class Reference:
    """d demonstrations, padded to t frames by holding their last; metres, radians, quaternions wxyz.

    Attributes:
        targets: the wrist's slides and turns, and the values of actuated joints, as demonstrated.
        controls: what to command so that the controllers are at each target when its frame comes, and press; of a
            teleoperated hand what its tracker says.
        grip: the share of the controls that presses the fingers on the object; of a teleoperated hand nothing.
        lacking: what the joints' controls of a teleoperated hand lack of those of the same demonstration without
            teleoperation, its press included; None of other hands.
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
    lacking: Float[Array, "d t u"] | None = None


def make_reference(
    demonstrations: Sequence[Demonstration],
    hands: Sequence[RigidHand | Body],
    *,
    grip_force: float | None,
    wrap_torque: float = 0.0,
    gains: Gains,
    live: bool = False,
) -> Reference:
    """Stack demonstrations and work out their controls.

    Args:
        demonstrations: in any order; kinds of object and grasp types may be mixed.
        hands: the twin's hand for each.
        grip_force: of all (N); 0 replays them as they are, None takes `envs.grip_table.default_grip_force` of each.
        wrap_torque: share of the torque limits with which hands that wrap close (`envs.grip.grip_offsets`).
        gains: of the hand's position controllers.
        live: whether the hands are teleoperated (`Task.live`).

    Raises:
        InputError: none given, several rates or sides, no force for a demonstration whose grasp is no type, or a
            teleoperated hand that no tracker saw.
    """
    _check(demonstrations)
    forces = grip_forces(demonstrations, hands, grip_force)
    frames = max(d.num_frames for d in demonstrations)
    targets, poses, bases, approach = [], [], [], []
    for d in demonstrations:
        targets.append(padded(demonstrated_targets(d), frames))
        poses.append(padded(d.object_pose, frames))
        bases.append(base_rotation(d))
        approach.append(padded(approach_weights(np.asarray(d.object_pose), d.motion.fps), frames))
    targets = jnp.asarray(np.stack(targets), jnp.float32)
    grip = grip_table(demonstrations, hands, targets, np.where(forces > 0, forces, np.nan), gains, wrap_torque)
    controls = jnp.asarray(anticipated(targets, gains, demonstrations[0].motion.fps)) + grip
    lacking = None
    if live:
        tracked = jnp.asarray(np.stack([padded(_tracked(d), frames) for d in demonstrations]), jnp.float32)
        lacking = (controls - tracked).at[:, :, :NUM_WRIST].set(0.0)
        controls, grip = tracked, jnp.zeros_like(grip)
    return Reference(
        targets=targets,
        controls=controls,
        grip=grip,
        tips=jnp.asarray(_tips(demonstrations, hands, targets), jnp.float32),
        object_pose=jnp.asarray(np.stack(poses), jnp.float32),
        approach=jnp.asarray(np.stack(approach), jnp.float32),
        base=jnp.asarray(np.stack(bases), jnp.float32),
        features=jnp.asarray(np.stack([object_features(d.object) for d in demonstrations]), jnp.float32),
        length=jnp.array([d.num_frames for d in demonstrations]),
        lacking=lacking,
    )


def demonstrated_targets(demonstration: Demonstration) -> Float[np.ndarray, "t u"]:
    """The wrist's slides and turns and the joints (m, rad) of a demonstration, in its scene."""
    motion = demonstration.motion
    wrist = wrist_coordinates(motion.wrist_position, motion.wrist_quaternion, base_rotation(demonstration))
    return np.concatenate([wrist, motion.angles], axis=1)


def _tracked(demonstration: Demonstration) -> Float[np.ndarray, "t u"]:
    """As `demonstrated_targets`, where a live tracker had the hand."""
    if demonstration.tracked is None:
        raise InputError(
            "task.live is true, and a demonstration has no tracked hand; make the set with data.streamed=true, or "
            "leave task.live out"
        )
    place, quaternion, angles = np.split(np.asarray(demonstration.tracked), [3, 7], axis=1)
    return np.concatenate([wrist_coordinates(place, quaternion, base_rotation(demonstration)), angles], axis=1)


def cached_reference(
    demonstrations: Sequence[Demonstration],
    hands: Sequence[RigidHand | Body],
    grip_force: float | None,
    wrap_torque: float,
    gains: Gains,
    live: bool = False,
) -> Reference:
    """`make_reference`, kept on disk."""

    def compute() -> dict[str, np.ndarray]:
        made = make_reference(
            demonstrations, hands, grip_force=grip_force, wrap_torque=wrap_torque, gains=gains, live=live
        )
        fields = {field.name: getattr(made, field.name) for field in dataclasses.fields(made)}
        return {name: np.asarray(value) for name, value in fields.items() if value is not None}

    bare = [_ingredient(hand) for hand in hands]
    arrays = cached(compute, list(demonstrations), bare, grip_force, wrap_torque, dataclasses.astuple(gains), live)
    return Reference(**{name: jnp.asarray(array) for name, array in arrays.items()})


def _tips(
    demonstrations: Sequence[Demonstration],
    hands: Sequence[RigidHand | Body],
    targets: Float[Array, "d t u"],
) -> Float[np.ndarray, "d t tips 3"]:
    """Where demonstrations have their finger tips (m, world)."""
    people, frames = people_of(hands), targets.shape[1]
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


def anticipated(
    targets: Float[Array, "d t u"] | Float[np.ndarray, "d t u"], gains: Gains, fps: float
) -> Float[Array, "d t u"] | Float[np.ndarray, "d t u"]:
    """Targets led by the controllers' lag times the targets' speed; of JAX or of NumPy, as they are given.

    A position controller with damping follows a moving target kv/kp seconds late. A frame's target is commanded for the
    whole step that ends at that frame, half a step early on average, which makes up for part of it.
    """
    kp = np.concatenate([[gains.wrist_slide[0]] * 3, [gains.wrist_turn[0]] * 3, gains.stiffness])
    kv = np.concatenate([[gains.wrist_slide[1]] * 3, [gains.wrist_turn[1]] * 3, gains.damping])
    xp = np if isinstance(targets, np.ndarray) else jnp
    speed = xp.asarray(xp.gradient(targets, 1 / fps, axis=1))
    return targets + xp.asarray(kv / kp - 0.5 / fps, targets.dtype) * speed


def _ingredient(hand: RigidHand | Body) -> object:
    """What a hand's part of the reference follows from."""
    rigid = body_of(hand).rigid
    return model_bytes(body_model(body_of(hand))) if rigid is None else without_meshes(rigid)


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
