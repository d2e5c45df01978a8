"""A rigid hand as a MuJoCo model, in memory (`MjSpec`) or on disk (MJCF and meshes)."""

from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from mjx_hand.errors import InputError
from mjx_hand.hand.joints import FINGERS, HINGE_LINKS, HINGES, LINKS, PARENTS, TIP_LINKS, WRIST_SLIDES, WRIST_TURNS
from mjx_hand.rigid.export.hulls import check_collision, convex_hulls, hull_name
from mjx_hand.rigid.export.mesh_folder import MESHES, file_stem, filling, write_meshes
from mjx_hand.rigid.gains import Gains
from mjx_hand.rigid.rigid_hand import RigidHand, axes_in_links

BASES = ("fixed", "free", "actuated")
VISUAL_GROUP, COLLISION_GROUP = 2, 3

_SKIN = (0.86, 0.66, 0.55, 1.0)
_COLLIDES: dict[str, Any] = {
    "group": COLLISION_GROUP,
    "contype": 1,
    "conaffinity": 0,
    "mass": 0,
    "rgba": (0.3, 0.5, 0.8, 0.5),
}
WRIST_REACH = 2.0  # metres that the wrist's slides may travel each way


def hand_spec(
    rigid: RigidHand,
    *,
    base: str = "fixed",
    prefix: str = "",
    visual: bool = True,
    gains: Gains | None = None,
    collision: str = "capsules",
) -> mujoco.MjSpec:
    """The hand as a MuJoCo spec: bodies named as `LINKS`, joints and position actuators as `HINGES`.

    The wrist body's origin is the wrist joint and its axes are the hand frame's. Joints, actuators and so qpos and ctrl
    run in the same order: the wrist's six where it is actuated, then `HINGES`. Collision shapes (group 3) have
    contype 1 and conaffinity 0: they meet MuJoCo's default geoms but not each other. Sites `<finger>_tip` mark the
    finger tips, with a framepos sensor each of the same name.

    Args:
        rigid: the hand.
        base: "fixed" to the world; "free" (a free joint `wrist`); or "actuated": slides wrist_x, wrist_y, wrist_z
            in the parent's frame, then hinges wrist_roll, wrist_pitch, wrist_yaw, R = Rx Ry Rz, each with an actuator.
        prefix: put before every name.
        visual: add the links' meshes (group 2, no contacts).
        gains: position gains and force limits; the default `Gains()`.
        collision: "capsules", or "hulls", the links' convex hulls.

    Raises:
        InputError: an unknown base or collision shape, or gains of another hand.
    """
    check_collision(collision)
    if base not in BASES:
        raise InputError(f"base is {base!r}; valid: {', '.join(BASES)}")
    gains = Gains() if gains is None else gains
    gains.check_for(HINGES)
    spec = mujoco.MjSpec()
    spec.modelname = f"{prefix}{file_stem(rigid)}"
    spec.compiler.degree = False
    spec.compiler.autolimits = True
    bodies = []
    for link, name in enumerate(LINKS):
        parent = spec.worldbody if link == 0 else bodies[PARENTS[link]]
        bodies.append(_add_link(parent, rigid, link, prefix + name))
    if visual:
        _add_meshes(spec, bodies, rigid, prefix)
    if collision == "hulls":
        _add_hulls(spec, bodies, rigid, prefix)
    else:
        _add_capsules(bodies, rigid, prefix)
    _add_wrist_joints(spec, bodies[0], base, prefix, gains)
    _add_hinges(spec, bodies, rigid, prefix, gains)
    for finger, link, tip in zip(FINGERS, TIP_LINKS, rigid.tip_offset, strict=True):
        name = f"{prefix}{finger}_tip"
        bodies[link].add_site(name=name, pos=tip, size=[0.002, 0, 0], group=VISUAL_GROUP)
        spec.add_sensor(
            name=name, type=mujoco.mjtSensor.mjSENS_FRAMEPOS, objtype=mujoco.mjtObj.mjOBJ_SITE, objname=name
        )
    return spec


def write_mjcf(
    rigid: RigidHand,
    folder: str | Path,
    *,
    base: str = "fixed",
    prefix: str = "",
    gains: Gains | None = None,
    collision: str = "capsules",
) -> Path:
    """Write `<side>_hand.xml` and `meshes/*.obj`, with paths relative to the folder; returns the XML's path.

    A joint's `range` is its hard limits. MuJoCo has no soft limits of its own, so they stand in the joint's `user`
    data, which no engine acts on: `model.joint(name).user`, lower and upper.

    Args as of `hand_spec`. The folder appears whole or not at all.

    Raises:
        InputError: an unknown base or collision shape, or a folder that cannot be written.
    """
    spec = hand_spec(rigid, base=base, prefix=prefix, visual=True, gains=gains, collision=collision)
    name = f"{file_stem(rigid)}.xml"
    with filling(folder) as temporary:
        write_meshes(rigid, temporary, collision)
        spec.meshdir = MESHES
        spec.modelfiledir = str(temporary)
        for mesh in spec.meshes:
            mesh.file = f"{mesh.name.removeprefix(prefix)}.obj"
            mesh.uservert, mesh.userface = [], []
        if rigid.soft_lower is not None and rigid.soft_upper is not None:
            for joint, *limits in zip(HINGES, rigid.soft_lower, rigid.soft_upper, strict=True):
                spec.joint(prefix + joint).userdata = limits
        spec.compile()
        (temporary / name).write_text(spec.to_xml())
    return Path(folder) / name


