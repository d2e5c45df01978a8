"""Files of a `RecordedScene`: the same named arrays as `.npz`, or as JSON for programs without NumPy.

`fps`, `source`, `up` (3 numbers, or none where it is not known), `hands` (their sides), `objects` (their names); of
each hand `SIDE_rotations` and the other attributes of `Motion`; of each object `object_K_position` and the other
attributes of `RecordedObject`, K counting from 0 in the order of `objects`. What an object does not have is left out.
"""

import json
from pathlib import Path
from typing import Any

import numpy as np

from mjx_hand.errors import InputError
from mjx_hand.files.checked_arrays import numbers, text, texts
from mjx_hand.files.json_text import read_json
from mjx_hand.files.npz_archive import load_arrays, replacing, save_arrays
from mjx_hand.files.npz_reader import Arrays
from mjx_hand.motion.motion import LAYOUT, OFFSETS, Motion
from mjx_hand.motion.scene import SIDES, Hinge, RecordedObject, RecordedScene, check_scene

SCHEMA = "mjx-hand/scene/1"
SUFFIXES = (".npz", ".json")
_POSES: dict[str, tuple[int | str, ...]] = {"position": ("t", 3), "quaternion": ("t", 4), "seen": ("t",), "size": (3,)}
_MESH: dict[str, tuple[int | str, ...]] = {"vertices": ("v", 3), "faces": ("f", 3)}
_HINGE: dict[str, tuple[int | str, ...]] = {"hinge_point": (3,), "hinge_axis": (3,), "hinge_angle": ("t",)}
_END = 4096  # bytes
_MOST = 1000  # objects; a damaged count is no reason to ask for a million arrays


def save_scene(scene: RecordedScene, path: str | Path) -> None:
    """Write a scene as `.npz`, or as `.json` with the same names (schema mjx-hand/scene/1).

    Raises:
        InputError: the scene is not well formed, the name ends otherwise, or the file cannot be written.
    """
    path = Path(path)
    if path.suffix.lower() not in SUFFIXES:
        raise InputError(f"{path}: a scene is written as .npz or .json; name it {path.with_suffix('.npz')}")
    arrays = _arrays(check_scene(scene))
    if path.suffix.lower() == ".npz":
        save_arrays(path, SCHEMA, arrays)
        return
    listed = {name: np.asarray(value).tolist() for name, value in arrays.items()}
    with replacing(path) as temporary:
        temporary.write_text(json.dumps({"schema": SCHEMA} | listed), encoding="utf-8")


def load_scene_file(path: str | Path) -> RecordedScene:
    """Read what `save_scene` wrote, or what others wrote in that form.

    Raises:
        InputError: not such a file, or its contents are not a well-formed scene.
    """
    path = Path(path)
    arrays = load_arrays(path, SCHEMA) if path.suffix.lower() != ".json" else _json_arrays(path)
    sides, names = texts(path, arrays, "hands"), texts(path, arrays, "objects")
    if not set(sides) <= set(SIDES) or len(names) > _MOST:
        raise InputError(
            f"{path}: hands are {sides} and objects {len(names)}; expected right, left and at most {_MOST}"
        )
    fps = float(numbers(path, arrays, {"fps": ()})["fps"])
    up = numbers(path, arrays, {"up": ("u",)})["up"].astype(float) if "up" in arrays else np.zeros(0)
    return check_scene(
        RecordedScene(
            fps=fps,
            hands=tuple(_hand(path, arrays, side, fps) for side in sides),
            objects=tuple(_object(path, arrays, k, name) for k, name in enumerate(names)),
            up=up if up.size else None,
            source=text(path, arrays, "source") if "source" in arrays else "",
        ),
        name=str(path),
    )


def is_scene_json(path: Path) -> bool:
    """Whether a file is JSON that says it is a scene; only its two ends are read, where a schema stands."""
    if path.suffix.lower() != ".json" or not path.is_file():
        return False
    with path.open("rb") as file:
        ends = file.read(_END)
        file.seek(max(path.stat().st_size - _END, 0))
        return f'"{SCHEMA.rpartition("/")[0]}/'.encode() in ends + file.read(_END)


