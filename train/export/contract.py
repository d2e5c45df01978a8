"""The contract of an exported policy: every input and output, the body, the demonstrations, versions, digest."""

import dataclasses
import importlib.metadata
import platform
from collections.abc import Mapping, Sequence
from typing import Any

import mujoco
import numpy as np

from envs.observation import observed_features
from envs.scene import TIMESTEP
from envs.task import Task
from mjx_hand.bodies.body import NUM_WRIST, Body
from mjx_hand.bodies.body_places import body_model
from mjx_hand.objects.description import OBJECT_KINDS
from mjx_hand.player.exported_policy import ExportedPolicy
from mjx_hand.player.features import OBSERVATION_LIMIT, Feature
from mjx_hand.player.tracking_reference import FIELDS
from mjx_hand.player.tracking_reference import SCHEMA as REFERENCE_SCHEMA
from train.learning.checkpoint import Checkpoint

SCHEMA = "mjx-hand/contract/1"
_FOLLOWING = {
    "command": "clip(controls[min(frame + 1, last frame)] + residual, low, high), held for the whole step",
    "elsewhere": "follow_object: where the object is not where the demonstration has it at first, controls and "
    "targets of the wrist go there and back, as mjx_hand/player/approach.py tells",
}
_TELEOPERATED = {
    "command": "clip(tracked + residual, low, high), held for the whole step; the wrist is the person's",
    "tracked": "live: joints as they are tracked, steadied while the hand holds, as mjx_hand/player/steadying.py "
    "tells; where inputs say demonstrated, this is meant",
}
_PACKAGES = ("mjx-hand", "jax", "brax", "flax", "mujoco", "numpy")


def make_contract(
    policy: ExportedPolicy,
    checkpoint: Checkpoint,
    task: Task,
    body: Body,
    difference: float,
    demonstrations: Sequence[Mapping[str, Any]],
    side: str | None,
) -> dict[str, Any]:
    """What `contract.json` holds.

    Args:
        policy: as exported.
        checkpoint: that it was made from.
        task: that it was trained on.
        body: that it moves.
        difference: largest, of an action from Brax's inference.
        demonstrations: what each that is written beside it is.
        side: of the hands that it was trained on, None where that is not known.
    """
    table, targets, units = observed_features(task, body.names, body.reach), list(body.names.targets), _units(body)
    starts = np.cumsum([0, *(feature.size for feature in table)])[:-1].tolist()
    return {
        "schema": SCHEMA,
        "policy": {
            "experiment": checkpoint.experiment,
            "steps": checkpoint.steps,
            "success": checkpoint.success if np.isfinite(checkpoint.success) else None,
            "layers": [layer.bias.size for layer in policy.layers],
            "activation": "swish, the last layer linear",
            "precision": "float32",
            "digest": policy.digest,
        },
        "function": {
            "scaled": "clip((features - offset) * scale, -limit, limit)",
            "action": "clip(network(scaled), -1, 1)",
            "residual": "smoothing * features[residual] + (1 - smoothing) * residual_scale * action",
            **(_TELEOPERATED if task.live else _FOLLOWING),
            "limit": OBSERVATION_LIMIT,
            "smoothing": task.smoothing,
            "residual_scale": [float(value) for value in policy.residual_scale],
            "residual_start": policy.residual_start,
            "not_finite": "features must be finite: C returns 1 + the feature's number, Python raises InputError",
        },
        "rate": {"control_hz": 1 / (TIMESTEP * task.substeps), "substeps": task.substeps, "physics_step_s": TIMESTEP},
        "lookahead": list(task.lookahead),
        "follow_object": task.follow_object,
        "live": task.live,
        "side": side,
        "object_kinds": list(OBJECT_KINDS),
        "inputs": [_input(feature, start, units) for feature, start in zip(table, starts, strict=True)],
        "outputs": [
            {"name": "action", "size": len(targets), "unit": "1", "frame": "joint", "elements": targets},
            {
                "name": "residual",
                "size": len(targets),
                "unit": list(units.values()),
                "frame": "the wrist's slides: base; its turns and the hand's joints: joint",
                "elements": targets,
            },
        ],
        "conventions": {
            "quaternions": "wxyz",
            "world": "z up, the table at z = 0",
            "base": "where a demonstration's wrist orientation starts; the wrist's slides run along its axes",
            "hand": "body `wrist`: fingers along -x (of a left hand +x), back of the hand +y; its origin is a person's "
            "wrist joint or a robot's palm link",
            "wrist": "world_from_hand = base Rx(roll) Ry(pitch) Rz(yaw)",
        },
        "body": _body(body, units, demonstrations),
        "demonstration_format": {
            "schema": REFERENCE_SCHEMA,
            "arrays": {
                name: {"shape": list(field.shape), "unit": field.unit, "frame": field.frame, "meaning": field.meaning}
                for name, field in FIELDS.items()
            },
            "scene": "name of the MJCF file beside it: hand, object (body `object`), what holds it up, table; surfaces "
            "that touch stand in meshes/",
            "digest": "SHA-256 over name and SHA-256 of each file: reference, scene, meshes in order",
        },
        "demonstrations": [dict(demonstration) for demonstration in demonstrations],
        "parity": {"with": "Brax's inference", "inputs": 10_000, "largest_difference": difference},
        "versions": {
            "python": platform.python_version(),
            **{name: importlib.metadata.version(name) for name in _PACKAGES},
        },
    }


