"""What `mjx-hand live` takes on this machine: a hand sent by UDP, its twin, and the page in a headless Chromium.

The hand reaches down to the object, closes, lifts and opens again, at 60 frames a second. Sender, command and browser
are three programs, as they are in use. `--hours` streams as much in fast motion, without waiting, and compares memory.
"""

import dataclasses
import json
import re
import shutil
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator

import numpy as np
from jaxtyping import Float

from envs.live.flow.timing import STAGES, Timing
from envs.live.twin.follower import Follower
from envs.live.twin.hand_solver import HandSolver
from envs.live.twin.hinge_keypoints import hinge_keypoints
from envs.live.twin.placement import place_hand
from envs.live.twin.pose import HandPose
from envs.live.twin.tabletop import tabletop
from envs.live.twin.world import World
from mjx_hand.errors import InputError
from mjx_hand.hand.load import load_hand
from mjx_hand.rigid.build import build_rigid_hand
from mjx_hand.rigid.rigid_hand import RigidHand
from train.benchmark.memory import resident
from train.reports.machine import processor

_RATE = 60.0
_PERIOD = 6.0  # s of the motion
_BROWSERS = ("chromium", "chromium-browser", "google-chrome")
_HEADLESS = (
    *("--headless", "--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--no-first-run"),
    *("--disable-background-networking", "--disable-component-update", "--disable-sync", "--window-size=1200,800"),
    "--remote-debugging-port=0",
)


@dataclasses.dataclass(frozen=True)
class Options:
    """Measure the live twin.

    Attributes:
        seconds: of streaming, after the page has opened.
        browser: whether a headless Chromium looks on.
        object: a grasp type, or a mesh.
        hours: of streaming in fast motion, for memory; 0 leaves it out.
    """

    seconds: float = 60.0
    browser: bool = True
    object: str = "pinch"
    hours: float = 0.0


def report(options: Options) -> list[str]:
    """The measurements as Markdown.

    Raises:
        InputError: there is no Chromium, or the command did not start.
    """
    rigid = build_rigid_hand(load_hand())
    measured = _measure(options, _motion(rigid))
    stages, counts = measured["stages_ms"], measured["counts"]
    lines = [
        f"{processor()}; {options.seconds:g} s at {_RATE:g} frames/s, {options.object}, "
        + ("a headless Chromium drawing in software on the same cores" if options.browser else "no browser"),
        "",
        "| ms | p50 | p99 | longest |",
        "|---|---:|---:|---:|",
    ]
    lines += [f"| {s} | {stages[s]['p50']:.2f} | {stages[s]['p99']:.2f} | {stages[s]['max']:.1f} |" for s in STAGES]
    lines += ["", ", ".join(f"{name.replace('_', ' ')} {count:g}" for name, count in counts.items())]
    if options.hours:
        lines += ["", *_fast(options, rigid)]
    return lines


def _motion(rigid: RigidHand) -> Float[np.ndarray, "t 21 3"]:
    """Keypoints of a period, y up as headsets have it."""
    t = np.arange(round(_PERIOD * _RATE)) / (_PERIOD * _RATE)
    down, closed = np.clip(np.sin(2 * np.pi * t), 0, 1), np.clip(1.5 * np.sin(2 * np.pi * t - 0.5), 0, 1)
    angles = closed[:, None] * np.array([0.0, 0.9, 0.9, 0.6] * 5) + 0.1
    place = np.stack([-0.1 * down, 1.2 - 0.12 * down, np.full(len(t), -0.4)], axis=1)
    return hinge_keypoints(angles, place, np.tile([1.0, 0.0, 0.0, 0.0], (len(t), 1)), rigid)


def _measure(options: Options, keypoints: Float[np.ndarray, "t 21 3"]) -> dict:
    browser = next(filter(None, map(shutil.which, _BROWSERS)), None)
    if options.browser and browser is None:
        raise InputError(f"there is none of {', '.join(_BROWSERS)} to look on; install one, or give --no-browser")
    command = [sys.executable, "-m", "mjx_hand", "live", "--source", "udp", "--udp-port", "0", "--port", "0"]
    command += ["--object", options.object]
    with (
        tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile,
        subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as live,
    ):
        looking = None
        try:
            assert live.stderr is not None
            url, port = _addresses(live.stderr)
            if options.browser and browser is not None:
                call = [browser, *_HEADLESS, f"--user-data-dir={profile}", url]
                looking = subprocess.Popen(call, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            _send(keypoints, port, options.seconds)
            live.send_signal(2)
            out, _ = live.communicate(timeout=60)
            return json.loads(out)
        finally:
            for process in (looking, live):
                if process is not None and process.poll() is None:
                    process.kill()
                    process.wait()


def _addresses(said: Iterator[str]) -> tuple[str, int]:
    """The page's address and the port of messages, as the command says them."""
    url, text = "", ""
    for line in said:
        text += line
        url = url or next(iter(re.findall(r"open (http\S+)", line)), "")
        if port := re.search(r"udp \S+:(\d+)", line):
            return url, int(port[1])
    raise InputError(f"mjx-hand live did not start: {text.strip()[-300:]}")


def _send(keypoints: Float[np.ndarray, "t 21 3"], port: int, seconds: float) -> None:
    """Send the motion over and over, in time."""
    messages = [json.dumps({"keypoints": np.round(frame, 6).tolist()}).encode() for frame in keypoints]
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sending:
        began = time.monotonic()
        for k in range(round(seconds * _RATE)):
            time.sleep(max(0.0, began + k / _RATE - time.monotonic()))
            sending.sendto(messages[k % len(messages)], ("127.0.0.1", port))


def _fast(options: Options, rigid: RigidHand) -> list[str]:
    """Hours of streaming without waiting: retargeting, following, physics and timing, in one thread."""
    keypoints = _motion(rigid)
    solver, timing, table = HandSolver(rigid), Timing(), tabletop(options.object)
    frames, memory = round(3600 * options.hours * _RATE), []
    placement, world, follower = None, None, None
    began, due = time.monotonic(), 0.0
    for k in range(frames):
        found = solver.solve(keypoints[k % len(keypoints)])
        if found is None:
            continue
        position, quaternion, angles = found
        placement = placement or place_hand(position, quaternion, rigid, "+y", "-z")
        pose = HandPose(placement.position(position), placement.quaternion(quaternion), angles)
        if world is None or follower is None:
            world, follower = World(rigid, table, pose), Follower(pose)
        due += 1 / _RATE
        while float(world.data.time) < due:
            timing.count("physics_resets", not world.step(follower.advance(pose, world.timestep)))
        timing.add("retargeting", 0.0)
        if k % (frames // 20) == frames // 20 - 1:
            memory.append((resident("VmRSS") or 0) / 2**20)
    assert world is not None
    took = time.monotonic() - began
    drift = float(world.data.time) - frames / _RATE
    return [
        f"{options.hours:g} h in fast motion took {took / 60:.1f} min; memory after each twentieth of it: "
        f"{', '.join(f'{m:.0f}' for m in memory)} MiB; simulated time off by {1e3 * drift:.1f} ms, worlds begun again "
        f"{timing.counts['physics_resets']:g}",
    ]
