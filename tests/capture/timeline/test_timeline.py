"""Rows at their times: any unit, holes, repeats, and pieces of evidence that contradict each other."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mjx_hand.capture.timeline.clock_names import names_numbers, names_time, unit_in
from mjx_hand.capture.timeline.compare_clocks import timeline_of
from mjx_hand.capture.timeline.time_units import seconds_of
from mjx_hand.errors import InputError

HOLE = np.r_[0:30, 42:90]  # 0.4 s without a row at 30/s

AHEAD = np.r_[0:30, 42:102].astype(float)  # frame numbers of 90 rows


def frames_of(**said) -> tuple[float | None, np.ndarray, tuple[str, ...]]:
    """Rate and, of each frame, the row's own number as recorded (NaN in gaps), and the notes."""
    stamps = next(v for k, v in said.items() if k in ("times", "numbers"))
    values = said.pop("values", np.arange(len(stamps), dtype=float))
    found = timeline_of("file", len(stamps), **said)
    return found.fps, found.sampled(values[:, None])[:, 0], found.notes


@pytest.mark.parametrize("unit", [1.0, 1e3, 1e6, 1e9])
@pytest.mark.parametrize("fps", [2.0, 30.0, 240.0])
def test_times_in_any_unit_give_the_rate(unit, fps):
    times = 5.0 * unit + np.arange(50) / fps * unit
    seconds = seconds_of("file", times, "t")
    assert seconds is not None
    assert np.diff(seconds) == pytest.approx(1 / fps)
    rate, kept, notes = frames_of(times=times)
    assert rate == pytest.approx(fps)
    np.testing.assert_allclose(kept, np.arange(50))
    assert not notes


@pytest.mark.parametrize(
    ("name", "unit"),
    [("timestamp_ms", "ms"), ("Time (Seconds)", "s"), ("timestampUs", "us"), ("time_ns", "ns"), ("t", None)],
)
def test_names_that_say_a_unit(name, unit):
    assert names_time(name)
    assert unit_in(name) == unit


def test_other_names_are_not_taken():
    assert not any(map(names_time, ("temperature", "thumb_tip_x", "times_seen", "tx")))
    assert all(map(names_numbers, ("frame", "Frame#", "frame_id", "frameNumber", "frame_index")))
    assert not any(map(names_numbers, ("frame_rate", "framework", "fps")))


@pytest.mark.parametrize(("name", "scale", "start"), [("time_ms", 1e3, 0), ("t", 1e3, 1.7e12), ("t", 1e6, 1.7e15)])
def test_a_thousand_frames_a_second(name, scale, start):
    fps, _, _ = frames_of(times=start + np.arange(60) * 1e-3 * scale, name=name)
    assert fps == pytest.approx(1000, rel=1e-3)


def test_a_unit_that_cannot_be_told_leaves_the_rate_open():
    fps, kept, notes = frames_of(times=np.array([0.0, 1, 2, 3, 6, 7, 8]))
    assert fps is None
    assert notes == ("the unit of the times is not told: they would be 1/s in s, 1000/s in ms",)
    np.testing.assert_array_equal(kept, [0, 1, 2, 3, np.nan, np.nan, 4, 5, 6])
    with pytest.raises(InputError, match=r"'time_ms' in ms gives 3e\+04 frames a second; in s it would be 30"):
        frames_of(times=np.arange(9) / 30, name="time_ms")


@pytest.mark.parametrize("unit", [1.0, 1e3, 1e6, 1e9])
@pytest.mark.parametrize("apart", [94e-6, 2e-3])
@pytest.mark.parametrize("together", [2, 3])
def test_stamps_next_to_each_other_are_one_frame(unit, apart, together):
    ticks = np.arange(31) / 30
    times = np.sort(np.concatenate([ticks + k * apart for k in range(together)])) * unit
    fps, kept, notes = frames_of(times=times, values=times / unit)
    assert fps == pytest.approx(30)
    np.testing.assert_allclose(kept, ticks, atol=1e-9)
    assert "equal or nearly equal time" in notes[0]


def test_frames_far_apart_are_not_taken_for_repeats():
    """A hand that is seen for three frames each second: its frames are no repeats of each other."""
    times = np.concatenate([k + np.arange(3) / 30 for k in range(10)])
    fps, kept, notes = frames_of(times=times)
    assert fps == pytest.approx(30)
    assert (np.isfinite(kept).sum(), len(kept)) == (30, 273)
    assert not notes


def test_a_repeated_frame_fills_in_what_the_first_lacks():
    times = np.array([0.0, 0.1, 0.1, 0.2, 0.3])
    values = np.array([0.0, np.nan, 7.0, 2.0, 3.0])
    assert frames_of(times=times, values=values)[1].tolist() == [0.0, 7.0, 2.0, 3.0]


def test_uneven_times_are_interpolated_and_dropped_frames_left_open():
    times = np.array([0.0, 0.1, 0.2, 0.33, 0.4, 0.5, 0.9, 1.0])
    rate, values, _ = frames_of(times=times, values=times)
    assert rate == pytest.approx(10.0)
    assert np.isnan(values[6:9]).all()
    kept = np.delete(np.arange(11), [6, 7, 8])
    np.testing.assert_allclose(values[kept], kept / 10, atol=1e-9)


