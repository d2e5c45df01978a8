"""Reading small YAML files of descriptions and settings, whoever wrote them.

What is read is the core schema of YAML 1.2 (https://yaml.org/spec/1.2.2/#103-core-schema): mappings, lists, text,
numbers, true, false and null. No dates, no times as numbers of base 60, no objects. Aliases and merge keys, with which
a few lines stand for gigabytes, are refused, and so are a key that is there twice, deep nesting and long files. Values
are made of the parser's events, without recursion.
"""

import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from mjx_hand.errors import InputError

LARGEST = 2**18  # bytes; a description has some thousand
DEEPEST = 30  # mappings and lists inside each other
_SHOWN = 80  # characters of a value in a message
_REASON = 160  # characters of what the parser says
_TAGS = "tag:yaml.org,2002:"
_INTEGER = re.compile(r"[-+]?[0-9]+|0o[0-7]+|0x[0-9a-fA-F]+")
_FLOAT = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?|[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)")
_NAMES = {"true": True, "false": False, "null": None}
_WORDS = {"": None, "~": None} | {f(n): v for n, v in _NAMES.items() for f in (str.lower, str.title, str.upper)}


class _Refused(Exception):
    """What is valid YAML and yet not read here."""


@dataclass
class _Open:
    """A mapping or list whose end has not come yet; a mapping's key waits for its value."""

    value: dict[Any, Any] | list[Any]
    key: Any = None
    has_key: bool = False

    def add(self, item: Any, line: int) -> None:
        if isinstance(self.value, list):
            self.value.append(item)
        elif self.has_key:
            self.value[self.key], self.has_key = item, False
        elif isinstance(item, dict | list):
            raise _Refused(f"line {line}: a key is a mapping or a list; keys are words or numbers")
        elif item == "<<":
            raise _Refused(f"line {line}: has a merge key, '<<'; write its entries out")
        elif item in self.value:
            raise _Refused(f"line {line}: {shown(item)} is there twice; give each its own name")
        else:
            self.key, self.has_key = item, True


def read_yaml(path: str | Path) -> Any:
    """What a YAML file says.

    Args:
        path: of a file of UTF-8 text.

    Raises:
        InputError: it cannot be read, is too large, is not YAML, or is YAML of a kind that is refused here.
    """
    path = Path(path)
    try:
        with path.open("rb") as file:
            content = file.read(LARGEST + 1)
        text = content[:LARGEST].decode("utf-8-sig", errors="strict" if len(content) <= LARGEST else "ignore")
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror or error}); give a YAML file") from None
    except UnicodeDecodeError:
        raise InputError(f"{path}: not YAML: it is not UTF-8 text; save it as UTF-8") from None
    return parse_yaml(text + " " * (len(content) > LARGEST), str(path))


def parse_yaml(text: str, source: str) -> Any:
    """What YAML text says; None where it says nothing.

    Args:
        text: one document.
        source: what messages call it.

    Raises:
        InputError: it is too large, is not YAML, or is YAML of a kind that is refused here.
    """
    if len(text) > LARGEST:
        raise InputError(f"{source}: over {LARGEST >> 10} KiB of YAML; a description or settings need a few")
    try:
        return _built(yaml.parse(text, Loader=yaml.SafeLoader))
    except _Refused as error:
        reason = str(error)
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        reason = f"line {mark.line + 1}: {error.problem or error.context}" if mark else str(error.problem)
    except Exception as error:  # PyYAML passes on whatever reading odd text raises
        reason = (str(error).splitlines() or [type(error).__name__])[0]
    raise InputError(f"{source}: not YAML that can be read ({_cut(reason, _REASON)})")


def shown(value: Any) -> str:
    """A value of a file as messages quote it: on one line, and not longer than a line."""
    return _cut(repr(value), _SHOWN)


def _cut(text: str, length: int) -> str:
    line = " ".join(text.split())
    return line if len(line) <= length else f"{line[: length - 1]}…"


def _built(events: Iterable[yaml.Event]) -> Any:
    """The value of the one document."""
    root: list[Any] = []
    stack = [_Open(root)]
    documents = 0
    for event in events:
        line = event.start_mark.line + 1
        if isinstance(event, yaml.DocumentStartEvent):
            documents += 1
            if documents > 1:
                raise _Refused(f"line {line}: a second document begins; give one a file")
        elif isinstance(event, yaml.AliasEvent):
            raise _Refused(f"line {line}: has an alias, *{event.anchor}; write out what it stands for")
        elif isinstance(event, yaml.ScalarEvent):
            stack[-1].add(_scalar(event, line), line)
        elif isinstance(event, yaml.SequenceStartEvent | yaml.MappingStartEvent):
            kind, fresh = ("seq", []) if isinstance(event, yaml.SequenceStartEvent) else ("map", {})
            if event.tag not in (None, "!", _TAGS + kind):
                raise _Refused(f"line {line}: has the tag {event.tag}; leave it out")
            if len(stack) > DEEPEST:
                raise _Refused(f"line {line}: nested over {DEEPEST} deep")
            stack[-1].add(fresh, line)
            stack.append(_Open(fresh))
        elif isinstance(event, yaml.SequenceEndEvent | yaml.MappingEndEvent):
            stack.pop()
    return root[0] if root else None


def _scalar(event: yaml.ScalarEvent, line: int) -> Any:
    """Text, a number, true, false or null, as written or as the tag says."""
    word, tag = event.value, event.tag
    found = word if event.style else _plain(word, line)
    if tag in (None, "!"):
        return word if tag == "!" else found
    if tag == f"{_TAGS}str":
        return word
    kinds = {"int": int, "float": (int, float), "bool": bool, "null": type(None)}
    kind = kinds.get(tag.removeprefix(_TAGS))
    if kind is None:
        raise _Refused(f"line {line}: has the tag {tag}; leave it out")
    found = _plain(word, line)
    if not isinstance(found, kind) or (isinstance(found, bool) and kind is not bool):
        raise _Refused(f"line {line}: {shown(word)} is no {tag.removeprefix(_TAGS)}")
    return float(found) if tag == f"{_TAGS}float" else found


def _plain(word: str, line: int) -> Any:
    if word in _WORDS:
        return _WORDS[word]
    if _INTEGER.fullmatch(word):
        if len(word) > 30 or abs(value := int(word, 0 if word[:2] in ("0o", "0x") else 10)) >= 2**63:
            raise _Refused(f"line {line}: the number {shown(word)} is too large")
        return value
    if _FLOAT.fullmatch(word):
        return float(word.lower().replace(".inf", "inf").replace(".nan", "nan"))
    return word
