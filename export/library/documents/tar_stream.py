"""The members of a .tar, read from a stream in one pass with a bounded amount of work per header.

Python's `tarfile` reads names and extended headers of any size, takes quadratic time on some of them, and
extracts differently from release to release. This reader supports what archives of plain files need: the
headers of POSIX (ustar), the long names of GNU, and `path` and `size` in the extended headers of POSIX (pax).
Members of other kinds are returned with kind `other`, and their content is not read.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import IO, Final, Literal

from ....models.errors import InputError

Kind = Literal["file", "folder", "other"]

_BLOCK: Final = 512
_CHUNK: Final = 1 << 20
MOST_EXTENDED: Final = 1 << 13
"""Bytes of an extended header or a long name; common programs write a few hundred."""
_MOST_RECORDS: Final = 64  # of an extended header
_LONG_NAME, _LONG_LINK, _EXTENDED, _GLOBAL = b"L", b"K", b"x", b"g"
_OCTAL: Final = re.compile(rb" *([0-7]+)[ \0]*")
_RECORD: Final = re.compile(rb"([0-9]{1,4}) ([^=\n]{1,100})=")


@dataclass(frozen=True)
class Member:
    """A member of an archive: its name, kind, size in bytes, and the stream that holds its content."""

    name: str
    kind: Kind
    size: int
    stream: IO[bytes]

    def chunks(self) -> Iterator[bytes]:
        """Yield the content, once. Raises ValueError where it is cut off."""
        left = self.size
        while left:
            chunk = _exactly(self.stream, min(left, _CHUNK))
            left -= len(chunk)
            yield chunk


def members(stream: IO[bytes]) -> Iterator[Member]:
    """Yield the members of a .tar; the content of each can be read until the next one is requested.

    After the last member the stream may hold zeros only. Raises ValueError for a stream that is no .tar, is
    cut off or goes on, and InputError for a header beyond the limits.
    """
    counted, extended = _Counted(stream), _Extended()
    while (block := _exactly(counted, _BLOCK)).strip(b"\0"):
        size, flag = _size(block), block[156:157]
        if flag in (_LONG_NAME, _LONG_LINK, _EXTENDED, _GLOBAL):
            extended.read(flag, _extension(counted, size))
            continue
        member = extended.applied(block, size, counted)
        extended = _Extended()
        end = counted.place + member.size + -member.size % _BLOCK
        yield member
        while counted.place < end:
            _exactly(counted, min(end - counted.place, _CHUNK))
    while rest := counted.read(_CHUNK):
        if rest.strip(b"\0"):
            raise ValueError("something follows the end")


class _Counted:
    """A stream that counts the bytes it has given."""

    def __init__(self, stream: IO[bytes]) -> None:
        self._stream, self.place = stream, 0

    def read(self, size: int) -> bytes:
        """Return the next bytes."""
        data = self._stream.read(size)
        self.place += len(data)
        return data


class _Extended:
    """Facts about a member from the headers before its own."""

    def __init__(self) -> None:
        self.name: bytes | None = None
        self.size: int | None = None
        self.sparse = False

    def read(self, flag: bytes, content: bytes) -> None:
        """Take over a long name or the records of an extended header."""
        if flag == _LONG_NAME:
            self.name = content.rstrip(b"\0")
        if flag not in (_EXTENDED, _GLOBAL):
            return
        for key, value in _records(content):
            if flag == _GLOBAL and key in (b"path", b"size"):
                raise ValueError("a global header names or measures members")
            if key == b"path":
                self.name = value
            elif key == b"size":
                self.size = int(value[:20])
            self.sparse = self.sparse or key.startswith(b"GNU.sparse")

    def applied(self, block: bytes, size: int, stream: _Counted) -> Member:
        """The member that a header announces, with what came before the header."""
        name = _name(block) if self.name is None else self.name
        size = size if self.size is None else self.size
        kind: Kind = "other"
        if block[156:157] == b"5" or (block[156:157] == b"\0" and name.endswith(b"/")):
            kind = "folder" if size == 0 else "other"
        elif block[156:157] in (b"0", b"\0", b"7") and not self.sparse and not name.endswith(b"/"):
            kind = "file"
        return Member(name.decode(), kind, size, stream)  # type: ignore[arg-type]


def _exactly(stream: IO[bytes] | _Counted, size: int) -> bytes:
    data = stream.read(size)
    if len(data) != size:
        raise ValueError("the archive is cut off")
    return data


def _size(block: bytes) -> int:
    """The size that a header states, whose checksum must be right."""
    if _number(block[148:156]) != sum(block[:148]) + sum(block[156:]) + 8 * ord(" "):
        raise ValueError("a header has another checksum")
    return _number(block[124:136])


def _number(field: bytes) -> int:
    """A number in octal digits, or in the binary form of GNU for large files."""
    if field[:1] == b"\x80":
        return int.from_bytes(field[1:], "big")
    found = _OCTAL.fullmatch(field)
    if found is None:
        raise ValueError("a header holds no number")
    return int(found[1], 8)


def _name(block: bytes) -> bytes:
    """The name in a header, with the folders before it if the header is of POSIX."""
    name, prefix = block[:100].split(b"\0")[0], block[345:500].split(b"\0")[0]
    return prefix + b"/" + name if prefix and block[257:263] == b"ustar\0" else name


def _extension(stream: _Counted, size: int) -> bytes:
    if size > MOST_EXTENDED:
        raise InputError("holds unreasonably much in a header; do not unpack it")
    return _exactly(stream, size + -size % _BLOCK)[:size]


def _records(content: bytes) -> Iterator[tuple[bytes, bytes]]:
    """Keys and values of an extended header."""
    at = 0
    for _ in range(_MOST_RECORDS):
        if at == len(content):
            return
        found = _RECORD.match(content, at)
        end = at + int(found[1]) if found else 0
        if found is None or not found.end() < end <= len(content) or content[end - 1 : end] != b"\n":
            raise ValueError("an extended header holds no record")
        yield found[2], content[found.end() : end - 1]
        at = end
    if at < len(content):
        raise InputError("holds unreasonably much in a header; do not unpack it")
