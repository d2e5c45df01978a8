"""`mjx-hand robot --build`: a robot hand as MJCF, and what there is to say about it."""

from pathlib import Path

import numpy as np

from mjx_hand.bodies.robot_body import body_of_model, robot_model
from mjx_hand.bodies.write_robot import link_reports, write_robot
from mjx_hand.cli.output import print_table
from mjx_hand.errors import InputError
from mjx_hand.robots.robot_hand import load_robot, urdf_of


def build_robot(
    robot: str, urdf: Path | None, folder: Path, *, side: str | None, collision: str, absent: str, self_collision: bool
) -> None:
    """Write a robot hand and print its links, joints and what was mended.

    Raises:
        InputError: the hand cannot be built, is of another side, or the folder cannot be written.
    """
    description = load_robot(robot)
    file = urdf_of(description, urdf)
    model, found = robot_model(description, file, collision, absent)
    if side not in (None, found):
        raise InputError(f"{file} with {description.name} is a {found} hand; give a {side} hand's URDF and description")
    body = body_of_model(description, model, found)
    written = write_robot(body, folder, self_collision=self_collision)
    reports = link_reports(body, model)
    rows = []
    for each in reports:
        off = ("-", "-") if each.off is None else tuple(f"{1e3 * value:.1f}" for value in each.off)
        rows.append((each.body, each.finger or "palm", f"{1e3 * each.mass:.0f}", str(each.shapes), *off))
    mass = sum(each.mass for each in reports)
    title = (
        f"{body.name}, {found}: {len(body.joints)} actuated joints, {len(body.coupled)} that follow others, "
        f"{1e3 * mass:.0f} g"
    )
    print_table(title, ("link", "finger", "mass (g)", f"{collision}", "off the mesh (mm)", "95 %"), rows)
    gains = body.gains
    values = np.stack([gains.stiffness, gains.damping, gains.force_limit], axis=1)
    joints = [(name, *(f"{value:.3g}" for value in row)) for name, row in zip(body.joints, values, strict=True)]
    print_table("position control", ("joint", "kp", "kv", "force limit"), joints)
    for note in (*model.notes, *(each.inertia.note for each in model.links if each.inertia and each.inertia.note)):
        print(f"note: {note}")
    print(f"{written}  for MuJoCo and MJX: mujoco.MjModel.from_xml_path({str(written)!r})")
