"""What all readers of marker files share: from labels and numbers to a checked `MarkerRecording` in metres."""

from collections import Counter
from pathlib import Path

import numpy as np
from jaxtyping import Float

from mjx_hand.capture.markers.marker_recording import MarkerRecording, check_recording
from mjx_hand.capture.timeline.compare_clocks import timeline_of
from mjx_hand.capture.timeline.timeline import Timeline
from mjx_hand.errors import InputError

METRES = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254}
_WORDS = {"meter": "m", "metre": "m", "centimeter": "cm", "millimeter": "mm", "millimetre": "mm", "inch": "in"}


def unit_metres(path: Path, unit: str) -> float:
    """How many metres a unit is: m, cm, mm or in, also spelt out.

    Raises:
        InputError: it is none of these.
    """
    word = unit.strip().strip("()[]").lower()
    word = _WORDS.get(word.removesuffix("s"), word)
    if word not in METRES:
        raise InputError(f"{path}: unit {unit!r} is unknown; valid are {', '.join(METRES)}: say it with --units")
    return METRES[word]


def timeline_at(
    path: Path,
    rows: int,
    stated: float | None,
    asked: float | None,
    *,
    times: Float[np.ndarray, "t"] | None = None,
    name: str = "time",
    numbers: Float[np.ndarray, "t"] | None = None,
) -> Timeline:
    """The even frames of a file's rows.

    Args:
        path: for messages.
        rows: how many there are.
        stated: frames per second that the file says; None if it does not.
        asked: what the caller says.
        times, name, numbers: as for `timeline_of`.

    Raises:
        InputError: no rate is known, two differ, or times and numbers contradict them.
    """
    if stated is not None and asked is not None and abs(asked / stated - 1) > 1e-3:
        raise InputError(f"{path}: was recorded at {stated:g} frames per second; leave out fps={asked:g}")
    if rows == 0:
        raise InputError(f"{path}: no frames in it, only a header; export the recording again")
    timeline = timeline_of(
        path, rows, rate=asked if stated is None else stated, times=times, name=name, numbers=numbers
    )
    if timeline.fps is None:
        raise InputError(f"{path}: no frame rate, nor times that give it; say it with --fps")
    return timeline


def recording_of(
    path: Path,
    names: list[str],
    positions: Float[np.ndarray, "t m 3"],
    timeline: Timeline,
    unit: str,
    notes: tuple[str, ...] = (),
) -> MarkerRecording:
    """The recording of positions in `unit`. A marker that is NaN, or exactly 0, 0, 0, was not seen in that frame.

    Markers without a label of their own (none, or one that repeats) are left out, which its warnings say.

    Args:
        path: of the file.
        names: the markers' labels.
        positions: a row of the file each.
        timeline: when the rows were taken.
        unit: of the positions.
        notes: what else is doubtful.

    Raises:
        InputError: no marker has a label of its own, or nothing was seen.
    """
    if not names:
        raise InputError(f"{path}: no markers in it; export the labelled trajectories")
    kept, lacking = own_labels(path, names)
    positions, names = positions[:, kept], [names[k] for k in kept]
    seen = np.isfinite(positions).all(axis=2) & (positions != 0).any(axis=2)
    if not seen.any():
        raise InputError(f"{path}: none of its {len(names)} markers is seen in any of {len(positions)} frames")
    even = timeline.sampled(np.where(seen[..., None], positions, np.nan))
    visible = np.asarray(np.isfinite(even).all(axis=2))
    metres = np.where(visible[..., None], even, 0.0) * unit_metres(path, unit)
    return check_recording(
        MarkerRecording(
            fps=float(timeline.fps or np.nan),
            positions=metres,
            visible=visible,
            names=tuple(names),
            source=path.name,
            warnings=(*notes, *lacking, *timeline.notes),
        )
    )


def own_labels(path: Path, names: list[str]) -> tuple[list[int], tuple[str, ...]]:
    """Which markers have a label of their own, and a note on the others.

    Raises:
        InputError: none has.
    """
    count = Counter(names)
    kept = [k for k, name in enumerate(names) if name and count[name] == 1]
    repeated = sorted(name for name, times in count.items() if name and times > 1)
    if not kept:
        shared = f", and {', '.join(repeated[:6])} repeat" if repeated else ""
        raise InputError(f"{path}: none of its {len(names)} markers has a label of its own{shared}; label them")
    shown = ", ".join(repeated[:6]) + (f" and {len(repeated) - 6} more" if len(repeated) > 6 else "")
    notes = [f"{count['']} markers without a label are left out"] if count[""] else []
    notes += [f"markers whose labels repeat are left out: {shown}"] if repeated else []
    return kept, tuple(notes)
