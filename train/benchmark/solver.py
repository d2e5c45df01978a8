"""`python -m train.benchmark solver`: what the C engine's settings cost and what they do to grasps.

Random scripted grasps of each type are performed with each of the settings: reach, close, lift, carry, turn, hold. All
settings get the same scripts, and take turns; CPU time is measured. So ratios hold on a machine that is busy.
"""

import contextlib
import dataclasses
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from jaxtyping import Bool, Float

from envs.demonstrations.scripted.perform import judge, roll_out
from envs.demonstrations.scripted.trials import Script, draw_scripts, script_controls
from envs.grasps import grasp_names, grasp_type
from envs.physics.solver import gauss_seidel
from envs.scene import OBJECT
from mjx_hand.errors import InputError
from mjx_hand.hand.load import load_hand
from mjx_hand.progress import counter
from mjx_hand.rigid.build import build_rigid_hand
from train.benchmark.solver_report import Figures, text, write

_LAST = 0.6  # s at the end, when the object is held still
_SAMPLE = 0.02  # s between the moments at which paths are compared; every time step divides it
_EVERY = 4  # samples between those whose contacts are looked at


@dataclasses.dataclass(frozen=True)
class Settings:
    """Settings that depart from the engine's own (`envs.physics.solver.gauss_seidel`).

    Attributes:
        options: fields of `mujoco.MjOption`.
        solref: time constant (s) of all contacts; None leaves the scene's.
    """

    options: dict[str, Any] = dataclasses.field(default_factory=dict)
    solref: float | None = None

    def applied(self, models: Sequence[mujoco.MjModel]) -> list[mujoco.MjModel]:
        """Copies with these settings."""
        copies = gauss_seidel(models)
        for model in copies:
            for name, value in self.options.items():
                setattr(model.opt, name, value)
            if self.solref is not None:
                model.geom_solref[:, 0] = self.solref
        return copies


_SOLVER, _DENSE, _SPARSE = mujoco.mjtSolver, mujoco.mjtJacobian.mjJAC_DENSE, mujoco.mjtJacobian.mjJAC_SPARSE
_PYRAMIDS = mujoco.mjtCone.mjCONE_PYRAMIDAL


def newton(iterations: int, jacobian: Any = _SPARSE, **options: Any) -> Settings:
    """Newton's method in place of the engine's own, sparse unless another Jacobian is given."""
    return Settings({"solver": _SOLVER.mjSOL_NEWTON, "iterations": iterations, "jacobian": jacobian, **options})


def _conjugate(iterations: int) -> Settings:
    return Settings({"solver": _SOLVER.mjSOL_CG, "iterations": iterations, "jacobian": _SPARSE})


CHOSEN = "as chosen: PGS 15, elliptic, impratio 50, 4 ms, solref 10 ms"
SWEEP = {
    CHOSEN: Settings(),
    "PGS 10": Settings({"iterations": 10}),
    "PGS 20": Settings({"iterations": 20}),
    "PGS 30": Settings({"iterations": 30}),
    "PGS 15, sparse": Settings({"jacobian": _SPARSE}),
    "Newton 10, dense": newton(10, _DENSE),
    "Newton 10, sparse": newton(10),
    "Newton 100, dense": newton(100, _DENSE),
    "Newton 100, sparse": newton(100),
    "CG 20, sparse": _conjugate(20),
    "CG 50, sparse": _conjugate(50),
    "PGS 15, pyramidal": Settings({"cone": _PYRAMIDS}),
    "Newton 10, sparse, pyramidal": newton(10, cone=_PYRAMIDS),
    "impratio 1": Settings({"impratio": 1.0}),
    "impratio 3": Settings({"impratio": 3.0}),
    "impratio 10": Settings({"impratio": 10.0}),
    "impratio 200": Settings({"impratio": 200.0}),
    "2 ms": Settings({"timestep": 0.002}),
    "5 ms": Settings({"timestep": 0.005}),
    "solref 20 ms": Settings(solref=0.02),
    "2 ms, solref 5 ms": Settings({"timestep": 0.002}, solref=0.005),
}
# What the paths are measured against: the same contacts, solved to the end at a quarter of the step.
_REFERENCE = newton(100, timestep=0.001, tolerance=1e-10, ls_iterations=50)


@dataclasses.dataclass(frozen=True)
class Options:
    """Measure speed, stability and penetration of grasps over settings of the solver.

    Attributes:
        grasps: the types; all if none is named.
        scripts: random grasps of each type, by eight hands.
        runs: timed runs of each setting.
        seed: of the grasps.
        out: folder for solver.md and solver.json.
    """

    grasps: tuple[str, ...] = ()
    scripts: int = 24
    runs: int = 3
    seed: int = 5
    out: Path = Path("outputs/benchmark")


