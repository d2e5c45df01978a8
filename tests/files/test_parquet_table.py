import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from mjx_hand.errors import InputError
from mjx_hand.files.describe import described
from mjx_hand.files.parquet_table import columns, count_rows, is_parquet, read_column, read_row

ROWS = [{"index": {"uuid": f"u{k}"} if k != 3 else None, "values": [[float(k)], []], "name": str(k)} for k in range(7)]


@pytest.fixture
def path(tmp_path):
    pq.write_table(pa.Table.from_pylist(ROWS), tmp_path / "a.parquet", row_group_size=3)
    return tmp_path / "a.parquet"


def test_each_row_is_the_one_that_went_in(path):
    assert (columns(path), count_rows(path), is_parquet(path)) == (["index", "values", "name"], 7, True)
    for k, row in enumerate(ROWS):
        found = read_row(path, k, ("index", "values", "other"))
        assert found == {name: row[name] for name in ("index", "values")}
    assert read_column(path, "index.uuid") == [f"u{k}" if k != 3 else None for k in range(7)]
    assert described(path) == "a table of 7 rows and the columns index, values, name"


def test_what_is_not_there_and_what_is_damaged_is_one_line(path):
    with pytest.raises(InputError, match="has no row 7; it has 7"):
        read_row(path, 7, ("index",))
    with pytest.raises(InputError, match="no such file"):
        columns(path.with_name("b.parquet"))
    for content in (path.read_bytes()[:-9], b"PAR1" + b"\xff" * 60 + b"PAR1"):
        path.write_bytes(content)
        for read in (columns, count_rows, described):
            with pytest.raises(InputError, match="not a readable Parquet table") as refusal:
                read(path)
            assert "\n" not in str(refusal.value)
