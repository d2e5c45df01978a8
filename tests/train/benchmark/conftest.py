"""Where the benchmarks' sets are kept while tests run."""

import pytest


@pytest.fixture(scope="session")
def demonstrations(tmp_path_factory):
    """A folder in which the small sets that are measured on are made once."""
    return tmp_path_factory.mktemp("demonstrations")
