"""`TrackingVectorEnv`: many worlds of `TrackingEnv` for a learner of one's own, as Gymnasium's vector environments are.

NumPy goes in and out, whatever JAX computes on.
"""

from collections.abc import Mapping
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from brax.envs.base import State
from gymnasium.spaces import Box
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from jaxtyping import Array, Bool, Float, Float32, Int

from envs.tracking import TrackingEnv
from envs.twin import Tables, twin_of
from mjx_hand.errors import InputError
from mjx_hand.player.features import OBSERVATION_LIMIT

Step = tuple[
    Float32[np.ndarray, "n o"], Float32[np.ndarray, "n"], Bool[np.ndarray, "n"], Bool[np.ndarray, "n"], dict[str, Any]
]


class TrackingVectorEnv(VectorEnv[np.ndarray, np.ndarray, np.ndarray]):
    """`num_envs` worlds side by side, each of which starts a new episode when its own is over.

    Observations are float32 (n, o) within the limits of `observation_space`; actions (n, u) within [-1, 1], beyond
    which they are cut off; rewards float32 (n,). An episode terminates where the object is lost or the simulation
    diverges, and is truncated at its demonstration's end.

    `infos` has for each world the `demonstration` and the `frame` that it is at, and, of steps, the terms of the
    reward (`reward/position`, ...), `error/position` (m), `error/rotation` (rad) and `unstable` (1 where the simulation
    diverged), each with Gymnasium's mask of the worlds that have it, such as `_reward/position`.

    Args:
        env: one world.
        num_envs: how many.
        seed: of the first `reset`, where that is given none. World i draws from seed + i, however many there are.
        autoreset_mode: when a new episode starts. NEXT_STEP, Gymnasium's own default: at the next step, which takes no
            action and gives no reward. SAME_STEP: at once; what ended stands in `infos["final_obs"]` and
            `infos["final_info"]`, with masks `_final_obs` and `_final_info`.

    Attributes:
        progress: share of the training that is over, for tasks that change with it; 1, as evaluations have it, unless
            a learner sets it.

    Raises:
        InputError: no world, a negative seed, or another autoreset mode.
    """

    def __init__(
        self,
        env: TrackingEnv,
        num_envs: int,
        seed: int = 0,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
    ):
        if num_envs < 1:
            raise InputError(f"num_envs is {num_envs}; it must be at least 1")
        mode = next((m for m in AutoresetMode if autoreset_mode in (m, m.value)), None)
        if mode not in (AutoresetMode.NEXT_STEP, AutoresetMode.SAME_STEP):
            raise InputError(f"autoreset_mode is {autoreset_mode!r}; valid: NextStep, SameStep")
        self.env = env
        self.num_envs = num_envs
        self.metadata = {"autoreset_mode": mode, "render_modes": [], "render_fps": round(env.fps)}
        limit = OBSERVATION_LIMIT
        self.single_observation_space = Box(-limit, limit, (env.observation_size,), np.float32)
        self.single_action_space = Box(-1.0, 1.0, (env.action_size,), np.float32)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self.progress = 1.0
        self._same_step = mode is AutoresetMode.SAME_STEP
        self._keys = _keys(seed, num_envs)
        self._state: State | None = None
        self._over = np.zeros(num_envs, bool)
        # The tables are arguments, as in a training: compiled in, demonstrations would be constants.
        self._compiled_reset = jax.jit(self._reset_all)
        self._compiled_start = jax.jit(lambda tables, *start: jax.vmap(env.with_tables(tables).start)(*start))
        self._compiled_step = jax.jit(self._step_all)

    def reset(
        self, *, seed: int | None = None, options: Mapping[str, Any] | None = None
    ) -> tuple[Float32[np.ndarray, "n o"], dict[str, Any]]:
        """Start a new episode in every world.

        Args:
            seed: as the constructor's; without one, the draws go on.
            options: `demonstration` and `frame`, an integer or (n,) of them, to start there and not at random; the
                frame is 0 where only the demonstration is given, which is the unassisted start of evaluations.

        Raises:
            InputError: a negative seed, another option, or a demonstration or a frame that there is not.
        """
        if seed is not None:
            self._keys = _keys(seed, self.num_envs)
        super().reset(seed=seed)
        if options:
            state = self._compiled_start(self.env.tables, *self._start_of(options))
        else:
            state, self._keys = self._compiled_reset(self.env.tables, self._keys)
        self._state, self._over = state, np.zeros(self.num_envs, bool)
        return np.array(state.obs, np.float32), _masked(_place(state), np.ones(self.num_envs, bool))

    def step(self, actions: Float[np.ndarray, "n u"]) -> Step:
        """One control step of every world.

        Raises:
            InputError: before the first `reset`, or actions of another shape or that are not finite.
        """
        if self._state is None:
            raise InputError("step comes after reset; call reset() first")
        actions = np.asarray(actions, np.float32)
        if actions.shape != self.action_space.shape or not np.isfinite(actions).all():
            raise InputError(
                f"actions must be finite and of shape {self.action_space.shape}; these are of shape {actions.shape}"
            )
        progress = np.full(self.num_envs, self.progress, np.float32)
        state, stepped, self._keys = self._compiled_step(
            self.env.tables, self._state, self._keys, actions, self._over, progress
        )
        said = stepped if self._same_step else state
        truncated = np.asarray(said.info["truncation"]) > 0
        ended = np.asarray(said.done) > 0
        everywhere, restarted = np.ones(self.num_envs, bool), ended if self._same_step else self._over
        infos = _masked(_place(state), everywhere) | _masked(_metrics(stepped), ~restarted)
        if self._same_step and ended.any():
            final, last = np.full(self.num_envs, None, object), np.asarray(stepped.obs)
            for world in np.flatnonzero(ended):
                final[world] = last[world].copy()
            infos |= {"final_obs": final, "_final_obs": ended.copy()}
            infos |= {"final_info": _masked(_place(stepped) | _metrics(stepped), ended), "_final_info": ended.copy()}
        self._state, self._over = state, ended
        observations, rewards = np.array(state.obs, np.float32), np.array(said.reward, np.float32)
        return observations, rewards, ended & ~truncated, truncated, infos

    def close_extras(self) -> None:
        """Give up the worlds' states."""
        self._state = None

    def _reset_all(self, tables: Tables, keys: Array) -> tuple[State, Array]:
        now, later = _split(keys)
        return jax.vmap(self.env.with_tables(tables).reset)(now), later

    def _step_all(
        self,
        tables: Tables,
        state: State,
        keys: Array,
        actions: Float[Array, "n u"],
        over: Bool[Array, "n"],
        progress: Float[Array, "n"],
    ) -> tuple[State, State, Array]:
        """The state to go on from, the one before any restart, and the keys; only a restart uses a world's key up."""
        env = self.env.with_tables(tables)
        state = state.replace(info={**state.info, "progress": progress})  # type: ignore[attr-defined]
        stepped = jax.vmap(env.step)(state, actions)
        now, later = _split(keys)
        restart = stepped.done > 0 if self._same_step else over

        def choose(restart: Array, new: Any, old: Any) -> Any:
            return jax.tree.map(lambda a, b: jnp.where(restart, a, b), new, old)

        choose_all = jax.vmap(choose)
        return choose_all(restart, jax.vmap(env.reset)(now), stepped), stepped, choose_all(restart, later, keys)

    def _start_of(self, options: Mapping[str, Any]) -> tuple[Int[np.ndarray, "n"], Int[np.ndarray, "n"]]:
        if set(options) - {"demonstration", "frame"} or "demonstration" not in options:
            raise InputError(f"options are {sorted(options)}; valid: demonstration, and with it frame")
        which = self._whole("demonstration", options["demonstration"], np.array(self.env.num_demonstrations))
        return which, self._whole("frame", options.get("frame", 0), np.asarray(self.env.reference.length)[which])

    def _whole(self, name: str, value: Any, count: Int[np.ndarray, "*n"]) -> Int[np.ndarray, "n"]:
        given = np.asarray(value)
        valid = given.shape in ((), (self.num_envs,)) and np.issubdtype(given.dtype, np.integer)
        if not valid or (given < 0).any() or (given >= count).any():
            raise InputError(
                f"{name} is {value}; it must be an integer or {self.num_envs}, from 0 to {count.min() - 1}"
            )
        return np.broadcast_to(given.astype(np.int32), (self.num_envs,))


def _keys(seed: int, count: int) -> Array:
    if seed < 0:
        raise InputError(f"seed is {seed}; it must not be negative")
    return jax.vmap(jax.random.key)(np.asarray((seed + np.arange(count)) % 2**32, np.uint32))


def _split(keys: Array) -> tuple[Array, Array]:
    both = jax.vmap(jax.random.split)(keys)
    return both[:, 0], both[:, 1]


def _place(state: State) -> dict[str, np.ndarray]:
    twin = twin_of(state)
    return {"demonstration": np.asarray(twin.demonstration), "frame": np.asarray(twin.frame)}


def _metrics(state: State) -> dict[str, np.ndarray]:
    return {name: np.asarray(value) for name, value in state.metrics.items()}


def _masked(values: Mapping[str, np.ndarray], mask: Bool[np.ndarray, "n"]) -> dict[str, np.ndarray]:
    """As Gymnasium has infos: beside each name a mask of the worlds that have it; zero in the others."""
    filled = {name: np.where(mask, value, 0).astype(value.dtype) for name, value in values.items()}
    return filled | {f"_{name}": mask.copy() for name in values}
