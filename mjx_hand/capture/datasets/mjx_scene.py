"""The project's own scene files, `.npz` and JSON (`mjx_hand.motion.scene_file`)."""

from pathlib import Path

from mjx_hand.capture.datasets.dataset_format import Contents, DatasetFormat, Request
from mjx_hand.capture.datasets.mano_motion import chosen_side
from mjx_hand.motion import Motion, RecordedScene, load_scene_file
from mjx_hand.motion.scene_file import SCHEMA, is_scene_json
from mjx_hand.pytree import replace


def _recognises(path: Path, contents: Contents) -> bool:
    return str(contents.get("schema", "")) == SCHEMA or is_scene_json(path)


def _read(path: Path, contents: Contents, request: Request) -> Motion:
    scene = load_scene_file(path)
    return scene.hand(chosen_side(path, [motion.side for motion in scene.hands], request))


def _read_scene(path: Path, contents: Contents, request: Request) -> RecordedScene:
    scene = load_scene_file(path)
    return scene if request.side is None else replace(scene, hands=(scene.hand(request.side),))


FORMAT = DatasetFormat(
    name=f"mjx-hand scene (.npz or .json, schema {SCHEMA})",
    recognises=_recognises,
    read=_read,
    read_scene=_read_scene,
)
