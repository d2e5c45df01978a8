"""A demonstration's scene as MJCF that plain MuJoCo loads and steps as the native engine does."""

import xml.etree.ElementTree as ET
from pathlib import Path

import mujoco
import numpy as np

from envs.physics.solver import gauss_seidel
from envs.scene import demonstration_spec
from mjx_hand.bodies.body import Body
from mjx_hand.motion.demonstration import Demonstration
from mjx_hand.rigid.export.mesh_folder import write_surfaces
from mjx_hand.rigid.rigid_hand import RigidHand

_SOLVER = ("solver", "iterations", "ls_iterations", "cone", "impratio")
# Attributes whose numbers MuJoCo writes with six digits, and the model's fields that have all of them.
_BODY = {"pos": "body_pos", "quat": "body_quat"}
_INERTIAL = {"pos": "body_ipos", "quat": "body_iquat", "mass": "body_mass", "diaginertia": "body_inertia"}
_EXACT = {
    "joint": {"axis": "jnt_axis", "range": "jnt_range"},
    "geom": {"size": "geom_size", "pos": "geom_pos", "quat": "geom_quat", "friction": "geom_friction"},
    "site": {"pos": "site_pos"},
    "general": {
        "ctrlrange": "actuator_ctrlrange",
        "forcerange": "actuator_forcerange",
        "gainprm": "actuator_gainprm",
        "biasprm": "actuator_biasprm",
    },
}
_TYPES = {
    "joint": mujoco.mjtObj.mjOBJ_JOINT,
    "geom": mujoco.mjtObj.mjOBJ_GEOM,
    "site": mujoco.mjtObj.mjOBJ_SITE,
    "general": mujoco.mjtObj.mjOBJ_ACTUATOR,
}


def write_scene(
    path: Path, demonstration: Demonstration, hand: RigidHand | Body, contacts: str = "object", forces: bool = False
) -> list[str]:
    """Write the scene, with the native engine's solver; the rest as `envs.scene.scene_spec` has it.

    Surfaces go to `meshes/` beside it; their paths from there on are returned.
    """
    spec = demonstration_spec(demonstration, hand, contacts=contacts, forces=forces)
    (solved,) = gauss_seidel([spec.compile()])
    for name in _SOLVER:
        setattr(spec.option, name, getattr(solved.opt, name))
    meshes = write_surfaces(spec, path.parent)
    path.write_text(exact_xml(spec))
    return meshes


def exact_xml(spec: mujoco.MjSpec) -> str:
    """The spec as MJCF whose places, shapes, masses, limits and gains have all their digits.

    MuJoCo's own writer rounds to six. Loaded, this is the same model to the last bit, and so are its steps.
    """
    model = spec.compile()
    root = ET.fromstring(spec.to_xml())
    for body in root.iter("body"):
        number = model.body(body.attrib["name"]).id
        _write(body, model, _BODY, number)
        for inertial in body.findall("inertial"):
            _write(inertial, model, _INERTIAL, number)
    for tag, fields in _EXACT.items():
        for element in root.iter(tag):
            number = mujoco.mj_name2id(model, _TYPES[tag], element.attrib.get("name", ""))
            if number < 0:  # a free joint's or a default's
                continue
            mesh = "mesh" in element.attrib  # whose place in the file is the mesh's own, and not its centre's
            _write(element, model, {k: f for k, f in fields.items() if not mesh or k == "friction"}, number)
            if "mass" in element.attrib:
                element.set("mass", repr(float(spec.geom(element.attrib["name"]).mass)))
    for element in root.iter("mesh"):
        if "vertex" in element.attrib:
            element.set("vertex", _text(np.asarray(spec.mesh(element.attrib["name"]).uservert)))
    for element, law in zip(root.iterfind("equality/joint"), model.eq_data, strict=True):
        element.set("polycoef", _text(law[:5]))
    ET.indent(root)
    return ET.tostring(root, encoding="unicode") + "\n"


def _write(element: ET.Element, model: mujoco.MjModel, fields: dict[str, str], number: int) -> None:
    """Put all digits into those attributes that the element has; it may leave out usual values at their end."""
    for attribute, field in fields.items():
        if attribute in element.attrib:
            values = np.atleast_1d(getattr(model, field)[number])
            element.set(attribute, _text(values[: len(element.attrib[attribute].split())]))


def _text(values: np.ndarray) -> str:
    return " ".join(repr(float(value)) for value in values)