def _arrays(scene: RecordedScene) -> dict[str, Any]:
    arrays: dict[str, Any] = {
        "fps": scene.fps,
        "source": scene.source,
        "up": np.zeros(0) if scene.up is None else scene.up,
        "hands": np.array([motion.side for motion in scene.hands], str),
        "objects": np.array([found.name for found in scene.objects], str),
    }
    for motion in scene.hands:
        fields = [*LAYOUT, *OFFSETS, "source"]
        values = {field: getattr(motion, field) for field in fields if field != "fps"}
        arrays |= {f"{motion.side}_{field}": value for field, value in values.items() if value is not None}
        if motion.warnings:
            arrays[f"{motion.side}_warnings"] = np.array(motion.warnings)
    for k, found in enumerate(scene.objects):
        values = {field: getattr(found, field) for field in ("kind", *_POSES)}
        if found.kind == "mesh":
            values |= {field: getattr(found, field) for field in _MESH}
        if found.hinge is not None:
            values |= {name: getattr(found.hinge, name.removeprefix("hinge_")) for name in (*_HINGE, "hinge_parent")}
        arrays |= {f"object_{k}_{field}": value for field, value in values.items()}
    return arrays


def _hand(path: Path, arrays: Arrays, side: str, fps: float) -> Motion:
    own = _own(arrays, f"{side}_")
    layout = {field: shape for field, shape in LAYOUT.items() if field != "fps"}
    n = numbers(f"{path}: {side} hand", own, layout)
    offsets = {field: (rows, 3) for field, rows in OFFSETS.items() if field in own}
    n |= numbers(f"{path}: {side} hand", own, offsets)
    return Motion(
        fps=fps,
        side=side,
        source=text(path, own, "source") if "source" in own else "",
        warnings=texts(path, own, "warnings", needed=False),
        **{field: value.astype(bool if field == "valid" else float) for field, value in n.items()},
    )


def _object(path: Path, arrays: Arrays, k: int, name: str) -> RecordedObject:
    own, where = _own(arrays, f"object_{k}_"), f"{path}: object {name!r}"
    kind = text(where, own, "kind")
    meshed, hinged = kind == "mesh", "hinge_angle" in own
    n = numbers(where, own, _POSES | (_MESH if meshed else {}) | (_HINGE if hinged else {}))
    n = {field: value.astype({"seen": bool, "faces": int}.get(field, float)) for field, value in n.items()}
    hinge = None
    if hinged:
        hinge = Hinge(parent=text(where, own, "hinge_parent"), **{f.removeprefix("hinge_"): n[f] for f in _HINGE})
    return RecordedObject(
        name=name,
        kind=kind,
        vertices=n["vertices"] if meshed else np.zeros((0, 3)),
        faces=n["faces"] if meshed else np.zeros((0, 3), int),
        hinge=hinge,
        **{field: n[field] for field in _POSES},
    )


def _own(arrays: Arrays, prefix: str) -> dict[str, Any]:
    return {name[len(prefix) :]: arrays[name] for name in arrays if name.startswith(prefix)}


def _json_arrays(path: Path) -> dict[str, Any]:
    found = read_json(path)
    if not isinstance(found, dict) or found.get("schema") != SCHEMA:
        raise InputError(f"{path}: not a scene; its 'schema' must be {SCHEMA!r}")
    try:
        return {name: _shaped(name, np.asarray(value)) for name, value in found.items() if name != "schema"}
    except ValueError:  # rows of different lengths
        raise InputError(f"{path}: an array has rows of different lengths; write it again") from None


def _shaped(name: str, value: np.ndarray) -> np.ndarray:
    """An empty list has lost how long its rows are."""
    return value.reshape(0, 3) if value.size == 0 and name.endswith(("_vertices", "_faces")) else value
