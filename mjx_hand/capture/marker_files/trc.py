"""TRC, the marker format of Motion Analysis and OpenSim.

Three lines of header (`PathFileType`, names and values of `DataRate`, `NumMarkers`, `Units`, ...), a line of labels,
one of axes, then frame number, time and X, Y, Z of every marker, tab-separated
(https://opensimconfluence.atlassian.net/wiki/spaces/OpenSim/pages/53089972). Gaps are empty, `nan` or zero. The
format does not say which axis points up: positions are left in its own.
"""

from pathlib import Path

from mjx_hand.capture.marker_files.marker_format import MarkerFormat
from mjx_hand.capture.marker_files.samples import recording_of
from mjx_hand.capture.markers.marker_recording import MarkerRecording
from mjx_hand.errors import InputError
from mjx_hand.files.text_table import check_count, numbers_of, positive, read_lines


def _read(path: Path, units: str | None) -> MarkerRecording:
    lines = read_lines(path)
    if len(lines) < 5 or not lines[0].startswith("PathFileType"):
        raise InputError(f"{path}: not a TRC file (its first line must start with PathFileType); export it again")
    header = dict(zip(lines[1].split("\t"), lines[2].split("\t"), strict=False))
    missing = [key for key in ("DataRate", "NumMarkers", "Units") if not header.get(key, "").strip()]
    if missing:
        raise InputError(f"{path}: the TRC header lacks {', '.join(missing)}; export it again")
    names = [name.strip() for name in lines[3].split("\t")[2:] if name.strip()]
    promised = positive(path, "NumMarkers", header["NumMarkers"])
    if len(names) != promised:
        raise InputError(f"{path}: {len(names)} marker names for NumMarkers {promised:g}; export it again")
    table = numbers_of(path, lines[5:], "\t", 2 + 3 * len(names), 6, trimmed=True)
    if header.get("NumFrames", "").strip():
        check_count(path, positive(path, "NumFrames", header["NumFrames"]), len(table))
    positions = table[:, 2:].reshape(len(table), len(names), 3)
    fps = positive(path, "DataRate", header["DataRate"])
    return recording_of(path, names, positions, fps, units or header["Units"])


FORMAT = MarkerFormat(name="TRC of Motion Analysis and OpenSim (.trc)", suffixes=(".trc",), read=_read)
