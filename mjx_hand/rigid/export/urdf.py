"""A rigid hand as URDF (https://wiki.ros.org/urdf/XML): links, revolute joints, meshes, capsules built from primitives.

URDF joints turn about one axis, so each base joint becomes two with a small link between them; and URDF has no capsule,
so each becomes a cylinder and two spheres. `wrist` is the root link, or the last of six joints from `base`.
"""

import xml.etree.ElementTree as ET
from collections.abc import Iterable
from pathlib import Path

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from mjx_hand.hand.joints import FINGERS, HINGE_LINKS, HINGES, LINKS, PARENTS, TIP_LINKS, WRIST_SLIDES, WRIST_TURNS
from mjx_hand.rigid.export.hulls import check_collision, hull_name
from mjx_hand.rigid.export.mesh_folder import MESHES, file_stem, filling, write_meshes
from mjx_hand.rigid.export.mjcf import WRIST_REACH
from mjx_hand.rigid.gains import Gains
from mjx_hand.rigid.rigid_hand import RigidHand, axes_in_links

# Links that carry no flesh. Without mass most simulators are singular, and PyBullet assumes a kilogram.
_SMALL_MASS = 1e-5  # kg
_SMALL_INERTIA = 1e-9 * np.eye(3)  # kg m^2
_WRIST_FORCE, _WRIST_TORQUE, _WRIST_SPEED = 200.0, 20.0, 2.0  # N, N m, m/s: what the limits of the wrist's joints state
# At soft limits (https://wiki.ros.org/pr2_controller_manager/safety_limits): the speed allowed per radian from the
# limit (1/s), and how far below the allowed speed (rad/s) the full force may act.
_SOFT_SLOPE, _SOFT_SPEED = 100.0, 1.0


def write_urdf(
    rigid: RigidHand,
    folder: str | Path,
    *,
    wrist_joints: bool = False,
    gains: Gains | None = None,
    collision: str = "capsules",
) -> Path:
    """Write `<side>_hand.urdf` and `meshes/*.obj`, with paths relative to the folder; returns the URDF's path.

    Links are named as `hand.joints.LINKS`, joints as `HINGES`; finger tips are links `<finger>_tip` on fixed joints.
    `<limit>` has the hard limits, `<safety_controller>` the soft ones. The folder appears whole or not at all.

    Args:
        rigid: the hand.
        folder: made if absent; other files in it stay.
        wrist_joints: put the joints wrist_x, wrist_y, wrist_z (prismatic), wrist_roll, wrist_pitch and wrist_yaw
            between a root link `base` and the wrist.
        gains: force limits and speeds for `<limit>`; the default `Gains()`.
        collision: "capsules" (each a cylinder and two spheres), or "hulls" (`meshes/<link>_hull.obj`).

    Raises:
        InputError: an unknown collision shape, or a folder that cannot be written.
    """
    check_collision(collision)
    robot = urdf_tree(rigid, wrist_joints=wrist_joints, gains=Gains() if gains is None else gains, collision=collision)
    ET.indent(robot)
    name = f"{file_stem(rigid)}.urdf"
    with filling(folder) as temporary:
        write_meshes(rigid, temporary, collision)
        ET.ElementTree(robot).write(temporary / name, encoding="utf-8", xml_declaration=True)
    return Path(folder) / name


def urdf_tree(rigid: RigidHand, *, wrist_joints: bool, gains: Gains, collision: str) -> ET.Element:
    """The `<robot>` element; meshes are named, not written."""
    robot = ET.Element("robot", name=file_stem(rigid))
    # For MuJoCo alone; others skip it. Its own default drops folders from mesh paths, and the meshes with them.
    extension = ET.SubElement(robot, "mujoco")
    ET.SubElement(extension, "compiler", strippath="false", discardvisual="false", fusestatic="false")
    if wrist_joints:
        _add_wrist_joints(robot)
    for link, name in enumerate(LINKS):
        _add_link(robot, rigid, link, name, collision)
    hinges_of = {link: [h for h, moved in enumerate(HINGE_LINKS) if moved == link] for link in range(1, len(LINKS))}
    axes = axes_in_links(rigid)
    for link, hinges in hinges_of.items():
        parent, offset = LINKS[PARENTS[link]], np.asarray(rigid.link_offset[link])
        for hinge in hinges[:-1]:
            between = f"{HINGES[hinge]}_link"
            _add_small_link(robot, between)
            joint = _add_joint(robot, HINGES[hinge], "revolute", parent, between, offset, rigid.hinge_axis[hinge])
            _limit_hinge(joint, rigid, hinge, gains)
            parent, offset = between, np.zeros(3)
        # The link's own frame begins at its last hinge, and with it the rest rotation.
        last = hinges[-1]
        rest = rigid.rest_rotation
        rpy = (0.0, 0.0, 0.0) if rest is None else Rotation.from_matrix(rest[link - 1]).as_euler("xyz")
        joint = _add_joint(robot, HINGES[last], "revolute", parent, LINKS[link], offset, axes[last], rpy)
        _limit_hinge(joint, rigid, last, gains)
    for finger, link, tip in zip(FINGERS, TIP_LINKS, rigid.tip_offset, strict=True):
        _add_small_link(robot, f"{finger}_tip")
        _add_joint(robot, f"{finger}_tip_fixed", "fixed", LINKS[link], f"{finger}_tip", tip)
    return robot


