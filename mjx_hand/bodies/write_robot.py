"""A robot hand on disk: MJCF and meshes, and how well what touches follows what is seen."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mjx_hand.bodies.body import Body
from mjx_hand.rigid.export.mesh_folder import filling, write_surfaces
from mjx_hand.robots.model.shapes import off_the_mesh
from mjx_hand.robots.model.spec import RobotModel


@dataclass(frozen=True)
class LinkReport:
    """A link of a written hand: its body, finger, mass (kg), shapes that touch, and how far (m) these are off the mesh.

    `off` is the mean and the 95th percentile of the distance of their surface from what is seen; None without a mesh.
    """

    body: str
    finger: str
    mass: float
    shapes: int
    off: tuple[float, float] | None


def write_robot(body: Body, folder: str | Path, *, self_collision: bool = False) -> Path:
    """Write `NAME.xml` and `meshes/*.obj`, with paths relative to the folder; returns the XML's path.

    The folder appears whole or not at all.

    Args:
        body: the hand.
        folder: to write to.
        self_collision: let the hand's links meet each other, but for neighbours.

    Raises:
        InputError: the folder cannot be written.
    """
    spec = body.spec(visual=True)
    touching = {contact.name for contact in body.contacts}
    for geom in spec.geoms:
        if geom.name in touching and self_collision:
            geom.conaffinity = 1
    with filling(folder) as temporary:
        write_surfaces(spec, temporary)
        spec.compile()
        (temporary / f"{body.name}.xml").write_text(spec.to_xml())
    return Path(folder) / f"{body.name}.xml"


def link_reports(body: Body, robot: RobotModel) -> Sequence[LinkReport]:
    """What each link with a shape came to."""
    fingers = {contact.link: contact.finger for contact in body.contacts}
    reports = []
    for each in robot.links:
        if not each.touching:
            continue
        meshes = [shape for shape in each.visual if shape.kind == "mesh"]
        away = off_the_mesh(each.touching, meshes)
        off = (float(away.mean()), float(np.quantile(away, 0.95))) if away.size else None
        mass = 0.0 if each.inertia is None else each.inertia.mass
        reports.append(LinkReport(each.body, fingers[each.body], mass, len(each.touching), off))
    return reports
