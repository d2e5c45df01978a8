"""What `mjx-hand build --report` says: how far the rigid links' skin lies from the blended skin, and where."""

import csv
import dataclasses
from pathlib import Path

import numpy as np
from jaxtyping import Float, Int

from mjx_hand.capture.load import load_motion
from mjx_hand.cli.output import print_table, spread
from mjx_hand.errors import InputError
from mjx_hand.hand.joints import LINKS
from mjx_hand.hand.model import HandModel
from mjx_hand.projection import project
from mjx_hand.rigid.postures import postures
from mjx_hand.rigid.rigid_hand import RigidHand, forward_kinematics
from mjx_hand.rigid.segmentation.segments import cut
from mjx_hand.rigid.skin_error import posed_skins
from mjx_hand.view.figures.skin_figure import skin_error_figure

TABLE, PICTURE = "skin_error.csv", "skin_error.png"
_SHOWN = ("fist", "pinch", "spread")
_FRAMES = 200  # of a recording at most, evenly spread: more do not change the figures


@dataclasses.dataclass(frozen=True)
class SkinReport:
    """Distances (m) of the hand's vertices on rigid links from the blended skin.

    Attributes:
        errors: by the name of the postures, (postures, vertices).
        owner: the link that each vertex moves with.
    """

    errors: dict[str, Float[np.ndarray, "b v"]]
    owner: Int[np.ndarray, "v"]


def recorded_postures(path: Path, rigid: RigidHand) -> Float[np.ndarray, "t 20"]:
    """Hinge angles (rad) of a recording's good frames, at most some hundreds, evenly spread.

    Raises:
        InputError: the recording cannot be read, is of the other hand, or has no good frame.
    """
    motion = load_motion(path)
    if motion.side != rigid.side:
        raise InputError(f"{path}: holds a {motion.side} hand, but the hand built is a {rigid.side} one; give its side")
    good = np.flatnonzero(motion.valid)
    if not len(good):
        raise InputError(f"{path}: every frame lies in a gap; give a recording with poses")
    chosen = good[np.unique(np.linspace(0, len(good) - 1, _FRAMES).astype(int))]
    return np.asarray(project(np.asarray(motion.rotations)[chosen].astype(np.float32), rigid))


def write_skin_report(
    folder: Path, hand: HandModel, shape: Float[np.ndarray, "_"], rigid: RigidHand, motion: Path | None
) -> SkinReport:
    """Write `skin_error.csv` (mm; postures, link, mean, 95th percentile, max) and `skin_error.png` to the folder.

    Args:
        folder: an existing one.
        hand, shape: what `rigid` was built from.
        rigid: the hand.
        motion: a recording whose postures are measured too.

    Raises:
        InputError: the recording cannot be used.
    """
    named = postures(np.asarray(rigid.hinge_lower), np.asarray(rigid.hinge_upper))
    if motion is not None:
        named[motion.name] = recorded_postures(motion, rigid)
    errors, rigids, softs, shown = {}, [], [], []
    all_hard, all_soft = posed_skins(hand, shape, rigid, np.concatenate(list(named.values())))  # compiled once
    first = 0
    for name, angles in named.items():
        hard, soft = all_hard[first : first + len(angles)], all_soft[first : first + len(angles)]
        first += len(angles)
        errors[name] = np.linalg.norm(hard - soft, axis=-1)
        if name in _SHOWN or (motion is not None and name == motion.name):
            worst = int(errors[name].mean(axis=1).argmax())
            rigids.append(_segments(rigid, angles[worst]))
            softs.append((soft[worst], np.asarray(hand.faces)))
            shown.append((name, errors[name][worst]))
    report = SkinReport(errors, cut(hand).skin.vertex_links)
    with (folder / TABLE).open("w", newline="") as file:
        table = csv.writer(file)
        table.writerow(("postures", "link", "mean_mm", "p95_mm", "max_mm"))
        for name, found in errors.items():
            table.writerow((name, "all", *spread(found, 1e3)))
            table.writerows((name, link, *figures) for link, figures in _by_link(found, report.owner))
    figure = skin_error_figure([name for name, _ in shown], rigids, softs, [error for _, error in shown])
    figure.savefig(folder / PICTURE, dpi=130)
    return report


def print_skin_report(report: SkinReport) -> None:
    """The figures as two tables: by posture, and by link over all postures."""
    columns = ("mean", "95 %", "max")
    rows = [(f"{name} ({len(found)})", *spread(found, 1e3)) for name, found in report.errors.items()]
    print_table("skin on rigid links against blended skin (mm), by postures", ("postures", *columns), rows)
    together = np.concatenate(list(report.errors.values()))
    rows = [(link, *figures) for link, figures in _by_link(together, report.owner)]
    print_table(
        "the same over all postures, by link (mm)", ("link", *columns), [*rows, ("all", *spread(together, 1e3))]
    )


def _by_link(errors: Float[np.ndarray, "b v"], owner: Int[np.ndarray, "v"]) -> list[tuple[str, tuple[str, str, str]]]:
    return [(name, spread(errors[:, owner == link], 1e3)) for link, name in enumerate(LINKS)]


def _segments(rigid: RigidHand, angles: Float[np.ndarray, "20"]) -> list[tuple[np.ndarray, np.ndarray]]:
    """The segments' vertices (m, hand frame) and triangles in a posture."""
    turn, position = (np.asarray(found, float) for found in forward_kinematics(angles.astype(np.float32), rigid))
    return [
        (vertices @ turn[link].T + position[link] + rigid.wrist_position, faces)
        for link, (vertices, faces) in enumerate(zip(rigid.mesh_vertices, rigid.mesh_faces, strict=True))
    ]
