"""Damaged and hostile copies of a valid file: of its bytes, of its text, and of what stands in its archive."""

import io
import re
import struct
import zipfile
from collections.abc import Callable
from pathlib import PurePath

import numpy as np

ABSURD = (
    *("1e999", "-1e999", "nan", "NaN", "inf", "Infinity", "-0", "0", "-1", "1e300", "1e-300", "999999999999", "true"),
    *("9" * 400, "9" * 5000, "null", "''", '""', "[]", "{}", "~", "0x10", "1:1", "2001-99-99", "𝟡", "\x00", "1,5"),
)
YAML = ("&a [*a]", "*nobody", "!!python/object/apply:os.system [ls]", "!!bool x", "!!int ''", "!!timestamp x", "<<: 3")
SUFFIXES = {"text": (".json", ".jsonl", ".csv", ".tsv", ".trc", ".yaml", ".yml", ".urdf")}
_NUMBER = re.compile(rb"-?\d+(\.\d+)?([eE][-+]?\d+)?")
_DEEPEST = 100_000

Bytes = Callable[[np.random.Generator, bytes], bytes]


def mutant(rng: np.random.Generator, name: str, content: bytes) -> bytes:
    """A mutant of a file, of a kind that its name's suffix allows."""
    suffix = PurePath(name).suffix.lower()
    kinds: list[Bytes] = [_flip, _flip, _cut, _delete, _insert, _fill, _twice, _behind]
    if suffix in SUFFIXES["text"]:
        kinds += [_number, _number, _nest, _lines, _long, _swap, _token]
    if suffix in (".yaml", ".yml"):
        kinds += [_yaml, _laugh]
    if suffix == ".urdf":
        kinds += [_entities]
    if suffix == ".npz":
        kinds += [_member, _member, _member, _directory, _bomb, _repeat]
    if suffix == ".npy":
        kinds += [lambda r, c: _array(r, c)]
    if suffix == ".pkl":
        kinds += [_opcode, _opcode]
    made = content
    for _ in range(int(rng.choice([1, 1, 1, 2]))):
        made = kinds[rng.integers(len(kinds))](rng, made)
    return made


def _place(rng: np.random.Generator, content: bytes) -> tuple[int, int]:
    begin = int(rng.integers(max(len(content), 1)))
    return begin, min(begin + int(2 ** rng.uniform(0, 9)), len(content))


def _flip(rng: np.random.Generator, content: bytes) -> bytes:
    made = bytearray(content)
    for _ in range(int(2 ** rng.uniform(0, 5))):
        if made:
            made[rng.integers(len(made))] ^= 1 << int(rng.integers(8))
    return bytes(made)


def _cut(rng: np.random.Generator, content: bytes) -> bytes:
    return content[: _place(rng, content)[0]]


def _delete(rng: np.random.Generator, content: bytes) -> bytes:
    begin, end = _place(rng, content)
    return content[:begin] + content[end:]


def _insert(rng: np.random.Generator, content: bytes) -> bytes:
    begin, end = _place(rng, content)
    return content[:begin] + rng.bytes(end - begin) + content[begin:]


def _fill(rng: np.random.Generator, content: bytes) -> bytes:
    begin, end = _place(rng, content)
    return content[:begin] + bytes([int(rng.choice([0, 255, 0x7F, 32]))]) * (end - begin) + content[end:]


def _twice(rng: np.random.Generator, content: bytes) -> bytes:
    begin, end = _place(rng, content)
    return content[:end] + content[begin:]


def _behind(rng: np.random.Generator, content: bytes) -> bytes:
    return content + rng.bytes(int(rng.integers(1, 2000)))


def _number(rng: np.random.Generator, content: bytes) -> bytes:
    found = list(_NUMBER.finditer(content))
    if not found:
        return content
    at = found[rng.integers(len(found))]
    return content[: at.start()] + str(rng.choice(ABSURD)).encode() + content[at.end() :]


def _token(rng: np.random.Generator, content: bytes) -> bytes:
    """A word of the file replaced by another of its words."""
    words = list(re.finditer(rb"\w+", content))
    if len(words) < 2:
        return content
    at, other = (words[k] for k in rng.integers(len(words), size=2))
    return content[: at.start()] + other[0] + content[at.end() :]


