"""An MJCF as the links and joints that a URDF would have (https://mujoco.readthedocs.io/en/stable/XMLreference.html).

MuJoCo reads and compiles it, so that includes, defaults and every format of mesh work. The root link is the world. A
body is a link, its origin at its last joint. So is a site, fixed to its body, and the end of each body that carries no
other, `BODY_tip`: its point that is farthest from its joint; either may stand for a finger tip. A joint's zero is the
posture that the file is drawn in. Joint equalities are mimic joints; tendons are left out, the joints that they pull
move one by one.
"""

import dataclasses
from pathlib import Path

import mujoco
import numpy as np
import trimesh
import yourdfpy
from jaxtyping import Float
from scipy.spatial.transform import Rotation
from yourdfpy.urdf import Box, Collision, Cylinder, Geometry, Inertial, Joint, Limit, Link, Mesh, Mimic, Sphere, Visual

from mjx_hand.errors import InputError
from mjx_hand.files.safe_yaml import shown

_HINGE, _SLIDE, _FREE = (int(getattr(mujoco.mjtJoint, f"mjJNT_{kind}")) for kind in ("HINGE", "SLIDE", "FREE"))
_GEOM = mujoco.mjtGeom
_NO_SHAPE = [int(kind) for kind in (_GEOM.mjGEOM_PLANE, _GEOM.mjGEOM_HFIELD, _GEOM.mjGEOM_SDF)]  # a room's
WORLD = "world"


@dataclasses.dataclass(eq=False)
class ReadMesh(Mesh):
    """A mesh that is read already, or a shape that a URDF has no word for.

    Attributes:
        surface: in the geometry's frame (m).
        kind, size: as of `robots.model.shapes.Shape`.
    """

    surface: trimesh.Trimesh = dataclasses.field(default_factory=trimesh.Trimesh)
    kind: str = "mesh"
    size: tuple[float, ...] = ()


def read_mjcf(path: Path) -> yourdfpy.Robot:
    """The robots in an MJCF, on one root link, `world`; objects, tables and markers on no joint of theirs are left out.

    Raises:
        InputError: MuJoCo cannot read it, a mesh is not there, a ball joint, a slide without a range, or no joints.
    """
    try:
        model = mujoco.MjModel.from_xml_path(str(path))
    except ValueError as error:
        lines = [line.strip() for line in str(error).splitlines() if line.strip()]
        raise InputError(f"{path}: not an MJCF that MuJoCo can read ({' '.join(lines)[:160] or 'no reason'})") from None
    return _Reading(path, model).robot()


