"""Folders of recordings onto hinges: any number of files of any lengths, in bounded memory, and able to go on.

Short recordings are laid end to end until a chunk is full, long ones are cut into chunks, and every chunk is one call
of the same compiled function over all devices. Files are read a little ahead, so that no more than a few are held.
"""

import dataclasses
import os
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from mjx_hand.capture.load import load_motion
from mjx_hand.errors import InputError, reason_of
from mjx_hand.files.npz_archive import remove_leftovers
from mjx_hand.motion import Motion, check_motion, save_joint_motion
from mjx_hand.retarget.frames import CHUNK, HANDS
from mjx_hand.retarget.hands import KinematicHands
from mjx_hand.retarget.ledger import NAME as LEDGER
from mjx_hand.retarget.ledger import Ledger, key_of
from mjx_hand.retarget.options import RetargetOptions
from mjx_hand.retarget.sequence import errors_of_many, plausible_angles, retarget_many
from mjx_hand.retarget.smoothing import penalty
from mjx_hand.retarget.summary import FAILED, Outcome, outcome_of, write_summary
from mjx_hand.rigid.rigid_hand import RigidHand

SUMMARY = "summary.csv"
_AHEAD = 2  # recordings read while others are computed


@dataclasses.dataclass(frozen=True)
class _Item:
    """One recording of the data set: its name in the summary, where it is and where its output goes."""

    file: str
    source: Path
    output: Path
    key: str
    size: int


@dataclasses.dataclass(frozen=True)
class _Loaded:
    item: _Item
    motion: Motion
    rigid: RigidHand


def retarget_dataset(
    folder: Path,
    out: Path,
    options: RetargetOptions,
    *,
    axes: str = "anatomical",
    mano: Path | None = None,
    side: str | None = None,
    fps: float | None = None,
    pattern: str = "*.npz",
    began: Callable[[int], None] = lambda total: None,
    advance: Callable[[int], None] = lambda size: None,
) -> list[Outcome]:
    """Retarget every recording below `folder`, to a joint-motion file of the same name below `out`.

    A run that was killed is taken up where it stopped: what is done with the same input and settings is not done again.
    A file that cannot be used is reported in its row, its output from an earlier run removed, and the rest done.
    `out/summary.csv` has one row per file.

    Args:
        folder: recordings, in folders of any depth; names that begin with a dot are passed over.
        out: where outputs go; made if absent.
        options: how to retarget.
        axes: see `KinematicHands`.
        mano: a licensed MANO file, for recordings made with one.
        side, fps: as for `load_motion`, for all recordings.
        pattern: which files (or folders, where a recording is one) are recordings, such as "*.npz" or "seq*/hand.npy".
        began: told the number of bytes to be worked through.
        advance: told each time how many bytes are done.

    Returns:
        The rows, in the order of the files' names.

    Raises:
        InputError: nothing matches, the settings are not valid, or the output cannot be written.
    """
    if mano is not None and not mano.is_file():
        raise InputError(f"{mano}: no such file; give the path of a MANO file, or none for the open hand")
    hands = KinematicHands(mano, axes)
    given = {"axes": axes, "mano": None if mano is None else key_of(mano, {}), "side": side, "fps": fps}
    items = _items(folder, out, pattern, dataclasses.asdict(options) | given)
    ledger = Ledger(out)
    _remove_leftovers(out, items)
    began(sum(item.size for item in items))
    rows: dict[str, Outcome] = {}
    waiting: list[_Item] = []
    for item in items:
        row = ledger.done(item.file, item.key, item.output)
        if row is None:
            waiting.append(item)
        else:
            rows[item.file] = row
            advance(item.size)

    def read(source: Path) -> tuple[Motion, RigidHand]:
        motion = check_motion(load_motion(source, side=side, mano=mano, fps=fps), name=str(source))
        if options.smooth is not None:
            penalty(float(motion.fps), options.smooth)
        return motion, hands.of(motion)

    batch: list[_Loaded] = []

    def finish() -> None:
        for item, row in _finished(batch, options, ledger):
            rows[item.file] = row
            advance(item.size)
        batch.clear()

    for item, loaded in _read_ahead(read, waiting):
        if isinstance(loaded, Outcome):
            if ledger.knows(item.file):
                item.output.unlink(missing_ok=True)
            rows[item.file] = loaded
            advance(item.size)
            continue
        frames = sum(other.motion.num_frames for other in batch)
        if batch and (frames + loaded.motion.num_frames > CHUNK or len(batch) == HANDS):
            finish()
        batch.append(loaded)
    finish()
    outcomes = [rows[item.file] for item in items]
    write_summary(outcomes, out / SUMMARY)
    return outcomes


