"""Qualisys Track Manager's TSV export: keys, each with tab-separated values, then a table of millimetres.

The keys `FREQUENCY` and `MARKER_NAMES` are needed. Rows hold X, Y, Z of every marker, with or without frame number
and time in front (https://docs.qualisys.com/qtm). Gaps are empty, `nan`, or zero, as the export was told. The format
knows no other unit than the millimetre.
"""

from pathlib import Path

from mjx_hand.capture.marker_files.marker_format import MarkerFormat
from mjx_hand.capture.marker_files.samples import recording_of, timeline_at
from mjx_hand.capture.markers.marker_recording import MarkerRecording
from mjx_hand.errors import InputError
from mjx_hand.files.text_table import check_count, numbers_of, positive, read_lines

_LEADING = ("frame", "time")


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True


def _read(path: Path, units: str | None, fps: float | None) -> MarkerRecording:
    lines = read_lines(path)
    keys: dict[str, list[str]] = {}
    start = 0
    for start, line in enumerate(lines):  # noqa: B007
        cells = [cell.strip() for cell in line.split("\t")]
        if _is_number(cells[0]):
            break
        keys[cells[0]] = cells[1:]
    else:
        start = len(lines)
    needed = ("MARKER_NAMES",) if fps else ("FREQUENCY", "MARKER_NAMES")
    missing = [key for key in needed if not keys.get(key)]
    if missing:
        raise InputError(f"{path}: not a Qualisys TSV (no {' and no '.join(missing)}); export it as TSV with header")
    names = [name for name in keys["MARKER_NAMES"] if name]
    promised = positive(path, "NO_OF_MARKERS", keys.get("NO_OF_MARKERS", [str(len(names))])[0])
    if promised != len(names):
        raise InputError(f"{path}: {len(names)} marker names for {promised:g} markers; label all trajectories")
    titles = next(([key, *keys[key][:1]] for key in keys if key.lower() in _LEADING), [])
    leading = [word.lower() for word in titles if word.lower() in _LEADING]
    table = numbers_of(path, lines[start:], "\t", len(leading) + 3 * len(names), start + 1)
    if "NO_OF_FRAMES" in keys:
        check_count(path, positive(path, "NO_OF_FRAMES", keys["NO_OF_FRAMES"][0]), len(table))
    stated = positive(path, "FREQUENCY", keys["FREQUENCY"][0]) if keys.get("FREQUENCY") else None
    numbers, times = (table[:, leading.index(word)] if word in leading else None for word in _LEADING)
    timeline = timeline_at(path, len(table), stated, fps, times=times, numbers=numbers)
    positions = table[:, len(leading) :].reshape(len(table), len(names), 3)
    return recording_of(path, names, positions, timeline, units or "mm")


FORMAT = MarkerFormat(name="Qualisys TSV (.tsv)", suffixes=(".tsv",), read=_read)
