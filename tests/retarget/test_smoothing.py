"""Over time: the filter against a dense solve in double precision, its response, gaps, and whole turns."""

import jax
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mjx_hand.errors import InputError
from mjx_hand.retarget.smoothing import penalty, smooth, unwrap

FRAMES = 256


def dense(values, valid, weight):
    """The same minimiser by NumPy's least squares on the stacked equations."""
    second = np.diff(np.eye(len(valid)), 2, axis=0)
    rows = np.concatenate([np.eye(len(valid))[valid], np.sqrt(weight) * second])
    right = np.concatenate([values[valid], np.zeros((len(second), values.shape[1]))])
    return np.linalg.lstsq(rows, right, rcond=None)[0]


def course(seed=0):
    rng = np.random.default_rng(seed)
    time = np.arange(FRAMES)[:, None] / 60
    phase = 2 * np.pi * rng.uniform(0.3, 3, 3) * time + rng.uniform(0, 6, 3)
    return np.sin(phase) + 0.05 * rng.normal(size=(FRAMES, 3))


@pytest.mark.parametrize(("fps", "cutoff"), [(25.0, 6.0), (120.0, 6.0), (1000.0, 6.0)])
def test_equals_the_dense_solution_with_gaps(fps, cutoff):
    valid = np.random.default_rng(1).random(FRAMES) > 0.2
    valid[100:130] = False
    valid[[0, -1]] = False
    values, weight = course(), penalty(fps, cutoff)
    expected = dense(values, valid, weight)
    holed = np.where(valid[:, None], values, np.nan).astype(np.float32)  # what stands in a gap must not matter
    found = np.asarray(smooth(holed, valid, weight))
    np.testing.assert_allclose(found[valid], expected[valid], atol=1e-3)  # the first frames' prior
    assert np.abs(found - expected).max() < 0.02  # gaps' middles are less certain in single precision


def test_cutoff_is_halved_slow_passes_and_fast_goes():
    time = np.arange(2048) / 100
    waves = np.stack([np.sin(2 * np.pi * f * time) for f in (1.0, 6.0, 25.0)], axis=1).astype(np.float32)
    found = np.asarray(smooth(waves, np.ones(2048, bool), penalty(100.0, 6.0)))[500:1500]
    amplitude = np.sqrt(2) * found.std(axis=0)
    assert amplitude[0] == pytest.approx(1.0, abs=0.01)
    assert amplitude[1] == pytest.approx(0.5, abs=0.01)
    assert amplitude[2] < 0.01


def test_straight_lines_pass_and_one_frame_is_itself():
    line = np.linspace([0, 1], [3, -1], FRAMES).astype(np.float32)
    valid = np.ones(FRAMES, bool)
    valid[50:90] = False
    np.testing.assert_allclose(smooth(line, valid, penalty(60.0, 4.0)), line, atol=1e-4)
    one = np.zeros(FRAMES, bool)
    one[7] = True
    np.testing.assert_allclose(smooth(line, one, penalty(60.0, 4.0))[7], line[7], atol=1e-6)


def test_vmap_over_sequences():
    values = np.stack([course(k) for k in range(3)]).astype(np.float32)
    valid = np.random.default_rng(2).random((3, FRAMES)) > 0.3
    many = jax.vmap(smooth, in_axes=(0, 0, None))(values, valid, 10.0)
    for k in range(3):
        np.testing.assert_allclose(many[k], smooth(values[k], valid[k], 10.0), atol=1e-3)


@pytest.mark.parametrize("cutoff", [0.0, -1.0, 12.5, 50.0])
def test_cutoffs_out_of_range_are_refused(cutoff):
    with pytest.raises(InputError, match="must lie between 0 and half"):
        penalty(25.0, cutoff)


@settings(deadline=None, max_examples=25)
@given(seed=st.integers(0, 2**20), gap=st.integers(0, FRAMES - 2))
def test_whole_turns_are_taken_out_and_gaps_do_not_matter(seed, gap):
    rng = np.random.default_rng(seed)
    steps = rng.uniform(-2.5, 2.5, (FRAMES, 4))
    truth = np.cumsum(steps, axis=0)
    truth += -2 * np.pi * np.round(truth.mean(axis=0) / (2 * np.pi))
    wrapped = np.mod(truth + np.pi, 2 * np.pi) - np.pi
    found = np.asarray(unwrap(wrapped.astype(np.float32), np.ones(FRAMES, bool), np.zeros(4, np.float32)))
    np.testing.assert_allclose(np.diff(found, axis=0), steps[1:], atol=1e-3)
    assert np.abs(found.mean(axis=0)).max() <= np.pi + 1e-2
    valid = np.ones(FRAMES, bool)
    valid[gap] = False
    slow = 0.3 * steps.cumsum(axis=0) / 2.5
    wrapped = np.mod(slow + np.pi, 2 * np.pi) - np.pi
    wrapped[gap] = np.nan
    found = np.asarray(unwrap(wrapped.astype(np.float32), valid, np.zeros(4, np.float32)))[valid]
    assert np.isfinite(found).all()
    assert np.abs(np.diff(found, axis=0)).max() < np.pi


def test_of_equal_courses_the_one_nearest_the_hinges_range():
    angles = np.full((FRAMES, 2), 3.0, np.float32)
    middle = np.array([0.6, -1.0], np.float32)
    found = np.asarray(unwrap(angles, np.ones(FRAMES, bool), middle))
    np.testing.assert_allclose(found[0], [3.0, 3.0 - 2 * np.pi], atol=1e-5)
