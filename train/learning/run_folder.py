"""The folder of one training: its settings, the states it can go on from, and the lock that keeps a second one out."""

import contextlib
import dataclasses
import shutil
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from filelock import FileLock, Timeout

from mjx_hand.errors import InputError
from mjx_hand.files.npz_archive import remove_leftovers, replacing
from train.learning.curve import CURVE, points_of
from train.learning.training_state import load_run, save_run
from train.settings.config import Config
from train.settings.processes import is_first, wait_for_all
from train.settings.saved import FILE, Settings, contradiction, read_settings, settings_of, write_settings

BEST, LAST = "best.npz", "last.npz"
_LOCK = "lock"
_ADVICE = "choose another folder with out=FOLDER, or train anew in this one with fresh=true"


@contextlib.contextmanager
def run_folder(config: Config) -> Iterator["RunFolder"]:
    """`config.out`, made if absent, to this training alone until the context ends.

    With `config.fresh` whatever an earlier training left to go on from is deleted. A folder that was made here goes
    again where the training is refused before it has a state.

    Raises:
        InputError: it cannot be written, another training is under way in it, or it holds one of other settings.
    """
    folder = RunFolder(Path(config.out), settings_of(config))
    with _gone_if_refused(folder), _alone_in(folder.path):
        if is_first():
            if config.fresh:
                for old in (folder.states, folder.path / "tensorboard"):
                    shutil.rmtree(old, ignore_errors=True)
            folder.clear()
        wait_for_all("run folder")
        if folder.states.is_dir() and (folder.path / FILE).is_file():
            _check_same(folder)
        if is_first():
            with replacing(folder.path / FILE) as temporary:
                write_settings(config, temporary)
        yield folder


@dataclasses.dataclass(frozen=True)
class RunFolder:
    """Where a training keeps its files; `run_folder` opens it.

    Attributes:
        path: of the folder.
        settings: of the training, which every state must have been made with.
    """

    path: Path
    settings: Settings

    @property
    def states(self) -> Path:
        """The folder of the states."""
        return self.path / "state"

    def load(self, template: Any) -> tuple[Any, dict[str, Any]] | None:
        """The newest sound state of these settings and its notes, as `load_run`."""
        return load_run(self.states, template, self._check_notes)

    def save(self, steps: int, state: Any, notes: Mapping[str, Any]) -> None:
        """Keep a state, as `save_run`."""
        save_run(self.states, steps, state, {**notes, "settings": dict(self.settings)})

    def clear(self) -> None:
        """Delete what trainings that were killed were writing."""
        remove_leftovers(self.path, (BEST, LAST, CURVE, FILE))
        remove_leftovers(self.states)
        remove_leftovers(self.path / "unstable")

    def _check_notes(self, notes: Mapping[str, Any]) -> None:
        if refused := contradiction("it", notes["settings"], self.settings):
            raise InputError(refused)
        numbers = [notes["seconds"], *(value for point in points_of(notes) for value in dataclasses.astuple(point))]
        if not all(isinstance(number, int | float) for number in numbers):
            raise InputError("its evaluations are no numbers")


@contextlib.contextmanager
def _gone_if_refused(folder: RunFolder) -> Iterator[None]:
    made = [path for path in (folder.path, *folder.path.parents) if not path.exists()]
    try:
        yield
    except InputError:
        if made and not folder.states.is_dir() and is_first():
            with contextlib.suppress(OSError):  # it never came to be, or something else is in it by now
                for name in (FILE, _LOCK):
                    (folder.path / name).unlink(missing_ok=True)
                for path in made:
                    path.rmdir()
        raise


@contextlib.contextmanager
def _alone_in(path: Path) -> Iterator[None]:
    """A context in which no other training writes there; the system ends it for a process that is killed."""
    if not is_first():
        yield
        return
    lock = FileLock(path / _LOCK)
    try:
        path.mkdir(parents=True, exist_ok=True)
        lock.acquire(blocking=False)
    except Timeout:
        raise InputError(
            f"another training is under way in {path}; let it end or stop it, or choose another folder with out=FOLDER"
        ) from None
    except OSError as error:
        raise InputError(f"cannot write {path}: {error.strerror}; choose another folder with out=FOLDER") from None
    try:
        yield
    finally:
        lock.release()


def _check_same(folder: RunFolder) -> None:
    written = folder.path / FILE
    try:
        before = read_settings(written)
    except InputError as error:  # it is written anew; each state says itself what it belongs to
        print(f"damaged, so the settings in the states are used: {error}", flush=True)
        return
    if refused := contradiction(str(folder.path), before, folder.settings):
        raise InputError(f"{refused}; {_ADVICE}")
