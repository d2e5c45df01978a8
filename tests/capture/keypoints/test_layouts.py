"""Layouts: every device's joints go to the right places among the 21 and back."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mjx_hand.capture.keypoints.layouts import (
    KEYPOINTS,
    LAYOUTS,
    LINK_KEYPOINTS,
    NUM_KEYPOINTS,
    TIP_KEYPOINTS,
    from_keypoints,
    hand_keypoints,
    to_keypoints,
)
from mjx_hand.capture.keypoints.names import counted_keypoints, layout_named, named_keypoints, plain
from mjx_hand.errors import InputError
from mjx_hand.hand.joints import FINGERS, LINKS

LAYOUT = st.sampled_from(list(LAYOUTS.values()))


def some_points(seed: int, count: int) -> np.ndarray:
    return np.random.default_rng(seed).normal(size=(3, count, 3))


@settings(deadline=None, max_examples=40)
@given(LAYOUT, st.integers(0, 1000))
def test_keypoints_survive_the_way_through_a_layout(layout, seed):
    points = some_points(seed, NUM_KEYPOINTS)
    there = from_keypoints(points, layout)
    assert there.shape == (3, len(layout.joints), 3)
    back = to_keypoints(there, layout)
    lacking = [k for k, name in enumerate(layout.keypoints) if name is None]
    assert np.isnan(back[:, lacking]).all()
    kept = np.setdiff1d(np.arange(NUM_KEYPOINTS), lacking)
    np.testing.assert_array_equal(back[:, kept], points[:, kept])


@settings(deadline=None, max_examples=40)
@given(LAYOUT, st.integers(0, 1000))
def test_names_tell_keypoints_in_any_order(layout, seed):
    order = np.random.default_rng(seed).permutation(len(layout.joints))
    points = some_points(seed, len(layout.joints))
    found, name = named_keypoints("file", [layout.joints[k] for k in order], points[:, order])
    np.testing.assert_array_equal(found, to_keypoints(points, layout))
    assert LAYOUTS[name].indices is not None


@pytest.mark.parametrize(
    ("name", "count"), [("mediapipe", 21), ("leap", 20), ("webxr", 25), ("openxr", 26), ("quest", 24)]
)
def test_the_number_of_points_tells_the_layout(name, count):
    points = some_points(0, count)
    found, layout = counted_keypoints("file", points)
    assert layout == name
    np.testing.assert_array_equal(found, to_keypoints(points, LAYOUTS[name]))


def test_published_orders():
    # The numbers of the devices' own documentation, written out: MediaPipe's landmark 8 and WebXR's joint 9 are index
    # tips, OpenXR's XR_HAND_JOINT_LITTLE_TIP_EXT is 25, OVRSkeleton's Hand_Index1 is bone 6.
    mediapipe, webxr, openxr, quest = (LAYOUTS[n].indices for n in ("mediapipe", "webxr", "openxr", "quest"))
    tip, mcp, little = (KEYPOINTS.index(n) for n in ("index_tip", "index_mcp", "little_tip"))
    assert (mediapipe[tip], webxr[tip], openxr[little], quest[mcp]) == (8, 9, 25, 6)
    assert (webxr[0], openxr[0], quest[0]) == (0, 1, 0)


@pytest.mark.parametrize(
    "name", ["XR_HAND_JOINT_INDEX_TIP_EXT", "index-finger-tip", "indexFingerTip", "Index Tip", "INDEX_FINGER_TIP"]
)
def test_spellings_of_a_joint_agree(name):
    assert plain(name) == "indextip"


def test_mediapipes_own_names_are_known():
    names = ["WRIST", *(f"THUMB_{j}" for j in ("CMC", "MCP", "IP", "TIP"))]
    names += [
        f"{f}_{j}"
        for f in ("INDEX_FINGER", "MIDDLE_FINGER", "RING_FINGER", "PINKY")
        for j in ("MCP", "PIP", "DIP", "TIP")
    ]
    layout = layout_named(names)
    assert layout is not None
    assert layout.name == "mediapipe"


def test_links_and_keypoints_name_the_same_joints():
    anatomy = {
        "wrist": "wrist",
        "index1": "index_mcp",
        "middle2": "middle_pip",
        "pinky3": "little_dip",
        "thumb1": "thumb_cmc",
    }
    for link, keypoint in anatomy.items():
        assert KEYPOINTS[LINK_KEYPOINTS[LINKS.index(link)]] == keypoint
    assert [KEYPOINTS[k].split("_")[0] for k in TIP_KEYPOINTS] == ["index", "middle", "little", "ring", "thumb"]
    joints, tips = some_points(1, 16), some_points(2, 5)
    points = np.asarray(hand_keypoints(joints, tips))
    np.testing.assert_allclose(points[:, KEYPOINTS.index("thumb_ip")], joints[:, LINKS.index("thumb3")], rtol=1e-6)
    np.testing.assert_allclose(points[:, KEYPOINTS.index("ring_tip")], tips[:, FINGERS.index("ring")], rtol=1e-6)


@pytest.mark.parametrize(
    ("names", "says"),
    [
        ([*KEYPOINTS[:20], "nose"], "lacks little_tip"),
        ([f"p{k}" for k in range(21)], "no hand's joints"),
        (list(KEYPOINTS[:20]), "has 21 points per hand and 20 names"),
        ([*KEYPOINTS, "WRIST"], "twice"),
    ],
)
def test_wrong_names_are_refused_in_one_line(names, says):
    points = some_points(0, 22 if len(names) == 22 else 21)
    with pytest.raises(InputError, match=says) as caught:
        named_keypoints("hand.json", names, points)
    assert "\n" not in str(caught.value)


def test_wrong_number_of_points_is_refused():
    with pytest.raises(InputError, match="has 18 points per hand"):
        counted_keypoints("hand.npz", some_points(0, 18))
    with pytest.raises(InputError, match="layout is 'kinect'"):
        counted_keypoints("hand.npz", some_points(0, 21), "kinect")
