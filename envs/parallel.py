"""Many worlds for Brax PPO: vmapped, restarted when done, with the bookkeeping that `brax.training` reads."""

import jax
import jax.numpy as jnp
from brax.envs.base import Env, State
from jaxtyping import Array, Float, Int

from envs.commands import EXPERT
from envs.tracking import TrackingEnv
from envs.twin import Tables, Twin, twin_of
from mjx_hand.pytree import pytree


@pytree
class Caught:
    """What went before the last step of a world in which its simulation diverged.

    Attributes:
        count: how many steps of this world have diverged; 0 means that the rest says nothing.
        twin: the state before the step.
        action: what the policy did.
    """

    count: Int[Array, "*b"]
    twin: Twin
    action: Float[Array, "*b u"]


class ParallelEnv(Env):
    """A batch of `TrackingEnv` worlds; pass it to Brax PPO with `wrap_env=False`.

    Brax's own wrappers restart a world at the state of its very first reset. Here every restart draws a new
    demonstration and a new frame, which costs one look-up in the environment's table of starts.

    With `guard`, `info["caught"]` holds the `Caught` of each world.
    """

    def __init__(self, env: TrackingEnv, guard: bool = False):
        self.env = env
        self.guard = guard

    @property
    def action_size(self) -> int:
        """As `TrackingEnv.action_size`."""
        return self.env.action_size

    @property
    def observation_size(self) -> int:
        """As `TrackingEnv.observation_size`."""
        return self.env.observation_size

    @property
    def backend(self) -> str:
        """As `TrackingEnv.backend`."""
        return self.env.backend

    def with_tables(self, tables: Tables) -> "ParallelEnv":
        """As `TrackingEnv.with_tables`."""
        return ParallelEnv(self.env.with_tables(tables), self.guard)

    def reset(self, rng: Array) -> State:
        """One state a key; rng has a leading axis."""
        return jax.vmap(self._reset)(rng)

    def step(self, state: State, action: Float[Array, "n u"]) -> State:
        """One control step of every world, as `TrackingEnv.step`; a new episode follows one that has ended."""
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
        if self.guard:
            count, idle = jnp.zeros((), jnp.int32), jnp.zeros(self.action_size)
            info["caught"] = Caught(count=count, twin=twin_of(state), action=idle)
        return state.replace(info=info)  # type: ignore[attr-defined]

    def _step(self, state: State, action: Float[Array, "u"]) -> State:
        ours = {name: state.info[name] for name in ("truncation", "progress", EXPERT) if name in state.info}
        stepped = self.env.step(state.replace(info=ours), action)  # type: ignore[attr-defined]
        now, later = jax.random.split(state.info["rng"])
        fresh = self.env.reset(now)
        over = stepped.done > 0

        # Sums run over an episode and are read on its last step, so they start anew one step later.
        going = 1 - state.info["episode_done"]
        sums = state.info["episode_metrics"]
        terms = {"sum_reward": stepped.reward, "length": jnp.ones(()), **stepped.metrics}
        info = {
            **{name: stepped.info[name] for name in ours},
            "rng": later,
            "episode_done": stepped.done,
            "episode_metrics": {name: sums[name] * going + value for name, value in terms.items()},
        }

        if self.guard:
            before: Caught = state.info["caught"]
            bad = stepped.metrics["unstable"] > 0
            now_caught = Caught(count=before.count + 1, twin=twin_of(state), action=action)
            info["caught"] = jax.tree.map(lambda new, old: jnp.where(bad, new, old), now_caught, before)

        def choose(new: Array, old: Array) -> Array:
            return jnp.where(over, new, old)

        return stepped.replace(  # type: ignore[attr-defined]
            pipeline_state=jax.tree.map(choose, fresh.pipeline_state, stepped.pipeline_state),
            obs=jax.tree.map(choose, fresh.obs, stepped.obs),
            info=info,
        )
