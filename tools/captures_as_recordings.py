"""A set's simulated captures as what people record: scene files or GRAB's layout, each object a mesh.

    python -m tools.captures_as_recordings SET FOLDER [scene|grab]

writes each capture of the training part of a set (a folder that `python -m envs.demonstrations` made) into FOLDER, as
a scene's file or as GRAB ships its recordings. `config=recording data.recording.path=FOLDER` then goes the whole road
from there; what it reaches stands beside what the set itself does (docs/results.md). GRAB's recordings do not say how
long the subject's bones are without the licensed hand: those are read with mean ones.
"""

import sys
from pathlib import Path

import numpy as np
import trimesh
from scipy.spatial.transform import Rotation

from envs.demonstrations.load_set import load_part
from envs.demonstrations.observation.solids import Solid, solid_of
from mjx_hand.errors import InputError
from mjx_hand.hand.load import load_hand
from mjx_hand.motion.demonstration import Demonstration
from mjx_hand.motion.make_scene import make_scene, recorded_object
from mjx_hand.motion.motion import Motion, load_motion_file
from mjx_hand.motion.scene_file import save_scene

_MESHES = "tools/object_meshes/contact_meshes"  # below GRAB's root


def write_scene(name: str, motion: Motion, demonstration: Demonstration, folder: Path) -> Path:
    """Write `NAME.npz`, a scene of the fitted motion, the object's poses and its mesh."""
    solid = _solid(demonstration)
    found = recorded_object(demonstration.grasp, demonstration.object_pose, mesh=(solid.vertices, solid.faces))
    path = folder / f"{name}.npz"
    save_scene(make_scene(motion, found, up="+z", source=name), path)
    return path


def write_grab(name: str, motion: Motion, demonstration: Demonstration, folder: Path) -> Path:
    """Write `grab/simulated/NAME.npz` and the object's mesh, in GRAB's layout (`mjx_hand.capture.datasets.grab`)."""
    solid = _solid(demonstration)
    mesh = folder / _MESHES / f"{name}.ply"
    mesh.parent.mkdir(parents=True, exist_ok=True)
    trimesh.Trimesh(solid.vertices, solid.faces, process=False).export(mesh)
    hand = load_hand(side=motion.side)
    wrist = hand.joint_regressor[0] @ hand.template  # of the mean hand, which the translation leaves where it is
    turns = Rotation.from_quat(motion.wrist_quaternion, scalar_first=True)
    fingers = Rotation.from_matrix(motion.rotations.reshape(-1, 3, 3)).as_rotvec().reshape(-1, 45)
    side = motion.side[0]
    given = {"global_orient": turns.as_rotvec(), "fullpose": fingers, "transl": motion.wrist_position - wrist}
    pose = demonstration.object_pose
    placed = {
        "global_orient": Rotation.from_quat(pose[:, 3:], scalar_first=True).inv().as_rotvec(),
        "transl": pose[:, :3],
    }
    told: dict = {
        f"{side}hand": {"params": given, "vtemp": f"tools/subject_meshes/{name}_{side}hand.ply"},
        "object": {"params": placed, "object_mesh": f"{_MESHES}/{mesh.name}"},
    }
    path = folder / "grab" / "simulated" / f"{name}.npz"
    path.parent.mkdir(parents=True, exist_ok=True)
    arrays = {key: np.array(value, dtype=object) for key, value in told.items()}
    np.savez(path, framerate=motion.fps, obj_name=demonstration.grasp, **arrays)  # type: ignore[arg-type]
    return path


LAYOUTS = {"scene": write_scene, "grab": write_grab}


def _solid(demonstration: Demonstration) -> Solid:
    described = demonstration.object
    shape = recorded_object("object", demonstration.object_pose, kind=described.kind, size=described.size)
    return solid_of(shape, demonstration.source)


def main(arguments: list[str]) -> None:
    """Write all captures of the set.

    Raises:
        InputError: it is no set of a scripted grasp type.
    """
    if len(arguments) not in (2, 3) or (arguments[2:] and arguments[2] not in LAYOUTS):
        raise SystemExit("usage: python -m tools.captures_as_recordings SET FOLDER [scene|grab]")
    made, folder = Path(arguments[0]), Path(arguments[1])
    layout = arguments[2] if arguments[2:] else "scene"
    demonstrations = load_part(made, "train")
    for k, demonstration in enumerate(demonstrations):
        file = made / "train" / f"{k:03d}.motion.npz"
        if not file.is_file():
            raise InputError(f"{file}: absent; give a set of a scripted grasp type, which keeps what capture fitted")
        folder.mkdir(parents=True, exist_ok=True)
        LAYOUTS[layout](f"{k:03d}", load_motion_file(file), demonstration, folder)
    print(f"{folder}: {len(demonstrations)} recordings, {layout}")


if __name__ == "__main__":
    try:
        main(sys.argv[1:])
    except InputError as error:
        sys.exit(f"error: {error}")
