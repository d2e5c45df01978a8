"""Sets of demonstrations for a robot hand, kept from one start to the next."""

import dataclasses
import functools
from collections import Counter
from collections.abc import Sequence

import numpy as np

from envs.demonstrations.on_robot.bring import moved_by, on_robot
from envs.demonstrations.on_robot.left_out import LeftOut
from envs.demonstrations.on_robot.trial import Rehearsal
from mjx_hand.bodies.body import Body
from mjx_hand.bodies.body_places import body_model
from mjx_hand.errors import InputError
from mjx_hand.files.array_cache import cached, model_bytes
from mjx_hand.files.digests import digest
from mjx_hand.motion.demonstration import Demonstration
from mjx_hand.progress import counter
from mjx_hand.rigid.rigid_hand import RigidHand

METHOD = 4  # how references come about: counted up where they change, so that results on others are made anew
_MOTION = ("angles", "wrist_position", "wrist_quaternion")
_REHEARSAL, _LEFT_OUT = "rehearsal", "left out"


@dataclasses.dataclass(frozen=True)
class RobotSet:
    """What of a set a robot can do.

    Attributes:
        done: the demonstrations on the robot, by their numbers in the set.
        left_out: why it cannot do the others, by theirs.
        rehearsals: how the object went in simulation, without a policy, in those that it can do.
    """

    done: dict[int, Demonstration]
    left_out: dict[int, LeftOut]
    rehearsals: dict[int, Rehearsal]


def robot_set(demonstrations: Sequence[Demonstration], people: Sequence[RigidHand], body: Body) -> RobotSet:
    """The demonstrations on a robot hand, and those that it cannot do.

    Args:
        demonstrations: of people.
        people: the twin's hand for each.
        body: the robot's.

    Raises:
        InputError: a hand of the other side.
    """
    done, left_out, rehearsals = {}, {}, {}
    model = digest([model_bytes(body_model(body))])  # megabytes, read once and not for each demonstration
    with counter(len(demonstrations), f"demonstrations on {body.name}") as advance:
        for k, (d, person) in enumerate(zip(demonstrations, people, strict=True)):
            # Each is kept by itself, so that a set that was interrupted goes on where it was, with the same code.
            arrays = cached(functools.partial(_brought, d, person, body), "on a robot", d, person, body.name, model)
            if _LEFT_OUT in arrays:
                left_out[k] = LeftOut(*(str(text) for text in arrays[_LEFT_OUT]))
            else:
                done[k] = moved_by(body, d, *(np.asarray(arrays[name]) for name in _MOTION))
                rehearsals[k] = Rehearsal(*arrays[_REHEARSAL].tolist())
            advance(1)
    return RobotSet(done, left_out, rehearsals)


def _brought(demonstration: Demonstration, person: RigidHand, body: Body) -> dict[str, np.ndarray]:
    """A robot's motion and how its rehearsal went, or why it cannot do the demonstration."""
    try:
        brought = on_robot(demonstration, person, body)
    except LeftOut as error:
        return {_LEFT_OUT: np.array([error.reason, str(error)])}
    motion = {name: getattr(brought.demonstration.motion, name) for name in _MOTION}
    return {**motion, _REHEARSAL: np.array(dataclasses.astuple(brought.rehearsal))}


def robot_demonstrations(
    demonstrations: Sequence[Demonstration], people: Sequence[RigidHand], body: Body
) -> list[Demonstration]:
    """The demonstrations on a robot hand; those that it cannot do are left out, and said with the reason.

    Those of which the object is lost in rehearsal stay, as a policy may hold it; how many they are is said.

    Raises:
        InputError: as `robot_set`, or it can do none of them.
    """
    made = robot_set(demonstrations, people, body)
    for grasp, count in Counter(demonstrations[k].grasp for k in made.left_out).items():
        first = next(reason for k, reason in made.left_out.items() if demonstrations[k].grasp == grasp)
        of_type = sum(d.grasp == grasp for d in demonstrations)
        if not made.done:
            raise InputError(f"{body.name} can do none of {len(demonstrations)} demonstrations: {first}")
        print(f"{body.name}: {count} of {of_type} demonstrations of {grasp} left out: {first}", flush=True)
    lost = Counter(demonstrations[k].grasp for k, rehearsal in made.rehearsals.items() if rehearsal.until < 1)
    for grasp, count in lost.items():
        of_type = sum(demonstrations[k].grasp == grasp for k in made.done)
        print(f"{body.name}: without a policy {count} of {of_type} objects of {grasp} are lost on the way", flush=True)
    return list(made.done.values())
