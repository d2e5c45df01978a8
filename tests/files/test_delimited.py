"""Tables as spreadsheets, databases and scripts write them."""

import numpy as np
import pytest

from mjx_hand.errors import InputError
from mjx_hand.files.delimited import read_table


def table(tmp_path, text: str):
    (tmp_path / "a.csv").write_text(text)
    return read_table(tmp_path / "a.csv")


@pytest.mark.parametrize(
    "text",
    [
        "# fps: 30\n\nname,a_x,a_y\nleft,1.5,-2\nright,,nan\n",
        "# FPS : 30\nname;a_x;a_y\nleft;1,5;-2\nright;;NaN\n",
        '# fps: 30\n"name"\ta_x\ta_y\n"left"\t1.5\t-2\nright\t\tn/a\t\n',
        '# fps: 30\nname,a_x,a_y\n"left","1.5","-2"\n"right","",""\n',
    ],
)
def test_separators_quotation_marks_and_gaps(tmp_path, text):
    found = table(tmp_path, text)
    assert found.said == {"fps": "30"}
    assert found.columns == ("name", "a_x", "a_y")
    rows = found.rows()
    assert [row[0] for row in rows] == ["left", "right"]
    np.testing.assert_array_equal(found.numbers(rows, [1, 2]), [[1.5, -2], [np.nan, np.nan]])


def test_what_is_no_table_of_numbers(tmp_path):
    found = table(tmp_path, "a,b\n1,2\n1\n")
    with pytest.raises(InputError, match="frame 1 has 1 cells of 2"):
        found.rows()
    found = table(tmp_path, "a,b\n1,two\n")
    with pytest.raises(InputError, match="frame 0 has 'two' where a number is expected"):
        found.numbers(found.rows(), [1])
    endless = '"' + "x" * 200_000
    with pytest.raises(InputError, match="no row of a table"):
        table(tmp_path, f"a,{endless}\n1,2\n")
    with pytest.raises(InputError, match="no row of a table"):
        table(tmp_path, f"a,b\n1,{endless}\n").rows()
    assert table(tmp_path, "a,b,a\n").repeated() == ["a"]
    assert table(tmp_path, "\n").columns == ()
