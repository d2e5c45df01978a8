"""A recording's labels onto a marker set: aliases, prefixes, two hands."""

import dataclasses

import numpy as np
import pytest

from mjx_hand.capture.markers.labels import match_labels
from mjx_hand.capture.markers.marker_recording import MarkerRecording
from mjx_hand.capture.markers.marker_set import MarkerSet
from mjx_hand.errors import InputError

SET = MarkerSet(
    names=("tip", "back"),
    vertices=np.array([1, 2]),
    offsets=np.zeros(2),
    labels=((r"nail\d?", "TP"), ()),
)


def recording(*names: str) -> MarkerRecording:
    """Each marker's position is its place among the names, counted from 1."""
    positions = np.tile(np.arange(1.0, len(names) + 1)[:, None], (4, 1, 3))
    return MarkerRecording(
        fps=50.0, positions=positions, visible=np.ones((4, len(names)), bool), names=names, source="f"
    )


@pytest.mark.parametrize(
    ("names", "prefix", "found"),
    [
        (("elbow", "back", "tip"), "", {"tip": 3, "back": 2}),
        (("BACK", "Tip"), "", {"tip": 2, "back": 1}),
        (("Subject 1:back", "Subject 1:nail2"), "", {"tip": 2, "back": 1}),
        (("back", "tp"), "", {"tip": 2, "back": 1}),
        (("R_back", "L_back", "R_tip", "L_tip"), "r_", {"tip": 3, "back": 1}),
        (("s:L_back", "s:L_tip", "s:R_tip"), "s:L_", {"tip": 2, "back": 1}),
    ],
)
def test_labels_find_their_markers(names, prefix, found):
    labelled = match_labels(recording(*names), SET, prefix)
    where = dict(zip(labelled.recording.names, labelled.recording.positions[0, :, 0], strict=True))
    assert where == found
    assert labelled.missing == ()
    assert set(labelled.others) == {n for k, n in enumerate(names, 1) if k not in found.values()}


def test_what_is_missing_is_said():
    labelled = match_labels(recording("tip", "elbow"), SET)
    assert (labelled.missing, labelled.others) == (("back",), ("elbow",))
    never = recording("tip", "back")
    never = dataclasses.replace(never, visible=never.visible & np.array([True, False]))
    assert match_labels(never, SET).missing == ("back",)


@pytest.mark.parametrize(
    ("names", "prefix", "message"),
    [
        (("A:tip", "B:tip", "back"), "", "'A:tip' and 'B:tip' are both marker 'tip'; are there two hands"),
        (("tip", "nail1"), "", "'tip' and 'nail1' are both marker 'tip'"),
        (("R_tip", "L_tip", "R_back"), "", "some are after 'L_', 'R_': say --prefix"),
        (("elbow", "knee"), "", r"none of its labels \(elbow, knee\) is in the marker set \(tip, back"),
        (("tip",), "R_", "no label is 'R_' and a marker of the set"),
        (("L_tip",), "R_", "no label is 'R_' and a marker of the set; some begin with 'L_'"),
    ],
)
def test_labels_that_cannot_be_matched(names, prefix, message):
    with pytest.raises(InputError, match=message):
        match_labels(recording(*names), SET, prefix)
