"""`load_scene`: hands and objects from a recording of any format that the project reads."""

from pathlib import Path

from mjx_hand.capture.datasets.dataset_format import Contents, DatasetFormat, dataset_formats
from mjx_hand.capture.load import contents_of, load_motion, motion_in, requested
from mjx_hand.errors import InputError
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
    path, request = Path(path), requested(side, sequence, mano, fps)
    if markers is not None:
        return make_scene(load_motion(path, side=side, sequence=sequence, mano=mano, fps=fps, markers=markers))
    contents = contents_of(path)
    known = scene_format(path, contents)
    if known is None or known.read_scene is None:
        return make_scene(motion_in(path, contents, request))
    if sequence is not None and not known.has_sequences:
        raise InputError(f"{path}: holds one recording; leave out sequence={sequence!r}")
    scene = known.read_scene(path, contents, request)
    if fps is not None and fps != scene.fps:
        raise InputError(f"{path}: was recorded at {scene.fps:g} frames per second; leave out fps={fps:g}")
    return replace(scene, hands=tuple(plausible_motion(hand, name=str(path)) for hand in scene.hands))


def scene_format(path: Path, contents: Contents) -> DatasetFormat | None:
    """The format that recognises a recording and reads more than one hand, or None."""
    known = next((each for each in dataset_formats() if each.recognises(path, contents)), None)
    return known if known is not None and known.read_scene is not None else None