def _input(feature: Feature, start: int, units: Mapping[str, str]) -> dict[str, Any]:
    def every(values: Any) -> list[float]:
        return [float(value) for value in np.broadcast_to(np.asarray(values, float), feature.size)]

    unit: str | list[str] = feature.unit
    if any(units.get(name, "rad") != "rad" for name in feature.elements) and unit.startswith("rad"):  # fingers' slides
        unit = [feature.unit.replace("rad", units[name]) for name in feature.elements]
    return {
        "name": feature.name,
        "start": start,
        "size": feature.size,
        "unit": unit,
        "frame": feature.frame,
        "elements": list(feature.elements),
        "offset": every(feature.offset),
        "scale": every(feature.scale),
        "meaning": feature.meaning,
    }


def _units(body: Body) -> dict[str, str]:
    """Of each target, in order."""
    model = body_model(body)
    slides = {name: model.joint(name).type[0] == mujoco.mjtJoint.mjJNT_SLIDE for name in body.names.targets}
    return {name: "m" if slide else "rad" for name, slide in slides.items()}


def _body(body: Body, units: Mapping[str, str], demonstrations: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    gains = body.gains
    stiffness = [gains.wrist_slide[0]] * 3 + [gains.wrist_turn[0]] * 3 + gains.stiffness.tolist()
    damping = [gains.wrist_slide[1]] * 3 + [gains.wrist_turn[1]] * 3 + gains.damping.tolist()
    limit = [None] * NUM_WRIST + gains.force_limit.tolist()
    return {
        "name": body.name,
        "hand": sorted({demonstration["hand"] for demonstration in demonstrations}),
        "fingers": list(body.fingers),
        "actuators": [
            {
                "name": name,
                "kind": "position",
                "unit": unit,
                "stiffness": kp,
                "damping": kv,
                "force_limit": most,
            }
            for (name, unit), kp, kv, most in zip(units.items(), stiffness, damping, limit, strict=True)
        ],
        "coupled": [dataclasses.asdict(each) for each in body.coupled],
        "units": "stiffness N/m or N m/rad, damping N s/m or N m s/rad, force_limit N or N m (null: none)",
        "coupling": "joint = slope * leader + shift: joints that others move, without an actuator",
        "wrist": "carried without gravity: the body has gravity compensation, the arm is not modelled",
        "limits": "low and high of each reference",
    }
