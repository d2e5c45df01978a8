"""Trials: random scripted grasps of a type, by several people, performed in the engine until enough succeed."""

import dataclasses
from collections import Counter
from collections.abc import Callable, Mapping, Sequence

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from envs.demonstrations.scripted.grasp_posture import Posture, opened_angles, solve_postures, squeeze_angles
from envs.demonstrations.scripted.own_object import OwnObject
from envs.demonstrations.scripted.perform import OUTCOMES, Performance, perform
from envs.demonstrations.scripted.script import GraspMotion, Tempo, scripted_targets
from envs.grasps import GraspType
from envs.physics.solver import gauss_seidel
from envs.scene import TIMESTEP, scene_spec, wrist_coordinates
from mjx_hand.errors import InputError
from mjx_hand.objects.description import ObjectDescription
from mjx_hand.objects.primitives import half_extents
from mjx_hand.rigid.gains import Gains
from mjx_hand.rigid.rigid_hand import RigidHand

_ROUNDS = 6  # batches of attempts before giving up
NO_POSTURE, SPARE = "no posture found", "held, and not needed"
_TOUCH_LIMIT = 0.002  # m: a posture whose contacts miss by more is not tried


@dataclasses.dataclass(frozen=True)
class Trial:
    """One grasp that was performed and held; metres, radians, wxyz, at the physics rate.

    Attributes:
        person: index of the hand that did it.
        object: what was grasped.
        angles, wrist_position, wrist_rotation, object_pose: as in `Performance`, one trial's.
    """

    person: int
    object: ObjectDescription
    angles: Float[np.ndarray, "t j"]
    wrist_position: Float[np.ndarray, "t 3"]
    wrist_rotation: Float[np.ndarray, "t 3 3"]
    object_pose: Float[np.ndarray, "t 7"]


@dataclasses.dataclass(frozen=True)
class Script:
    """A grasp to perform; metres, radians, wxyz.

    Attributes:
        hand: index of the hand that does it, among those that scripts were drawn for.
        object: what is grasped.
        object_start: where it stands.
        motion: what the hand is told.
        base: world_from_base of the scene's wrist.
        model: the scene.
    """

    hand: int
    object: ObjectDescription
    object_start: Float[np.ndarray, "7"]
    motion: GraspMotion
    base: Float[np.ndarray, "3 3"]
    model: mujoco.MjModel


