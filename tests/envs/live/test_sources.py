"""Sources: recordings at their own pace, datagrams of one sender, a camera's hand in its place."""

import socket
import threading
import time
from types import SimpleNamespace

import numpy as np
import pytest

from envs.live.flow.arrival import Arrival
from envs.live.flow.timing import Timing
from envs.live.sources.datagrams import Datagrams
from envs.live.sources.mailbox import Mailbox
from envs.live.sources.recorded import Recorded, hinge_keypoints, open_recording
from envs.live.sources.webcam import Webcam, placed_before_camera, seen_keypoints
from mjx_hand.capture.keypoints.recording import KeypointRecording, save_keypoints
from mjx_hand.capture.keypoints.skeleton import rest_keypoints
from mjx_hand.errors import InputError
from mjx_hand.hand.load import load_hand
from mjx_hand.rigid.build import build_rigid_hand

HAND = rest_keypoints(load_hand())[0]


def arrivals(source, until) -> list[Arrival]:
    """What a source hands on until `until` says of them that it is enough."""
    found: list[Arrival] = []
    stop = threading.Event()

    def put(arrival: Arrival) -> None:
        found.append(arrival)
        if until(found):
            stop.set()

    source.run(put, stop, Timing())
    return found


def test_a_recording_has_its_own_pace():
    frames = np.arange(12)[:, None, None] * np.ones((1, 21, 3))
    found = arrivals(Recorded(frames, 50.0, "test", "right", loop=False), lambda _: False)
    assert [np.asarray(each.content)[0, 0] for each in found] == list(range(12))
    times = np.array([each.at for each in found])
    assert times[-1] - times[0] == pytest.approx(11 / 50, abs=0.05)
    assert [each.again for each in found] == [True] + [False] * 11


def test_a_recording_begins_again_in_time():
    frames = np.ones((3, 21, 3))
    found = arrivals(Recorded(frames, 100.0, "test", "right"), lambda found: len(found) == 10)
    assert [each.again for each in found] == [k % 3 == 0 for k in range(10)]
    assert found[-1].at - found[0].at == pytest.approx(0.09, abs=0.05)


def test_a_keypoint_file_is_a_source(tmp_path):
    bent = hinge_keypoints(
        np.full((4, 20), 0.4), np.zeros((4, 3)), np.tile([1.0, 0, 0, 0], (4, 1)), build_rigid_hand(load_hand())
    )
    save_keypoints(KeypointRecording(fps=30.0, positions=bent, side="right"), tmp_path / "hand.npz")
    source = open_recording(tmp_path / "hand.npz")
    assert (source.side, source.fps, source.hand) == ("right", 30.0, None)
    np.testing.assert_allclose(source.keypoints, bent, atol=1e-6)
    with pytest.raises(InputError, match="30 frames per second"):
        open_recording(tmp_path / "hand.npz", fps=60.0)


def test_real_recordings_are_sources(recordings):
    glove = open_recording(recordings / "dexmv_mustard" / "sequence.npz")
    assert glove.keypoints.shape[1:] == (21, 3)
    video = open_recording(recordings / "mediapipe_video" / "joints.npz", fps=30.0)
    assert video.up == "-y"


@pytest.fixture
def sender():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as made:
        yield made


def test_datagrams_of_one_sender_drive_and_a_second_is_refused(sender):
    source, timing, stop = Datagrams("127.0.0.1", 0), Timing(), threading.Event()
    found: list[Arrival] = []
    thread = threading.Thread(target=source.run, args=(found.append, stop, timing))
    thread.start()
    where = ("127.0.0.1", source.port)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as second:
        sender.sendto(b"first", where)
        deadline = time.monotonic() + 10
        while not found:
            assert time.monotonic() < deadline
        for _ in range(200):
            second.sendto(b"second", where)
            sender.sendto(b"first", where)
        while len(found) < 201 and time.monotonic() < deadline:
            time.sleep(0.01)
    stop.set()
    thread.join()
    assert all(each.content == b"first" for each in found)
    assert timing.counts["refused"] > 0
    assert "a second sender was refused" in timing.notice


def test_a_busy_port_of_datagrams_is_said():
    first = Datagrams("127.0.0.1", 0)
    with pytest.raises(InputError, match=f"cannot listen at 127.0.0.1:{first.port}.*--udp-port"):
        Datagrams("127.0.0.1", first.port)
    with pytest.raises(InputError, match="0 to 65535"):
        Datagrams("127.0.0.1", 70_000)
    ended = threading.Event()
    ended.set()
    first.run(print, ended, Timing())


def test_a_mailbox_hands_on_only_while_it_runs():
    box, stop, found = Mailbox("test"), threading.Event(), []
    box.receive("early")
    thread = threading.Thread(target=box.run, args=(found.append, stop, Timing()))
    thread.start()
    while not found:
        box.receive("now")
    stop.set()
    thread.join()
    count = len(found)
    box.receive("late")
    assert all(each.content == "now" for each in found)
    assert len(found) == count


def test_no_camera_is_one_line():
    with pytest.raises(InputError, match=r"MediaPipe|there is no camera 97") as refused:
        Webcam("right", 97)
    assert "--source udp" in str(refused.value)


def test_a_hand_before_the_camera_is_where_it_is_seen():
    place, width, height = np.array([0.11, -0.07, 0.62]), 640, 480
    focal = width / 2 / np.tan(np.deg2rad(30))
    world = HAND - HAND.mean(axis=0)
    flat = world * [1, 1, 0.02]  # of one distance, so that the picture is the hand at a scale
    pixels = focal * (flat + place)[:, :2] / place[2] + [width / 2, height / 2]
    np.testing.assert_allclose(placed_before_camera(flat, pixels, width, height), flat + place, atol=1e-6)

    def landmarks(points):
        return SimpleNamespace(landmark=[SimpleNamespace(x=x, y=y, z=z) for x, y, z in points])

    def result(label):  # MediaPipe takes every image for a mirror's
        return SimpleNamespace(
            multi_hand_world_landmarks=[landmarks(flat)],
            multi_hand_landmarks=[landmarks(np.c_[pixels / [width, height], np.zeros(21)])],
            multi_handedness=[SimpleNamespace(classification=[SimpleNamespace(label=label, score=0.9)])],
        )

    found = seen_keypoints(result("Left"), "right", width, height)
    np.testing.assert_allclose(found, flat + place, atol=1e-6)
    assert np.isnan(seen_keypoints(result("Right"), "right", width, height)).all()
    nothing = SimpleNamespace(multi_hand_world_landmarks=None, multi_hand_landmarks=None, multi_handedness=None)
    assert np.isnan(seen_keypoints(nothing, "right", width, height)).all()
