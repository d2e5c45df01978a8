"""The twin's scene: a hand on an actuated wrist, an object, boxes that hold it up, and a table."""

from collections.abc import Sequence

import mujoco
import numpy as np
from jaxtyping import Float
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from envs.hand_contacts import SOLREF, meet_as_ground, meet_as_hand, meet_as_object, meet_itself, meet_nobody
from mjx_hand.bodies.body import NUM_WRIST as NUM_WRIST
from mjx_hand.bodies.body import Body
from mjx_hand.bodies.human_body import body_of
from mjx_hand.errors import InputError
from mjx_hand.motion.demonstration import Demonstration
from mjx_hand.objects.description import OBJECT_KINDS, ObjectDescription
from mjx_hand.player.contact_force import add_contact_sensors
from mjx_hand.rigid.gains import Gains
from mjx_hand.rigid.rigid_hand import RigidHand

TIMESTEP = 0.004  # s; 10 ms loses every grasp, 6.7 ms a third of them
OBJECT, SUPPORT, TABLE, SPARE = "object", "support", "table", "spare"
# Of the hand with the object, and again of the object with the ground: the deepest contacts, the nearest pairs. A fist
# around a handle has 13 of each, the other types fewer.
MJX_CAPS = {"max_contact_points": 16, "max_geom_pairs": 16}

_GEOM = {
    "box": mujoco.mjtGeom.mjGEOM_BOX,
    "sphere": mujoco.mjtGeom.mjGEOM_SPHERE,
    "cylinder": mujoco.mjtGeom.mjGEOM_CYLINDER,
    "capsule": mujoco.mjtGeom.mjGEOM_CAPSULE,
}


def scene_spec(
    hand: RigidHand | Body,
    description: ObjectDescription,
    support: Float[np.ndarray, "b 3"],
    support_position: Float[np.ndarray, "b 3"],
    base_rotation: Float[np.ndarray, "3 3"],
    *,
    gains: Gains | None = None,
    visual: bool = False,
    spare: int = 0,
    assisted: bool = False,
    contacts: str = "object",
    forces: bool = False,
) -> mujoco.MjSpec:
    """The scene. Compiled, its qpos is the wrist's 3 slides (m) and 3 turns (rad), the hand's
    joints, the object's free joint.

    Args:
        hand: a person's, or any body.
        description: of the object.
        support, support_position: half extents and centres (m, world) of the boxes that hold the object up, if it does
            not stand on the table.
        base_rotation: world_from_base; the wrist's slides run along the base's axes and its turns start from it, so
            that they stay far from the Euler angles' singularity for a demonstration that starts near it.
        gains: of the hand's joints; its own if None.
        visual: with the hand's meshes, for pictures; without them the model is small and quick.
        spare: how many boxes to add that touch nothing.
        assisted: with six motors on the object, after the hand's actuators: a force (N, world axes) and a torque (N m,
            the object's axes).
        contacts: what the hand meets: the object alone, or also table and support ("ground"), its own links ("self"),
            or "all".
        forces: with sensors of what each link does to the object, which MJX has not of its own (`envs.physics.mjx`).
    """
    if description.kind not in OBJECT_KINDS:
        raise InputError(f"object kind {description.kind!r} is not known; valid: {', '.join(OBJECT_KINDS)}")
    spec = body_of(hand).spec(gains, visual)
    spec.option.timestep = TIMESTEP
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_EULERDAMP
    wrist = spec.body("wrist")
    wrist.quat = Rotation.from_matrix(base_rotation).as_quat(scalar_first=True)
    for body in spec.bodies[1:]:
        body.gravcomp = 1.0  # the arm that is not modelled carries the hand
    for geom in spec.geoms:
        if geom.contype:
            meet_as_hand(geom, contacts)
            _contact(geom, description.friction, condim=4)  # torsion too: a pad is an area, not a point
    meet_itself(spec, contacts, coarse=body_of(hand).rigid is None)
    _add_ground(spec, support, support_position, description.friction, contacts)
    for k in range(spare):
        box = spec.worldbody.add_geom(name=f"{SPARE}{k}", type=_GEOM["box"], size=[0.001] * 3, pos=[0.0, 0.0, -0.1])
        meet_nobody(box)
    body = spec.worldbody.add_body(name=OBJECT)
    body.add_freejoint(name=OBJECT)
    for k, gear in enumerate(np.eye(6) if assisted else ()):
        motor = spec.add_actuator(name=f"{OBJECT}_motor{k}", target=OBJECT, trntype=mujoco.mjtTrn.mjTRN_JOINT)
        motor.gear = gear
    for geom in _object_geoms(spec, body, description):
        geom.rgba = (0.9, 0.35, 0.2, 1.0)
        meet_as_object(geom)
        _contact(geom, description.friction)
    add_contact_sensors(spec, body_of(hand).touching_links if forces else (), OBJECT)
    # MJX alone reads these: it works every possible contact out, and is a tenth as quick without a cap.
    for name, most in MJX_CAPS.items():
        spec.add_numeric(name=name, data=[most])
    return spec


