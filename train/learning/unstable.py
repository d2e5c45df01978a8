"""Simulations that diverged in training: their last good state on disk, and the step that broke them, again.

With `debug.nan_guard=true` each is written to `out/unstable/STEPS-WORLD.npz` (schema mjx-hand/unstable/2): the seed,
control steps so far and world, the demonstration and frame, qpos and qvel before the step (MuJoCo's layout), and what
the actuators were told. `python -m train.play play.unstable=FILE` shows it.
"""

import dataclasses
from pathlib import Path

import jax
import mujoco
import numpy as np
from jaxtyping import Float

from envs.parallel import Caught
from envs.tracking import TrackingEnv
from mjx_hand.files.checked_arrays import numbers
from mjx_hand.files.npz_archive import load_arrays, save_arrays

SCHEMA = "mjx-hand/unstable/2"
_MOST = 50  # files a training; what diverges everywhere needs no thousand examples


@dataclasses.dataclass(frozen=True)
class Unstable:
    """One step that diverged.

    Attributes:
        seed, steps, world: of the training, its control steps before, and which of its worlds.
        demonstration, frame: what the world was following, and where.
        qpos, qvel: the state before the step.
        targets: of the actuators during it (m, rad).
    """

    seed: int
    steps: int
    world: int
    demonstration: int
    frame: int
    qpos: Float[np.ndarray, "q"]
    qvel: Float[np.ndarray, "v"]
    targets: Float[np.ndarray, "u"]


class UnstableLog:
    """Writes each world's newly diverged step below a folder.

    Args:
        folder: of the files; made when the first is written.
        env: the environment of the worlds.
        seed: of the training.
    """

    def __init__(self, folder: Path, env: TrackingEnv, seed: int):
        self.folder, self.env, self.seed = folder, env, seed
        self.seen: np.ndarray | None = None

    def write(self, steps: int, caught: Caught) -> list[Path]:
        """The files written for worlds that diverged since the last call; at most 50 stay in the folder."""
        count = np.asarray(caught.count)
        new = np.flatnonzero(count > (0 if self.seen is None else self.seen))
        self.seen = count
        written = []
        for world in new:
            if len(list(self.folder.glob("*.npz"))) >= _MOST:
                break
            twin, action = jax.tree.map(lambda leaf, world=world: leaf[world], (caught.twin, caught.action))
            path = self.folder / f"{steps:012d}-{world}.npz"
            arrays = {
                "seed": self.seed,
                "steps": steps,
                "world": int(world),
                "demonstration": int(twin.demonstration),
                "frame": int(twin.frame),
                "qpos": np.asarray(twin.physics.qpos),
                "qvel": np.asarray(twin.physics.qvel),
                "targets": np.asarray(self.env.command(twin, action)[2]),
            }
            save_arrays(path, SCHEMA, arrays)
            written.append(path)
        return written


def load_unstable(path: str | Path) -> Unstable:
    """Read one file.

    Raises:
        InputError: it is not such a file.
    """
    arrays = load_arrays(path, SCHEMA)
    whole = ("seed", "steps", "world", "demonstration", "frame")
    layout = {**dict.fromkeys(whole, ()), "qpos": ("q",), "qvel": ("v",), "targets": ("u",)}
    found = numbers(path, arrays, layout, finite=False)
    return Unstable(
        **{name: int(found[name]) for name in whole},
        qpos=found["qpos"],
        qvel=found["qvel"],
        targets=found["targets"],
    )


def step_again(model: mujoco.MjModel, unstable: Unstable, substeps: int) -> Float[np.ndarray, "s q"]:
    """qpos before the step and after each of its physics steps, up to the one after which the engine gave up.

    Args:
        model: the scene of its demonstration, with the engine's settings.
        unstable: the step.
        substeps: physics steps a control step.
    """
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:], data.ctrl[:] = unstable.qpos, unstable.qvel, unstable.targets
    path = [data.qpos.copy()]
    for _ in range(substeps):
        mujoco.mj_step(model, data)
        if any(warning.number for warning in data.warning) or not np.isfinite(data.qpos).all():
            break
        path.append(data.qpos.copy())
    return np.stack(path)
