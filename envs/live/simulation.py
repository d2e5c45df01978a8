"""`Simulation`: the twin's world, in real time, towards where the tracker has the hand."""

import threading
import time
from dataclasses import dataclass
from pathlib import Path

from envs.live.flow.newest import Newest
from envs.live.flow.timing import Timing
from envs.live.real_time import Pace
from envs.live.service.feed import Feed
from envs.live.service.scene_message import scene_message
from envs.live.service.snapshot import Snapshot
from envs.live.twin.follower import Follower
from envs.live.twin.pose import HandPose
from envs.live.twin.recorder import Recorder, save_recording
from envs.live.twin.tabletop import Tabletop
from envs.live.twin.tracker import Tracker
from envs.live.twin.world import OFF, Assist, World
from mjx_hand.errors import InputError
from mjx_hand.motion.scene import RecordedScene

_PICTURES = 1 / 60  # s between pictures where no frame is new
_RECORDED = 5  # physics steps a recorded frame: 50 a second, the control rate of training


@dataclass(frozen=True)
class Target:
    """Where the hand is to be, by one frame.

    Attributes:
        pose: None while the hand is not seen.
        arrived, ready: when the frame came, and when the pose was found (s).
        again: whether a recording begins with it, anew.
    """

    pose: HandPose | None
    arrived: float
    ready: float
    again: bool = False


class Simulation:
    """Steps the world as time passes, and publishes it.

    Args:
        table: the object.
        side: of the hand.
        folder: for recordings.
        timing: told of all that takes time.
        feed: where the twin goes.
        assist: see `World`.

    Attributes:
        recording: whether what the twin does is recorded.
    """

    def __init__(self, table: Tabletop, side: str, folder: Path, timing: Timing, feed: Feed, assist: Assist = OFF):
        self._table, self._side, self._folder = table, side, folder
        self._assist: Assist = assist
        self._timing, self._feed = timing, feed
        self._wishes: set[str] = set()
        self._number, self._shown = 0, 0.0
        self.recording = False

    def wish(self, what: str) -> None:
        """Somebody wants "reset" or "record"; done at the next step."""
        self._wishes.add(what)

    def run(self, targets: Newest[Target], tracker: Tracker, stop: threading.Event) -> None:
        """Wait for the hand; then step until `stop`.

        Args:
            targets: where the hand is to be.
            tracker: that finds them; it knows the hand by the first.
            stop: ends it.
        """
        while (first := targets.take(0.1)) is None or first.pose is None:
            if stop.is_set():
                return
        assert tracker.hand is not None
        assert tracker.placement is not None
        world = World(tracker.hand.rigid, self._table, first.pose, self._assist)
        follower = Follower(first.pose)
        recorder = Recorder(self._table, tracker.hand.shape, self._side, 1 / (_RECORDED * world.timestep))
        self._feed.scene = scene_message(tracker.hand.rigid, self._table, tracker.placement)
        wanted, steps = first.pose, 0
        pace = Pace(world.timestep, self._timing)
        while not stop.is_set():
            pace.wait()
            new = targets.take()
            if new is not None:
                wanted = new.pose
                if new.again and new.pose is not None:
                    world.reset(new.pose)
                    follower = Follower(new.pose)
            self._grant(world, recorder)
            if not world.step(follower.advance(wanted, world.timestep)):
                self._timing.count("physics_resets")
                self._timing.say("physics diverged and was reset")
            steps += 1
            if steps % _RECORDED == 0:
                self._record(world, recorder)
            self._show(world, new, tracked=wanted is not None)

    def _show(self, world: World, new: Target | None, tracked: bool) -> None:
        """Publish the world where a frame is new, and else at the rate of pictures."""
        stepped = time.monotonic()
        fresh = new if new is not None and new.pose is not None else None
        if fresh is not None:
            self._timing.add("physics", stepped - fresh.ready)
        elif stepped - self._shown < _PICTURES:
            return
        self._number, self._shown = self._number + 1, stepped
        self._feed.publish(
            Snapshot(
                number=self._number,
                time=float(world.data.time),
                poses=world.poses(),
                angles=world.angles,
                touches=tuple(world.touches()) if self._feed.wants_touches else (),
                tracked=tracked,
                stepped=stepped,
                arrived=fresh.arrived if fresh is not None else None,
            )
        )

    def _grant(self, world: World, recorder: Recorder) -> None:
        """Do what somebody wished."""
        if not self._wishes:
            return
        wishes, self._wishes = self._wishes, set()
        if "reset" in wishes:
            world.put_object_back()
        if "record" in wishes:
            if self.recording:
                self._save(recorder.end())
            else:
                recorder.begin()
            self.recording = recorder.on

    def _record(self, world: World, recorder: Recorder) -> None:
        if not recorder.on:
            return
        recorder.add(world, world.poses())
        if not recorder.on:
            self.recording = False
            self._timing.say("the recording was full and has ended")
            self._save(recorder.end())

    def _save(self, scene: RecordedScene | None) -> None:
        """Write a recording, beside the physics."""

        def save() -> None:
            if scene is None:
                self._timing.say("nothing was recorded")
                return
            try:
                path = save_recording(scene, self._folder)
                self._timing.say(f"recorded {scene.num_frames / scene.fps:.1f} s: {path}")
            except InputError as error:
                self._timing.say(str(error))

        threading.Thread(target=save, name="live recording").start()
