"""What the gate says of points, poses and paces that are wrong beyond doubt, doubtful, and as they should be."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mjx_hand.errors import InputError
from mjx_hand.motion import Motion
from mjx_hand.motion.motion import load_motion_file, save_motion
from mjx_hand.motion.plausibility.finding import Finding, judged
from mjx_hand.motion.plausibility.motions import plausible_motion
from mjx_hand.motion.plausibility.pace import span_findings, travel_findings
from mjx_hand.motion.plausibility.points import (
    constancy_findings,
    picture_findings,
    place_findings,
    proportion_findings,
)
from mjx_hand.motion.plausibility.pose import angle_findings, shape_findings, turn_findings
from mjx_hand.pytree import replace

FRAMES = 40


def bent(degrees: float, side: str = "right") -> np.ndarray:
    """Rotation vectors of fingers that all bend so far."""
    vectors = np.zeros((FRAMES, 15, 3))
    vectors[:, :12, 2] = np.radians(degrees) * (1 if side == "right" else -1)
    return vectors


def motion(degrees: float = 40.0, side: str = "right", **changed) -> Motion:
    rotations = Rotation.from_rotvec(bent(degrees).reshape(-1, 3)).as_matrix().reshape(FRAMES, 15, 3, 3)
    made = Motion(
        fps=30.0,
        rotations=rotations,
        wrist_position=np.linspace(0, 0.3, FRAMES)[:, None] * np.ones(3),
        wrist_quaternion=np.tile([1.0, 0, 0, 0], (FRAMES, 1)),
        shape=np.array([1.5, -2.0]),
        valid=np.ones(FRAMES, bool),
        side=side,
        source="made",
    )
    return replace(made, **changed)


def grade(findings: list[Finding]) -> str:
    """Whether findings pass, warn or refuse."""
    return "wrong" if any(f.certain for f in findings) else "doubtful" if findings else "good"


@pytest.mark.parametrize(
    ("fps", "frames", "expected"),
    [(30.0, 900, "good"), (1.0, 55, "good"), (1000.0, 60, "good"), (0.03, 60, "doubtful"), (5e4, 60, "wrong"),
     (1e-5, 60, "wrong"), (30.0, 30 * 3600 * 6, "doubtful")],
)  # fmt: skip
def test_pace(fps, frames, expected):
    assert grade(span_findings(fps, frames)) == expected


@pytest.mark.parametrize(("speed", "expected"), [(5.0, "good"), (20.0, "doubtful"), (500.0, "wrong")])
def test_travel(speed, expected):
    places = np.arange(FRAMES)[:, None] * speed / 30 * np.array([1.0, 0, 0])
    assert grade(travel_findings(places, np.ones(FRAMES, bool), 30.0)) == expected
    assert not travel_findings(places, np.arange(FRAMES) % 2 == 0, 30.0)  # no two frames beside each other


@pytest.mark.parametrize(("most", "expected"), [(3.0, "good"), (8.0, "doubtful"), (30.0, "wrong")])
def test_shape(most, expected):
    assert grade(shape_findings(np.array([0.5, -most]))) == expected


@pytest.mark.parametrize(
    ("degrees", "expected"), [(95, "good"), (0, "good"), (-8, "doubtful"), (-40, "wrong"), (170, "wrong")]
)
@pytest.mark.parametrize("side", ["right", "left"])
def test_turns(degrees, side, expected):
    assert grade(turn_findings(bent(degrees, side), side)) == expected
    if degrees == -40:
        other = "left" if side == "right" else "right"
        assert f"try side={other!r}" in str(turn_findings(bent(degrees, side), side)[0])


@pytest.mark.parametrize(("degrees", "expected"), [(60, "good"), (110, "good"), (140, "doubtful"), (170, "wrong")])
def test_angles(degrees, expected):
    angles = np.zeros((FRAMES, 3))
    angles[:, 1] = np.radians(degrees)
    limits = np.radians([-20.0] * 3), np.radians([100.0] * 3)
    found = angle_findings(angles, *limits, np.ones(FRAMES, bool), ("a", "b", "c"))
    assert grade(found) == expected
    assert not found or "most b" in str(found[0])


def hand(rng: np.random.Generator, varies: float) -> np.ndarray:
    """A wrist and five straight fingers of three bones whose lengths vary so from frame to frame; m."""
    directions = np.stack([np.cos(0.3 * np.arange(5)), np.sin(0.3 * np.arange(5)), 0.1 * np.arange(5)], axis=1)
    steps = np.array([0.08, 0.04, 0.03, 0.02]) * (1 + varies * rng.standard_normal((FRAMES, 5, 4)))
    along = np.cumsum(steps, axis=2)
    fingers = along[..., None] * directions[:, None]
    return np.concatenate([np.zeros((FRAMES, 1, 3)), fingers.reshape(FRAMES, 20, 3)], axis=1) + np.array(
        [0.4, 0.3, 0.0]
    )


def bones(points: np.ndarray) -> np.ndarray:
    fingers = points[:, 1:].reshape(FRAMES, 5, 4, 3)
    return np.linalg.norm(np.diff(fingers, axis=2), axis=-1).reshape(FRAMES, 15)


@pytest.mark.parametrize(("varies", "expected"), [(0.0, "good"), (0.12, "good"), (0.25, "doubtful"), (0.8, "wrong")])
def test_bones_keep_their_lengths(varies, expected):
    assert grade(constancy_findings(bones(hand(np.random.default_rng(0), varies)))) == expected


@pytest.mark.parametrize(("share", "expected"), [(0.0, "good"), (0.2, "doubtful"), (0.9, "wrong")])
def test_points_at_one_place(share, expected):
    points = hand(np.random.default_rng(0), 0.05)
    points[: int(share * FRAMES), 4] = points[: int(share * FRAMES), 3]
    found = place_findings(points, [f"p{k}" for k in range(21)])
    assert grade(found) == expected
    assert not found or "p3 and p4 at one place" in str(found[0])


def test_proportions_whatever_the_size():
    expected = np.tile([0.04, 0.03, 0.02], 5)
    assert grade(proportion_findings(1.4 * expected * np.exp(0.1 * np.sin(np.arange(15))), expected)) == "good"
    assert grade(proportion_findings(np.roll(expected, 1), expected)) != "good"
    assert grade(proportion_findings(np.full(15, np.nan), expected)) == "good"


def test_places_in_a_picture():
    rng = np.random.default_rng(0)
    assert grade(picture_findings(hand(rng, 0.15), 0.15)) == "wrong"
    assert grade(picture_findings(hand(rng, 0.0), 0.0)) == "doubtful"
    assert not picture_findings(hand(rng, 0.15) + np.array([0, 0, 0.5]), 0.15)  # in a room
    assert not picture_findings(hand(rng, 0.15) - [0.4, 0.3, 0.0], 0.15)  # relative to the wrist


def test_warnings_stand_in_the_file(tmp_path):
    found = plausible_motion(motion(shape=np.array([7.0])))
    assert found.warnings == (
        "shape coefficients: up to 7, expected within 5; check the order of the points and their unit",
    )
    assert plausible_motion(found).warnings == found.warnings  # not twice
    save_motion(found, tmp_path / "m.npz")
    assert load_motion_file(tmp_path / "m.npz").warnings == found.warnings
    assert plausible_motion(motion()).warnings == ()
    save_motion(motion(), tmp_path / "m.npz")
    assert "warnings" not in np.load(tmp_path / "m.npz").files


def test_what_is_beyond_doubt_is_refused_with_all_that_is():
    with pytest.raises(
        InputError, match=r"made: no hand's motion: shape coefficients.*\| bend of the fingers"
    ) as caught:
        plausible_motion(motion(shape=np.array([70.0]), side="left"))
    assert "\n" not in str(caught.value)
    assert judged("x", [], ("before",)) == ("before",)
