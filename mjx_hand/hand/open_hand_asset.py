"""The open hand's file: its arrays, packed small.

`open_hand.npz` (schema mjx-hand/open-hand/1) holds the template in metres (float32), faces (uint16), shape directions
as int16 times a scale for each component, and the skinning weights and joint regressor as (row, column, value) entries.
"""

from pathlib import Path

import numpy as np

from mjx_hand.files.npz_archive import load_arrays, save_arrays
from mjx_hand.hand.joints import NUM_LINKS
from mjx_hand.hand.model import HandModel

SCHEMA = "mjx-hand/open-hand/1"
WEIGHT_STEPS = 65535
SHAPE_STEPS = 32767


def save_asset(
    path: str | Path,
    *,
    template: np.ndarray,
    faces: np.ndarray,
    weights: np.ndarray,
    shapedirs: np.ndarray,
    joint_regressor: np.ndarray,
    tip_vertices: np.ndarray,
) -> None:
    """Write the right hand's arrays (shapes as in `HandModel`), quantised to well under a micrometre."""
    scale = np.abs(shapedirs).max(axis=(0, 1)) / SHAPE_STEPS
    vertex, link = np.nonzero(weights)
    joint, of_vertex = np.nonzero(joint_regressor)
    save_arrays(
        path,
        SCHEMA,
        {
            "template": template.astype(np.float32),
            "faces": faces.astype(np.uint16),
            "shape_steps": np.rint(shapedirs / scale).astype(np.int16),
            "shape_scale": scale.astype(np.float32),
            "weight_vertex": vertex.astype(np.uint16),
            "weight_link": link.astype(np.uint8),
            "weight_steps": np.rint(weights[vertex, link] * WEIGHT_STEPS).astype(np.uint16),
            "regressor_joint": joint.astype(np.uint8),
            "regressor_vertex": of_vertex.astype(np.uint16),
            "regressor_value": joint_regressor[joint, of_vertex].astype(np.float32),
            "tip_vertices": tip_vertices.astype(np.uint16),
        },
    )


def load_asset(path: str | Path) -> HandModel:
    """The right hand that `save_asset` wrote, as float32 and int32 arrays."""
    a = load_arrays(path, SCHEMA)
    template = a["template"]
    weights = np.zeros((len(template), NUM_LINKS))
    weights[a["weight_vertex"], a["weight_link"]] = a["weight_steps"]
    regressor = np.zeros((NUM_LINKS, len(template)))
    regressor[a["regressor_joint"], a["regressor_vertex"]] = a["regressor_value"]
    return HandModel(
        template=template,
        faces=a["faces"].astype(np.int32),
        weights=(weights / weights.sum(axis=1, keepdims=True)).astype(np.float32),
        shapedirs=a["shape_steps"].astype(np.float32) * a["shape_scale"],
        posedirs=np.zeros((*template.shape, 135), np.float32),
        joint_regressor=(regressor / regressor.sum(axis=1, keepdims=True)).astype(np.float32),
        tip_vertices=a["tip_vertices"].astype(np.int32),
        pose_mean=np.zeros((15, 3), np.float32),
        side="right",
        name="open hand",
    )
