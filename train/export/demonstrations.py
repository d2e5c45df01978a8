"""Demonstrations of an export: a scene that plain MuJoCo loads, and a reference for a player."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import jax
import numpy as np

from envs.tracking import TrackingEnv
from mjx_hand.errors import InputError
from mjx_hand.files.digests import digest, file_piece
from mjx_hand.player.tracking_reference import TrackingReference, save_tracking_reference
from train.export.scene_xml import write_scene

FOLDER = "demonstrations"


def save_demonstrations(env: TrackingEnv, numbers: Sequence[int], folder: Path) -> list[dict[str, Any]]:
    """Write `demonstrations/NNN.xml`, its meshes and `NNN.npz` of an environment's demonstrations.

    Returns:
        What each is, for the contract.

    Raises:
        InputError: the task still helps the object when the training is over, which no player can.
    """
    if env.assisted and float(env.task.assist_stiffness(jax.numpy.ones(()))) > 0:
        raise InputError(
            f"task.assist_until is {env.task.assist_until}: the object is still helped at the end of the training, "
            "which no player can; train with 1 or less"
        )
    (folder / FOLDER).mkdir()
    return [_save(env, k, folder / FOLDER) for k in numbers]


def _save(env: TrackingEnv, number: int, folder: Path) -> dict[str, Any]:
    demonstration, tables = env.demonstrations[number], env.tables
    frames = demonstration.num_frames
    name = f"{number:03d}"
    rows = {
        field: np.asarray(getattr(env.reference, field)[number])[:frames]
        for field in ("targets", "controls", "grip", "object_pose")
    }
    reference = TrackingReference(
        **rows,
        base=np.asarray(env.reference.base[number]),
        object_features=np.asarray(env.reference.features[number]),
        start_qpos=np.asarray(tables.starts.qpos[number, 0]),
        start_qvel=np.asarray(tables.starts.qvel[number, 0]),
        low=np.asarray(tables.low),
        high=np.asarray(tables.high),
        rate=env.fps,
        substeps=env.task.substeps,
        scene=f"{name}.xml",
    )
    given = demonstration, env.hands[number], env.task.contacts, env.task.observe_forces
    meshes = write_scene(folder / reference.scene, *given)
    save_tracking_reference(reference, folder / f"{name}.npz")
    files = [f"{name}.npz", reference.scene, *meshes]
    return {
        "reference": f"{FOLDER}/{name}.npz",
        "scene": f"{FOLDER}/{name}.xml",
        "meshes": [f"{FOLDER}/{mesh}" for mesh in meshes],
        "digest": digest(file_piece(folder / file) for file in files),
        "frames": frames,
        "grasp": demonstration.grasp,
        "object": demonstration.object.kind,
        "hand": demonstration.motion.side,
        "source": demonstration.source,
    }
