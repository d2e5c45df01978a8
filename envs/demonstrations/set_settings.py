"""`SetSettings`: what a demonstration set holds, and where it is kept."""

import dataclasses
from pathlib import Path
from typing import Any

from envs.demonstrations.recordings.recording_files import recording_digest
from envs.demonstrations.recordings.recording_settings import RecordingSettings
from envs.demonstrations.scripted.simulated_capture import CaptureSettings
from envs.grasps import FIVE, grasp_names, grasp_type
from envs.grip_force import RECORDED
from mjx_hand.errors import InputError
from mjx_hand.files.digests import json_digest
from mjx_hand.objects.mesh_file import mesh_digest

ALL = "all"
GIVEN = "given"
_VERSION = 4  # of the generator: a change that makes other demonstrations of the same settings raises it
_RECORDED_VERSION = 5  # the same of what is made of a recording
_STREAMED_VERSION = 1  # the same of how a tracker sees hands (`envs.demonstrations.streamed_hand`)


@dataclasses.dataclass(frozen=True)
class SetSettings:
    """What a demonstration set holds.

    Attributes:
        grasp: name of the grasp type, "all" for a set of each of the paper's five (`envs.grasps.FIVE`), "recorded" for
            what a real recording shows, or "given" for a folder of finished demonstrations, of which nothing is made.
        people: random hand shapes in the training part.
        trials: demonstrations of each of them.
        heldout_people, heldout_trials: others, in the held-out part, and the demonstrations of each.
        sealed_people, sealed_trials: those of the sealed part, which is made and evaluated apart, after everything was
            chosen (`sealed_folder`).
        sealed_seed: of the sealed part's draw. Once its figures were read and something was changed after them, they
            are no longer unknown: the next are of the next seed.
        seed: of every draw; the held-out part uses the next one.
        capture: how they are recorded.
        recording: the real recording, and how it is varied; of the other settings it uses the seed.
        streamed: whether what a live tracker makes of the hand, late and with noise, stands beside how it moved
            (`envs.demonstrations.streamed_hand`); of scripted grasps.
        side: of the hand that scripted grasps are of; a left one's are mirror images of the right one's. A recording
            has its own.
        folder: of finished demonstrations, as `load_set.load_part` reads it.
        object: a mesh file (m), which scripted grasps grasp in place of the type's objects; its axes are the type's.
        object_mass, object_density: of it, kg or kg/m³; without either the type's range of masses is drawn from.
    """

    grasp: str
    people: int = 8
    trials: int = 8
    heldout_people: int = 20
    heldout_trials: int = 3
    sealed_people: int = 20
    sealed_trials: int = 3
    sealed_seed: int = 1
    seed: int = 0
    capture: CaptureSettings = dataclasses.field(default_factory=CaptureSettings)
    recording: RecordingSettings = dataclasses.field(default_factory=RecordingSettings)
    streamed: bool = False
    side: str = "right"
    folder: str = ""
    object: str = ""
    object_mass: float | None = None
    object_density: float | None = None

    def __post_init__(self):
        if self.grasp not in (ALL, RECORDED, GIVEN):
            grasp_type(self.grasp)
        if self.side not in ("right", "left"):
            raise InputError(f"data.side is {self.side!r}; valid: right, left")
        if self.side != "right" and self.grasp in (RECORDED, GIVEN):
            raise InputError(
                f"data.side is {self.side!r} and data.grasp {self.grasp!r}; it is of scripted grasps, "
                "a recording's hand is chosen by data.recording.side"
            )
        if self.streamed and self.grasp in (RECORDED, GIVEN):
            raise InputError(
                f"data.streamed is true and data.grasp {self.grasp!r}; it is of scripted grasps: "
                f"{', '.join(grasp_names())}, {ALL}"
            )
        if (self.grasp == GIVEN) != bool(self.folder):
            raise InputError(
                f"data.grasp is {self.grasp!r} and data.folder {self.folder!r}; give data.folder=PATH alone for "
                "finished demonstrations, or a grasp type and no folder"
            )
        if (self.grasp == RECORDED) != bool(self.recording.path):
            raise InputError(
                f"data.grasp is {self.grasp!r} and data.recording.path {self.recording.path!r}; "
                f"give both, data.grasp={RECORDED} and the recording's folder, or a grasp type and no recording"
            )
        if self.object and self.grasp in (ALL, RECORDED, GIVEN):
            raise InputError(
                f"data.object is {self.object!r} and data.grasp {self.grasp!r}; an own object is grasped by one "
                f"scripted type: {', '.join(grasp_names())}"
            )
        if not self.object and (self.object_mass, self.object_density) != (None, None):
            raise InputError(
                "data.object_mass and data.object_density are those of data.object=FILE, which is not given"
            )
        if self.object_mass is not None and self.object_density is not None:
            raise InputError("both data.object_mass and data.object_density are given; give one of them")
        for name in ("people", "trials", "heldout_people", "heldout_trials", "sealed_people", "sealed_trials"):
            if getattr(self, name) < 1:
                raise InputError(f"data.{name} is {getattr(self, name)}; it must be at least 1")
        for name in ("seed", "sealed_seed"):
            if getattr(self, name) < 0:
                raise InputError(f"data.{name} is {getattr(self, name)}; it must not be negative")

    def expand_types(self) -> tuple["SetSettings", ...]:
        """The settings of the single sets that are made: one, five of `all`, or none of a given folder."""
        if self.grasp == GIVEN:
            return ()
        names = sorted(FIVE) if self.grasp == ALL else [self.grasp]
        return tuple(dataclasses.replace(self, grasp=name) for name in names)


