"""How near an engine comes to MuJoCo's C engine, in the air and in a grip, and how far it may be off."""

import dataclasses
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from envs.physics.engine import Engine, PhysicsState
from envs.physics.native import NativeEngine
from envs.tracking import TrackingEnv

STEPS = 6  # control steps of the comparison: longer, and paths in contact part from rounding on
_OBJECT = slice(-7, -4)  # its place, in a free joint that is the last of all
_NOISE = 0.002  # standard deviation (m, rad) of what is added to the demonstration's targets
_LIFTED = 0.02  # m above its start, where the hand must be holding the object


@dataclasses.dataclass(frozen=True)
class Limits:
    """How far (m) an engine may be from the C engine with the same solver settings.

    Attributes:
        free: object and finger tips of worlds in which nothing is gripped.
        gripped: the object that is gripped: by share of the worlds (1 is all), what they stay below.
    """

    free: float
    gripped: Mapping[float, float]


# MJX's where the hand does not meet itself: of capsules side by side it finds one contact, the C engine two.
# Four worlds in contact, whose paths part from rounding on: how far differs from grasp to grasp.
LIMITS = {
    "mjx": Limits(free=2e-5, gripped={0.5: 1e-3, 1.0: 5e-3}),
    "warp": Limits(free=1e-5, gripped={0.5: 5e-5, 1.0: 2e-3}),
}


class Worlds(NamedTuple):
    """Where worlds start, what they are told at each control step, and which of them hold the object."""

    variant: Int[Array, "n"]
    qpos: Float[Array, "n q"]
    qvel: Float[Array, "n v"]
    controls: Float[Array, "t n u"]
    gripping: Bool[np.ndarray, "n"]


def free_and_gripping(env: TrackingEnv) -> Worlds:
    """Eight worlds on the first two demonstrations, half in the air before the grasp, half lifting; a little noisy."""
    poses, lengths = np.asarray(env.reference.object_pose), np.asarray(env.reference.length)
    frames = []
    for pose, length in zip(poses[:2], lengths[:2], strict=True):
        lifted = np.flatnonzero(pose[:length, 2] - pose[0, 2] > _LIFTED)
        frames += [2, 10, lifted[0], lifted[20]]
    frames, variant = np.array(frames), np.repeat([0, 1], 4)
    start = jax.jit(jax.vmap(env.start))(variant, frames).pipeline_state.physics
    last = lengths[variant] - 1
    targets = np.asarray(env.reference.controls)
    controls = np.stack([targets[variant, np.minimum(frames + 1 + k, last)] for k in range(STEPS)])
    noise = np.random.default_rng(0).normal(scale=_NOISE, size=controls.shape)
    low, high = env.models[0].actuator_ctrlrange[: env.action_size].T
    return Worlds(
        variant=jnp.asarray(variant, jnp.int32),
        qpos=jnp.asarray(start.qpos),
        qvel=jnp.asarray(start.qvel),
        controls=jnp.asarray(np.clip(controls + noise, low, high), jnp.float32),
        gripping=np.tile([False, False, True, True], 2),
    )


def rolled(engine: Engine) -> Callable[[Any, Any, Any, Any], PhysicsState]:
    """A jitted function from (variants, qpos, qvel, controls of each step) to the states after each step."""

    @jax.jit
    def roll(variant: Array, qpos: Array, qvel: Array, controls: Array) -> PhysicsState:
        state = jax.vmap(engine.reset)(variant, qpos, qvel, controls[0])

        def step(state: PhysicsState, ctrl: Array) -> tuple[PhysicsState, PhysicsState]:
            state = jax.vmap(engine.step)(state, ctrl)
            return state, state

        return jax.lax.scan(step, state, controls)[1]

    return roll


def c_engine(engine: Engine) -> NativeEngine:
    """MuJoCo's C engine on another engine's models, solver settings included."""
    return NativeEngine(engine.models, engine.substeps)


@dataclasses.dataclass(frozen=True)
class Departure:
    """How far (m) an engine was from the C engine.

    Attributes:
        free: object or finger tips at their furthest, in worlds where nothing is gripped.
        gripped: of each other world, the object at its furthest.
        unstable: simulations that the engine gave up.
    """

    free: float
    gripped: Float[np.ndarray, "g"]
    unstable: int

    def quantile(self, share: float) -> float:
        """What this share of the gripping worlds stays below (m)."""
        return float(np.quantile(self.gripped, share))

    def complaints(self, limits: Limits) -> list[str]:
        """What is beyond its limit, a line each."""
        found = [f"{self.unstable} steps diverged"] if self.unstable else []
        if not self.free < limits.free:
            found.append(f"free: {self.free:.2g} m off, at most {limits.free:g}")
        for share, limit in limits.gripped.items():
            if not self.quantile(share) < limit:
                found.append(f"gripped, {share:.0%} of the worlds: {self.quantile(share):.2g} m off, at most {limit:g}")
        return found


def departure(found: PhysicsState, wanted: PhysicsState, gripping: Bool[np.ndarray, "n"]) -> Departure:
    """Compare an engine's states after each step with the C engine's."""
    distance = np.linalg.norm(np.asarray(found.qpos - wanted.qpos)[..., _OBJECT], axis=-1).max(axis=0)
    tips = np.abs(np.asarray(found.sensordata - wanted.sensordata)).max(axis=(0, 2))
    return Departure(
        free=float(max(distance[~gripping].max(), tips[~gripping].max())),
        gripped=distance[gripping],
        unstable=int(np.asarray(found.unstable).sum()),
    )
