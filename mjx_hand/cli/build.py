"""`mjx-hand build`: a personalised hand as URDF and MJCF."""

from pathlib import Path
from typing import Literal

import numpy as np

from mjx_hand.cli.output import print_table
from mjx_hand.errors import InputError
from mjx_hand.hand.joints import HINGES, LINKS
from mjx_hand.hand.load import load_hand
from mjx_hand.rigid.build import build_rigid_hand
from mjx_hand.rigid.export.mesh_folder import filling
from mjx_hand.rigid.export.mjcf import write_mjcf
from mjx_hand.rigid.export.urdf import write_urdf

MOST = 10  # standard deviations of a shape coefficient; a slip of the keyboard makes a thumb of nine kilograms


def build(
    out: Path,
    shape: tuple[float, ...] = (),
    side: Literal["right", "left"] = "right",
    mano: Path | None = None,
    wrist_joints: bool = False,
    collision: Literal["capsules", "hulls"] = "capsules",
    report: bool = False,
    motion: Path | None = None,
    axes_from: Path | None = None,
    limits_from: Path | None = None,
) -> None:
    """Write a hand of a given shape as URDF and MJCF, with meshes, masses, limits and collision shapes.

    Args:
        out: folder to write to; made if absent.
        shape: shape coefficients, unit variance each; none is the mean hand.
        side: which hand.
        mano: a licensed MANO file (MANO_RIGHT.pkl, MANO_LEFT.pkl or .npz); without it, the open hand.
        wrist_joints: add six joints that move the wrist: three slides and three turns.
        collision: collision shapes: capsules, or the convex hull of each link.
        report: measure how far the rigid links' skin lies from the blended skin, in postures from fist to spread
            fingers: a table here, skin_error.csv and skin_error.png in the folder.
        motion: a recording whose postures the report measures too.
        axes_from: a recording of the person whose motion the hinge axes are fitted to (docs/axes.md).
        limits_from: a recording of the person whose range becomes the soft limits.
    """
    if motion is not None and not report:
        raise InputError(f"--motion {motion} is measured by the report alone; give --report too")
    if any(abs(value) > MOST for value in shape):
        raise InputError(f"--shape {' '.join(f'{value:g}' for value in shape)}: no hand; stay within +-{MOST}")
    hand = load_hand(mano, side)
    rigid = build_rigid_hand(hand, np.array(shape))
    taken = []
    if axes_from is not None or limits_from is not None:
        from mjx_hand.cli.from_recording import with_recorded_axes, with_recorded_limits

        for take, recording in ((with_recorded_axes, axes_from), (with_recorded_limits, limits_from)):
            if recording is not None:
                rigid, said = take(rigid, recording)
                taken.append(said)
    measured = None
    with filling(out) as folder:  # all files or none
        names = [
            write_urdf(rigid, folder, wrist_joints=wrist_joints, collision=collision).name,
            write_mjcf(rigid, folder, base="actuated" if wrist_joints else "fixed", collision=collision).name,
        ]
        if report:
            from mjx_hand.cli.skin_report import write_skin_report

            measured = write_skin_report(folder, hand, np.array(shape), rigid, motion)
    rows = [
        (link, f"{mass * 1e3:.1f}", str(len(faces)), str(rigid.capsule_links.count(k)))
        for k, (link, mass, faces) in enumerate(zip(LINKS, rigid.link_mass, rigid.mesh_faces, strict=True))
    ]
    title = f"{rigid.name}, {rigid.side}: {len(LINKS)} links, {len(HINGES)} hinges, {rigid.link_mass.sum() * 1e3:.0f} g"
    print_table(title, ("link", "mass (g)", "triangles", "capsules"), rows)
    for said in taken:
        print(said)
    if measured is not None:
        from mjx_hand.cli.skin_report import PICTURE, TABLE, print_skin_report

        print_skin_report(measured)
        print(f"{out / PICTURE} shows where, {out / TABLE} has every link and posture")
    urdf, mjcf = (out / name for name in names)
    print(f"{urdf}  for PyBullet, Isaac, Drake, ROS: yourdfpy.URDF.load({str(urdf)!r})")
    print(f"{mjcf}  for MuJoCo and MJX: mujoco.MjModel.from_xml_path({str(mjcf)!r})")
