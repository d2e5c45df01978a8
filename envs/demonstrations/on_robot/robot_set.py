"""Sets of demonstrations for a robot hand, kept from one start to the next."""

from collections import Counter
from collections.abc import Sequence

import numpy as np

from envs.demonstrations.on_robot.bring import moved_by, on_robot
from mjx_hand.bodies.body import Body
from mjx_hand.bodies.body_places import body_model
from mjx_hand.errors import InputError
from mjx_hand.files.array_cache import cached, model_bytes
from mjx_hand.motion.demonstration import Demonstration
from mjx_hand.progress import counter
from mjx_hand.rigid.rigid_hand import RigidHand

_MOTION = ("angles", "wrist_position", "wrist_quaternion")


def robot_demonstrations(
    demonstrations: Sequence[Demonstration], people: Sequence[RigidHand], body: Body
) -> list[Demonstration]:
    """The demonstrations on a robot hand; those that it cannot do are left out, and said with the reason.

    Args:
        demonstrations: of people.
        people: the twin's hand for each.
        body: the robot's.

    Raises:
        InputError: it can do none of them.
    """

    def compute() -> dict[str, np.ndarray]:
        arrays: dict[str, np.ndarray] = {}
        with counter(len(demonstrations), f"demonstrations on {body.name}") as advance:
            for k, (d, person) in enumerate(zip(demonstrations, people, strict=True)):
                try:
                    motion = on_robot(d, person, body).demonstration.motion
                    arrays |= {f"{name}.{k}": getattr(motion, name) for name in _MOTION}
                except InputError as error:
                    arrays[f"refused.{k}"] = np.array(str(error))
                advance(1)
        return arrays

    arrays = cached(compute, "on a robot", list(demonstrations), body.name, model_bytes(body_model(body)))
    refused = {k: str(arrays[f"refused.{k}"]) for k in range(len(demonstrations)) if f"refused.{k}" in arrays}
    for grasp, count in Counter(demonstrations[k].grasp for k in refused).items():
        first = next(reason for k, reason in refused.items() if demonstrations[k].grasp == grasp)
        of_type = sum(d.grasp == grasp for d in demonstrations)
        if len(refused) == len(demonstrations):
            raise InputError(f"{body.name} can do none of {len(demonstrations)} demonstrations: {first}")
        print(f"{body.name}: {count} of {of_type} demonstrations of {grasp} left out: {first}", flush=True)
    kept = [(k, d) for k, d in enumerate(demonstrations) if k not in refused]
    return [moved_by(body, d, *(np.asarray(arrays[f"{name}.{k}"]) for name in _MOTION)) for k, d in kept]
