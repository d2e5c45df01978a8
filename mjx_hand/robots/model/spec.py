"""A robot hand as a MuJoCo spec: on a wrist with the axes of a person's hand, with actuators, tips and ties."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import mujoco
import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from mjx_hand.errors import InputError
from mjx_hand.hand.joints import WRIST_SLIDES, WRIST_TURNS
from mjx_hand.rigid.export.mjcf import COLLISION_GROUP, VISUAL_GROUP, WRIST_REACH
from mjx_hand.rigid.gains import Gains
from mjx_hand.robots.model.inertias import Inertia, inertia_of
from mjx_hand.robots.model.links import HandLinks, Link
from mjx_hand.robots.model.shapes import COLLISIONS, Shape, bones, capsule, hull, is_there, shapes_of

WRIST = "wrist"
ABSENT = ("refuse", "bones")
_TAKEN = (WRIST, "world", "object", "table")  # names that scenes have
_TIE = (
    [0.01, 1.0],
    [0.95, 0.99, 0.001, 0.5, 2.0],
)  # solref, solimp of tied joints: stiff, and no more than steps allow
_TYPES = {
    "box": mujoco.mjtGeom.mjGEOM_BOX,
    "cylinder": mujoco.mjtGeom.mjGEOM_CYLINDER,
    "sphere": mujoco.mjtGeom.mjGEOM_SPHERE,
    "capsule": mujoco.mjtGeom.mjGEOM_CAPSULE,
}
_HULL_CORNERS = 40  # of what touches; the hulls of printed parts have hundreds
_SEEN, _TOUCHES = (0.35, 0.37, 0.4, 1.0), (0.3, 0.5, 0.8, 0.5)


@dataclass(frozen=True)
class ModelLink:
    """A link with all that a model needs of it.

    Attributes:
        link: the URDF's.
        body: what its body is called.
        inertia: None of one that has none.
        visual: what is seen.
        touching: what touches.
    """

    link: Link
    body: str
    inertia: Inertia | None
    visual: tuple[Shape, ...]
    touching: tuple[Shape, ...]


@dataclass(frozen=True)
class RobotModel:
    """A robot hand, ready to be made a spec.

    Attributes:
        name: of the model.
        links: parents first.
        mount: wrist_from_root, 4 x 4 (m).
        tips: link of each finger's tip, by finger.
        notes: what of the URDF was left out, one line each.
    """

    name: str
    links: tuple[ModelLink, ...]
    mount: Float[np.ndarray, "4 4"]
    tips: Mapping[str, str]
    notes: tuple[str, ...] = ()

    def bodies(self) -> dict[str, str]:
        """What the body of each link is called."""
        return {each.link.name: each.body for each in self.links}


def model_links(hand: HandLinks, collision: str, absent: str = "refuse") -> tuple[ModelLink, ...]:
    """The links with their shapes and inertias.

    Args:
        hand: the links.
        collision: "hulls" for a URDF's own collision shapes, meshes by their convex hulls, or "capsules" in the place
            of each of these; what a link has none of is taken from what is seen of it. A mesh that is only seen may
            be absent.
        absent: "refuse" a URDF whose touching meshes are not there, or leave them out: a link that then has no
            shape gets "bones", capsules to the links that it carries.

    Raises:
        InputError: an unknown collision or way with absent meshes, or as `shapes_of`.
    """
    if absent not in ABSENT:
        raise InputError(f"absent meshes is {absent!r}; valid: {', '.join(ABSENT)}")
    if collision not in COLLISIONS:
        raise InputError(f"collision is {collision!r}; valid: {', '.join(COLLISIONS)}")
    made = []
    for link in hand.links:
        given = link.source.collisions or link.source.visuals
        if absent == "bones":
            given = [each for each in given if is_there(hand.path, each)]
        solid = shapes_of(hand.path, link.name, given)
        if not solid and absent == "bones":
            solid = bones([below.place[:3, 3] for below in hand.links if below.parent == link.name])
        seen = [each for each in link.source.visuals if is_there(hand.path, each)]
        visual = shapes_of(hand.path, link.name, seen)
        solid = tuple(hull(each) for each in solid)
        touching = tuple(map(capsule, solid)) if collision == "capsules" else solid
        inertia = inertia_of(link.source, solid, moves=link.hinge is not None or not link.parent)
        body = f"{link.name}_link" if link.name in _TAKEN else link.name
        made.append(ModelLink(link, body, inertia, visual or solid, touching))
    return tuple(made)


def geom_name(body: str, number: int) -> str:
    """What a link's touching shape is called."""
    return f"{body}_collision{number}"


