"""TRC, the marker format of Motion Analysis and OpenSim.

Three lines of header (`PathFileType`, names and values of `DataRate`, `NumMarkers`, `Units`, ...), a line of labels,
one of axes, then frame number, time and X, Y, Z of every marker, tab-separated
(https://opensimconfluence.atlassian.net/wiki/spaces/OpenSim/pages/53089972). Gaps are empty, `nan` or zero. Cortex
writes unnamed trajectories behind the named ones, as many as there are in each row; they are passed over. The format
does not say which axis points up: positions are left in its own.
"""

from pathlib import Path

from mjx_hand.capture.marker_files.marker_format import MarkerFormat
from mjx_hand.capture.marker_files.samples import recording_of, timeline_at
from mjx_hand.capture.markers.marker_recording import MarkerRecording
from mjx_hand.errors import InputError
from mjx_hand.files.text_table import check_count, numbers_of, positive, read_lines


def _read(path: Path, units: str | None, fps: float | None) -> MarkerRecording:
    lines = read_lines(path)
    if len(lines) < 5 or not lines[0].startswith("PathFileType"):
        raise InputError(f"{path}: not a TRC file (its first line must start with PathFileType); export it again")
    header = dict(zip(lines[1].split("\t"), lines[2].split("\t"), strict=False))
    stated = header.get("DataRate", "").strip()
    needed = [key for key in ("NumMarkers", "Units") if not (key == "Units" and units)]
    missing = [key for key in needed if not header.get(key, "").strip()]
    missing += [] if stated or fps else ["DataRate (or say --fps)"]
    if missing:
        raise InputError(f"{path}: the TRC header lacks {', '.join(missing)}; export it again")
    body = lines[5:]
    names, unnamed = _labels(path, lines[3], positive(path, "NumMarkers", header["NumMarkers"]), body)
    table = numbers_of(path, body, "\t", 2 + 3 * len(names), 6, trimmed=True, wider=True)
    if header.get("NumFrames", "").strip():
        check_count(path, positive(path, "NumFrames", header["NumFrames"]), len(table))
    rate = positive(path, "DataRate", header["DataRate"]) if stated else None
    timeline = timeline_at(path, len(table), rate, fps, times=table[:, 1], numbers=table[:, 0])
    kept = [k for k, name in enumerate(names) if name]
    positions = table[:, 2:].reshape(len(table), len(names), 3)[:, kept]
    notes = (f"up to {unnamed} trajectories without a name are left out",) if unnamed else ()
    return recording_of(path, [names[k] for k in kept], positions, timeline, units or header["Units"], notes)


def _labels(path: Path, line: str, promised: float, body: list[str]) -> tuple[list[str], int]:
    """The label of each trajectory from the first to the last named one, and how many have none.

    Raises:
        InputError: neither the rows nor NumMarkers have as many trajectories as there are labels.
    """
    cells = [cell.strip() for cell in line.split("\t")[2:]]
    at = [k for k, cell in enumerate(cells) if cell]
    if not at:
        return [], 0
    # A label stands above its X; some programs leave the two cells after it out.
    spread = all(k % 3 == 0 for k in at)
    names = cells[: at[-1] + 1 : 3] if spread else [cells[k] for k in at]
    wide = max((len(row.rstrip("\t ").split("\t")) for row in body), default=0)
    there = max(-(-(wide - 2) // 3), 0)
    if len(names) > max(there, promised) or (promised > len(names) > there):
        raise InputError(
            f"{path}: {len(names)} marker names for NumMarkers {promised:g}, and {there} markers in the rows; "
            "export it again"
        )
    named = sum(map(bool, names))
    return names, max(there, len(names)) - named


FORMAT = MarkerFormat(name="TRC of Motion Analysis and OpenSim (.trc)", suffixes=(".trc",), read=_read)
