"""`load_scene`: hands and objects from a recording of any format that the project reads."""

from pathlib import Path

from mjx_hand.capture.datasets.dataset_format import Contents, DatasetFormat, Request, dataset_formats
from mjx_hand.capture.load import load_motion
from mjx_hand.errors import InputError
from mjx_hand.files.contents import read_contents
from mjx_hand.files.input_file import check_input_file
from mjx_hand.motion import RecordedScene, make_scene
from mjx_hand.motion.plausibility.motions import plausible_motion
from mjx_hand.pytree import replace


def load_scene(
    path: str | Path,
    *,
    side: str | None = None,
    sequence: str | None = None,
    mano: str | Path | None = None,
    fps: float | int | None = None,
    markers: str | Path | None = None,
) -> RecordedScene:
    """Read a recording with the objects in it: both hands where both are recorded, unless `side` chooses one.

    Recordings of one hand and nothing else are scenes without an object.

    Args:
        path, sequence, fps, markers: as `load_motion` takes them.
        side: "right" or "left", for that hand alone.
        mano: a licensed MANO file of the hand that is read; for both hands the folder of MANO_RIGHT.pkl and
            MANO_LEFT.pkl.

    Raises:
        InputError: as `load_motion`, or the objects cannot be read.
    """
    path = Path(path)
    known, contents = None, {}
    if markers is None:
        if not path.is_dir():
            check_input_file(path, "give the path of a recording")
        contents = read_contents(path)
        known = scene_format(path, contents)
    if known is None or known.read_scene is None:
        return make_scene(load_motion(path, side=side, sequence=sequence, mano=mano, fps=fps, markers=markers))
    if side not in (None, "right", "left"):
        raise InputError(f"side is {side!r}; give 'right' or 'left'")
    if sequence is not None and not known.has_sequences:
        raise InputError(f"{path}: holds one recording; leave out sequence={sequence!r}")
    folder = None if mano is None else Path(mano)
    scene = known.read_scene(path, contents, Request(side, sequence, folder, None if fps is None else float(fps)))
    if fps is not None and fps != scene.fps:
        raise InputError(f"{path}: was recorded at {scene.fps:g} frames per second; leave out fps={fps:g}")
    return replace(scene, hands=tuple(plausible_motion(hand, name=str(path)) for hand in scene.hands))


def scene_format(path: Path, contents: Contents) -> DatasetFormat | None:
    """The format that recognises a recording and reads more than one hand, or None."""
    known = next((each for each in dataset_formats() if each.recognises(path, contents)), None)
    return known if known is not None and known.read_scene is not None else None