def bare_spec(robot: RobotModel, armature: float, wrist_armature: float, visual: bool) -> mujoco.MjSpec:
    """The hand on its wrist, without actuators."""
    spec = mujoco.MjSpec()
    spec.modelname = robot.name
    spec.compiler.degree = False
    spec.compiler.autolimits = True
    wrist = spec.worldbody.add_body(name=WRIST)
    for names, kind, reach, extra in (
        (WRIST_SLIDES, mujoco.mjtJoint.mjJNT_SLIDE, WRIST_REACH, 0.0),
        (WRIST_TURNS, mujoco.mjtJoint.mjJNT_HINGE, np.pi, wrist_armature),
    ):
        for name, axis in zip(names, np.eye(3), strict=True):
            wrist.add_joint(name=name, type=kind, axis=axis, range=[-reach, reach], armature=extra)
    bodies: dict[str, mujoco.MjsBody] = {"": wrist}
    for each in robot.links:
        place = each.link.place if each.link.parent else robot.mount @ each.link.place
        body = bodies[each.link.parent].add_body(name=each.body, pos=place[:3, 3], quat=_quaternion(place))
        bodies[each.link.name] = body
        _add_inertia(body, each.inertia)
        _add_joint(body, each.link, armature)
        for number, shape in enumerate(each.touching):
            geom = _add_shape(spec, body, shape, geom_name(each.body, number), _HULL_CORNERS)
            geom.group, geom.contype, geom.conaffinity, geom.rgba = COLLISION_GROUP, 1, 0, _TOUCHES
        for number, shape in enumerate(each.visual if visual else ()):
            geom = _add_shape(spec, body, shape, f"{each.body}_visual{number}", None)
            geom.group, geom.contype, geom.conaffinity, geom.rgba = VISUAL_GROUP, 0, 0, _SEEN
    for finger, link in robot.tips.items():
        bodies[link].add_site(name=f"{finger}_tip", size=[0.002, 0, 0], group=VISUAL_GROUP)
        spec.add_sensor(
            name=f"{finger}_tip",
            type=mujoco.mjtSensor.mjSENS_FRAMEPOS,
            objtype=mujoco.mjtObj.mjOBJ_SITE,
            objname=f"{finger}_tip",
        )
    for each in robot.links:
        if each.link.hinge is not None and each.link.hinge.mimic is not None:
            _tie(spec, each.link.hinge.name, *each.link.hinge.mimic)
    for one, other in _neighbours(robot.links):
        spec.add_exclude(bodyname1=one, bodyname2=other)
    return spec


def add_actuators(spec: mujoco.MjSpec, joints: Sequence[str], gains: Gains) -> None:
    """Position actuators: the wrist's six, then those of these joints."""
    for names, (kp, kv) in ((WRIST_SLIDES, gains.wrist_slide), (WRIST_TURNS, gains.wrist_turn)):
        for name in names:
            _actuator(spec, name, kp, kv, None)
    gains.check_for(joints)
    for name, kp, kv, limit in zip(joints, gains.stiffness, gains.damping, gains.force_limit, strict=True):
        _actuator(spec, name, float(kp), float(kv), float(limit))


def _actuator(spec: mujoco.MjSpec, joint: str, kp: float, kv: float, limit: float | None) -> None:
    actuator = spec.add_actuator(name=joint, target=joint, trntype=mujoco.mjtTrn.mjTRN_JOINT)
    actuator.set_to_position(kp=kp, kv=kv)
    actuator.inheritrange = 1.0  # targets stay within the joint's own range
    if limit is not None:
        actuator.forcerange = [-limit, limit]


def _add_inertia(body: mujoco.MjsBody, inertia: Inertia | None) -> None:
    body.explicitinertial = True  # shapes weigh nothing
    if inertia is None:
        return
    tensor = inertia.tensor
    body.mass, body.ipos = inertia.mass, inertia.centre
    body.fullinertia = [*np.diag(tensor), tensor[0, 1], tensor[0, 2], tensor[1, 2]]


def _add_joint(body: mujoco.MjsBody, link: Link, armature: float) -> None:
    if link.hinge is None:
        return
    kind = mujoco.mjtJoint.mjJNT_SLIDE if link.hinge.slides else mujoco.mjtJoint.mjJNT_HINGE
    joint = body.add_joint(name=link.hinge.name, type=kind, axis=link.hinge.axis, armature=armature)
    if link.hinge.mimic is None:  # what is tied stays within its own limits where its leader does
        joint.range = link.hinge.limits


def _add_shape(
    spec: mujoco.MjSpec, body: mujoco.MjsBody, shape: Shape, name: str, corners: int | None
) -> mujoco.MjsGeom:
    if shape.kind != "mesh":
        size = [*shape.size, 0.0, 0.0][:3]
        place = shape.place
        return body.add_geom(
            name=name, type=_TYPES[shape.kind], size=size, pos=place[:3, 3], quat=_quaternion(place), mass=0.0
        )
    mesh = spec.add_mesh(name=name)
    mesh.uservert = shape.vertices.ravel()
    mesh.userface = shape.faces.ravel()
    mesh.inertia = mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL  # of no weight; surfaces need not be closed
    if corners is not None:
        mesh.maxhullvert = corners
    return body.add_geom(name=name, type=mujoco.mjtGeom.mjGEOM_MESH, meshname=name, mass=0.0)


def _tie(spec: mujoco.MjSpec, joint: str, leader: str, slope: float, shift: float) -> None:
    """A mimic joint's law as an equality."""
    tie = spec.add_equality(type=mujoco.mjtEq.mjEQ_JOINT, objtype=mujoco.mjtObj.mjOBJ_JOINT, name1=joint, name2=leader)
    tie.data[:5] = [shift, slope, 0.0, 0.0, 0.0]
    tie.solref, tie.solimp = _TIE


def _neighbours(links: Sequence[ModelLink]) -> list[tuple[str, str]]:
    """Bodies that a joint joins, also over links that are fixed: these may overlap."""
    by_name = {each.link.name: each for each in links}
    group: dict[str, str] = {}
    for each in links:
        fixed = each.link.hinge is None and each.link.parent
        group[each.link.name] = group[each.link.parent] if fixed else each.link.name
    pairs = []
    for a in links:
        for b in links:
            if a.body >= b.body or not a.touching or not b.touching:
                continue
            one, other = group[a.link.name], group[b.link.name]
            above = (by_name[one].link.parent, by_name[other].link.parent)
            joined = [group.get(parent) for parent in above]
            if one == other or joined[0] == other or joined[1] == one:
                pairs.append((a.body, b.body))
    return pairs


def _quaternion(place: Float[np.ndarray, "4 4"]) -> Float[np.ndarray, "4"]:
    return Rotation.from_matrix(place[:3, :3]).as_quat(scalar_first=True)
