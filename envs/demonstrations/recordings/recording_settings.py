"""`RecordingSettings`: real recordings in the place of simulated capture, and how they are varied."""

import dataclasses
import math

from mjx_hand.errors import InputError
from mjx_hand.motion.make_scene import up_vector
from mjx_hand.motion.smooth import CUTOFF

VARIATION, RECORDING = "variation", "recording"
SIDES = ("", "right", "left")


@dataclasses.dataclass(frozen=True)
class RecordingSettings:
    """Real recordings in the place of simulated capture, and how to vary them.

    Attributes:
        path: a recording with its objects, or a folder of such; empty for simulated capture.
        up: against gravity in the recordings' axes, such as "+z"; empty where they say, or where it is to be found.
        side: "right" or "left" for that hand alone; empty for the one that moves an object longest.
        object: name of the object to take; empty for the one that is moved longest.
        hold_out: "variation": both parts hold variations of every recording, of different seeds; "recording": one of
            four recordings is held out as a whole.
        train, heldout: demonstrations in each part, of all recordings together. The first held-out one of each
            recording is the recording itself, not varied.
        mass, density: of the object, kg or kg/m³ of its volume; without either 500 kg/m³ are taken.
        friction: of the object as it was recorded.
        masses, frictions: between which variations draw them; without masses a quarter around the object's.
        force: with which the hand must be able to carry the object as it was recorded (N); null for what its weight
            asks for.
        speeds: between which the pace is drawn, as a multiple of the recorded one.
        wrist_error: standard deviation of the wrist's slow error, m; of its orientation, ten times as many rad.
        angle_error: of the hinges' slow error, rad.
        start_error: of where the wrist starts, m; gone when the hand is at the object.
        pieces: convex pieces at most that the object's mesh becomes.
        rate: of the demonstrations, 1/s.
        cutoff: of the low-pass filter on the recorded angles and poses, Hz.
    """

    path: str = ""
    up: str = ""
    side: str = ""
    object: str = ""
    hold_out: str = VARIATION
    train: int = 64
    heldout: int = 32
    mass: float | None = None
    density: float | None = None
    friction: float = 0.8
    masses: tuple[float, float] | None = None
    frictions: tuple[float, float] = (0.7, 1.0)
    force: float | None = None
    speeds: tuple[float, float] = (0.9, 1.1)
    wrist_error: float = 0.001
    angle_error: float = 0.02
    start_error: float = 0.01
    pieces: int = 6
    rate: float = 50.0
    cutoff: float = CUTOFF

    def __post_init__(self):
        up_vector(self.up or None)
        if self.side not in SIDES:
            raise InputError(f"data.recording.side is {self.side!r}; valid: right, left, or empty for either")
        if self.hold_out not in (VARIATION, RECORDING):
            raise InputError(f"data.recording.hold_out is {self.hold_out!r}; valid: {VARIATION}, {RECORDING}")
        if self.mass is not None and self.density is not None:
            raise InputError("both data.recording.mass and data.recording.density are given; give one of them")
        for name in ("train", "heldout", "pieces"):
            if getattr(self, name) < 1:
                raise InputError(f"data.recording.{name} is {getattr(self, name)}; it must be at least 1")
        for name in ("mass", "density", "friction", "force", "rate", "cutoff"):
            value = getattr(self, name)
            if value is not None and not 0 < value < math.inf:
                raise InputError(f"data.recording.{name} is {value}; it must be a positive number")
        for name in ("masses", "frictions", "speeds"):
            limits = getattr(self, name)
            if limits is not None and (len(limits) != 2 or not 0 < limits[0] <= limits[1] < math.inf):
                raise InputError(
                    f"data.recording.{name} is {list(limits)}; give the lowest and the highest, both above 0"
                )
        for name in ("wrist_error", "angle_error", "start_error"):
            if not 0 <= getattr(self, name) < math.inf:
                raise InputError(f"data.recording.{name} is {getattr(self, name)}; it must be a number of 0 or more")
        if self.cutoff >= self.rate / 2:
            raise InputError(
                f"data.recording.cutoff is {self.cutoff} Hz; it must be below half of data.recording.rate ({self.rate})"
            )