def _nest(rng: np.random.Generator, content: bytes) -> bytes:
    opening, closing = ((b"[", b"]"), (b'{"a":', b"}"), (b"- ", b""), (b"<link>", b"</link>"), (b"(", b")"))[
        rng.integers(5)
    ]
    depth = int(rng.choice([20, 600, 960, _DEEPEST]))
    found = list(_NUMBER.finditer(content)) or [re.match(b"", content)]
    at = found[rng.integers(len(found))]
    assert at is not None
    return content[: at.start()] + opening * depth + b"1" + closing * depth + content[at.end() :]


def _lines(rng: np.random.Generator, content: bytes) -> bytes:
    lines = content.split(b"\n")
    k, other = rng.integers(len(lines), size=2)
    kind = rng.integers(4)
    if kind == 0:
        del lines[k]
    elif kind == 1:
        lines.insert(other, lines[k])
    elif kind == 2:
        lines[k], lines[other] = lines[other], lines[k]
    else:
        lines[k] = lines[k] * int(rng.choice([2, 50]))
    return b"\n".join(lines)


def _long(rng: np.random.Generator, content: bytes) -> bytes:
    begin, _ = _place(rng, content)
    return content[:begin] + b"x" * int(rng.choice([300, 100_000, 3_000_000])) + content[begin:]


def _swap(rng: np.random.Generator, content: bytes) -> bytes:
    marks = (b",", b":", b"\t", b";", b"\n", b'"', b"'", b"<", b"=", b"-", b"[", b"{")
    mine, other = (marks[k] for k in rng.integers(len(marks), size=2))
    return content.replace(mine, other, int(rng.choice([1, 3, -1])))


def _yaml(rng: np.random.Generator, content: bytes) -> bytes:
    at = list(re.finditer(rb"(?<=: )\S.*", content))
    if not at:
        return content
    place = at[rng.integers(len(at))]
    return content[: place.start()] + str(rng.choice(YAML)).encode() + content[place.end() :]


def _laugh(rng: np.random.Generator, content: bytes) -> bytes:
    rows = [b"a0: &a0 [x, x, x, x, x, x, x, x, x]"]
    rows += [f"a{k}: &a{k} [{', '.join([f'*a{k - 1}'] * 9)}]".encode() for k in range(1, 12)]
    name = rng.choice(["fingers", "palm", "offset", "markers", "tips", "task", "betas", "num_frames"])
    return b"\n".join([*rows, f"{name}: *a11".encode()]) + b"\n" + content


def _entities(rng: np.random.Generator, content: bytes) -> bytes:
    rows = ['<!ENTITY a0 "' + "lol" * 10 + '">', '<!ENTITY file SYSTEM "file:///etc/passwd">']
    rows += [f'<!ENTITY a{k} "{f"&a{k - 1};" * 10}">' for k in range(1, 10)]
    used = str(rng.choice(["&a9;", "&file;", "&a2;"]))
    return f"<!DOCTYPE robot [{''.join(rows)}]>".encode() + content.replace(b"<link", f"{used}<link".encode(), 1)


def _members(content: bytes) -> dict[str, bytes] | None:
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            return {name: archive.read(name) for name in archive.namelist()}
    except Exception:  # damaged already
        return None


def _archive(members: dict[str, bytes], level: int | None = None) -> bytes:
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED, compresslevel=level) as archive:
        for name, content in members.items():
            archive.writestr(name, content)
    return stream.getvalue()


def _member(rng: np.random.Generator, content: bytes) -> bytes:
    members = _members(content)
    if not members:
        return content
    name = list(members)[rng.integers(len(members))]
    kind = rng.integers(6)
    if kind == 0:
        del members[name]
    elif kind == 1:
        members[name.replace(".npy", "2.npy")] = members[name]
    elif kind == 2:
        members[name] = _flip(rng, members[name])
    elif kind == 3:
        other = list(members)[rng.integers(len(members))]
        members[name], members[other] = members[other], members[name]
    else:
        members[name] = _array(rng, members[name])
    return _archive(members)


def _array(rng: np.random.Generator, content: bytes) -> bytes:
    """Another array, or a header that lies."""
    try:
        value = np.load(io.BytesIO(content), allow_pickle=False)
    except Exception:  # objects, or damaged already
        value = np.zeros(3)
    kind = rng.integers(5)
    if kind < 3:
        return _saved(_other(rng, value))
    shapes = ("10**12,", "1000000000000,", "-1,", "0, 1000000000000", "", "9" * 300, "1000000, 1000000, 1000000")
    types = ("<f8", "|O", "<U0", "|V0", "<U1", "|S100000", "<c16", "<M8[s]", "<f2", ">i4")
    shape, dtype = rng.choice(shapes), rng.choice(types)
    header = rng.choice([f"{{'descr': '{dtype}', 'fortran_order': False, 'shape': ({shape}), }}", "{", "(" * 200, "3"])
    text = str(header).encode().ljust(245) + b"\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(text)) + text + content[-200:]