def _add_link(robot: ET.Element, rigid: RigidHand, link: int, name: str, collision: str) -> None:
    element = ET.SubElement(robot, "link", name=name)
    inertia = np.asarray(rigid.link_inertia[link])
    _add_inertial(element, float(rigid.link_mass[link]), np.asarray(rigid.link_com[link]), inertia)
    visual = ET.SubElement(element, "visual")
    ET.SubElement(ET.SubElement(visual, "geometry"), "mesh", filename=f"{MESHES}/{name}.obj")
    skin = ET.SubElement(visual, "material", name="skin")
    ET.SubElement(skin, "color", rgba="0.86 0.66 0.55 1")
    if collision == "hulls":
        hull = ET.SubElement(ET.SubElement(element, "collision"), "geometry")
        ET.SubElement(hull, "mesh", filename=f"{MESHES}/{hull_name(name)}.obj")
        return
    for k, owner in enumerate(rigid.capsule_links):
        if owner == link:
            _add_capsule(element, np.asarray(rigid.capsule_ends[k]), float(rigid.capsule_radius[k]))


def _add_capsule(link: ET.Element, ends: Float[np.ndarray, "2 3"], radius: float) -> None:
    along = ends[1] - ends[0]
    length = float(np.linalg.norm(along))
    x, y, z = along / length
    turn = (0.0, np.arccos(np.clip(z, -1, 1)), np.arctan2(y, x))  # takes +z, the cylinder's axis, to the bone
    shapes: list[tuple[np.ndarray, tuple[float, float, float], str, dict[str, float]]] = [
        (ends.mean(axis=0), turn, "cylinder", {"radius": radius, "length": length}),
        (ends[0], (0.0, 0.0, 0.0), "sphere", {"radius": radius}),
        (ends[1], (0.0, 0.0, 0.0), "sphere", {"radius": radius}),
    ]
    for position, rpy, kind, sizes in shapes:
        collision = ET.SubElement(link, "collision")
        ET.SubElement(collision, "origin", xyz=_text(position), rpy=_text(rpy))
        geometry = ET.SubElement(collision, "geometry")
        ET.SubElement(geometry, kind, {key: _text([value]) for key, value in sizes.items()})


def _add_inertial(link: ET.Element, mass: float, com: Iterable[float], inertia: Float[np.ndarray, "3 3"]) -> None:
    inertial = ET.SubElement(link, "inertial")
    ET.SubElement(inertial, "origin", xyz=_text(com), rpy="0 0 0")
    ET.SubElement(inertial, "mass", value=_text([mass]))
    entries = {f"i{a}{b}": inertia["xyz".index(a), "xyz".index(b)] for a, b in ("xx", "xy", "xz", "yy", "yz", "zz")}
    ET.SubElement(inertial, "inertia", {key: _text([value]) for key, value in entries.items()})


def _add_small_link(robot: ET.Element, name: str) -> None:
    _add_inertial(ET.SubElement(robot, "link", name=name), _SMALL_MASS, np.zeros(3), _SMALL_INERTIA)


def _limit_hinge(joint: ET.Element, rigid: RigidHand, hinge: int, gains: Gains) -> None:
    force = float(gains.force_limit[hinge])
    _add_limit(joint, [float(rigid.hinge_lower[hinge]), float(rigid.hinge_upper[hinge]), force, gains.max_velocity])
    if rigid.soft_lower is None or rigid.soft_upper is None:
        return
    values = {
        "soft_lower_limit": float(rigid.soft_lower[hinge]),
        "soft_upper_limit": float(rigid.soft_upper[hinge]),
        "k_position": _SOFT_SLOPE,
        "k_velocity": force / _SOFT_SPEED,
    }
    ET.SubElement(joint, "safety_controller", {name: _text([value]) for name, value in values.items()})


def _add_wrist_joints(robot: ET.Element) -> None:
    _add_small_link(robot, "base")
    names = (*WRIST_SLIDES, *WRIST_TURNS)
    parent = "base"
    for k, (name, axis) in enumerate(zip(names, np.tile(np.eye(3), (2, 1)), strict=True)):
        slide = name in WRIST_SLIDES
        child = "wrist" if k == len(names) - 1 else f"{name}_link"
        if child != "wrist":
            _add_small_link(robot, child)
        joint = _add_joint(robot, name, "prismatic" if slide else "revolute", parent, child, np.zeros(3), axis)
        reach = WRIST_REACH if slide else np.pi
        force, speed = (_WRIST_FORCE, _WRIST_SPEED) if slide else (_WRIST_TORQUE, 2 * np.pi)
        _add_limit(joint, [-reach, reach, force, speed])
        parent = child


def _add_joint(
    robot: ET.Element,
    name: str,
    kind: str,
    parent: str,
    child: str,
    offset: Iterable[float],
    axis: Iterable[float] | None = None,
    rpy: Iterable[float] = (0.0, 0.0, 0.0),
) -> ET.Element:
    joint = ET.SubElement(robot, "joint", name=name, type=kind)
    ET.SubElement(joint, "origin", xyz=_text(offset), rpy=_text(rpy))
    ET.SubElement(joint, "parent", link=parent)
    ET.SubElement(joint, "child", link=child)
    if axis is not None:
        ET.SubElement(joint, "axis", xyz=_text(axis))
    return joint


def _add_limit(joint: ET.Element, values: list[float]) -> None:
    names = ("lower", "upper", "effort", "velocity")
    ET.SubElement(joint, "limit", {name: _text([value]) for name, value in zip(names, values, strict=True)})


def _text(values: Iterable[float]) -> str:
    # Nine digits: positions to a nanometre, and unit axes stay unit to more than float32.
    return " ".join(f"{float(value):.9g}" for value in values)