def _object_geoms(spec: mujoco.MjSpec, body: mujoco.MjsBody, description: ObjectDescription) -> list[mujoco.MjsGeom]:
    """The object's geoms with their masses: one, or one a convex piece of a mesh."""
    if description.kind != "mesh":
        return [body.add_geom(name=OBJECT, type=_GEOM[description.kind], size=description.size, mass=description.mass)]
    volumes = np.array([ConvexHull(hull).volume for hull in description.hulls])
    geoms = []
    for k, (hull, share) in enumerate(zip(description.hulls, volumes / volumes.sum(), strict=True)):
        name = f"{OBJECT}{k}"
        spec.add_mesh(name=name).uservert = np.unique(hull, axis=0).ravel()
        mass = description.mass * share
        geoms.append(body.add_geom(name=name, type=mujoco.mjtGeom.mjGEOM_MESH, meshname=name, mass=mass))
    return geoms


def _contact(geom: mujoco.MjsGeom, friction: float, condim: int = 3) -> None:
    geom.condim = condim
    geom.friction = [friction, 0.005, 0.0001]
    geom.solref = SOLREF


def _add_ground(
    spec: mujoco.MjSpec,
    support: Float[np.ndarray, "b 3"],
    position: Float[np.ndarray, "b 3"],
    friction: float,
    contacts: str,
) -> None:
    table = spec.worldbody.add_geom(
        name=TABLE, type=mujoco.mjtGeom.mjGEOM_PLANE, size=[1.0, 1.0, 0.01], rgba=(0.82, 0.82, 0.8, 1.0)
    )
    boxes = [
        spec.worldbody.add_geom(
            name=f"{SUPPORT}{k}", type=mujoco.mjtGeom.mjGEOM_BOX, size=half, pos=centre, rgba=(0.5, 0.55, 0.6, 1.0)
        )
        for k, (half, centre) in enumerate(zip(support, position, strict=True))
    ]
    for geom in (table, *boxes):
        meet_as_ground(geom, contacts)
        _contact(geom, friction)


def base_rotation(demonstration: Demonstration) -> Float[np.ndarray, "3 3"]:
    """world_from_base of a demonstration's scene: where the wrist's orientation starts."""
    first = int(np.argmax(demonstration.motion.valid))
    return Rotation.from_quat(demonstration.motion.wrist_quaternion[first], scalar_first=True).as_matrix()


def demonstration_spec(
    demonstration: Demonstration,
    hand: RigidHand | Body,
    *,
    gains: Gains | None = None,
    visual: bool = False,
    spare: int = 0,
    assisted: bool = False,
    contacts: str = "object",
    forces: bool = False,
) -> mujoco.MjSpec:
    """The scene that a demonstration takes place in; arguments as of `scene_spec`."""
    return scene_spec(
        hand,
        demonstration.object,
        demonstration.support,
        demonstration.support_position,
        base_rotation(demonstration),
        gains=gains,
        visual=visual,
        spare=spare,
        assisted=assisted,
        contacts=contacts,
        forces=forces,
    )


def spare_boxes(demonstrations: Sequence[Demonstration]) -> list[int]:
    """How many boxes each scene of a set lacks to have as many as the one with most."""
    most = max(len(d.support) for d in demonstrations)
    return [most - len(d.support) for d in demonstrations]


def demonstration_models(
    demonstrations: Sequence[Demonstration],
    hands: Sequence[RigidHand | Body],
    *,
    gains: Gains | None = None,
    assisted: bool = False,
    contacts: str = "object",
) -> list[mujoco.MjModel]:
    """The scenes of demonstrations that run side by side, each on its own hand, with sensors of its forces.

    An engine's models have equally many geoms: scenes whose supports have fewer boxes than others get spare ones, which
    touch nothing.
    """
    chosen = {"gains": gains, "assisted": assisted, "contacts": contacts, "forces": True}
    return [
        demonstration_spec(d, hand, spare=spare, **chosen).compile()
        for d, hand, spare in zip(demonstrations, hands, spare_boxes(demonstrations), strict=True)
    ]


def wrist_coordinates(
    position: Float[np.ndarray, "t 3"], quaternion: Float[np.ndarray, "t 4"], base: Float[np.ndarray, "3 3"]
) -> Float[np.ndarray, "t 6"]:
    """The wrist's slides (m) and turns (rad, R = Rx Ry Rz, without jumps of 2 pi) for world poses (wxyz)."""
    turned = Rotation.from_matrix(base.T) * Rotation.from_quat(quaternion, scalar_first=True)
    turns = np.unwrap(turned.as_euler("XYZ"), axis=0)
    return np.concatenate([position @ base, turns], axis=1)