@pytest.mark.parametrize("fps", [120.0, 240.0])
def test_rounded_times_are_frames_in_a_row(fps):
    found, kept, _ = frames_of(times=np.round(np.arange(500) / fps, 3))
    assert found == pytest.approx(fps, rel=2e-3)
    np.testing.assert_array_equal(kept, np.arange(500))
    found, kept, notes = frames_of(times=np.round(np.arange(500) / fps, 2), rate=fps)  # coarser than a frame
    assert (found, notes) == (fps, ())
    np.testing.assert_array_equal(kept, np.arange(500))


@pytest.mark.parametrize(
    "said",
    [
        {"times": HOLE / 30},
        {"times": HOLE / 30 * 1e3, "numbers": HOLE},
        {"times": HOLE / 30 + 1.7e9, "numbers": np.arange(78)},  # the rows counted
        {"numbers": HOLE + 100},
        {"times": HOLE, "name": "t"},  # beside a rate no seconds, but numbers
        {"times": np.round(HOLE / 30, 2)},
    ],
)
def test_rows_that_are_left_out_are_gaps_beside_a_stated_rate(said):
    fps, kept, notes = frames_of(rate=30.0, **{k: np.asarray(v, float) if k != "name" else v for k, v in said.items()})
    assert (fps, notes) == (30.0, ())
    assert len(kept) == 90
    np.testing.assert_array_equal(kept[HOLE], np.arange(78))
    assert np.isnan(np.delete(kept, HOLE)).all()


def test_numbers_and_times_without_a_rate():
    fps, kept, _ = frames_of(times=HOLE / 30, numbers=HOLE.astype(float))
    assert fps == pytest.approx(30)
    np.testing.assert_array_equal(kept[HOLE], np.arange(78))


def test_a_nominal_rate_gives_way_to_the_times():
    fps, kept, notes = frames_of(times=np.arange(300) / 28.2, rate=30.0)
    assert fps == pytest.approx(28.2)
    assert len(kept) == 300
    assert "states 30 frames/s, but its times are 28.2/s" in notes[0]
    fps, _, notes = frames_of(times=np.arange(30000) / 29.97, rate=30.0)
    assert (fps, notes) == (30.0, ())


@pytest.mark.parametrize(
    ("said", "message"),
    [
        ({"rate": 30.0, "times": np.arange(90) / 60}, "states 30 frames per second, but its times are 60 a second"),
        ({"rate": 30.0, "times": np.arange(90) / 29.9, "numbers": AHEAD}, "contradict each other: at frame 30"),
        ({"times": np.arange(90) / 30, "numbers": AHEAD}, "numbers and times contradict each other: at frame 30"),
        ({"times": np.array([0, 1, np.inf, 3]) / 30}, "frame 2's time is inf"),
        ({"times": np.array([0, 1, np.nan, 3]) / 30, "rate": 30.0}, "frame 2's time is nan"),
        ({"times": np.r_[0:20, 0:20] / 30.0}, "frame 20's time is before the one before it"),
        ({"numbers": np.array([0.0, 1.5, 3])}, "frame 1's number is not a whole one"),
        ({"times": np.arange(9.0), "rate": -3.0}, "fps is -3.0, expected a positive number"),
        ({"times": np.r_[np.arange(6) / 30, 86400 + np.arange(6) / 30]}, "frame 6 is .* frames .8.64e.04 s. after"),
        ({"times": np.r_[0.0, 1.7e9 + np.arange(11) / 30]}, "frame 1 is"),
        ({"numbers": np.array([0, 1, 2, 1e15]), "rate": 30.0}, "frame 3 is 1e.15 frames"),
        ({"times": np.array([-1e308, 0, 1e308])}, "frame 0's time is -1e.308"),
    ],
)
def test_what_is_refused(said, message):
    with pytest.raises(InputError, match=message) as caught:
        frames_of(**said)
    assert "\n" not in str(caught.value)


def test_a_single_time_astray_is_left_out_and_told():
    times = np.arange(60) / 30
    times[20] = 700.0  # in another unit
    fps, kept, notes = frames_of(times=times)
    assert fps == pytest.approx(30)
    assert np.isnan(kept[20])
    assert len(kept) == 60
    assert notes == ("1 frame left out whose time is before an earlier one's, first 20",)


def test_every_other_frame_of_a_video():
    fps, kept, notes = frames_of(numbers=np.arange(0.0, 60, 2), rate=30.0)
    assert fps == 15.0
    assert len(kept) == 30
    assert "frame numbers go up by 2" in notes[0]


@given(st.lists(st.floats(allow_nan=True, allow_infinity=True, width=64), min_size=1, max_size=12), st.booleans())
def test_any_times_give_frames_or_one_line(times, stated):
    try:
        found = timeline_of("file", len(times), rate=30.0 if stated else None, times=np.array(times))
    except InputError:
        return
    out = found.sampled(np.zeros((len(times), 3)))
    assert len(out) <= 10_000 + len(times)
    assert np.isfinite(out).any()
