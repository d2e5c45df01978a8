"""Short gaps are filled as the marker would have moved; long ones and open ends stay."""

import numpy as np
import pytest

from mjx_hand.capture.markers.gap_filling import fill_short_gaps
from mjx_hand.capture.markers.marker_recording import MarkerRecording, hide_marker
from mjx_hand.errors import InputError


@pytest.fixture
def recording() -> MarkerRecording:
    """Two markers on smooth courses; the first has gaps of 3 and 20 frames, and is hidden at both ends."""
    times = np.arange(200) / 100.0
    course = np.stack([np.sin(3 * times), np.cos(2 * times), times], axis=1) * 0.1
    visible = np.ones((200, 2), bool)
    visible[[0, 1, 199], 0] = False
    visible[50:53, 0] = visible[100:120, 0] = False
    positions = np.stack([course, course + 0.02], axis=1)
    return MarkerRecording(
        fps=100.0, positions=np.where(visible[..., None], positions, 0.0), visible=visible, names=("a", "b"), source="s"
    )


def test_short_gaps_follow_the_course_and_long_ones_stay(recording):
    filled = fill_short_gaps(recording, 0.1)
    hidden = np.flatnonzero(~filled.visible[:, 0])
    np.testing.assert_array_equal(hidden, [0, 1, *range(100, 120), 199])
    np.testing.assert_allclose(filled.positions[50:53, 0], filled.positions[50:53, 1] - 0.02, atol=1e-4)
    np.testing.assert_array_equal(filled.positions[recording.visible], recording.positions[recording.visible])
    assert fill_short_gaps(recording, 0.2).visible[100:120, 0].all()
    np.testing.assert_array_equal(fill_short_gaps(recording, 0.0).visible, recording.visible)


def test_bad_arguments(recording):
    with pytest.raises(InputError, match=r"gaps of up to -1\.0 s"):
        fill_short_gaps(recording, -1.0)
    with pytest.raises(InputError, match="no marker 'c' to leave out; it has a, b"):
        hide_marker(recording, "c")
    hidden = hide_marker(recording, "b")
    assert not hidden.visible[:, 1].any()
    assert not hidden.positions[:, 1].any()
    np.testing.assert_array_equal(hidden.visible[:, 0], recording.visible[:, 0])
