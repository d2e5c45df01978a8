"""Solver settings, chosen by measurement (`python -m train.benchmark solver`).

Contacts have elliptic cones with impratio 50 everywhere: at 1 no pinch holds, at 10 a held ball creeps out of the
fingers at 2 to 3 mm/s, and pyramidal cones lose half of the pinches (19 of 40 held against 38 of 40, same scripts).
"""

import copy
from collections.abc import Sequence

import mujoco


def newton(models: Sequence[mujoco.MjModel]) -> list[mujoco.MjModel]:
    """Copies for engines that have Newton's method alone; it stops early, so its caps are cheap.

    Line searches of 20 steps and not 50 end before their minimum: objects that stand on a table slide by centimetres.
    """
    return _set(models, mujoco.mjtSolver.mjSOL_NEWTON, iterations=10)


def gauss_seidel(models: Sequence[mujoco.MjModel]) -> list[mujoco.MjModel]:
    """Copies for MuJoCo's C engine: projected Gauss-Seidel on the few forces of a grasp.

    15 sweeps hold and drop the same objects as Newton's method, and under training's commands, which jump every 20 ms
    by random residuals, step up to twice as fast; under smooth ones they are no faster (`docs/physics.md`).
    """
    return _set(models, mujoco.mjtSolver.mjSOL_PGS, iterations=15)


def _set(models: Sequence[mujoco.MjModel], solver: mujoco.mjtSolver, iterations: int) -> list[mujoco.MjModel]:
    copies = [copy.copy(model) for model in models]
    for model in copies:
        model.opt.solver = solver
        model.opt.iterations = iterations
        model.opt.ls_iterations = 50
        model.opt.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
        model.opt.impratio = 50.0
    return copies
