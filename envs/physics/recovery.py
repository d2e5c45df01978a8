"""What to do about a simulation that diverged, for engines that do not notice by themselves."""

import jax.numpy as jnp
from jaxtyping import Array, Float

_LIMIT = 1e4  # m/s or rad/s: far beyond any hand; C MuJoCo's own limit is 1e10, which float32 reaches after NaN


def recovered(
    rest: Float[Array, "*b nq"],
    qpos: Float[Array, "*b nq"],
    qvel: Float[Array, "*b nv"],
    warmstart: Float[Array, "*b nv"],
) -> tuple[Float[Array, "*b nq"], Float[Array, "*b nv"], Float[Array, "*b nv"], Float[Array, "*b"]]:
    """qpos, qvel and the solver's warm start, diverged worlds' reset to `rest`; and 1 for each such world."""
    fine = jnp.isfinite(qpos).all(-1) & jnp.isfinite(warmstart).all(-1) & (jnp.abs(qvel) < _LIMIT).all(-1)
    keep = fine[..., None]
    return (
        jnp.where(keep, qpos, rest),
        jnp.where(keep, qvel, 0.0),
        jnp.where(keep, warmstart, 0.0),
        1.0 - fine.astype(jnp.float32),
    )
