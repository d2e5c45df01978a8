"""Where a body's links and finger tips are, by MuJoCo's kinematics."""

import functools

import mujoco
import numpy as np
from jaxtyping import Float

from mjx_hand.bodies.body import Body


def model_places(
    body: Body, coordinates: Float[np.ndarray, "t m"]
) -> tuple[Float[np.ndarray, "t links 3"], Float[np.ndarray, "t tips 3"]]:
    """Body origins and tip sites (m) in the wrist's base frame, by MuJoCo's kinematics."""
    model = body_model(body)
    data = mujoco.MjData(model)
    links = [model.body(name).id for name in body.links]
    tips = [model.site(f"{finger}_tip").id for finger in body.fingers]
    places, ends = np.empty((len(coordinates), len(links), 3)), np.empty((len(coordinates), len(tips), 3))
    for t, row in enumerate(coordinates):
        data.qpos[:] = row
        mujoco.mj_kinematics(model, data)
        places[t], ends[t] = data.xpos[links], data.site_xpos[tips]
    return places, ends


@functools.lru_cache(maxsize=8)
def body_model(body: Body) -> mujoco.MjModel:
    """The body alone, compiled."""
    return body.spec().compile()
