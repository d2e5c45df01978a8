"""Project 200,000 poses onto the hinges in one compiled call, and time it.

    python examples/08_project_a_data_set.py [poses]

Compilation is timed apart: it is paid once for each shape of the input. Whole folders: `mjx-hand retarget FOLDER`.
"""

import sys
import time

import jax
import jax.numpy as jnp
import numpy as np

import mjx_hand


def main(poses: int = 200_000) -> None:
    """Random poses within the hand's limits, made and projected."""
    rigid = mjx_hand.build_rigid_hand(mjx_hand.load_hand())
    lower, upper = (np.asarray(limit, np.float32) for limit in (rigid.hinge_lower, rigid.hinge_upper))
    share = np.random.default_rng(0).random((poses, 20), np.float32)
    truth = lower + share * (upper - lower)  # (poses, 20), rad
    rotations = jax.block_until_ready(mjx_hand.joint_rotations(truth, rigid))  # (poses, 15, 3, 3)

    began = time.perf_counter()
    project = jax.jit(lambda turns: mjx_hand.project(turns, rigid)).lower(rotations).compile()
    compiled = time.perf_counter()
    angles = jax.block_until_ready(project(rotations))
    seconds = time.perf_counter() - compiled
    print(f"compiled in {compiled - began:.1f} s on {jax.devices()[0].platform}")
    print(f"{poses:,} poses in {seconds:.2f} s: {poses / seconds:,.0f} poses/s")
    print(f"largest error: {np.rad2deg(jnp.abs(angles - truth).max()):.4f} degrees")


if __name__ == "__main__":
    main(*map(int, sys.argv[1:2]))