def _other(rng: np.random.Generator, value: np.ndarray) -> np.ndarray:
    kind = rng.integers(9)
    if kind == 0:
        return value[None]
    if kind == 1:
        return value.ravel()[:1].reshape(()) if value.size else np.zeros(())
    if kind == 2:
        return np.asarray(rng.choice(["", "line\nbreak \x1b[2J", "x" * 3000, "right"]))
    if kind == 3:
        return value[:0] if value.ndim else value
    if kind == 4:
        return value.astype(complex) if value.dtype.kind in "fiub" else np.array([b"bytes"])
    if kind == 5:
        return np.concatenate([value, value]) if value.ndim else np.array([value, value])
    if kind == 6:
        return np.full(value.shape, rng.choice([np.nan, np.inf, 1e300, -1.0, 1e18, 0.0]))
    if kind == 7 and value.size and value.dtype.kind in "fiu":
        made = value.astype(float).ravel()
        made[rng.integers(made.size)] = rng.choice([np.nan, np.inf, 1e300, -1e5, 1e18])
        return made.reshape(value.shape)
    return value[..., :-1] if value.ndim else np.zeros(3)


def _saved(value: np.ndarray) -> bytes:
    stream = io.BytesIO()
    np.save(stream, value, allow_pickle=False)
    return stream.getvalue()


def _directory(rng: np.random.Generator, content: bytes) -> bytes:
    made = bytearray(content)
    start = max(content.find(b"PK\x01\x02"), 0)
    for _ in range(int(rng.integers(1, 4))):
        if len(made) > start:
            made[rng.integers(start, len(made))] = int(rng.integers(256))
    return bytes(made)


def _bomb(rng: np.random.Generator, content: bytes) -> bytes:
    """A member of zeros that unpacks to two hundred times its size."""
    members = _members(content)
    if not members:
        return content
    name = str(rng.choice([*members, "unused.npy"]))
    rows = 300_000
    header = f"{{'descr': '<f8', 'fortran_order': False, 'shape': ({rows}, 100), }}".ljust(117).encode() + b"\n"
    members[name] = b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header)) + header + bytes(rows * 800)
    return _archive(members, level=1)  # a third of the time


def _repeat(rng: np.random.Generator, content: bytes) -> bytes:
    """The directory's entries twice, and so two members of each name."""
    start, end = content.find(b"PK\x01\x02"), content.rfind(b"PK\x05\x06")
    if start < 0 or end < start:
        return content
    entries, tail = content[start:end], bytearray(content[end:])
    if len(tail) < 22:
        return content
    count, size = struct.unpack_from("<HI", tail, 10)
    struct.pack_into("<HHI", tail, 8, (2 * count) % 65536, (2 * count) % 65536, (2 * size) % 2**32)
    return content[:start] + entries * 2 + bytes(tail)


def _opcode(rng: np.random.Generator, content: bytes) -> bytes:
    """A piece of another program among a pickle's own."""
    pieces = (
        b"cos\nsystem\n(S'true'\ntR",
        b"cbuiltins\nexec\n(Vpass\ntR",
        b"\x8c\x02os\x8c\x06system\x93\x8c\x04true\x85R",
        b"\x96" + struct.pack("<Q", 3 * 10**9),
        b"B" + struct.pack("<I", 2**32 - 1),
        b"X" + struct.pack("<I", 2**31),
        b"r" + struct.pack("<I", 2**31 - 1),
        b"j" + struct.pack("<I", 2**31 - 1),
        b"Pid\n",
        b"(" * 1000,
        b"]" * 3000 + b"a" * 3000,
        b"}b",
        b"2" * 500,
        b"0" * 20,
        b"cnumpy\nndarray\n)\x81",
        b"N.",
        b"I" + b"9" * 5000 + b"\n",
    )
    begin, end = _place(rng, content)
    return content[:begin] + pieces[rng.integers(len(pieces))] + content[begin if rng.integers(2) else end :]
