"""How each link of the hand presses the object: sensors of the scene, and where engines find what they read.

A link's force is the sum over its contacts with the object, and its point the mean of theirs, weighted by their forces
(MuJoCo's contact sensor with the reduction "netforce").
"""

from collections.abc import Sequence

import mujoco
import numpy as np
from jaxtyping import Int

_PREFIX = "contact_"
_SIZE = 6  # force (N) and point (m)
_DATA = sum(1 << int(f) for f in (mujoco.mjtConDataField.mjCONDATA_FORCE, mujoco.mjtConDataField.mjCONDATA_POS))
_NET_FORCE = 3


def add_contact_sensors(spec: mujoco.MjSpec, links: Sequence[str], other: str) -> None:
    """A sensor for each of these bodies, of what it does to the body `other`."""
    for link in links:
        sensor = spec.add_sensor(
            name=_PREFIX + link,
            type=mujoco.mjtSensor.mjSENS_CONTACT,
            objtype=mujoco.mjtObj.mjOBJ_BODY,
            objname=link,
            reftype=mujoco.mjtObj.mjOBJ_BODY,
            refname=other,
        )
        sensor.intprm[:3] = _DATA, _NET_FORCE, 1


def contact_columns(model: mujoco.MjModel) -> Int[np.ndarray, "links 6"]:
    """Where sensordata has each link's force and point, in the order in which the sensors were added."""
    first = model.sensor_adr[model.sensor_type == mujoco.mjtSensor.mjSENS_CONTACT]
    return first[:, None] + np.arange(_SIZE)


def position_columns(model: mujoco.MjModel) -> Int[np.ndarray, "p"]:
    """Where sensordata has what depends on position alone."""
    return np.setdiff1d(np.arange(model.nsensordata), contact_columns(model))


def sensed_bodies(model: mujoco.MjModel) -> Int[np.ndarray, "links 2"]:
    """The link and the other body of each contact sensor."""
    contact = model.sensor_type == mujoco.mjtSensor.mjSENS_CONTACT
    return np.stack([model.sensor_objid[contact], model.sensor_refid[contact]], axis=1)


def stop_contact_sensors(model: mujoco.MjModel) -> None:
    """Make clocks of the model's contact sensors, for an engine that has not their kind."""
    contact = model.sensor_type == mujoco.mjtSensor.mjSENS_CONTACT
    model.sensor_type[contact] = mujoco.mjtSensor.mjSENS_CLOCK
    model.sensor_needstage[contact] = mujoco.mjtStage.mjSTAGE_POS
    model.sensor_objtype[contact] = model.sensor_reftype[contact] = mujoco.mjtObj.mjOBJ_UNKNOWN
