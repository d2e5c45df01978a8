"""Digests stand in the names of users' folders: these are the values that `sha256sum` and other programs give."""

import hashlib

import pytest

from mjx_hand.files.digests import digest, file_digest, file_piece, json_digest

ABC = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"  # of "abc": FIPS 180-2, appendix B.1


def test_pieces_are_one_after_the_other(tmp_path):
    assert digest([b"abc"]) == digest([b"a", b"", b"bc"]) == ABC
    (tmp_path / "a").write_bytes(b"abc")
    assert file_digest(tmp_path / "a") == ABC


def test_plain_values_in_any_order_of_their_keys(tmp_path):
    wanted = hashlib.sha256(b'{"a": [1, 0.5], "b": null}').hexdigest()
    assert json_digest({"b": None, "a": (1, 0.5)}) == wanted
    with pytest.raises(TypeError):
        json_digest(tmp_path)
    assert json_digest(tmp_path, default=str) == json_digest(str(tmp_path))


def test_a_file_is_known_by_its_name_and_content_wherever_it_is(tmp_path):
    for folder in ("one", "two"):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "a").write_bytes(b"abc")
    assert file_piece(tmp_path / "one" / "a") == file_piece(tmp_path / "two" / "a") == b"a" + bytes.fromhex(ABC)
    (tmp_path / "one" / "b").write_bytes(b"abc")
    assert file_piece(tmp_path / "one" / "b") != file_piece(tmp_path / "one" / "a")