def set_folder(settings: SetSettings, root: str | Path) -> Path:
    """Where a set of these settings lives below `root`: its name carries a digest of all settings and of the type.

    Raises:
        InputError: several or finished sets, which have no such folder, or a recording that is not there.
    """
    ingredients: list[Any] = [_VERSION, fingerprint(settings)]
    recording = ingredients[1].pop("recording", None)
    if settings.grasp == RECORDED:
        del recording["path"]  # what it holds tells, not where it is
        ingredients = [_RECORDED_VERSION, settings.seed, recording, recording_digest(settings.recording.path)]
    else:
        ingredients.append(_performed(settings.grasp))
    return Path(root) / f"{settings.grasp}-{json_digest(ingredients)[:10]}"


def sealed_folder(settings: SetSettings, root: str | Path) -> Path:
    """Where the sealed part of a set lives: other people and objects, of a seed that no other part or type has.

    Raises:
        InputError: demonstrations of recordings or given ones, which have no such part.
    """
    if settings.grasp not in grasp_names():
        raise InputError(
            f"demonstrations of {settings.grasp!r} have no sealed part, which scripted grasp types have; "
            "evaluate the part 'heldout'"
        )
    told = fingerprint(settings)
    told |= {"people": settings.sealed_people, "trials": settings.sealed_trials, "sealed_seed": settings.sealed_seed}
    del told["heldout_people"], told["heldout_trials"]
    return Path(root) / f"{settings.grasp}-sealed-{json_digest([_VERSION, told, _performed(settings.grasp)])[:10]}"


def seed_of_sealed(settings: SetSettings) -> int:
    """What a type's sealed part is drawn with, far from what the other parts and other types are drawn with."""
    return int(json_digest(["sealed", settings.sealed_seed, settings.seed, settings.grasp])[:8], 16)


def _performed(grasp: str) -> dict[str, Any]:
    """What of a grasp type decides on its demonstrations."""
    performed = dataclasses.asdict(grasp_type(grasp))
    del performed["grip_force"]  # it is the twin's: the same demonstrations are made whatever it is
    return performed


def fingerprint(settings: SetSettings) -> dict[str, Any]:
    """All settings that tell sets apart, as in `CaptureSettings.fingerprint`."""
    told = dataclasses.asdict(settings) | {"capture": settings.capture.fingerprint()}
    for name in ("sealed_people", "sealed_trials", "sealed_seed"):  # of a part that stands apart
        del told[name]
    del told["folder"]  # what it holds tells, not where it is: `load_set.part_digest`
    if settings.grasp != RECORDED:
        del told["recording"]
    # Right hands' sets, and those that no tracker saw, keep the names that they had before there were others.
    if settings.side == "right":
        del told["side"]
    if settings.streamed:
        told["streamed"] = _STREAMED_VERSION
    else:
        del told["streamed"]
    if settings.object:
        told["object"] = mesh_digest(settings.object)
    else:  # sets from before there were own objects keep their names
        for name in ("object", "object_mass", "object_density"):
            del told[name]
    return told
