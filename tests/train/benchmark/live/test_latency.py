"""The live benchmark's motion and its fast mode; the programs that it starts are tested where they are."""

import numpy as np

from mjx_hand.hand.load import load_hand
from mjx_hand.rigid.build import build_rigid_hand
from train.benchmark.live.latency import Options, _addresses, _fast, _motion


def test_the_hand_goes_down_closes_and_comes_back():
    keypoints = _motion(build_rigid_hand(load_hand()))
    assert keypoints.shape == (360, 21, 3)
    wrist = keypoints[:, 0]
    assert np.ptp(wrist[:, 1]) > 0.1
    speed = np.linalg.norm(np.diff(keypoints, axis=0, append=keypoints[:1]), axis=-1) * 60
    assert speed.max() < 1.5  # m/s, where it begins again too


def test_streaming_in_fast_motion_keeps_time():
    (line,) = _fast(Options(hours=1 / 600), build_rigid_hand(load_hand()))
    assert "simulated time off by" in line
    assert abs(float(line.split("off by ")[1].split(" ms")[0])) <= 4.0
    assert line.endswith("begun again 0")


def test_addresses_are_read_from_what_the_command_says():
    said = ["one moment\n", "open http://localhost:81/?token=abc in a browser\n", "messages go to udp 127.0.0.1:99\n"]
    assert _addresses(iter(said)) == ("http://localhost:81/?token=abc", 99)
