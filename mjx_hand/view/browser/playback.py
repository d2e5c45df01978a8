"""Which frame is due: real time, slowed or sped up."""

from dataclasses import dataclass

SPEEDS = (0.1, 0.25, 0.5, 1.0, 2.0, 4.0)


@dataclass(frozen=True)
class Playback:
    """A recording that plays since a moment.

    Attributes:
        frames: of the recording.
        fps: frames per second.
        began: when it began (s, any clock).
        start: the frame that it began with.
        speed: times real time.
        loop: whether it begins again after the last frame.
    """

    frames: int
    fps: float
    began: float
    start: int = 0
    speed: float = 1.0
    loop: bool = True

    def frame(self, now: float) -> int:
        """The frame to show at a time of the same clock; the last one after the end."""
        due = self.start + int((now - self.began) * self.fps * self.speed + 1e-9)
        return due % self.frames if self.loop else min(due, self.frames - 1)

    def over(self, now: float) -> bool:
        """Whether the last frame has been reached and nothing follows."""
        return not self.loop and self.frame(now) == self.frames - 1
