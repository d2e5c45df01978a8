"""Which of several holdings a hand could carry an object in: what the engine drops was not how it was held."""

import dataclasses
from collections.abc import Sequence

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from envs.demonstrations.holding import Holding
from envs.demonstrations.perform import SLIP, SLIP_TURN
from envs.grip import grip_offsets
from envs.physics.solver import gauss_seidel
from envs.scene import NUM_WRIST, scene_model
from envs.signed_distance import hull_planes
from mjx_hand.errors import InputError
from mjx_hand.hand.joints import NUM_HINGES
from mjx_hand.motion.demonstration import ObjectDescription
from mjx_hand.rigid.gains import Gains
from mjx_hand.rigid.rigid_hand import RigidHand, without_meshes

_FORCES = (6.0, 9.0, 12.0, 16.0, 20.0)  # N
_SQUEEZE, _CARRY = 100, 250  # physics steps without gravity, and with it
_NO_BOXES = np.zeros((0, 3))
_HEIGHT = np.array([0.0, 0.0, 1.0])  # m above the table
_THING = NUM_WRIST + NUM_HINGES


def firmest(
    holdings: Sequence[Holding], hand: RigidHand, thing: ObjectDescription, wrist: Float[np.ndarray, "3 3"]
) -> Holding:
    """The one that needs the least force to hold the object, the first of those where several do.

    Args:
        holdings: to choose from, the likeliest first.
        hand: the twin's.
        thing: the object, a mesh.
        wrist: world_from_hand while the object is carried.

    Raises:
        InputError: none of them holds it.
    """
    bare = jax.tree.map(jnp.asarray, without_meshes(hand))
    planes = jnp.asarray(hull_planes(thing.hulls), jnp.float32)
    gains = Gains()
    (model,) = gauss_seidel([scene_model(hand, thing, _NO_BOXES, _NO_BOXES, wrist, gains=gains)])

    @jax.jit
    def pressed(angles, rotation, position, force):  # type: ignore[no-untyped-def]
        place = rotation[None], position[None]
        return angles + grip_offsets(angles[None], place, bare, thing.kind, jnp.zeros(3), force, gains, planes)[0]

    for force in _FORCES:
        for holding in holdings:
            rows = (jnp.asarray(row, jnp.float32) for row in dataclasses.astuple(holding))
            if _holds(model, holding, np.asarray(pressed(*rows, force), float), wrist):
                return holding
    raise InputError(
        f"no posture near the recorded one holds the object of {thing.mass:g} kg and friction {thing.friction:g} with "
        f"{_FORCES[-1]:g} N; give a lighter object or more friction"
    )


def _holds(
    model: mujoco.MjModel, holding: Holding, targets: Float[np.ndarray, "20"], wrist: Float[np.ndarray, "3 3"]
) -> bool:
    """Whether the object stays in the hand, which presses first and then feels its weight."""
    data = mujoco.MjData(model)
    gravity = model.opt.gravity.copy()
    data.qpos[:3] = wrist.T @ _HEIGHT
    data.qpos[NUM_WRIST:_THING] = holding.angles
    data.qpos[_THING : _THING + 3] = wrist @ holding.position + _HEIGHT
    data.qpos[_THING + 3 :] = Rotation.from_matrix(wrist @ holding.rotation).as_quat(scalar_first=True)
    data.ctrl[:_THING] = np.clip(np.concatenate([data.qpos[:NUM_WRIST], targets]), *model.actuator_ctrlrange.T)
    model.opt.gravity[:] = 0.0
    mujoco.mj_step(model, data, _SQUEEZE)
    model.opt.gravity[:] = gravity
    before = data.qpos[_THING:].copy()
    mujoco.mj_step(model, data, _CARRY)
    after = data.qpos[_THING:]
    turn = Rotation.from_quat(np.stack([before[3:], after[3:]]), scalar_first=True)
    slip = np.linalg.norm(after[:3] - before[:3])
    return bool(slip < SLIP and (turn[0].inv() * turn[1]).magnitude() < SLIP_TURN)
