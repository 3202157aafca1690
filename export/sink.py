"""Bytes on their way to a file: counted and hashed as they pass, or compressed, in threads beside the writer.

zlib and hashlib let other threads run while they work, so that writing a file takes as long as the slowest of the three. A compressed file
is one gzip member without name and time. It is made of pieces that are compressed on their own and end on a byte boundary (Z_FULL_FLUSH),
as pigz does it, so that the pieces of one file go to all cores; piece by piece the bytes depend on the content alone.
"""

from __future__ import annotations

import hashlib
import os
import struct
import zlib
from collections import deque
from collections.abc import Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from typing import Any, Final

from ..models.storage import replacing

LEVEL: Final = 2
"""Of zlib: twice as fast as its default, and files of one record repeated are no larger for it."""

PIECE: Final = 1 << 22
"""Bytes that are compressed on their own: enough for the loss at their seams to be nothing."""

_AHEAD: Final = 16
"""Chunks, of about 1 MB, or pieces that may wait for another thread: enough to keep it busy, few enough to keep memory flat."""

_HEAD: Final = b"\x1f\x8b\x08\0\0\0\0\0\0\xff"
_TAIL: Final = b"\x03\0"
"""An empty last block."""


def save(path: Path, chunks: Iterable[bytes]) -> dict[str, Any]:
    """Number of bytes and SHA-256 of the file now at `path`, compressed when it ends in .gz. Raises OutputError."""
    digest, size = hashlib.sha256(), 0
    with replacing(path) as stream, ThreadPoolExecutor(1) as pool:
        hashed: deque[Future[None]] = deque()
        for chunk in gzipped(chunks) if path.suffix == ".gz" else chunks:
            hashed.append(pool.submit(digest.update, chunk))
            stream.write(chunk)
            size += len(chunk)
            if len(hashed) > _AHEAD:
                hashed.popleft().result()
    return {"bytes": size, "sha256": digest.hexdigest()}


def gzipped(chunks: Iterable[bytes]) -> Iterator[bytes]:
    """The bytes of a gzip file that holds the chunks, in order."""
    check = size = 0
    yield _HEAD
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        waiting: deque[Future[bytes]] = deque()
        for piece in joined(chunks, PIECE):
            waiting.append(pool.submit(_deflated, piece))
            check, size = zlib.crc32(piece, check), size + len(piece)
            if len(waiting) > _AHEAD:
                yield waiting.popleft().result()
        yield from (future.result() for future in waiting)
    yield _TAIL + struct.pack("<II", check, size & 0xFFFFFFFF)


def joined(chunks: Iterable[bytes], least: int) -> Iterator[bytes]:
    """The same bytes in pieces of at least that length, the last one aside."""
    parts: list[bytes] = []
    length = 0
    for chunk in chunks:
        parts.append(chunk)
        length += len(chunk)
        if length >= least:
            yield b"".join(parts)
            parts, length = [], 0
    if parts:
        yield b"".join(parts)


def _deflated(piece: bytes) -> bytes:
    packer = zlib.compressobj(LEVEL, zlib.DEFLATED, -zlib.MAX_WBITS)
    return packer.compress(piece) + packer.flush(zlib.Z_FULL_FLUSH)
