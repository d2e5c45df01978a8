"""Many worlds for Brax PPO: vmapped, restarted when done, with the bookkeeping that `brax.training` reads."""

import jax
import jax.numpy as jnp
from brax.envs.base import Env, State
from jaxtyping import Array, Float

from envs.tracking import TrackingEnv


class ParallelEnv(Env):
    """A batch of `TrackingEnv` worlds; pass it to Brax PPO with `wrap_env=False`.

    Brax's own wrappers restart a world at the state of its very first reset. Here every restart draws a new
    demonstration and a new frame, which costs one look-up in the environment's table of starts.
    """

    def __init__(self, env: TrackingEnv):
        self.env = env

    @property
    def action_size(self) -> int:
        return self.env.action_size

    @property
    def observation_size(self) -> int:
        return self.env.observation_size

    @property
    def backend(self) -> str:
        return self.env.backend

    def reset(self, rng: Array) -> State:
        """One state a key; rng has a leading axis."""
        return jax.vmap(self._reset)(rng)

    def step(self, state: State, action: Float[Array, "n 26"]) -> State:
        return jax.vmap(self._step)(state, action)

    def _reset(self, rng: Array) -> State:
        first, later = jax.random.split(rng)
        state = self.env.reset(first)
        zero = jnp.zeros(())
        info = {
            **state.info,
            "rng": later,
            "episode_done": zero,
            "episode_metrics": dict.fromkeys(("sum_reward", "length", *state.metrics), zero),
        }
        return state.replace(info=info)  # type: ignore[attr-defined]

    def _step(self, state: State, action: Float[Array, "26"]) -> State:
        ours = {"truncation": state.info["truncation"]}
        stepped = self.env.step(state.replace(info=ours), action)  # type: ignore[attr-defined]
        now, later = jax.random.split(state.info["rng"])
        fresh = self.env.reset(now)
        over = stepped.done > 0

        # Sums run over an episode and are read on its last step, so they start anew one step later.
        going = 1 - state.info["episode_done"]
        sums = state.info["episode_metrics"]
        terms = {"sum_reward": stepped.reward, "length": jnp.ones(()), **stepped.metrics}
        info = {
            "truncation": stepped.info["truncation"],
            "rng": later,
            "episode_done": stepped.done,
            "episode_metrics": {name: sums[name] * going + value for name, value in terms.items()},
        }

        def choose(new: Array, old: Array) -> Array:
            return jnp.where(over, new, old)

        return stepped.replace(  # type: ignore[attr-defined]
            pipeline_state=jax.tree.map(choose, fresh.pipeline_state, stepped.pipeline_state),
            obs=jax.tree.map(choose, fresh.obs, stepped.obs),
            info=info,
        )
