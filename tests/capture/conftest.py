"""The open hand, its markers, a short marker recording, and one batch of fits that several tests look at."""

import dataclasses

import numpy as np
import pytest

from mjx_hand.capture.marker_fit.fit import FitReport, fit_many
from mjx_hand.capture.markers.marker_recording import MarkerRecording
from mjx_hand.capture.markers.marker_set import MarkerSet, included_marker_set
from mjx_hand.capture.simulation.simulate import simulate_markers
from mjx_hand.hand.load import load_hand
from mjx_hand.hand.model import HandModel
from mjx_hand.motion import Motion
from tests.capture.grasps import grasp


@pytest.fixture(scope="session")
def hand() -> HandModel:
    return load_hand()


@pytest.fixture(scope="session")
def marker_set(hand: HandModel) -> MarkerSet:
    return included_marker_set(hand)


@dataclasses.dataclass(frozen=True)
class Case:
    truth: Motion
    recording: MarkerRecording
    fit: Motion
    report: FitReport


@pytest.fixture(scope="session")
def noisy(hand: HandModel, marker_set: MarkerSet) -> list[Case]:
    """Three subjects as a capture system sees them: noise, gaps, misplaced markers."""
    truths = [grasp(hand, seed) for seed in range(3)]
    recordings = [simulate_markers(hand, truth, marker_set, seed) for seed, truth in enumerate(truths)]
    fits = fit_many(recordings, hand, marker_set)
    return [Case(t, r, *f) for t, r, f in zip(truths, recordings, fits, strict=True)]


@pytest.fixture(scope="session")
def clean(hand: HandModel, marker_set: MarkerSet) -> list[Case]:
    """The same subjects without noise, gaps or misplaced markers, and moving about their hinges only."""
    truths = [grasp(hand, seed, off_axis=0.0) for seed in range(3)]
    recordings = [
        simulate_markers(hand, truth, marker_set, 0, noise=0.0, gap_fraction=0.0, placement=0.0) for truth in truths
    ]
    fits = fit_many(recordings, hand, marker_set)
    return [Case(t, r, *f) for t, r, f in zip(truths, recordings, fits, strict=True)]


@pytest.fixture(scope="session")
def millimetres() -> np.ndarray:
    """A marker recording: five frames with gaps; to three decimals, as text formats write them."""
    positions = np.random.default_rng(0).uniform(-900, 900, (5, 3, 3)).round(3)
    positions[1:3, 0] = np.nan
    positions[4, 2] = np.nan
    return positions