def perform_trials(
    grasp: GraspType,
    hands: Sequence[RigidHand],
    per_person: int,
    seed: int,
    report: Callable[[int, int], None] = lambda kept, tried: None,
    own: OwnObject | None = None,
) -> tuple[list[Trial], Mapping[str, int]]:
    """`per_person` successful trials of each hand, in the order of the hands; and what came of all attempts.

    The second part counts attempts by outcome: `perform.OUTCOMES`, `NO_POSTURE` and `SPARE`.

    Args:
        grasp: the type.
        hands: the people's true hands.
        per_person: how many of each.
        seed: of every random draw.
        report: called after each batch with the trials kept and tried so far.
        own: grasped in place of the type's objects.

    Raises:
        InputError: after several batches some hand has not succeeded often enough.
    """
    rng = np.random.default_rng(seed)
    kept: dict[int, list[Trial]] = {person: [] for person in range(len(hands))}
    tried = 0
    tally: Counter[str] = Counter()
    for _ in range(_ROUNDS):
        missing = [p for p, trials in kept.items() for _ in range(per_person - len(trials))]
        if not missing:
            break
        # A fixed batch size, so that the posture solver compiles once: fill up with spare attempts of the same people.
        size = -(-len(hands) * per_person * 5 // 4)
        people = [missing[k % len(missing)] for k in range(size)]
        held, outcomes = _attempt(grasp, [hands[p] for p in people], people, rng, own)
        tally.update(outcomes)
        for trial in held:
            if len(kept[trial.person]) < per_person:
                kept[trial.person].append(trial)
            else:
                tally.update({OUTCOMES[0]: -1, SPARE: 1})
        tried += size
        report(sum(map(len, kept.values())), tried)
    short = [p for p, trials in kept.items() if len(trials) < per_person]
    if short:
        what = f"{grasp.name!r} of {own.path}" if own else repr(grasp.name)
        raise InputError(
            f"grasp {what}: hands {short} held fewer than {per_person} objects in {tried} attempts "
            f"({_told(tally)}); use other shapes, smaller objects, or mend the type's posture"
        )
    return [trial for trials in kept.values() for trial in trials], tally


def _told(tally: Mapping[str, int]) -> str:
    return ", ".join(f"{outcome} {count}" for outcome, count in tally.items() if count)


def _attempt(
    grasp: GraspType,
    hands: Sequence[RigidHand],
    people: Sequence[int],
    rng: np.random.Generator,
    own: OwnObject | None,
) -> tuple[list[Trial], list[str]]:
    """One batch of random trials: those that held, and what came of each."""
    scripts = draw_scripts(grasp, hands, rng, own)
    unsolved = [NO_POSTURE] * (len(hands) - len(scripts))
    if not scripts:
        return [], unsolved
    models = gauss_seidel([script.model for script in scripts])
    done = perform(
        models,
        np.stack([script.base for script in scripts]),
        script_controls(scripts, models[0]),
        np.stack([script.object_start for script in scripts]),
        np.array([script.motion.tempo.end("lift") for script in scripts]),
    )
    held = [_trial(done, row, people[s.hand], s) for row, s in enumerate(scripts) if done.held[row]]
    return held, unsolved + [OUTCOMES[k] for k in done.outcome]


def draw_scripts(
    grasp: GraspType, hands: Sequence[RigidHand], rng: np.random.Generator, own: OwnObject | None = None
) -> list[Script]:
    """A random grasp of each hand, less those for whose object no posture is found."""
    descriptions = [_draw_object(grasp, rng, own) for _ in hands]
    solved = solve_postures(grasp, hands, descriptions)
    postures = [jax.tree.map(lambda leaf, k=k: np.asarray(leaf[k], float), solved) for k in range(len(hands))]
    gains = Gains()
    lying = np.array(grasp.object_rotation)
    upright = Rotation.from_matrix(lying).as_quat(scalar_first=True)
    scripts = []
    for k, (hand, description, posture) in enumerate(zip(hands, descriptions, postures, strict=True)):
        if not posture.touch_error < _TOUCH_LIMIT:  # NaN where a mesh has no face that the type touches
            continue
        reach = np.abs(lying[2]) @ np.asarray(half_extents(description.kind, jnp.asarray(description.size)))
        centre = np.array([0.0, 0.0, grasp.rest + reach])
        scripts.append(
            Script(
                hand=k,
                object=description,
                object_start=np.concatenate([centre, upright]),
                motion=_draw_motion(grasp, posture, centre, hand, gains, rng),
                base=posture.rotation,
                model=_scene(grasp, hand, description, posture.rotation, gains),
            )
        )
    return scripts


def _scene(
    grasp: GraspType, hand: RigidHand, description: ObjectDescription, base: Float[np.ndarray, "3 3"], gains: Gains
) -> mujoco.MjModel:
    """Where a person performs: their hand meets itself, table and support, as a person's does."""
    return scene_spec(hand, description, *support_boxes(grasp), base, gains=gains, contacts="all").compile()


def support_boxes(grasp: GraspType) -> tuple[Float[np.ndarray, "b 3"], Float[np.ndarray, "b 3"]]:
    """Half extents and centres (m) of the boxes that hold the type's objects up."""
    halves, centres = [box.half for box in grasp.support], [box.centre for box in grasp.support]
    return np.array(halves).reshape(-1, 3), np.array(centres).reshape(-1, 3)


def _trial(done: Performance, row: int, person: int, script: Script) -> Trial:
    steps = round(script.motion.tempo.duration / TIMESTEP)
    return Trial(
        person=person,
        object=script.object,
        angles=done.angles[row, :steps],
        wrist_position=done.wrist_position[row, :steps],
        wrist_rotation=done.wrist_rotation[row, :steps],
        object_pose=done.object_pose[row, :steps],
    )


def _draw_object(grasp: GraspType, rng: np.random.Generator, own: OwnObject | None) -> ObjectDescription:
    if own is not None:
        return own.draw(grasp, rng)
    low, high = map(np.array, grasp.object_size)
    return ObjectDescription(
        kind=grasp.object_kind,
        size=low + rng.uniform() * (high - low),
        mass=float(rng.uniform(*grasp.object_mass)),
        friction=float(rng.uniform(*grasp.object_friction)),
    )


def _draw_motion(
    grasp: GraspType,
    posture: Posture,
    centre: Float[np.ndarray, "3"],
    hand: RigidHand,
    gains: Gains,
    rng: np.random.Generator,
) -> GraspMotion:
    closed = np.asarray(posture.angles)
    opened = np.clip(opened_angles(grasp.closing, posture), hand.hinge_lower, hand.hinge_upper)
    heading = rng.uniform(0, 2 * np.pi)
    way = rng.uniform(*grasp.carry)
    axis = rng.normal(size=3)
    return GraspMotion(
        open_angles=opened,
        closed_angles=closed,
        squeeze_angles=squeeze_angles(grasp.closing, posture, gains),
        position=centre + np.asarray(posture.position),
        rotation=np.asarray(posture.rotation),
        approach=np.array(grasp.approach) + rng.uniform(-0.005, 0.005, 3),
        travel=np.array([way * np.cos(heading), way * np.sin(heading), rng.uniform(*grasp.lift)]),
        turn=axis / np.linalg.norm(axis) * rng.uniform(*grasp.turn),
        tempo=Tempo(approach=rng.uniform(0.7, 0.9), close=rng.uniform(0.5, 0.9), lift=rng.uniform(0.8, 1.1)),
    )


def script_controls(scripts: Sequence[Script], model: mujoco.MjModel) -> Float[np.ndarray, "n t u"]:
    """Targets at the model's physics rate, all as long as the longest script (the shorter ones hold their last)."""
    step = model.opt.timestep
    time = np.arange(round(max(script.motion.tempo.duration for script in scripts) / step)) * step
    rows = []
    for script in scripts:
        angles, position, quaternion = scripted_targets(script.motion, time)
        rows.append(np.concatenate([wrist_coordinates(position, quaternion, script.base), angles], axis=1))
    low, high = model.actuator_ctrlrange.T
    return np.clip(np.stack(rows), low, high)
