"""The folder of one training: its settings, the states it can go on from, and the lock that keeps a second one out."""

import contextlib
import dataclasses
import json
import shutil
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from filelock import FileLock, Timeout
from omegaconf import OmegaConf

from envs.demonstrations.load_set import part_digest
from mjx_hand.errors import InputError
from mjx_hand.files.npz_archive import replacing
from train.learning.training_state import load_run, save_run
from train.settings.config import Config
from train.settings.processes import is_first, wait_for_all

# What may differ between a training and its continuation: places, and how long and how often.
_FREE = (
    "seeds",
    "out",
    "demonstrations",
    "checkpoint",
    "fresh",
    "distributed",
    "debug",
    "play",
    "export",
    "checks",
    "data.folder",
    "device",
    "ppo.num_updates",
    "ppo.num_timesteps",
)
# What options were called in folders of older trainings.
_RENAMED = {
    "task.wrist_move": "task.residual_scale_wrist_position",
    "task.wrist_turn": "task.residual_scale_wrist_rotation",
    "task.finger": "task.residual_scale_fingers",
    "task.position_sharpness": "task.reward_position_alpha",
    "task.rotation_sharpness": "task.reward_rotation_alpha",
    "task.lost_at": "task.termination_distance",
    "task.lost_at_last": "task.termination_distance_last",
    "task.mid_start": "task.random_start_prob",
    "task.ahead": "task.lookahead",
    "task.action_cost": "task.rewards.action",
}


@contextlib.contextmanager
def run_folder(config: Config) -> Iterator["RunFolder"]:
    """`config.out`, made if absent, to this training alone until the context ends.

    With `config.fresh` whatever an earlier training left to go on from is deleted.

    Raises:
        InputError: it cannot be written, another training is under way in it, or it holds one of other settings.
    """
    path = Path(config.out)
    folder = RunFolder(path)
    with _alone_in(path):
        if config.fresh and is_first():
            for old in (folder.states, path / "tensorboard"):
                shutil.rmtree(old, ignore_errors=True)
        wait_for_all("run folder")
        written = path / "config.yaml"
        if folder.states.is_dir() and written.is_file():
            _check_same(config, written)
        if is_first():
            with replacing(written) as temporary:
                temporary.write_text(OmegaConf.to_yaml(OmegaConf.create(_told(config))))
        yield folder


@dataclasses.dataclass(frozen=True)
class RunFolder:
    """Where a training keeps its files; `run_folder` opens it."""

    path: Path

    @property
    def states(self) -> Path:
        """The folder of the states."""
        return self.path / "state"

    def load(self, template: Any) -> tuple[Any, dict[str, Any]] | None:
        """The newest sound state and its notes, as `load_run`."""
        return load_run(self.states, template)

    def save(self, steps: int, state: Any, notes: Mapping[str, Any]) -> None:
        """Keep a state, as `save_run`."""
        save_run(self.states, steps, state, notes)


@contextlib.contextmanager
def _alone_in(path: Path) -> Iterator[None]:
    """A context in which no other training writes there; the system ends it for a process that is killed."""
    if not is_first():
        yield
        return
    lock = FileLock(path / "lock")
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


def _check_same(config: Config, written: Path) -> None:
    # An option that there was not yet when the folder was written had what is now its default.
    saved = {_RENAMED.get(name, name): value for name, value in _settings(_read(written)).items()}
    before, now = _settings(_told(Config())) | saved, _settings(_told(config))
    differing = [name for name in sorted(before.keys() | now.keys()) if before.get(name) != now.get(name)]
    if differing:
        name = differing[0]
        others = f" and {len(differing) - 1} more" if len(differing) > 1 else ""
        raise InputError(
            f"{written.parent} holds a training with {name}={before.get(name)}, now {now.get(name)}{others}; "
            "choose another folder with out=FOLDER, or train anew in this one with fresh=true"
        )


def _told(config: Config) -> dict[str, Any]:
    """All options as the file has them, lists for tuples, and what finished demonstrations hold, wherever they are."""
    options = json.loads(json.dumps(dataclasses.asdict(config)))
    if config.data.folder:
        options["data"]["contents"] = part_digest(config.data.folder, "train")
    return options


def _read(path: Path) -> dict[str, Any]:
    values = OmegaConf.to_container(OmegaConf.load(path))
    if not isinstance(values, dict):
        raise InputError(f"{path}: not a configuration; train anew with fresh=true")
    return {str(name): value for name, value in values.items()}


def _settings(values: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """Dotted option to value, without those that may differ."""
    flat: dict[str, Any] = {}
    for name, value in values.items():
        option = prefix + name
        if option not in _FREE:
            flat |= _settings(value, f"{option}.") if isinstance(value, Mapping) else {option: value}
    return flat
