"""Messages of trackers: every form says the same hand, and no message does more than be refused."""

import json
import random
import time

import numpy as np
import pytest

from envs.live.sources.messages import LONGEST, Messages
from envs.live.twin.hinge_keypoints import hinge_keypoints
from mjx_hand.capture.keypoints.layouts import LAYOUTS, from_keypoints
from mjx_hand.capture.keypoints.skeleton import rest_keypoints
from mjx_hand.errors import InputError
from mjx_hand.hand.load import load_hand
from mjx_hand.rigid.build import build_rigid_hand

HAND = rest_keypoints(load_hand())[0] + np.array([0.1, 0.9, -0.3])
WEBXR = LAYOUTS["webxr"]


def webxr_joints() -> dict[str, list[float]]:
    points = np.nan_to_num(from_keypoints(HAND, WEBXR), nan=0.05)
    return {name: point.tolist() for name, point in zip(WEBXR.joints, points, strict=True)}


@pytest.mark.parametrize(
    "message",
    [
        {"keypoints": HAND.tolist()},
        {"keypoints": HAND.tolist(), "side": "right", "time": 3},
        {"keypoints": (1000 * HAND).tolist(), "unit": "mm"},
        {"right": webxr_joints(), "left": webxr_joints()},
        {"hands": [{"side": "left", "joints": {}}, {"side": "right", "joints": webxr_joints()}]},
        {"joints": webxr_joints()},
    ],
    ids=["points", "said", "millimetres", "webxr", "page", "names"],
)
def test_every_form_says_the_same_hand(message: dict):
    for raw in (json.dumps(message), json.dumps(message).encode()):
        found = Messages("right").keypoints(raw)
        assert found is not None
        np.testing.assert_allclose(found, HAND, atol=1e-9)


@pytest.mark.parametrize(
    "message",
    [
        {"keypoints": None},
        {"hands": []},
        {"right": None, "time": 1.0},
        {"left": webxr_joints()},
        {"keypoints": HAND.tolist(), "side": "left"},
    ],
)
def test_a_message_without_the_hand_says_that_it_is_not_seen(message: dict):
    found = Messages("right").keypoints(json.dumps(message))
    assert found is not None
    assert np.isnan(found).all()


def test_of_two_hands_without_a_side_the_one_that_bends_as_it_does_is_followed():
    angles = np.full((1, 20), 0.5)
    still = np.zeros((1, 3)), np.array([[1.0, 0, 0, 0]])
    both = {s: hinge_keypoints(angles, *still, build_rigid_hand(load_hand(side=s)))[0] for s in ("left", "right")}
    message = json.dumps({"multiHandWorldLandmarks": [both["left"].tolist(), both["right"].tolist()]})
    for side, points in both.items():
        found = Messages(side).keypoints(message)
        assert found is not None
        np.testing.assert_allclose(found, points, atol=1e-9)


def test_a_point_that_is_missing_or_infinite_is_missing():
    points = [[None] * 3, *HAND[1:].tolist()]
    points[5] = [float("inf"), 0.0, 0.0]
    found = Messages("right").keypoints(json.dumps({"keypoints": points}))
    assert found is not None
    missing = np.isnan(found).any(axis=1)
    assert missing.tolist() == [k in (0, 5) for k in range(21)]


def test_overtaken_messages_are_left_out_and_a_clock_that_jumps_is_taken_as_it_is():
    messages = Messages("right")

    def taken(stamp: object) -> bool:
        return messages.keypoints(json.dumps({"keypoints": HAND.tolist(), "time": stamp})) is not None

    assert [taken(t) for t in (5.0, 5.02, 5.01, 5.02, 5.03)] == [True, True, False, False, True]
    assert messages.jumped == 0
    assert [taken(t) for t in (4000.0, 4000.02, 3.0, 3.02)] == [True] * 4
    assert messages.jumped == 2
    assert [taken(t) for t in ("noon", float("nan"), float("inf"), True, None, 10**400)] == [True] * 6


@pytest.mark.parametrize(
    ("message", "said"),
    [
        (b"\xff\xfe\x00", "no JSON"),
        ("[" * 50_000, "no JSON"),
        ("[]", "no object"),
        ("{}", "no hand's keypoints"),
        ('{"keypoints": 7}', "no hand's keypoints"),
        (json.dumps({"keypoints": (1e6 * HAND).tolist()}), "send metres"),
        (json.dumps({"keypoints": HAND[:16].tolist()}), "16 points"),
        (json.dumps({"keypoints": HAND.tolist(), "unit": "miles"}), "unit"),
        (json.dumps({"multi_hand_landmarks": [HAND.tolist()]}), "world landmarks"),
        ("x" * (LONGEST + 1), "at most"),
    ],
)
def test_what_is_no_hand_is_refused_in_one_line(message: bytes | str, said: str):
    with pytest.raises(InputError, match=said):
        Messages("right").keypoints(message)


def test_no_garbage_does_more_than_be_refused():
    rng = random.Random(1)
    whole = [json.dumps(m) for m in ({"keypoints": HAND.tolist(), "time": 1}, {"right": webxr_joints()})]
    odd = [
        "NaN",
        "Infinity",
        "null",
        "true",
        "{}",
        "[]",
        '""',
        "1e999",
        "-0",
        "9" * 400,
        '"x":',
        "[[[",
        "}}",
        "\\ud800",
    ]
    messages, began = Messages("right"), time.monotonic()
    for k in range(1500):
        text = list(whole[k % 2])
        for _ in range(rng.randint(1, 6)):
            at = rng.randrange(len(text))
            text[at : at + rng.randint(0, 12)] = rng.choice([*odd, chr(rng.randrange(1, 0x2FF))])
        try:
            found = messages.keypoints("".join(text).encode("utf-8", "surrogatepass"))
        except InputError:
            continue
        assert found is None or (found.shape == (21, 3) and not np.isinf(found).any())
    assert time.monotonic() - began < 20
