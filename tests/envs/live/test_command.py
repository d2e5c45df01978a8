"""`mjx-hand live` from end to end: a recorded hand becomes a twin in physics; whatever is wrong is one line."""

import contextlib
import json
import re
import socket
import threading
import time

import jax
import numpy as np
import pytest
from websockets.sync.client import connect

from envs.live.command import main
from envs.live.session import serving
from envs.live.sources.mailbox import Mailbox
from envs.live.twin.hinge_keypoints import hinge_keypoints
from envs.live.twin.person import SECONDS
from envs.live.twin.tabletop import tabletop
from envs.live.twin.tracker import Tracker
from mjx_hand.capture.keypoints.recording import KeypointRecording, save_keypoints
from mjx_hand.capture.load_scene import load_scene
from mjx_hand.hand.load import load_hand
from mjx_hand.motion.demonstration import save_demonstration
from mjx_hand.rigid.build import build_rigid_hand

TOKEN = "0123456789abcdef"
COMPILING = "/jax/core/compile/backend_compile_duration"


def closing(count: int, shape: tuple[float, ...] = ()) -> tuple[np.ndarray, np.ndarray]:
    """Keypoints of a hand that closes, and its hinge angles."""
    rigid = build_rigid_hand(load_hand(), np.array(shape))
    angles = np.linspace(0.1, 0.9, count)[:, None] * np.array([0.0, 1.0, 1.0, 0.7] * 5)
    position = np.linspace([0.3, 1.2, -0.4], [0.35, 1.1, -0.4], count)
    return hinge_keypoints(angles, position, np.tile([1.0, 0, 0, 0], (count, 1)), rigid), angles


def test_a_person_is_measured_and_followed_and_nothing_compiles_while_live():
    compiled: list[float] = []
    tracker = Tracker("right", "+y", "-z", None, print)
    keypoints, angles = closing(60, (1.5, -1.0, 0.5))
    jax.monitoring.register_event_duration_secs_listener(
        lambda event, duration_secs, **kwargs: compiled.append(duration_secs) if event == COMPILING else None
    )
    try:
        poses = [tracker.pose(frame, SECONDS / 40 * k) for k, frame in enumerate(keypoints)]
        lost = tracker.pose(np.full((21, 3), np.nan), 9.0)
        found = tracker.pose(keypoints[-1], 9.1)
    finally:
        jax.monitoring.clear_event_listeners()
    assert compiled == []
    assert lost is None
    assert tracker.known == 1.0
    assert poses[0] is None
    assert poses[-1] is not None
    assert found is not None
    flexion = np.flatnonzero(angles[-1])
    assert np.abs(poses[-1].angles - angles[-1])[flexion].mean() < 0.1
    np.testing.assert_allclose(found.angles, poses[-1].angles, atol=0.05)
    ways = np.diff([pose.position for pose in poses if pose is not None], axis=0)
    # Up (+y of the source) is the world's z; the hand sinks a tenth of a metre in all.
    assert ways[:, 2].sum() == pytest.approx(-0.1 * len(ways) / 59, abs=5e-3)


def test_a_recording_is_a_twin_that_records(tmp_path, capsys):
    """Over the page's own websocket: poses move as the recording does, and R makes a scene of it."""
    keypoints, _ = closing(120)
    save_keypoints(KeypointRecording(fps=60.0, positions=keypoints, side="right"), tmp_path / "hand.npz")
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    arguments = ["--source", str(tmp_path / "hand.npz"), "--seconds", "7", "--port", str(port), "--token", TOKEN]
    status: list[int] = []
    command = threading.Thread(target=lambda: status.append(main([*arguments, "--out", str(tmp_path / "live")])))
    command.start()
    poses, states = [], []
    with looking(port) as ws, contextlib.suppress(Exception):
        while True:
            message = ws.recv(timeout=20)
            if isinstance(message, str):
                states.append(json.loads(message).get("panel", {}).get("state"))
                continue
            ws.send(json.dumps({"drawn": int(np.frombuffer(message[:4], np.uint32)[0])}))
            poses.append(np.frombuffer(message[8:], np.float32).reshape(17, 7))
            if len(poses) in (10, 40):
                ws.send(json.dumps({"wish": "record"}))
    command.join()
    assert status == [0]
    assert len(poses) > 45
    assert any("measuring the hand" in state for state in states if state)
    moved = np.array(poses)
    assert np.isfinite(moved).all()
    assert np.ptp(moved[:, 3, 2]) > 0.02  # the index finger's tip comes down as the hand closes
    report = json.loads(capsys.readouterr().out)
    assert report["stages_ms"]["wire"]["count"] > 20
    assert report["counts"]["lost"] == report["counts"]["physics_resets"] == 0
    scene = load_scene(tmp_path / "live" / "live-001.npz")
    assert (scene.hands[0].side, scene.objects[0].kind, scene.fps) == ("right", "box", 50.0)
    assert 0.1 < scene.num_frames / scene.fps < 7


@contextlib.contextmanager
def looking(port: int):
    deadline = time.monotonic() + 120
    while True:
        try:
            with connect(f"ws://127.0.0.1:{port}/view?token={TOKEN}") as ws:
                yield ws
            return
        except OSError:
            assert time.monotonic() < deadline
            time.sleep(0.2)


def test_a_demonstration_brings_its_object_and_ends_once(tmp_path, capsys, demonstrations):
    shown = demonstrations[0]
    save_demonstration(shown, tmp_path / "one.npz")
    assert main(["--source", str(tmp_path / "one.npz"), "--once", "--port", "0"]) == 0
    printed = capsys.readouterr()
    counts = json.loads(printed.out)["counts"]
    assert counts["frames"] <= shown.num_frames <= counts["frames"] + counts["replaced"]
    assert "?token=" in printed.err
    assert "warning" not in printed.err
    assert main(["--source", str(tmp_path / "one.npz"), "--object", "pinch"]) == 2
    assert "has an object of its own" in capsys.readouterr().err


def test_whoever_waits_goes_on_when_all_is_stopped(tmp_path):
    """A headset that never sends anything is stopped by another thread."""
    with serving(Mailbox("headset"), tabletop("pinch"), "right", TOKEN, folder=tmp_path) as session:
        waits = threading.Thread(target=session.pipeline.wait, args=(None,), daemon=True)
        waits.start()
        session.pipeline.stop()
        waits.join(10)
        assert not waits.is_alive()


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ("--source nothing", "valid: webcam, webxr, udp, ws, or the path"),
        ("--source webcam --camera 97", "MediaPipe|no camera 97"),
        ("--source ws --object teapot", "object is 'teapot'; valid: "),
        ("--source ws --object no.stl", "no such file"),
        ("--source ws --mass -1", "mass is -1"),
        ("--source ws --token short", "too easy to guess"),
        ("--source ws --seconds 0", "positive"),
        ("--source ws --once", "no recording"),
        ("--source ws --port 70000", "0 to 65535"),
        ("--source udp --udp-port -1", "0 to 65535"),
        ("--source ws --publish nowhere", "HOST:PORT"),
    ],
)
def test_what_cannot_be_used_is_one_line(capsys, arguments, said):
    assert main(arguments.split()) == 2
    printed = capsys.readouterr()
    assert printed.out == ""
    lines = printed.err.strip().splitlines()
    assert len(lines) == 1
    assert re.search(said, lines[0])


def test_a_busy_port_is_said_before_anything_is_compiled(capsys):
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        assert main(["--source", "ws", "--port", str(taken.getsockname()[1])]) == 2
    assert "cannot serve at 127.0.0.1" in capsys.readouterr().err
