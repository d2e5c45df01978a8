"""YAML from anybody: what is plain is read as its core schema says, everything else refused in one short line."""

import time
from pathlib import Path

import pytest
import yaml

from mjx_hand.errors import InputError
from mjx_hand.files.safe_yaml import LARGEST, parse_yaml, read_yaml, shown


def test_plain_yaml_is_read_as_pyyaml_reads_it():
    text = """
# a comment
palm: base_link
tips: {th tip: thumb_tip, "15": index_tip}
scaling: 1.25
small: 1.0e-05
whole: -3
flags: [true, false, null, ~]
text: 'yes: no'
block: |
  two
  lines
nested:
  - [1, 2.5]
  - {a: {b: c}}
"""
    assert parse_yaml(text, "x") == yaml.safe_load(text)
    assert parse_yaml('{"json": [1, 2.0, "x", null]}', "x") == {"json": [1, 2.0, "x", None]}
    assert parse_yaml("", "x") is None


def test_the_core_schema_knows_no_dates_and_no_base_60():
    words = ["2001-01-01", "1:30:00", "20200702_151821", "5e-3", "no", "0x1F", ".5", "-.inf", "010"]
    expected = ["2001-01-01", "1:30:00", "20200702_151821", 5e-3, "no", 31, 0.5, float("-inf"), 10]
    assert parse_yaml("\n".join(f"- {word}" for word in words), "x") == expected
    assert parse_yaml("[!!str 12, !!float 3, !!int 4, ! 5]", "x") == ["12", 3.0, 4, "5"]


LAUGH = "a: &a [x,x,x,x,x,x,x,x,x]\n" + "".join(
    f"{b}: &{b} [{','.join([f'*{a}'] * 9)}]\n" for a, b in zip("abcdefgh", "bcdefghi", strict=True)
)


@pytest.mark.parametrize(
    "text",
    [
        LAUGH,
        "a: &x {b: 1}\nc: {<<: *x}",
        "<<: {a: 1}",
        "a: 1\na: 2",
        "a: !!timestamp x",
        "a: !!bool x",
        "a: !!int ''",
        "a: !!python/object/apply:os.system [ls]",
        "a: !!set {b, c}",
        "a: !mine 3",
        "a: " + "9" * 5000,
        "a: " + "9" * 25,
        "a: !!int 2001-99-99",
        "[" * 900,
        "[" * 900 + "]" * 900,
        "- " * 900 + "x",
        "".join(f"{' ' * k}a:\n" for k in range(600)),
        "? [a, b]\n: c",
        "a: b: c",
        "a: 'open",
        "--- a\n--- b",
        "a: \x00",
        "a: *nowhere",
        "%YAML 9.9\n---\na",
        "a: %b",
        "\ttab: x",
        "x" * 2 + ": " + "y" * LARGEST,
    ],
)
def test_what_is_not_plain_is_one_short_line_at_once(text, tmp_path):
    began = time.process_time()
    (tmp_path / "x.yaml").write_text(text)
    for read in (lambda: parse_yaml(text, "x.yaml"), lambda: read_yaml(tmp_path / "x.yaml")):
        with pytest.raises(InputError) as caught:
            read()
        message = str(caught.value).replace(str(tmp_path), "")
        assert "x.yaml: " in message
        assert "\n" not in message
        assert len(message) < 300
    assert time.process_time() - began < 2.0


def test_files_that_are_no_text_are_refused(tmp_path):
    (tmp_path / "x.yaml").write_bytes(b"\xff\xfe\x00a")
    for path, message in ((tmp_path / "x.yaml", "not UTF-8"), (tmp_path, "a folder"), (Path("nope"), "no such")):
        with pytest.raises(InputError, match=message):
            read_yaml(path)


def test_values_in_messages_are_cut_short():
    assert shown([1, "a"]) == "[1, 'a']"
    assert len(shown("x" * 10**6)) <= 80
    assert "\n" not in shown("a\nb")
