"""The pictures of docs/hand.md: rigid links beside blended skin, and where they part.

`python docs/figures/hand.py` writes hand.png and hand_error.png beside this file.
"""

from pathlib import Path

import jax.numpy as jnp
import mujoco
import numpy as np
from PIL import Image

import mjx_hand
from mjx_hand.rigid.postures import postures
from mjx_hand.rigid.rigid_hand import forward_kinematics
from mjx_hand.rigid.skin_error import posed_skins
from mjx_hand.view.figures.skin_figure import skin_error_figure
from mjx_hand.view.video.renderer import open_renderer

POSTURES = ("fist", "pinch", "spread")
VIEWS = ((0.15, -1.0, -0.1), (-0.1, -0.25, -1.0))  # looking along: at the back of the hand, and from the thumb's side
SIZE = 300
SKIN, BACKDROP = (0.86, 0.66, 0.55, 1.0), (0.96, 0.96, 0.97)

Mesh = tuple[np.ndarray, np.ndarray]


def picture(meshes: list[Mesh]) -> np.ndarray:
    """The meshes (m, hand frame) from each view, side by side."""
    spec = mujoco.MjSpec()
    spec.visual.global_.offwidth = spec.visual.global_.offheight = SIZE
    spec.visual.quality.offsamples = 8
    spec.visual.headlight.ambient, spec.visual.headlight.diffuse = [0.35] * 3, [0.45] * 3
    spec.visual.headlight.specular = [0.05] * 3
    spec.add_texture(
        type=mujoco.mjtTexture.mjTEXTURE_SKYBOX,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_FLAT,
        rgb1=BACKDROP,
        rgb2=BACKDROP,
        width=8,
        height=8,
    )
    spec.worldbody.add_light(pos=[0.3, 0.5, 0.5], dir=[-0.3, -0.5, -0.5], diffuse=[0.35] * 3, castshadow=False)
    for k, (vertices, faces) in enumerate(meshes):
        mesh = spec.add_mesh(name=str(k))
        mesh.uservert, mesh.userface = vertices.ravel(), faces.ravel()
        spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname=str(k), rgba=SKIN)
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    everything = np.concatenate([vertices for vertices, _ in meshes])
    shots = []
    with open_renderer(model, SIZE, SIZE) as renderer:
        for way in VIEWS:
            ahead = np.array(way) / np.linalg.norm(way)
            camera = mujoco.MjvCamera()
            camera.lookat[:] = (everything.min(axis=0) + everything.max(axis=0)) / 2
            camera.distance = 0.28
            camera.azimuth = np.rad2deg(np.arctan2(ahead[1], ahead[0]))
            camera.elevation = np.rad2deg(np.arcsin(ahead[2]))
            renderer.update_scene(data, camera)
            shots.append(renderer.render().copy())
    return np.concatenate(shots, axis=1)


def main() -> None:
    """Write both pictures."""
    hand = mjx_hand.load_hand()
    rigid = mjx_hand.build_rigid_hand(hand)
    named = postures(np.asarray(rigid.hinge_lower), np.asarray(rigid.hinge_upper))
    segments, skins, errors = [], [], []
    for name in POSTURES:
        hard, soft = posed_skins(hand, [], rigid, named[name])
        turn, position = (np.asarray(found[0], float) for found in forward_kinematics(jnp.float32(named[name]), rigid))
        place = position + rigid.wrist_position
        links = zip(rigid.mesh_vertices, rigid.mesh_faces, turn, place, strict=True)
        segments.append([(vertices @ r.T + p, faces) for vertices, faces, r, p in links])
        skins.append((soft[0], np.asarray(hand.faces)))
        errors.append(np.linalg.norm(hard - soft, axis=-1)[0])
    folder = Path(__file__).parent
    rows = [np.concatenate([picture(m) for m in some], axis=1) for some in (segments, [[skin] for skin in skins])]
    Image.fromarray(np.concatenate(rows)).quantize(160).save(folder / "hand.png", optimize=True)
    skin_error_figure(POSTURES, segments, skins, errors).savefig(folder / "hand_error.png", dpi=80)


if __name__ == "__main__":
    main()
