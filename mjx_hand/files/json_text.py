"""Values in text files: JSON, JSON lines, JSON in LZString's base64, and arrays or objects of a JavaScript module."""

import json
import re
from pathlib import Path
from typing import Any

from mjx_hand.errors import InputError
from mjx_hand.files.input_file import check_input_file
from mjx_hand.files.lz_string import decompress_base64

SUFFIXES = (".json", ".jsonl", ".ndjson", ".lz", ".js", ".mjs", ".ts")
_SCRIPTS = (".js", ".mjs", ".ts")
_LONGEST_INTEGER = 300  # digits that a float still holds
_STARTS = 50  # assignments of a script that are tried

# Pieces of a script: strings, within which nothing else counts, and comments.
_STRING = r'"(?:\\.|[^"\\\n])*"'
_PIECES = re.compile(rf"{_STRING}|'(?:\\.|[^'\\\n])*'|//[^\n]*|/\*.*?\*/", re.DOTALL)
_CODE = re.compile(rf"({_STRING})|[^\"]+")
_VALUE = re.compile(r"(?:=|\bexport\s+default\b|\breturn\b)\s*(?=[\[{])")


def read_json(path: Path) -> Any:
    """The value in a file of one of `SUFFIXES`: of JSON lines a list, of a script its first array or object.

    Whole numbers beyond what a float holds become infinite.

    Raises:
        InputError: no such file, or it is damaged; of lines, the message names the first that is.
    """
    check_input_file(path, "give the path of a recording")
    try:
        text = _decoded(path.read_bytes())
        if path.suffix.lower() == ".lz":
            text = decompress_base64(text)
        if path.suffix.lower() in _SCRIPTS:
            return _script(text)
        return _value(text)
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}); check its permissions") from None
    except RecursionError:
        raise InputError(f"{path}: not a readable {path.suffix} file (lists within lists, too many)") from None
    except ValueError as error:  # of bytes that are no text, of numbers, of JSON, of LZString
        reason = (str(error).splitlines() or [""])[0][:200]
        raise InputError(f"{path}: not a readable {path.suffix} file ({reason})") from None


def _decoded(content: bytes) -> str:
    wide = content.startswith((b"\xff\xfe", b"\xfe\xff"))  # PowerShell writes UTF-16
    return content.decode("utf-16" if wide else "utf-8-sig")


def _integer(digits: str) -> int | float:
    return int(digits) if len(digits) <= _LONGEST_INTEGER else float(digits)


_DECODER = json.JSONDecoder(parse_int=_integer)


def _value(text: str) -> Any:
    try:
        return _DECODER.decode(text)
    except json.JSONDecodeError as error:
        lines = [(number, line) for number, line in enumerate(text.splitlines(), start=1) if line.strip()]
        if len(lines) < 2 or error.msg != "Extra data":
            raise
    # A value a line: the first ended where more was to come.
    values = []
    for number, line in lines:
        try:
            values.append(_DECODER.decode(line))
        except json.JSONDecodeError as error:
            raise ValueError(f"line {number}: {error.msg}") from None
    return values


def _script(text: str) -> Any:
    """The first array or object that a script assigns, exports or returns; its keys may lack their quotation marks."""
    plain = _CODE.sub(lambda piece: piece[0] if piece[1] else _quoted(piece[0]), _PIECES.sub(_json_string, text))
    starts = [match.end() for match in _VALUE.finditer(plain)][:_STARTS]
    problem = ValueError("it assigns, exports or returns no array or object")
    for start in starts:
        try:
            return _DECODER.raw_decode(plain, start)[0]
        except json.JSONDecodeError as error:
            problem = error
    raise problem


def _json_string(piece: re.Match[str]) -> str:
    """A string in JSON's form; a space for a comment."""
    text = piece[0]
    if text[0] == "/":
        return " "
    return text if text[0] == '"' else json.dumps(text[1:-1].replace("\\'", "'"))


def _quoted(code: str) -> str:
    """Code with its keys in quotation marks, and without commas before a closing bracket."""
    code = re.sub(r"([{,]\s*)([A-Za-z_$][\w$]*)(\s*:)", r'\1"\2"\3', code)
    return re.sub(r",(\s*[\]}])", r"\1", code)
