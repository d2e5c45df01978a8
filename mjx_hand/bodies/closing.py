"""Which way the joints of a hand close it."""

import numpy as np
from jaxtyping import Float

from mjx_hand.bodies.body import NUM_WRIST, Body
from mjx_hand.bodies.body_places import body_model

_ONE_SIDED = 0.25  # of a range's half width: by how much its middle is off zero where a joint flexes


def closing_directions(body: Body) -> Float[np.ndarray, "j"]:
    """1 or -1 for each actuated joint that flexes, 0 for one that spreads; in the order of `body.joints`.

    Hands are straight at zero, and fingers bend far one way and little the other; they spread as far to either side.
    So the range tells, of people and of robots, and no finger has to be found.
    """
    low, high = body_model(body).actuator_ctrlrange[NUM_WRIST : body.num_targets].T
    off = (low + high) / (high - low)
    return np.where(np.abs(off) > _ONE_SIDED, np.sign(off), 0.0)
