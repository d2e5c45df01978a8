"""Light and backdrop for pictures of any scene: a key light with soft shadows, a fill light, an even background."""

import copy

import mujoco
import numpy as np
from jaxtyping import Float

BACKDROP = (0.90, 0.91, 0.93)
SKIN = (0.86, 0.66, 0.55, 1.0)
COLLISION_GROUP = 3  # as `rigid.export.mjcf` has it
HIDDEN_GROUP = 5
_ARROW, _ARROW_WIDTH = (0.10, 0.35, 0.90, 1.0), 0.003  # m


def studio_model(model: mujoco.MjModel, width: int, height: int) -> mujoco.MjModel:
    """A copy of the model whose looks suit pictures of this size: an endless floor that fades into the backdrop."""
    shown = copy.deepcopy(model)
    shown.vis.global_.offwidth, shown.vis.global_.offheight = width, height
    shown.vis.quality.offsamples = 4
    shown.vis.quality.shadowsize = 2048
    shown.stat.extent = 1.0  # so that the lengths below are metres
    shown.vis.map.znear, shown.vis.map.zfar = 0.02, 12.0
    shown.vis.map.fogstart, shown.vis.map.fogend = 0.5, 2.2
    shown.vis.map.shadowclip = 0.4  # half the width that shadows cover: small, so that their edges are fine
    shown.vis.rgba.fog[:3] = BACKDROP
    shown.vis.headlight.ambient[:] = 0.28
    shown.vis.headlight.diffuse[:] = 0.22
    shown.vis.headlight.specular[:] = 0.0
    _draw_links_once(shown)
    planes = shown.geom_type == mujoco.mjtGeom.mjGEOM_PLANE
    shown.geom_size[planes, :2] = 0.0  # endless
    return shown


def _draw_links_once(model: mujoco.MjModel) -> None:
    """Hide the collision shapes of bodies that have meshes; those of the others, in skin colour, are all there is."""
    meshes = (model.geom_type == mujoco.mjtGeom.mjGEOM_MESH) & (model.geom_group != COLLISION_GROUP)
    for shape in np.flatnonzero(model.geom_group == COLLISION_GROUP):
        if (meshes & (model.geom_bodyid == model.geom_bodyid[shape])).any():
            model.geom_group[shape] = HIDDEN_GROUP
        else:
            model.geom_rgba[shape] = SKIN


def light_scene(scene: mujoco.MjvScene, camera: mujoco.MjvCamera) -> None:
    """Add the lights, which stand still relative to the camera, and the backdrop to a scene that is ready to draw."""
    scene.flags[mujoco.mjtRndFlag.mjRND_FOG] = 1
    scene.flags[mujoco.mjtRndFlag.mjRND_SHADOW] = 1
    look = np.array(camera.lookat)
    azimuth = np.deg2rad(camera.azimuth)
    ahead = np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
    left = np.array([-ahead[1], ahead[0], 0.0])
    up = np.array([0.0, 0.0, 1.0])
    _add_light(scene, look, -0.5 * ahead + 0.55 * left + 1.0 * up, (0.62, 0.60, 0.57), shadow=True)
    _add_light(scene, look, -0.3 * ahead - 0.9 * left + 0.4 * up, (0.20, 0.22, 0.26), shadow=False)
    _add_backdrop(scene, look + 4.0 * ahead, ahead, left, up)


def add_arrows(scene: mujoco.MjvScene, arrows: Float[np.ndarray, "n 2 3"]) -> None:
    """Add arrows from their first to their second points (m, world) to a scene; those with NaN are left out."""
    for start, end in arrows[np.isfinite(arrows).all(axis=(1, 2))]:
        geom = scene.geoms[scene.ngeom]
        kind = mujoco.mjtGeom.mjGEOM_ARROW
        mujoco.mjv_initGeom(geom, kind, np.zeros(3), np.zeros(3), np.eye(3).ravel(), np.array(_ARROW))
        mujoco.mjv_connector(geom, kind, _ARROW_WIDTH, start, 2 * end - start)  # it is drawn half as long as asked for
        geom.category = mujoco.mjtCatBit.mjCAT_DECOR
        scene.ngeom += 1


def _add_light(
    scene: mujoco.MjvScene, look: np.ndarray, way: np.ndarray, colour: tuple[float, float, float], *, shadow: bool
) -> None:
    light = scene.lights[scene.nlight]
    scene.nlight += 1
    light.type = mujoco.mjtLightType.mjLIGHT_DIRECTIONAL
    light.headlight = 0
    light.pos[:] = look + way
    light.dir[:] = -way / np.linalg.norm(way)
    light.ambient[:] = 0.0
    light.diffuse[:] = colour
    light.specular[:] = 0.15 if shadow else 0.0
    light.castshadow = shadow
    light.attenuation[:] = (1.0, 0.0, 0.0)
    light.bulbradius = 0.02
    light.range = 10.0
    light.intensity = 0.0
    light.texid = -1


def _add_backdrop(
    scene: mujoco.MjvScene, centre: np.ndarray, ahead: np.ndarray, left: np.ndarray, up: np.ndarray
) -> None:
    geom = scene.geoms[scene.ngeom]
    frame = np.stack([ahead, left, up], axis=1)
    mujoco.mjv_initGeom(
        geom, mujoco.mjtGeom.mjGEOM_BOX, np.array([0.01, 12.0, 12.0]), centre, frame.ravel(), np.array([*BACKDROP, 1.0])
    )
    geom.emission = 1.0
    geom.category = mujoco.mjtCatBit.mjCAT_DECOR
    scene.ngeom += 1
