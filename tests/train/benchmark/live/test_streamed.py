"""The benchmark of streamed demonstrations says what it lacks; what it streams through is tested where it is."""

from pathlib import Path

import pytest

from mjx_hand.errors import InputError
from train.benchmark.live.streamed import Options, report


def test_sets_have_to_be_given():
    with pytest.raises(InputError, match="--sets FOLDER"):
        report(Options())
    with pytest.raises(InputError, match="no such folder"):
        report(Options(sets=(Path("nowhere"),)))