def _items(folder: Path, out: Path, pattern: str, settings: dict) -> list[_Item]:
    """The recordings, sorted by name."""
    if out.resolve() == folder.resolve():
        raise InputError(f"{out}: recordings and outputs are in one folder; give another one for the outputs")
    try:
        found = sorted({path for below in _folders(folder) for path in below.glob(_any_case(pattern))})
    except (ValueError, NotImplementedError) as error:
        raise InputError(f"pattern {pattern!r} is not one: {error}; give one such as '*.npz'") from None
    items: dict[Path, _Item] = {}
    for source in found:
        relative = source.relative_to(folder)
        hidden = any(part.startswith(".") for part in relative.parts)
        if hidden or source.resolve().is_relative_to(out.resolve()):
            continue
        named = relative.suffix.lower() == ".npz"
        output = out / (relative.with_suffix(".npz") if named else relative.with_name(f"{relative.name}.npz"))
        if output in items:
            raise InputError(f"{source} and {items[output].source} would have one output, {output}; rename one")
        items[output] = _Item(relative.as_posix(), source, output, key_of(source, settings), _size(source))
    if not items:
        raise InputError(f"{folder}: nothing in it matches {pattern!r}; give a pattern that fits the recordings' names")
    return list(items.values())


def _folders(folder: Path) -> Iterator[Path]:
    """`folder` and all below it, through symbolic links too, each once."""
    known: set[str] = set()
    for at, below, _ in os.walk(folder, followlinks=True):
        real = os.path.realpath(at)
        if real in known:
            below.clear()
            continue
        known.add(real)
        below[:] = sorted(name for name in below if not name.startswith("."))
        yield Path(at)


def _any_case(pattern: str) -> str:
    """A pattern whose suffix may be in capitals: cameras and Windows write A.NPZ."""
    stem, dot, ending = pattern.rpartition(".")
    if not dot or not ending.isalnum():
        return pattern
    return (
        stem + dot + "".join(f"[{letter.lower()}{letter.upper()}]" if letter.isalpha() else letter for letter in ending)
    )


def _size(source: Path) -> int:
    return sum(p.stat().st_size for p in source.rglob("*") if p.is_file()) if source.is_dir() else source.stat().st_size


def _remove_leftovers(out: Path, items: Sequence[_Item]) -> None:
    """Temporary files that a killed run was writing."""
    names: dict[Path, list[str]] = {out: [SUMMARY, LEDGER]}
    for item in items:
        names.setdefault(item.output.parent, []).append(item.output.name)
    for folder, own in names.items():
        remove_leftovers(folder, frozenset(own))


def _read_ahead(
    read: Callable[[Path], tuple[Motion, RigidHand]], items: Sequence[_Item]
) -> Iterator[tuple[_Item, _Loaded | Outcome]]:
    """Each item with what `read` makes of it, a few of them loaded in another thread meanwhile."""
    with ThreadPoolExecutor(1) as pool:
        pending = deque((item, pool.submit(_loaded, item, read)) for item in items[:_AHEAD])
        for later in [*items[_AHEAD:], *[None] * min(_AHEAD, len(items))]:
            item, future = pending.popleft()
            loaded = future.result()
            if later is not None:
                pending.append((later, pool.submit(_loaded, later, read)))
            yield item, loaded


def _loaded(item: _Item, read: Callable[[Path], tuple[Motion, RigidHand]]) -> _Loaded | Outcome:
    try:
        return _Loaded(item, *read(item.source))
    except InputError as error:
        return Outcome(item.file, FAILED, message=str(error))
    except Exception as error:  # a damaged file can make a library fail in any way; the others must go on
        message = f"{item.source}: cannot be read ({type(error).__name__}: {reason_of(error)})"
        return Outcome(item.file, FAILED, message=message)


def _finished(batch: Sequence[_Loaded], options: RetargetOptions, ledger: Ledger) -> Iterator[tuple[_Item, Outcome]]:
    """Retarget and write the recordings of one batch."""
    if not batch:
        return
    motions, hands = [b.motion for b in batch], [b.rigid for b in batch]
    made = retarget_many(motions, hands, options)
    errors = errors_of_many(motions, made, hands)
    for loaded, angles, error in zip(batch, made, errors, strict=True):
        item = loaded.item
        try:
            joints = plausible_angles(angles, loaded.rigid)
        except InputError as refusal:
            item.output.unlink(missing_ok=True)  # of an earlier run
            yield item, Outcome(item.file, FAILED, message=str(refusal))
            continue
        row = outcome_of(item.file, loaded.motion, error, joints.warnings)
        save_joint_motion(joints, item.output)
        ledger.add(row, item.key, item.output)
        yield item, row
