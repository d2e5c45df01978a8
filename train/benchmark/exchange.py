"""Files by which another version of MuJoCo steps the same worlds: a scene, the numbers of its models, a script.

The scene's MJCF says how it is built; it has six digits. The numbers of each model come beside it, in full.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import jax
import mujoco
import numpy as np
from jaxtyping import Float

from envs.scene import demonstration_spec
from envs.tracking import TrackingEnv
from train.benchmark.contestants import Script, make_script

_PICTURES = ("vis", "cam_", "light_", "mat_", "tex_", "skin_")
# MuJoCo 4 says that a position actuator is told a position. Earlier versions cannot read that, and need not: gains and
# biases make it one.
_INPUT = ' input="pos"'


class Start(NamedTuple):
    """A script, and the states that its worlds start from.

    Attributes:
        script: see `train.benchmark.contestants`; its controls are single precision, as an engine gets them.
        qpos, qvel: of each world, in single precision.
    """

    script: Script
    qpos: Float[np.ndarray, "n nq"]
    qvel: Float[np.ndarray, "n nv"]


def make_start(env: TrackingEnv, worlds: int) -> Start:
    """The script of a number of worlds."""
    script = make_script(env, worlds)
    state = jax.jit(jax.vmap(env.start))(script.variant, script.frame).pipeline_state.physics
    script = Script(script.variant, script.frame, script.controls.astype(np.float32))
    return Start(script, np.asarray(state.qpos), np.asarray(state.qvel))


def scene_xml(env: TrackingEnv) -> str:
    """The MJCF of the environment's scenes, which are alike but for numbers, as MuJoCo 3 reads it too."""
    most = max(range(len(env.demonstrations)), key=lambda k: len(env.demonstrations[k].support))
    d = env.demonstrations[most]
    spec = demonstration_spec(d, env.hands[most], contacts=env.task.contacts, forces=True)
    spec.compile()
    return spec.to_xml().replace(_INPUT, "")


def numbers(models: Sequence[mujoco.MjModel]) -> dict[str, np.ndarray]:
    """All that a step may read: numbers of the models, and their options as `opt.NAME`, one row per model.

    Bounding volumes are those that hold all models', because mjbatch has no others for each world.
    """
    first = models[0]
    fields = {
        name: np.stack([getattr(model, name) for model in models])
        for name in dir(first)
        if not name.startswith(("_", *_PICTURES))
        and isinstance(value := getattr(first, name), np.ndarray)
        and value.size
        and value.dtype.kind == "f"
    }
    fields["bvh_aabb"] = _covering(fields["bvh_aabb"])
    options = {
        f"opt.{name}": np.stack([np.asarray(getattr(model.opt, name)) for model in models])
        for name in dir(first.opt)
        if not name.startswith("_") and not callable(getattr(first.opt, name))
    }
    return fields | options


def _covering(boxes: Float[np.ndarray, "m n 6"]) -> Float[np.ndarray, "m n 6"]:
    """Centres and half extents (m) of boxes that hold those of all models, the same for each."""
    low, high = (boxes[..., :3] + sign * boxes[..., 3:] for sign in (-1, 1))
    low, high = low.min(axis=0), high.max(axis=0)
    return np.broadcast_to(np.concatenate([(low + high) / 2, (high - low) / 2], axis=-1), boxes.shape)


def write_scene(folder: Path, env: TrackingEnv, settings: Mapping[str, Sequence[mujoco.MjModel]]) -> None:
    """Write `scene.xml`, and `NAME.npz` with the numbers of each setting's models."""
    (folder / "scene.xml").write_text(scene_xml(env))
    for name, models in settings.items():
        np.savez(folder / f"{name}.npz", allow_pickle=False, **numbers(models))


def write_script(path: Path, start: Start, substeps: int) -> None:
    """Write a script with its worlds' starts."""
    script = start.script
    arrays = {"variant": script.variant, "qpos": start.qpos, "qvel": start.qvel, "controls": script.controls}
    np.savez(path, allow_pickle=False, substeps=np.array(substeps), **arrays)
