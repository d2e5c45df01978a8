"""`load_motion`: a hand motion from a file of any format that the project reads."""

from pathlib import Path

from mjx_hand.capture.datasets.dataset_format import Contents, DatasetFormat, Request, dataset_formats
from mjx_hand.capture.marker_files.load_markers import load_markers
from mjx_hand.capture.marker_fit.fit import fit_markers
from mjx_hand.capture.markers.gap_filling import FILL, fill_short_gaps
from mjx_hand.capture.markers.labels import match_labels
from mjx_hand.capture.markers.marker_set import load_marker_set
from mjx_hand.capture.unread import described_for_reading
from mjx_hand.errors import InputError
from mjx_hand.files.contents import read_contents
from mjx_hand.files.input_file import check_input_file
from mjx_hand.hand.load import load_hand
from mjx_hand.hand.model import HandModel
from mjx_hand.motion import Motion
from mjx_hand.motion.plausibility.motions import plausible_motion

_MARKER_FILES = (".c3d", ".trc", ".tsv")


def load_motion(
    path: str | Path,
    *,
    side: str | None = None,
    sequence: str | None = None,
    mano: str | Path | None = None,
    fps: float | int | None = None,
    markers: str | Path | None = None,
) -> Motion:
    """Read a motion; the format is recognised from the file itself (`mjx_hand/capture/datasets`, one module each).

    A recording of optical markers is fitted first, as `mjx-hand fit` does, which also says how good the fit is.

    Args:
        path: a recording: a file, or a folder where a dataset's recording is one.
        side: "right" or "left", where both hands are recorded.
        sequence: the name of one recording, where there are several.
        mano: a licensed MANO file of that side, where the poses need its components or mean.
        fps: frames per second, where the recording does not say.
        markers: the marker set of a marker recording: a YAML file, or "hand22" or "glove13".

    Raises:
        InputError: there is no such file, no format recognises it, its contents are not sound, or it is not what was
            asked for, or no hand moves so (`mjx_hand.motion.plausibility`).
    """
    path = Path(path)
    request = requested(side, sequence, mano, fps)
    if markers is not None:
        if sequence is not None or fps is not None:
            raise InputError(
                f"{path}: marker files hold one recording and its rate; leave out sequence= and fps= (where a file "
                "says none: load_markers(path, fps=), fit_markers)"
            )
        return _fitted(path, markers, load_hand(mano, side or "right"))
    return motion_in(path, contents_of(path), request)


def requested(side: str | None, sequence: str | None, mano: str | Path | None, fps: float | int | None) -> Request:
    """What a caller says of a recording.

    Raises:
        InputError: a side that there is not.
    """
    if side not in (None, "right", "left"):
        raise InputError(f"side is {side!r}; give 'right' or 'left'")
    return Request(
        side=side,
        sequence=sequence,
        mano=Path(mano) if mano is not None else None,
        fps=float(fps) if fps is not None else None,
    )


def contents_of(path: Path) -> Contents:
    """What a recording's file holds, read once for whoever asks what it is.

    Raises:
        InputError: there is no such file, or it is damaged.
    """
    if not path.is_dir():
        check_input_file(path, "give the path of a recording")
    return read_contents(path)


def motion_in(path: Path, contents: Contents, request: Request) -> Motion:
    """The motion in a recording whose contents are read.

    Raises:
        InputError: as `load_motion`.
    """
    for known in dataset_formats():
        if known.recognises(path, contents):
            motion = _asked_for(path, known, request, known.read(path, contents, request))
            return plausible_motion(motion, name=str(path))
    raise InputError(f"{path}: not a recording that is known here, but {_found(path, contents)}")


def _fitted(path: Path, markers: str | Path, hand: HandModel) -> Motion:
    """The motion of the hand that wears these markers."""
    marker_set = load_marker_set(markers, hand)
    recording = match_labels(load_markers(path), marker_set).recording
    return fit_markers(fill_short_gaps(recording, FILL), hand, marker_set)[0]


def _asked_for(path: Path, known: DatasetFormat, request: Request, motion: Motion) -> Motion:
    """`motion`, if nothing that the caller said is untrue of it."""
    if request.sequence is not None and not known.has_sequences:
        raise InputError(f"{path}: holds one recording; leave out sequence={request.sequence!r}")
    if request.side not in (None, motion.side):
        raise InputError(f"{path}: holds a {motion.side} hand; leave out side={request.side!r}")
    if request.fps not in (None, motion.fps):
        raise InputError(f"{path}: was recorded at {motion.fps:g} frames per second; leave out fps={request.fps:g}")
    return motion


def _found(path: Path, contents: Contents) -> str:
    if path.suffix.lower() in _MARKER_FILES:
        return "a marker recording: name its marker set, markers='hand22' or a YAML file, or run mjx-hand fit"
    if "schema" in contents:
        return f"an .npz of schema {str(contents['schema'])[:60]}, not a motion"
    return described_for_reading(path, contents)
