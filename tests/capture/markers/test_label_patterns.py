"""Patterns of labels: those that people write, and those that no label must be matched against."""

import time

import pytest

from mjx_hand.capture.markers.label_patterns import check_pattern, matches
from mjx_hand.errors import InputError


@pytest.mark.parametrize(
    ("pattern", "label"),
    [
        ("THNAIL", "thnail"),
        ("th.?tip", "TH_TIP"),
        ("ring.*tip.*", "ring_finger_tip2"),
        ("(l|left)_?index[0-9]+", "left_index12"),
        (r"hand\(1\)+", "hand(1)"),
        ("(?:right|r)?_hand", "right_hand"),
    ],
)
def test_what_people_write(pattern, label):
    assert matches(check_pattern("here", pattern), label)


@pytest.mark.parametrize(
    "pattern", ["(a+)+$", "(a|aa)*b", "(a*)*", "(.*a){20}", ".*.*.*.*.*x", "a?" * 30 + "a" * 30, "((a)+)"]
)
def test_what_would_take_for_ever(pattern):
    with pytest.raises(InputError, match=r"here: labels has .*(repeats a group|give at most 4)"):
        check_pattern("here", pattern)


@pytest.mark.parametrize("pattern", ["(", None, 3, [], "*", b"a"])
def test_what_is_no_pattern(pattern):
    with pytest.raises(InputError, match="is not a regular expression"):
        check_pattern("here", pattern)


def test_the_worst_that_is_allowed_is_quick():
    began = time.process_time()
    assert not matches(check_pattern("here", "a*a*a*a*b"), "a" * 64)
    assert not matches("a*a*a*a*b", "a" * 100_000)
    assert time.process_time() - began < 3
