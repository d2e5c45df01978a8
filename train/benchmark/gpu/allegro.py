"""A peer's scene: the cube in a left Allegro hand that Newton's own benchmark steps (its `bench_mujoco`, KpiAllegro).

From its published settings: Newton's method of at most 100 iterations with line searches of 10, elliptic cones,
implicit integration, steps of 1/6000 s of which ten follow one command, self-collision on, position control with gains
of 150 and 5, and for each joint a target drawn anew at every command from -1 to 1 rad, for 300 commands from the start.

What differs: links are the boxes and finger tips of the hand's URDF (the package dexi-rs carries it) where Newton has
hulls of meshes, and the hand lies with its palm up where Newton's is tilted. The cube is that of Newton's asset.
"""

import importlib
import importlib.util
from pathlib import Path

import mujoco

from mjx_hand.errors import InputError

TIMESTEP, SUBSTEPS, COMMANDS = 1 / 6000, 10, 300
ITERATIONS, LINE_SEARCH = 100, 10
STIFFNESS, DAMPING = 150.0, 5.0  # N m/rad, N m s/rad
CUBE_SIDE, CUBE_MASS, FRICTION = 0.072, 0.216, 0.5  # m, kg
PACKAGE, WHEEL = "dexi_rs", "dexi-rs==0.4.1"
# Up is the palm's normal, the hand's x: gravity and ground are turned, not the hand.
_UP, _GROUND = (1.0, 0.0, 0.0), -0.5
_CUBE_AT = (0.055, 0.0, 0.01)  # above the palm and the first links
_READING = (
    '<mujoco><compiler strippath="false" meshdir="{folder}" balanceinertia="true" discardvisual="true" '
    'fusestatic="false"/></mujoco>'
)


def allegro_model() -> mujoco.MjModel:
    """The compiled scene: 16 hinges with a position actuator each, and the cube's free joint after them.

    Raises:
        InputError: the package that carries the hand is not installed.
    """
    spec = mujoco.MjSpec.from_string(_urdf())
    option = spec.option
    option.timestep, option.iterations, option.ls_iterations = TIMESTEP, ITERATIONS, LINE_SEARCH
    option.solver, option.cone = mujoco.mjtSolver.mjSOL_NEWTON, mujoco.mjtCone.mjCONE_ELLIPTIC
    option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    option.gravity = [-9.81 * up for up in _UP]
    for joint in spec.joints:
        servo = spec.add_actuator(name=joint.name, target=joint.name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
        servo.set_to_position(kp=STIFFNESS, kv=DAMPING)
        # MuJoCo lets what is fixed to the world meet what moves on it; as everywhere, parent and child do not meet.
        if joint.parent.parent.name == "base_link":
            spec.add_exclude(bodyname1="base_link", bodyname2=joint.parent.name)
    cube = spec.worldbody.add_body(name="cube", pos=_CUBE_AT)
    cube.add_freejoint()
    half = [CUBE_SIDE / 2] * 3
    cube.add_geom(name="cube", type=mujoco.mjtGeom.mjGEOM_BOX, size=half, mass=CUBE_MASS)
    spec.worldbody.add_geom(
        name="ground", type=mujoco.mjtGeom.mjGEOM_PLANE, size=[0, 0, 1], pos=[_GROUND, 0, 0], zaxis=_UP
    )
    for geom in spec.geoms:
        geom.friction[0] = FRICTION
    return spec.compile()


def _urdf() -> str:
    """The left hand's URDF, told how MuJoCo is to read it."""
    if importlib.util.find_spec(PACKAGE) is None:
        raise InputError(f"the wheel dexi-rs, which carries the hand, is not installed: pip install {WHEEL}")
    folder = Path(str(importlib.import_module(PACKAGE).asset_path("robots/hands"))) / "allegro_hand"
    text = (folder / "allegro_hand_left.urdf").read_text()
    return text.replace("</robot>", _READING.format(folder=folder) + "</robot>")
