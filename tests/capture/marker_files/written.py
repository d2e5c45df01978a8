"""One short marker recording in every format, and what must be read from it."""

from pathlib import Path

import ezc3d
import numpy as np
import pytest

from mjx_hand.capture.markers.marker_recording import MarkerRecording

NAMES = ("hand_back", "Å tip", "nail.3")
FPS = 120.0


def write_c3d(path: Path, positions: np.ndarray, names=NAMES, units="mm", **point) -> Path:
    """By another project's writer; a gap is NaN there."""
    file = ezc3d.c3d()
    file["parameters"]["POINT"]["RATE"]["value"] = [FPS]
    file["parameters"]["POINT"]["LABELS"]["value"] = list(names)
    file["parameters"]["POINT"]["UNITS"]["value"] = [units]
    for key, value in point.items():
        file.add_parameter("POINT", key, [value])
    data = np.ones((4, len(names), len(positions)))
    data[:3] = positions.transpose(2, 1, 0)
    file["data"]["points"] = data
    file.write(str(path))
    return path


def write_tsv(path: Path, positions: np.ndarray, names=NAMES, gap="nan", table_head=True) -> Path:
    rows = [f"NO_OF_FRAMES\t{len(positions)}", f"NO_OF_MARKERS\t{len(names)}", f"FREQUENCY\t{FPS:g}"]
    rows.append("\t".join(["MARKER_NAMES", *names]))
    if table_head:
        rows.append("\t".join(["Frame", "Time", *(f"{n} {axis}" for n in names for axis in "XYZ")]))
    for k, frame in enumerate(positions):
        cells = [gap if np.isnan(v) else f"{v:.3f}" for v in frame.ravel()]
        rows.append("\t".join([str(k + 1), f"{k / FPS:.5f}", *cells] if table_head else cells))
    path.write_text("\n".join(rows) + "\n", encoding="utf-8")
    return path


def write_trc(path: Path, positions: np.ndarray, names=NAMES, units="mm", promised=None) -> Path:
    keys = {"DataRate": FPS, "CameraRate": FPS, "NumFrames": promised or len(positions), "NumMarkers": len(names)}
    keys |= {"Units": units}
    rows = ["PathFileType\t4\t(X/Y/Z)\tfile.trc", "\t".join(keys), "\t".join(map(str, keys.values()))]
    rows.append("Frame#\tTime\t" + "\t\t\t".join(names) + "\t\t")
    rows += ["\t\t" + "\t".join(f"{axis}{k + 1}" for k in range(len(names)) for axis in "XYZ"), ""]
    for k, frame in enumerate(positions):
        cells = ["" if np.isnan(v) else f"{v:.3f}" for v in frame.ravel()]
        rows.append("\t".join([str(k + 1), f"{k / FPS:.5f}", *cells]).rstrip("\t"))
    path.write_text("\n".join(rows) + "\n", encoding="utf-8")
    return path


def write_csv(path: Path, positions: np.ndarray, names=NAMES, head="# units: mm\n# rate: 120\n") -> Path:
    columns = [f"{n}_{axis}" for n in names for axis in "xyz"]
    rows = [",".join("" if np.isnan(v) else f"{v:.3f}" for v in frame.ravel()) for frame in positions]
    path.write_text(head + "\n".join([",".join(columns), *rows]) + "\n", encoding="utf-8")
    return path


WRITERS = {"c3d": write_c3d, "tsv": write_tsv, "trc": write_trc, "csv": write_csv}


def check_same(recording: MarkerRecording, millimetres: np.ndarray) -> None:
    seen = np.asarray(np.isfinite(millimetres).all(axis=2))
    np.testing.assert_array_equal(recording.visible, seen)
    np.testing.assert_allclose(recording.positions, np.where(seen[..., None], 0.001 * millimetres, 0.0), atol=1e-7)
    assert recording.fps == pytest.approx(FPS)
