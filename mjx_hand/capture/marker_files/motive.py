"""OptiTrack Motive's CSV export: a line of keys and values, lines that say what each column is, then one row per frame.

The columns of type `Marker` are read (https://docs.optitrack.com/motive/data-export/data-export-csv): measured places,
where `Rigid Body Marker` and `Bone Marker` are a solver's. `Length Units` and `Export Frame Rate` stand in the first
line. Gaps are empty. Motive's y points up: positions are left in its axes.
"""

from pathlib import Path

import numpy as np

from mjx_hand.capture.marker_files.marker_format import MarkerFormat
from mjx_hand.capture.marker_files.samples import recording_of, timeline_at
from mjx_hand.capture.markers.marker_recording import MarkerRecording
from mjx_hand.errors import InputError
from mjx_hand.files.text_table import check_count, numbers_of, positive, read_lines

BEGINS = "Format Version"
_RATES = ("Export Frame Rate", "Capture Frame Rate")


def _read(path: Path, units: str | None, fps: float | None) -> MarkerRecording:
    lines = [[cell.strip().strip('"') for cell in line.split(",")] for line in read_lines(path)]
    said = dict(zip(lines[0][::2], lines[0][1::2], strict=False))
    start = next((k for k, cells in enumerate(lines) if cells[0].lower() == "frame"), None)
    if start is None:
        raise InputError(f"{path}: a Motive export without its line of columns (Frame, Time, X, Y, Z); export it again")
    titles = {cells[1].lower(): cells for cells in lines[1:start] if len(cells) > 2 and not cells[0] and cells[1]}
    kinds = next((cells for cells in lines[1:start] if "Position" in cells), [])
    if "type" not in titles or "name" not in titles or not kinds:
        raise InputError(f"{path}: a Motive export whose header lacks Type, Name or Position; export it anew")
    names, where = _markers(titles["type"], titles["name"], kinds, lines[start])
    body = [",".join(cells) for cells in lines[start + 1 :]]
    table = numbers_of(path, body, ",", len(lines[start]), start + 2, trimmed=True)
    notes = _short(path, said, len(table))
    key = next((key for key in _RATES if said.get(key)), None)
    stated = positive(path, key, said[key]) if key else None
    titled = lines[start]
    timeline = timeline_at(path, len(table), stated, fps, times=table[:, 1], name=titled[1], numbers=table[:, 0])
    positions = table[:, where].reshape(len(table), len(names), 3)
    unit = units or said.get("Length Units")
    if unit is None:
        raise InputError(f"{path}: its first line has no Length Units; say the unit with --units")
    return recording_of(path, names, positions, timeline, unit, notes)


def _markers(types: list[str], names: list[str], kinds: list[str], axes: list[str]) -> tuple[list[str], np.ndarray]:
    """The markers' names, and the columns of their X, Y and Z, which stand one after the other."""
    count = min(map(len, (types, names, kinds, axes)))
    columns = [k for k in range(2, count) if types[k] == "Marker" and kinds[k] == "Position"]
    firsts = [k for k in columns if axes[k : k + 3] == ["X", "Y", "Z"] and k + 2 < count]
    return [names[k] for k in firsts], np.array([k + axis for k in firsts for axis in range(3)], int)


def _short(path: Path, said: dict[str, str], found: int) -> tuple[str, ...]:
    """A note where one frame less is there than is said; more is a truncated file."""
    if not said.get("Total Exported Frames"):
        return ()
    promised = positive(path, "Total Exported Frames", said["Total Exported Frames"])
    check_count(path, promised - 1, found)  # one may be counted that is not written: both ends of the range
    return (f"{found} frames where {promised:g} are said to be exported",) if found < promised else ()


FORMAT = MarkerFormat(name="CSV of OptiTrack Motive (.csv)", suffixes=(".csv",), read=_read, begins=BEGINS)
