"""The clock of the viewer: real time, other speeds, the end."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mjx_hand.view.browser.playback import SPEEDS, Playback


def test_real_time_and_other_speeds():
    assert Playback(frames=100, fps=50.0, began=10.0).frame(10.5) == 25
    assert Playback(frames=100, fps=50.0, began=10.0, speed=0.1).frame(10.5) == 2
    assert Playback(frames=100, fps=50.0, began=10.0, start=90).frame(10.5) == 15
    assert Playback(frames=100, fps=50.0, began=10.0, start=90, loop=False).frame(10.5) == 99


@given(
    st.integers(1, 500), st.floats(1, 240), st.sampled_from(SPEEDS), st.booleans(), st.floats(0, 100), st.floats(0, 1)
)
def test_frames_are_of_the_recording_and_never_run_back(frames, fps, speed, loop, now, later):
    playback = Playback(frames=frames, fps=fps, began=0.0, speed=speed, loop=loop)
    first, second = playback.frame(now), playback.frame(now + later)
    assert 0 <= first < frames
    if not loop:
        assert first <= second
        assert playback.over(now) == (first == frames - 1)
    elif later * fps * speed < 1:
        assert (second - first) % frames <= 1


@pytest.mark.parametrize("frame", range(60))
def test_every_frame_is_due_at_its_own_time(frame):
    assert Playback(frames=60, fps=30.0, began=0.0).frame(frame / 30.0) == frame