def report(options: Options) -> list[str]:
    """Measure, write the files, and return the lines of the report.

    Raises:
        InputError: for options out of range, or a folder that cannot be written.
    """
    if options.scripts < 1 or options.runs < 1:
        raise InputError(f"{options.scripts} scripts, {options.runs} runs; give at least 1 of each")
    types = [grasp_type(name) for name in options.grasps or grasp_names()]
    model, rng = load_hand(), np.random.default_rng(options.seed)
    hands = [build_rigid_hand(model, shape) for shape in np.clip(rng.normal(size=(8, model.num_shape)), -2, 2)]
    figures = {}
    with (
        contextlib.redirect_stdout(sys.stderr),  # progress; the report alone goes to standard output
        counter(len(types) * (len(SWEEP) * options.runs + 1), "performing") as advance,
    ):
        for grasp in types:
            scripts = draw_scripts(grasp, [hands[k % len(hands)] for k in range(options.scripts)], rng)
            if not scripts:
                raise InputError(f"no posture was found for {options.scripts} {grasp.name} grasps; draw more scripts")
            reference = _Take(scripts, _REFERENCE)
            advance(1)
            takes: dict[str, list[_Take]] = {name: [] for name in SWEEP}
            for _ in range(options.runs):
                for name, settings in SWEEP.items():
                    # Physics is the same in every run: only the first one's is kept.
                    takes[name].append(_Take(scripts, settings, keep=not takes[name]))
                    advance(1)
            figures[grasp.name] = {name: _figures(rows, reference) for name, rows in takes.items()}
    lines = text(figures, CHOSEN)
    kept = {name: getattr(options, name) for name in ("scripts", "runs", "seed")}
    return [*lines, "", *(str(file) for file in write(figures, lines, options.out, kept))]


class _Take:
    """One run of all scripts.

    Attributes:
        seconds: of CPU time that the engine took, on all cores together.
        step: the time step (s).
        steps: physics steps of all worlds together.
        held: which scripts held.
        paths: of the objects, every `_SAMPLE`.
        shaking: RMS acceleration (m/s^2) of each object at the end.
        depths: of the hand's contacts with each object that is held (m).
    """

    def __init__(self, scripts: Sequence[Script], settings: Settings, keep: bool = True):
        models = settings.applied([script.model for script in scripts])
        controls = script_controls(scripts, models[0])
        starts = np.stack([script.object_start for script in scripts])
        began = time.process_time()
        qpos, diverged = roll_out(models, controls, starts)
        self.seconds = time.process_time() - began
        self.step, self.steps = models[0].opt.timestep, controls.shape[0] * controls.shape[1]
        if keep:
            self._look(scripts, models, qpos, diverged)

    def _look(
        self,
        scripts: Sequence[Script],
        models: Sequence[mujoco.MjModel],
        qpos: Float[np.ndarray, "n t q"],
        diverged: Bool[np.ndarray, "n"],
    ) -> None:
        lifted = np.array([round(script.motion.tempo.end("lift") / self.step) for script in scripts])
        done = judge(qpos, diverged, np.stack([script.base for script in scripts]), lifted)
        self.held = done.held
        places = done.object_pose[..., :3]
        stride = round(_SAMPLE / self.step)
        self.paths = places[:, stride - 1 :: stride]
        end = places[:, -round(_LAST / self.step) :]
        self.shaking = np.sqrt((np.diff(end, 2, axis=1) ** 2).sum(-1).mean(1)) / self.step**2
        self.depths = [
            _depths(models[k], qpos[k, lifted[k] :: _EVERY * stride]) for k in np.flatnonzero(self.held).tolist()
        ]


def _depths(model: mujoco.MjModel, states: Float[np.ndarray, "t q"]) -> Float[np.ndarray, "_"]:
    """How deep (m) hand and object are in each other at each contact of these states."""
    data, object_id = mujoco.MjData(model), model.body(OBJECT).id
    found: list[float] = []
    for state in states:
        data.qpos[:] = state
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_collision(model, data)
        bodies = model.geom_bodyid[data.contact.geom]
        ours = (bodies == object_id).any(axis=1) & (bodies > 0).all(axis=1)  # the ground is part of the world, body 0
        found += list(-data.contact.dist[ours])
    return np.array(found)


def _figures(takes: Sequence[_Take], reference: _Take) -> Figures:
    first = takes[0]
    count = min(first.paths.shape[1], reference.paths.shape[1])
    away = np.linalg.norm(first.paths[:, :count] - reference.paths[:, :count], axis=-1).mean(axis=1)
    rates = [take.steps / take.seconds for take in takes]
    depths = np.concatenate([np.zeros(0), *first.depths])
    return Figures(
        steps=float(np.median(rates)),
        simulated=float(np.median(rates)) * first.step,
        scripts=len(first.held),
        held=int(first.held.sum()),
        shaking=float(np.median(first.shaking[first.held])) if first.held.any() else None,
        deviation=float(np.median(away[reference.held])) if reference.held.any() else None,
        mean_depth=float(depths.mean()) if depths.size else None,
        deepest=float(depths.max()) if depths.size else None,
    )
