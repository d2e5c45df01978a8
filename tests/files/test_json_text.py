"""JSON and its like: lines, scripts, LZString, and what is no such thing."""

import base64
import json
from pathlib import Path

import pytest

from mjx_hand.errors import InputError
from mjx_hand.files.json_text import read_json
from mjx_hand.files.lz_string import decompress_base64


def compressed(text: str) -> str:
    """LZString's compressToBase64, after its author's description."""
    bits: list[int] = []
    codes: dict[str, int] = {}
    fresh: set[str] = set()
    count, width, room, word = 3, 2, 2, ""

    def put(value: int, size: int) -> None:
        bits.extend((value >> k) & 1 for k in range(size))

    def emit(word: str) -> None:
        nonlocal width, room
        if word in fresh:
            wide = ord(word[0]) > 255
            put(1 if wide else 0, width)
            put(ord(word[0]), 16 if wide else 8)
            room -= 1
            if room == 0:
                room, width = 2**width, width + 1
            fresh.discard(word)
        else:
            put(codes[word], width)
        room -= 1
        if room == 0:
            room, width = 2**width, width + 1

    for letter in text:
        if letter not in codes:
            codes[letter] = count
            count += 1
            fresh.add(letter)
        if word + letter in codes:
            word += letter
            continue
        emit(word)
        codes[word + letter] = count
        count += 1
        word = letter
    if word:
        emit(word)
    put(2, width)
    data = [sum(bit << (7 - k) for k, bit in enumerate(bits[at : at + 8])) for at in range(0, len(bits), 8)]
    return base64.b64encode(bytes(data)).decode()


@pytest.mark.parametrize("text", ["a", "abab" * 50, "[1.5, 2.5, 3.5]" * 40, "Straße — 手 " * 9])
def test_lz_string_comes_back(text):
    assert decompress_base64(compressed(text)) == text


def test_lz_string_of_a_real_recording(recordings):
    folder = recordings / "leap_recorder"
    text = decompress_base64((folder / "wave.json.lz").read_text())
    assert json.loads(text) == json.loads((folder / "wave.json").read_text())


def test_lz_string_is_bounded_and_refuses_what_is_not_its_own():
    with pytest.raises(ValueError, match="more than 1000 characters"):
        decompress_base64(compressed("a" * 5000), longest=1000)
    for text in ("", "====", "not base64!", compressed("abcabc")[:5]):
        with pytest.raises(ValueError, match="it "):
            decompress_base64(text)


def test_lines_and_scripts(tmp_path):
    (tmp_path / "a.jsonl").write_text('{"t": 0}\n\n{"t": 1}\nnull\n')
    assert read_json(tmp_path / "a.jsonl") == [{"t": 0}, {"t": 1}, None]
    (tmp_path / "a.json").write_bytes('{"t": [1, 2]}'.encode("utf-16"))
    assert read_json(tmp_path / "a.json") == {"t": [1, 2]}
    script = """// poses, of [brackets] {too}
    import { x } from 'y'
    const note = 'it\\'s'
    const poses = [ /* the first */ {names: ["a, ]", 'b'], "at": [0, -1.5e2,], }, // last
    ]
    export { poses }"""
    (tmp_path / "a.js").write_text(script)
    assert read_json(tmp_path / "a.js") == [{"names": ["a, ]", "b"], "at": [0, -150.0]}]
    (tmp_path / "b.js").write_text("export default {a: 1}")
    assert read_json(tmp_path / "b.js") == {"a": 1}


@pytest.mark.parametrize(
    ("name", "text", "says"),
    [
        ("a.json", "[" * 100_000, "lists within lists"),
        ("a.json", "[1, ", "Expecting value"),
        ("a.jsonl", '{"a": 1}\n{"a": \n', "line 2: Expecting value"),
        ("a.js", "var x = 3", "no array or object"),
        ("a.lz", "plain text", "no base64"),
    ],
)
def test_damage_is_told_in_one_line(tmp_path, name, text, says):
    (tmp_path / name).write_text(text)
    with pytest.raises(InputError, match=says) as caught:
        read_json(tmp_path / name)
    assert "\n" not in str(caught.value)


def test_numbers_that_no_float_holds_are_infinite(tmp_path):
    (tmp_path / "a.json").write_text(f"[{'9' * 5000}, -{'9' * 400}, 7]")
    assert read_json(tmp_path / "a.json") == [float("inf"), float("-inf"), 7]


def test_a_pointer_or_pipe_is_not_read(tmp_path: Path):
    pointer = "version https://git-lfs.github.com/spec/v1\noid sha256:00\nsize 1\n"
    (tmp_path / "a.json").write_text(pointer)
    with pytest.raises(InputError, match="a Git LFS pointer"):
        read_json(tmp_path / "a.json")