class _Reading:
    """One compiled model on its way to links and joints."""

    def __init__(self, path: Path, model: mujoco.MjModel):
        self.path, self.model = path, model
        self.bodies = [model.body(k).name or f"body{k}" for k in range(model.nbody)]
        self.bodies[0] = WORLD
        self.joints = [model.joint(k).name or f"joint{k}" for k in range(model.njnt)]
        self.origins = np.zeros((model.nbody, 3))  # of links in their bodies' frames: where their last joint is
        self.efforts = self._efforts()
        self.mimics = self._mimics()

    def robot(self) -> yourdfpy.Robot:
        model = self.model
        links, joints = [Link(WORLD)], []
        for body in range(1, model.nbody):
            if self._moves_by_itself(body):
                above = self._add_joints(body, links, joints)
                links.append(self._link(body))
                joints.append(above)
        if len(links) == 1:
            raise InputError(f"{self.path}: no body has a hinge or a slide; give the MJCF of a hand whose fingers move")
        taken = {link.name for link in links}
        sites = enumerate(model.site_bodyid)
        carrying = set(model.body_parentid[1:].tolist())
        marks = [(model.site(k).name, int(body), model.site_pos[k] - self.origins[body]) for k, body in sites]
        ends = [body for body in range(1, model.nbody) if body not in carrying]
        marks += [(f"{self.bodies[body]}_tip", body, end) for body in ends if (end := self._end(body)) is not None]
        for name, body, position in marks:
            if name and name not in taken and self.bodies[body] in taken:
                taken.add(name)
                links.append(Link(name))
                parent = self.bodies[body]
                joints.append(Joint(f"{name} on {parent}", "fixed", parent, name, _place(position)))
        return yourdfpy.Robot(self.path.stem, links, joints)

    def _end(self, body: int) -> Float[np.ndarray, "3"] | None:
        """The point of a body's shapes that is farthest from its joint (m, its link's frame)."""
        link, corners = self._link(body), []
        for shape in link.collisions or link.visuals:
            place = np.asarray(shape.origin)
            corners.append(_corners(shape.geometry) @ place[:3, :3].T + place[:3, 3])
        if not corners:
            return None
        points = np.concatenate(corners)
        return points[np.argmax(np.linalg.norm(points, axis=1))]

    def _moves_by_itself(self, body: int) -> bool:
        """Whether a body is of a robot: what it hangs on in the world has a hinge or a slide anywhere."""
        root = self.model.body_rootid[body]
        types = self.model.jnt_type[self.model.body_rootid[self.model.jnt_bodyid] == root]
        return bool(np.isin(types, (_HINGE, _SLIDE)).any())

    def _add_joints(self, body: int, links: list[Link], joints: list[Joint]) -> Joint:
        """The joint right above a body; those above that one, with links between them, are added."""
        model, name = self.model, self.bodies[body]
        parent = self.bodies[model.body_parentid[body]]
        place = _place(model.body_pos[body], model.body_quat[body])
        place = _place(-self.origins[model.body_parentid[body]]) @ place
        first = model.body_jntadr[body]
        own = [k for k in range(first, first + model.body_jntnum[body]) if model.jnt_type[k] != _FREE]
        if not own:
            return Joint(f"{name} on {parent}", "fixed", parent, name, place)
        for joint in own[:-1]:
            made = self._joint(joint, parent, f"{name} {self.joints[joint]}", place @ _place(model.jnt_pos[joint]))
            joints.append(made)
            links.append(Link(made.child))
            parent, place = made.child, _place(-model.jnt_pos[joint])
        self.origins[body] = model.jnt_pos[own[-1]]
        return self._joint(own[-1], parent, name, place @ _place(self.origins[body]))

    def _joint(self, joint: int, parent: str, child: str, place: Float[np.ndarray, "4 4"]) -> Joint:
        model, name = self.model, self.joints[joint]
        slides, limited = model.jnt_type[joint] == _SLIDE, bool(model.jnt_limited[joint])
        if model.jnt_type[joint] not in (_HINGE, _SLIDE):
            raise InputError(f"{self.path}: {shown(name)} is a ball joint; valid: hinge, slide")
        if slides and not limited:
            raise InputError(f"{self.path}: joint {shown(name)} slides without a range; add range=...")
        low, high = model.jnt_range[joint] - model.qpos0[model.jnt_qposadr[joint]]
        limit = Limit(effort=self.efforts.get(joint), lower=float(low), upper=float(high)) if limited else None
        kind = "prismatic" if slides else "revolute" if limited else "continuous"
        axis = model.jnt_axis[joint].copy()
        return Joint(name, kind, parent, child, place, axis, limit=limit, mimic=self.mimics.get(joint))

    def _link(self, body: int) -> Link:
        model = self.model
        first, to_link = model.body_geomadr[body], _place(-self.origins[body])
        visuals, collisions = [], []
        for geom in range(first, first + model.body_geomnum[body]):
            geometry = self._geometry(geom)
            if geometry is None:
                continue
            place, name = to_link @ _place(model.geom_pos[geom], model.geom_quat[geom]), f"geom{geom}"
            if model.geom_contype[geom] or model.geom_conaffinity[geom]:
                collisions.append(Collision(name, place, geometry))
            else:
                visuals.append(Visual(name, place, geometry))
        centre = to_link @ _place(model.body_ipos[body], model.body_iquat[body])
        inertial = Inertial(centre, float(model.body_mass[body]), np.diag(model.body_inertia[body]))
        return Link(self.bodies[body], inertial, visuals, collisions)

    def _geometry(self, geom: int) -> Geometry | None:
        model, kind = self.model, self.model.geom_type[geom]
        size = model.geom_size[geom]
        radius, half = float(size[0]), float(size[1])
        if kind in _NO_SHAPE:
            return None
        if kind == _GEOM.mjGEOM_BOX:
            return Geometry(box=Box(2 * size))
        if kind == _GEOM.mjGEOM_CYLINDER:
            return Geometry(cylinder=Cylinder(radius, 2 * half))
        if kind == _GEOM.mjGEOM_SPHERE:
            return Geometry(sphere=Sphere(radius))
        name = f"geom {geom} of {self.bodies[model.geom_bodyid[geom]]}"
        if kind == _GEOM.mjGEOM_CAPSULE:
            made = trimesh.creation.capsule(height=2 * half, radius=radius)
            made.apply_translation(-made.bounds.mean(axis=0))
            return Geometry(mesh=ReadMesh(name, surface=made, kind="capsule", size=(radius, half)))
        if kind == _GEOM.mjGEOM_ELLIPSOID:
            made = trimesh.creation.icosphere(3)
            return Geometry(mesh=ReadMesh(name, surface=trimesh.Trimesh(made.vertices * size, made.faces)))
        mesh = model.geom_dataid[geom]
        vertex, face = model.mesh_vertadr[mesh], model.mesh_faceadr[mesh]
        vertices = model.mesh_vert[vertex : vertex + model.mesh_vertnum[mesh]].astype(float)
        faces = model.mesh_face[face : face + model.mesh_facenum[mesh]].astype(int)
        return Geometry(mesh=ReadMesh(name, surface=trimesh.Trimesh(vertices, faces, process=False)))

    def _efforts(self) -> dict[int, float]:
        """The largest force or torque of the joints of which the file says one."""
        model = self.model
        found: dict[int, float] = {}
        for joint in np.flatnonzero(model.jnt_actfrclimited):
            found[int(joint)] = float(np.abs(model.jnt_actfrcrange[joint]).max())
        for actuator in range(model.nu):
            if model.actuator_trntype[actuator] == mujoco.mjtTrn.mjTRN_JOINT and model.actuator_forcelimited[actuator]:
                joint = int(model.actuator_trnid[actuator, 0])
                most = float(np.abs(model.actuator_forcerange[actuator]).max() * abs(model.actuator_gear[actuator, 0]))
                found[joint] = min(most, found.get(joint, np.inf))
        return found

    def _mimics(self) -> dict[int, Mimic]:
        """Joints that an equality ties to another: by a line, as far as a polynomial's first two terms go.

        Raises:
            InputError: a curve.
        """
        model = self.model
        found: dict[int, Mimic] = {}
        for tie in np.flatnonzero((model.eq_type == mujoco.mjtEq.mjEQ_JOINT) & (model.eq_active0 > 0)):
            led, leader, law = int(model.eq_obj1id[tie]), int(model.eq_obj2id[tie]), model.eq_data[tie]
            if leader < 0:
                continue
            if law[2:5].any():
                raise InputError(
                    f"{self.path}: the equality of joints {shown(self.joints[led])} and {shown(self.joints[leader])} "
                    "is a curve; valid: polycoef of two numbers, an offset and a slope"
                )
            found[led] = Mimic(self.joints[leader], float(law[1]), float(law[0]))
        return found


def _corners(geometry: Geometry | None) -> Float[np.ndarray, "n 3"]:
    """Corners of a shape's surface (m, its frame)."""
    if geometry is None:
        return np.zeros((0, 3))
    if isinstance(geometry.mesh, ReadMesh):
        made = geometry.mesh.surface
    elif geometry.box is not None:
        made = trimesh.creation.box(geometry.box.size)
    elif geometry.cylinder is not None:
        made = trimesh.creation.cylinder(geometry.cylinder.radius, geometry.cylinder.length)
    else:
        assert geometry.sphere is not None
        made = trimesh.creation.icosphere(3, geometry.sphere.radius)
    return np.asarray(made.vertices, float)


def _place(position: Float[np.ndarray, "3"], quaternion: Float[np.ndarray, "4"] | None = None) -> np.ndarray:
    place = np.eye(4)
    if quaternion is not None:
        place[:3, :3] = Rotation.from_quat(quaternion, scalar_first=True).as_matrix()
    place[:3, 3] = position
    return place
