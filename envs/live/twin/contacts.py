"""`Touch`: where the hand touches the object, and with what force."""

from dataclasses import dataclass

import mujoco
import numpy as np
from jaxtyping import Float


@dataclass(frozen=True)
class Touch:
    """A contact of a link with the object.

    Attributes:
        link: its name, of `hand.joints.LINKS`.
        position: m, world.
        force: of the hand on the object (N, world axes), friction included.
    """

    link: str
    position: Float[np.ndarray, "3"]
    force: Float[np.ndarray, "3"]


def touches(model: mujoco.MjModel, data: mujoco.MjData, body: int) -> list[Touch]:
    """The contacts of the hand with the object's body, as the last step found them.

    Args:
        model, data: of a live world.
        body: the object's.
    """
    found = []
    for k, contact in enumerate(data.contact[: data.ncon]):
        bodies = [int(model.geom_bodyid[geom]) for geom in contact.geom]
        if body not in bodies or 0 in bodies or contact.efc_address < 0:  # of others, with the table, or only near
            continue
        of_second = np.zeros(6)
        mujoco.mj_contactForce(model, data, k, of_second)
        if of_second[0] <= 0:
            continue
        force = contact.frame.reshape(3, 3).T @ of_second[:3]
        second = bodies[1] == body
        link = model.body(bodies[0] if second else bodies[1]).name
        found.append(Touch(link, contact.pos.copy(), force if second else -force))
    return found
