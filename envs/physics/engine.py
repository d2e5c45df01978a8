"""The one interface that every physics engine serves, and how an engine is chosen.

An engine is made from a *family* of MuJoCo models: one model a variant (hand shape, object size, mass, friction), all
of the same structure. Each world says which variant it runs on, so worlds with different hands and objects step in
parallel. Engines are pure functions, written for one world and mapped with `jax.vmap`.
"""

import importlib
import importlib.util
from collections.abc import Sequence
from typing import Any, Protocol, runtime_checkable

import jax
import mujoco
from jaxtyping import Array, Float, Int

from mjx_hand.errors import InputError
from mjx_hand.pytree import pytree

ENGINES = ("native", "mjx", "warp")


@pytree
class PhysicsState:
    """What an engine carries from step to step; environments read all but `memory`.

    Attributes:
        variant: index of the model that this world runs on.
        qpos, qvel: generalised position and velocity (MuJoCo's layout and units, quaternions wxyz).
        sensordata: sensors that depend on position alone, at this very state (not a substep behind).
        contact: how each link pressed the object in the last physics step: force (N) on the object, and where (m), both
            along the world's axes; zeros for one that did not touch it, and after a reset.
        memory: the engine's own; opaque.
        unstable: 1 if the simulation diverged during the last step and was reset by the engine, else 0.
    """

    variant: Int[Array, "*b"]
    qpos: Float[Array, "*b nq"]
    qvel: Float[Array, "*b nv"]
    sensordata: Float[Array, "*b ns"]
    contact: Float[Array, "*b links 6"]
    memory: Any
    unstable: Float[Array, "*b"]


@runtime_checkable
class Engine(Protocol):
    """A physics engine over a family of models.

    Attributes:
        name: one of `ENGINES`.
        models: the compiled family, with this engine's solver settings.
        substeps: physics steps a control step.
        tables: the family's numbers, as arrays that a compiled function can be given as an argument.
    """

    name: str
    substeps: int
    tables: Any

    def with_tables(self, tables: Any) -> "Engine":
        """The same engine over the numbers of another family of equally many models of the same structure.

        A function compiled over `with_tables(argument)` steps any such family without compiling anew.
        """
        ...

    @property
    def models(self) -> Sequence[mujoco.MjModel]:
        """One compiled scene per variant."""
        ...

    def reset(
        self,
        variant: Int[Array, ""],
        qpos: Float[Array, "nq"],
        qvel: Float[Array, "nv"],
        ctrl: Float[Array, "nu"],
    ) -> PhysicsState:
        """A state at rest in the controller: `ctrl` is what the actuators were last told."""
        ...

    def step(self, state: PhysicsState, ctrl: Float[Array, "nu"]) -> PhysicsState:
        """Hold `ctrl` for `substeps` physics steps."""
        ...


def default_engine() -> str:
    """`native` on a machine without an accelerator, `warp` on NVIDIA where it is installed, else `mjx`."""
    if jax.default_backend() == "cpu":
        return "native"
    if jax.default_backend() == "gpu" and importlib.util.find_spec("warp") is not None:
        return "warp"
    return "mjx"


def available_engine(name: str) -> str:
    """The engine that `name` stands for ("auto": `default_engine`).

    Raises:
        InputError: no engine of that name, or one that is not installed.
    """
    name = default_engine() if name == "auto" else name
    if name not in ENGINES:
        raise InputError(f"engine {name!r} is not known; valid: auto, {', '.join(ENGINES)}")
    if name == "warp" and importlib.util.find_spec("warp") is None:
        raise InputError("engine 'warp' is not installed; install it with: pip install 'mjx-hand[warp]'")
    return name


def make_engine(name: str, models: Sequence[mujoco.MjModel], substeps: int) -> Engine:
    """The engine called `name` ("auto" picks `default_engine`) over a family of models.

    Raises:
        InputError: no engine of that name, one that is not installed, or models that are not one family.
    """
    name = available_engine(name)
    check_family(models)
    module = importlib.import_module(f"envs.physics.{name}")
    return module.make(models, substeps)


def check_family(models: Sequence[mujoco.MjModel]) -> None:
    """Raise InputError unless all models have the sizes and actuators of the first."""
    if not models:
        raise InputError("an engine needs at least one model, got none")
    first = models[0]
    for i, model in enumerate(models):
        for size in ("nq", "nv", "nu", "nbody", "ngeom", "nsite", "nsensordata", "npair", "nC", "nbvh"):
            if getattr(model, size) != getattr(first, size):
                raise InputError(
                    f"model {i} has {size} = {getattr(model, size)}, model 0 has {getattr(first, size)}; "
                    "all models of a family must come from one scene with different parameters; its objects are of "
                    "simple shapes, or all of one mesh"
                )
