"""No file, however damaged, ends in anything but a right result or one line."""

import pytest

from tests.fuzz.campaign import FAULTS, outcomes, tabulate


def check(count: int, first: int, folder) -> None:
    results = list(outcomes(range(first, first + count), folder))
    print(tabulate(results))
    assert len(results) == count
    assert [found for _, found in results if found["outcome"] in FAULTS] == []
    assert {found["outcome"] for _, found in results} == {"read", "refused"}


def test_some_hundred_damaged_files(tmp_path):
    check(400, 0, tmp_path)


@pytest.mark.slow
def test_twenty_thousand_damaged_files(tmp_path):
    check(20_000, 1_000_000, tmp_path)
