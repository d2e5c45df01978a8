"""Leaps away and back, made by hand."""

import numpy as np

from mjx_hand.capture.markers.outliers import excursions, middle

FPS = 100.0


def swinging() -> tuple[np.ndarray, np.ndarray]:
    """Four markers that swing together at up to 1 m/s, one of them 0.5 m/s faster; half a millimetre of noise."""
    rng = np.random.default_rng(0)
    times = np.arange(300) / FPS
    course = 0.2 * np.sin(5 * times)[:, None, None] * np.array([1.0, 0.3, 0.1])
    positions = rng.normal(size=(4, 3)) * 0.05 + course + rng.normal(scale=0.0005, size=(300, 4, 3))
    positions[:, 3, 1] += 0.05 * np.sin(10 * times)
    return positions, np.ones((300, 4), bool)


def test_a_moving_hand_has_none():
    assert not excursions(*swinging(), FPS).any()


def test_ghosts_and_swaps_are_found_and_nothing_else():
    positions, visible = swinging()
    expected = np.zeros_like(visible)
    positions[50, 0] += [0.03, 0.0, 0.02]  # one frame
    expected[50, 0] = True
    positions[100:140, [1, 2]] = positions[100:140, [2, 1]]
    expected[100:140, [1, 2]] = True
    np.testing.assert_array_equal(excursions(positions, visible, FPS), expected)


def test_a_marker_that_never_comes_back_or_comes_back_late_is_left():
    positions, visible = swinging()
    positions[50:, 0] += 0.05
    positions[60:200, 1] += 0.05
    assert not excursions(positions, visible, FPS).any()


def test_hidden_sights_are_no_leaps():
    positions, visible = swinging()
    visible[50:60, 0] = False
    positions[50:60, 0] = 0.0
    assert not excursions(positions, visible, FPS).any()
    assert excursions(positions[:2], visible[:2], FPS).shape == (2, 4)


def test_median_of_what_is_known():
    rng = np.random.default_rng(1)
    values = np.where(rng.random((7, 6, 3)) < 0.3, np.nan, rng.normal(size=(7, 6, 3)))
    values[:, 2] = np.nan
    known = [0, 1, 3, 4, 5]
    np.testing.assert_allclose(middle(values, 0)[known], np.nanmedian(values[:, known], axis=0))
    assert np.isnan(middle(values, 0)[2]).all()