def _add_link(parent: mujoco.MjsBody, rigid: RigidHand, link: int, name: str) -> mujoco.MjsBody:
    body = parent.add_body(name=name, pos=rigid.link_offset[link])
    if link and rigid.rest_rotation is not None:
        body.quat = Rotation.from_matrix(rigid.rest_rotation[link - 1]).as_quat(scalar_first=True)
    inertia = np.asarray(rigid.link_inertia[link])
    body.mass = float(rigid.link_mass[link])
    body.ipos = np.asarray(rigid.link_com[link])
    body.fullinertia = [*np.diag(inertia), inertia[0, 1], inertia[0, 2], inertia[1, 2]]
    body.explicitinertial = True
    return body


def _add_meshes(spec: mujoco.MjSpec, bodies: list[mujoco.MjsBody], rigid: RigidHand, prefix: str) -> None:
    spec.add_material(name=f"{prefix}skin", rgba=_SKIN)
    for name, body, vertices, faces in zip(LINKS, bodies, rigid.mesh_vertices, rigid.mesh_faces, strict=True):
        mesh = spec.add_mesh(name=prefix + name)
        mesh.uservert, mesh.userface = np.asarray(vertices).ravel(), np.asarray(faces).ravel()
        body.add_geom(
            name=f"{prefix}{name}_visual",
            type=mujoco.mjtGeom.mjGEOM_MESH,
            meshname=prefix + name,
            material=f"{prefix}skin",
            group=VISUAL_GROUP,
            contype=0,
            conaffinity=0,
            mass=0,
        )


def _add_capsules(bodies: list[mujoco.MjsBody], rigid: RigidHand, prefix: str) -> None:
    for name, link, ends, radius in zip(
        capsule_names(rigid), rigid.capsule_links, rigid.capsule_ends, rigid.capsule_radius, strict=True
    ):
        bodies[link].add_geom(
            name=prefix + name,
            type=mujoco.mjtGeom.mjGEOM_CAPSULE,
            fromto=np.asarray(ends).ravel(),
            size=[float(radius), 0, 0],
            **_COLLIDES,
        )


def _add_hulls(spec: mujoco.MjSpec, bodies: list[mujoco.MjsBody], rigid: RigidHand, prefix: str) -> None:
    for link, body, (vertices, faces) in zip(LINKS, bodies, convex_hulls(rigid), strict=True):
        name = prefix + hull_name(link)
        mesh = spec.add_mesh(name=name)
        mesh.uservert, mesh.userface = vertices.ravel(), faces.ravel()
        body.add_geom(name=name, type=mujoco.mjtGeom.mjGEOM_MESH, meshname=name, **_COLLIDES)


def capsule_names(rigid: RigidHand) -> list[str]:
    """A name a capsule: its link's, with a number where the link has several."""
    links = rigid.capsule_links
    return [
        f"{LINKS[link]}_capsule" + (f"{links[:k].count(link)}" if links.count(link) > 1 else "")
        for k, link in enumerate(links)
    ]


def _add_wrist_joints(spec: mujoco.MjSpec, wrist: mujoco.MjsBody, base: str, prefix: str, gains: Gains) -> None:
    if base == "free":
        wrist.add_freejoint(name=f"{prefix}wrist")
    if base != "actuated":
        return
    kinds = [(WRIST_SLIDES, mujoco.mjtJoint.mjJNT_SLIDE, gains.wrist_slide, WRIST_REACH, 0.0)]
    kinds += [(WRIST_TURNS, mujoco.mjtJoint.mjJNT_HINGE, gains.wrist_turn, np.pi, gains.wrist_armature)]
    for names, kind, (kp, kv), reach, armature in kinds:
        for name, axis in zip(names, np.eye(3), strict=True):
            wrist.add_joint(name=prefix + name, type=kind, axis=axis, range=[-reach, reach], armature=armature)
            _add_actuator(spec, prefix + name, kp, kv)


def _add_hinges(spec: mujoco.MjSpec, bodies: list[mujoco.MjsBody], rigid: RigidHand, prefix: str, gains: Gains) -> None:
    # Two joints of one body turn as R = R(first) R(second): abduction comes first in HINGES, as RigidHand wants it.
    axes = axes_in_links(rigid)
    for k, (name, link) in enumerate(zip(HINGES, HINGE_LINKS, strict=True)):
        bodies[link].add_joint(
            name=prefix + name,
            type=mujoco.mjtJoint.mjJNT_HINGE,
            axis=axes[k],
            range=[rigid.hinge_lower[k], rigid.hinge_upper[k]],
            armature=gains.armature,
        )
        _add_actuator(spec, prefix + name, gains.stiffness[k], gains.damping[k], gains.force_limit[k])


def _add_actuator(spec: mujoco.MjSpec, joint: str, kp: float, kv: float, limit: float | None = None) -> None:
    actuator = spec.add_actuator(name=joint, target=joint, trntype=mujoco.mjtTrn.mjTRN_JOINT)
    actuator.set_to_position(kp=kp, kv=kv)
    actuator.inheritrange = 1.0  # targets stay within the joint's own range
    if limit is not None:
        actuator.forcerange = [-limit, limit]
