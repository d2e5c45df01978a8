"""Robot descriptions on disk: a folder that appears whole or not at all, and its OBJ meshes."""

import contextlib
import os
from collections.abc import Iterator
from pathlib import Path

import mujoco
import numpy as np
from jaxtyping import Float, Int

from mjx_hand.errors import InputError
from mjx_hand.files.npz_archive import followed
from mjx_hand.files.working_folder import working_folder
from mjx_hand.hand.joints import LINKS
from mjx_hand.rigid.export.hulls import convex_hulls, hull_name
from mjx_hand.rigid.rigid_hand import RigidHand

MESHES = "meshes"  # the subfolder that descriptions refer to by relative paths


@contextlib.contextmanager
def filling(folder: str | Path) -> Iterator[Path]:
    """Yield a temporary folder beside `folder`; on success its files move there, on failure they go.

    Files that `folder` already has under other names stay, so that a URDF and an MJCF can share it.

    Raises:
        InputError: the folder cannot be made or written.
    """
    folder = followed(Path(folder))
    try:
        if folder.exists() and not folder.is_dir():
            raise InputError(f"{folder}: is a file; choose a folder")
        with working_folder(folder) as temporary:
            yield temporary
            umask = os.umask(0)
            os.umask(umask)
            temporary.chmod(0o777 & ~umask)  # mkdtemp makes private folders; give it the mode that mkdir() would
            if not folder.exists():
                temporary.rename(folder)
                return
            # Deepest first: a description is the last to appear, after the meshes that it names.
            for path in sorted((p for p in temporary.rglob("*") if p.is_file()), key=lambda p: -len(p.parts)):
                target = folder / path.relative_to(temporary)
                target.parent.mkdir(parents=True, exist_ok=True)
                path.replace(target)
    except OSError as error:
        raise InputError(f"cannot write {folder}: {error.strerror}; choose a folder that you may write to") from None


def write_meshes(rigid: RigidHand, folder: Path, collision: str) -> None:
    """Write each link's surface as `meshes/<link>.obj` (m, link frame), and its hull where `collision` is "hulls"."""
    (folder / MESHES).mkdir()
    for link, vertices, faces in zip(LINKS, rigid.mesh_vertices, rigid.mesh_faces, strict=True):
        write_obj(folder / MESHES / f"{link}.obj", vertices, faces)
    if collision == "hulls":
        for link, (vertices, faces) in zip(LINKS, convex_hulls(rigid), strict=True):
            write_obj(folder / MESHES / f"{hull_name(link)}.obj", vertices, faces)


def write_surfaces(spec: mujoco.MjSpec, folder: Path) -> list[str]:
    """Write the spec's meshes as `meshes/NAME.obj`, where it looks for them from then on; their paths in the folder.

    Hulls, which are points without faces, stay in the spec.
    """
    surfaces = [mesh for mesh in spec.meshes if len(mesh.userface)]
    if surfaces:
        (folder / MESHES).mkdir(exist_ok=True)
        spec.meshdir, spec.modelfiledir = MESHES, str(folder)
    for mesh in surfaces:
        mesh.file = f"{mesh.name.replace('/', '_')}.obj"
        vertices, faces = np.array(mesh.uservert).reshape(-1, 3), np.array(mesh.userface).reshape(-1, 3)
        write_obj(folder / MESHES / mesh.file, vertices, faces)
        mesh.uservert, mesh.userface = [], []
    return [f"{MESHES}/{mesh.file}" for mesh in surfaces]


def write_obj(path: Path, vertices: Float[np.ndarray, "n 3"], faces: Int[np.ndarray, "f 3"]) -> None:
    """Triangles that share their corners, so that a closed surface stays closed."""
    lines = [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in vertices.tolist()]  # all digits of single precision
    lines += [f"f {a} {b} {c}" for a, b, c in (faces + 1).tolist()]
    path.write_text("\n".join(lines) + "\n")


def file_stem(rigid: RigidHand) -> str:
    """The description's file name without its suffix, "right_hand" or "left_hand"."""
    return f"{rigid.side}_hand"
