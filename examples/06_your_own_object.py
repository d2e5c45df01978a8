"""An object of your own: from a mesh to convex pieces, to a scene with the hand, stepped in MuJoCo.

    python examples/06_your_own_object.py

A mesh from a file: `trimesh.load_mesh("mug.obj")`, in metres.
"""

from pathlib import Path

import mujoco
import numpy as np
import trimesh
from PIL import Image

import mjx_hand
from envs.scene import scene_spec
from mjx_hand.objects.convex_decomposition import convex_pieces
from mjx_hand.objects.description import ObjectDescription
from mjx_hand.view.video.camera import Camera
from mjx_hand.view.video.renderer import RendererUnavailable
from mjx_hand.view.video.video import render_frames

OUT = Path("outputs/examples/own_object.png")


def cup() -> trimesh.Trimesh:
    """A cup without a handle, 8 cm high, its frame in the middle."""
    wall = trimesh.creation.annulus(r_min=0.03, r_max=0.036, height=0.08, sections=24)
    bottom = trimesh.creation.cylinder(radius=0.036, height=0.006, sections=24)
    bottom.apply_translation([0.0, 0.0, -0.037])
    return trimesh.boolean.union([wall, bottom], engine="manifold")


def main() -> None:
    """Drop the cup beside the hand and see it come to rest."""
    mesh = cup()
    hulls = convex_pieces(mesh.vertices, mesh.faces, concavity=0.1)  # (pieces, corners, 3), m
    print(f"{len(mesh.faces)} triangles became {len(hulls)} convex pieces")
    size = np.abs(mesh.vertices).max(axis=0)
    description = ObjectDescription(size=size, mass=0.2, friction=0.8, hulls=hulls, kind="mesh")

    rigid = mjx_hand.build_rigid_hand(mjx_hand.load_hand())
    model = scene_spec(rigid, description, np.zeros((0, 3)), np.zeros((0, 3)), np.eye(3), visual=True).compile()
    data = mujoco.MjData(model)
    data.qpos[:3] = data.ctrl[:3] = [0.10, 0.12, 0.12]  # the wrist's slides, m
    data.qpos[-7:] = [0.0, 0.0, size[2] + 0.05, 1.0, 0.0, 0.0, 0.0]  # the cup 5 cm above the table, upright
    mujoco.mj_step(model, data, nstep=round(1.5 / model.opt.timestep))
    bottom, tilt = 1e3 * (data.qpos[-5] - size[2]), np.rad2deg(2 * np.arccos(min(abs(data.qpos[-4]), 1.0)))
    print(f"after 1.5 s the cup's bottom is {bottom:.1f} mm above the table, {tilt:.1f} degrees tilted")

    OUT.parent.mkdir(parents=True, exist_ok=True)
    try:
        (picture,) = render_frames(model, data.qpos[None], Camera(distance=0.6))
    except RendererUnavailable as error:
        print(f"no picture: {error}")
        return
    Image.fromarray(picture).save(OUT)
    print(f"{OUT}: the scene at rest")


if __name__ == "__main__":
    main()
