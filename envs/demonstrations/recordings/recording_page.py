"""A page for each recording: what every step did to it, and which frames cannot be repeated and why."""

import dataclasses
import json
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from envs.demonstrations.recordings.recorded_demonstration import Figures
from envs.demonstrations.recordings.recorded_set import SEARCHED, RecordedSet
from envs.demonstrations.recordings.recording_settings import RecordingSettings
from envs.demonstrations.recordings.variations import held_out
from mjx_hand.files.npz_archive import replacing
from mjx_hand.motion.demonstration import Demonstration
from mjx_hand.view.report import Headline, Plot, Report, Section, Table, write_report

RECORDINGS = "recordings.json"  # figures of all recordings of a set, and why others are not in it


def write_pages(recorded: RecordedSet, settings: RecordingSettings, folder: Path) -> None:
    """Write `pages/NNN-NAME.html` for each recording into a set's folder, and `recordings.json` of all."""
    (folder / "pages").mkdir()
    apart = held_out(len(recorded.figures), settings)
    rows = []
    for k, (figures, demonstration) in enumerate(zip(recorded.figures, recorded.demonstrations, strict=True)):
        page = f"pages/{k:03d}-{figures.name}.html"
        part = {None: "training and held out, by variation", True: "held out", False: "training"}[apart[k]]
        write_report(folder / page, recording_report(figures, demonstration, part, settings))
        rows.append({"page": page, "part": part, **dataclasses.asdict(figures)})
    told = {"recordings": rows, "refused": [{"name": name, "why": why} for name, why in recorded.refused]}
    with replacing(folder / RECORDINGS) as file:
        file.write_text(json.dumps(told, indent=1))


def recording_report(f: Figures, demonstration: Demonstration, part: str, settings: RecordingSettings) -> Report:
    """What became of a recording."""
    lost = "to its end" if f.lost is None else f"lost in frame {_recorded_frame(f, f.lost, settings.rate)}"
    return Report(
        title=f"{f.name}: from a recording to a demonstration",
        task=f"The {f.side} hand with {f.object}: frames {f.first} to {f.last} of {f.frames} at {f.rate:g}/s; {part}.",
        headlines=(
            Headline("touching tips off the surface", f"{1e3 * f.gap:.1f} mm", f"{1e3 * f.gap_before:.1f} mm recorded"),
            Headline(
                "hand in the object at most", f"{1e3 * f.depth:.1f} mm", f"{1e3 * f.depth_before:.1f} mm recorded"
            ),
            Headline("hand moved", f"{1e3 * f.hand_moved:.1f} mm", f"{np.rad2deg(f.hand_turned):.1f}°, on average"),
            Headline("carried with nothing learned", f"{f.carried:.0%}", f"in the search for a grasp, {lost}")
            if f.road == SEARCHED
            else Headline("carried with nothing learned", f"{f.carried:.0%}", lost),
        ),
        sections=(
            Section("What every step did", [Table(("step", "result"), _steps(f, demonstration))]),
            Section("Frames that are not repeated", [_left_out(f)]),
            Section("The object's way", [Plot(_height(demonstration, f.lost), "Height of the object's origin.")]),
        ),
    )


def _steps(f: Figures, d: Demonstration) -> list[tuple[str, str]]:
    supports = ", ".join(f"{100 * height:.1f} cm" for height in f.supports)
    return [
        ("up", f.up),
        ("supports", f"{len(f.supports)}, at {supports}"),
        ("object where it rests", f"moved {1e3 * f.object_moved:.1f} mm, turned {np.rad2deg(f.object_turned):.1f}°"),
        ("object's way while it is carried", f"moved {1e3 * f.way_moved:.1f} mm on average"),
        ("orientations not believed", f"{f.bridged} frames"),
        ("convex pieces", str(f.pieces)),
        ("mass", f"{1e3 * f.mass:.0f} g ({f.how_heavy})"),
        ("fingers that touch", ", ".join(f.touching) or "none"),
        ("hand", f"moved {1e3 * f.hand_moved:.1f} mm, turned {np.rad2deg(f.hand_turned):.1f}°, on average"),
        ("hinges", f"moved {np.rad2deg(f.angles_moved):.1f}° on average"),
        ("grasp", f.road),
        ("twin's hand", "the other one, mirrored: most recordings are of that" if f.mirrored else f.side),
        ("length", f"{d.num_frames / d.motion.fps:.2f} s at {d.motion.fps:g}/s"),
    ]


def _left_out(f: Figures) -> Table:
    rows = [
        (reason, ", ".join(f"{a}" if a == b else f"{a} to {b}" for a, b in spans))
        for reason, spans in f.left_out.items()
    ]
    return Table(("why", "frames"), rows or [("all frames of the act are repeated", "")])


def _height(demonstration: Demonstration, lost: int | None) -> Figure:
    figure = Figure(figsize=(6.4, 2.4), layout="constrained")
    axes = figure.add_subplot()
    times = np.arange(demonstration.num_frames) / demonstration.motion.fps
    axes.plot(times, 100 * demonstration.object_pose[:, 2])
    if lost is not None:
        axes.axvline(times[min(lost, len(times) - 1)], linestyle="--", color="0.4", label="lost with nothing learned")
        axes.legend()
    axes.set(xlabel="time (s)", ylabel="height (cm)")
    axes.grid(alpha=0.3)
    return figure


def _recorded_frame(f: Figures, frame: int, rate: float) -> int:
    return f.first + round(frame * f.rate / rate)
