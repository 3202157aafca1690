"""Bytes on their way to a file: counted and hashed, or compressed, in threads next to the writer.

zlib, hashlib and the system let other threads run while they work. So a file takes as long as the
slowest of its steps, or as long as all of them shared by the cores. A small file starts no thread.

A compressed file is one gzip member without name and time. It consists of pieces that are compressed
separately and end on a byte boundary (Z_FULL_FLUSH), as in pigz, so that the pieces of one file go to all
cores. The bytes depend only on the content.
"""

from __future__ import annotations

import hashlib
import os
import struct
import zlib
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final, Self

from ...models.storage import replacing

LEVEL: Final = 2
"""Level of zlib: twice as fast as its default, and files of repeated records are not larger."""

PIECE: Final = 1 << 22
"""Bytes that are compressed separately: enough to make the loss at their seams negligible."""

_AHEAD: Final = 16
"""Pieces that may wait for another thread: enough to keep it busy, few enough to limit memory."""

SHARE: Final = 1 << 21
"""Bytes that are passed to another thread at once: enough to make the transfer negligible."""

_SHARES: Final = 16
"""Shares that may wait for each thread."""

_HEAD: Final = b"\x1f\x8b\x08\0\0\0\0\0\0\xff"
_TAIL: Final = b"\x03\0"
"""An empty last block."""


def is_packed(path: Path) -> bool:
    """Whether a path names a compressed file: its suffix is `.gz`, in upper or lower case."""
    return path.suffix.lower() == ".gz"


def save_file(path: Path, chunks: Iterable[bytes], *, force: bool = False) -> dict[str, Any]:
    """Write a file, compressed if `is_packed(path)`; return its size and SHA-256. Raises OutputError."""
    with pending_file(path, chunks, force=force) as facts:
        return facts


@contextmanager
def pending_file(path: Path, chunks: Iterable[bytes], *, force: bool = False) -> Iterator[dict[str, Any]]:
    """Size and SHA-256 of a file that gets its name at the end of the context, as `save_file` writes it.

    The bytes are written, under a temporary name, when the context begins. An error inside it leaves no file.
    """
    digest, size = hashlib.sha256(), 0

    def hash_all(share: list[bytes]) -> None:
        for chunk in share:
            digest.update(chunk)

    with replacing(path, force=force, sha256=digest.hexdigest) as stream:
        with _Pipeline(hash_all, stream.writelines) as beside:
            for share, length in gather_chunks(gzip_chunks(chunks) if is_packed(path) else chunks, SHARE):
                beside(share, wait=length < SHARE)
                size += length
        yield {"bytes": size, "sha256": digest.hexdigest()}


class _Pipeline:
    """Passes chunks to several tasks, each in order in its own thread, which lags by a few chunks.

    Errors of a task are raised by a later call or at the end.
    """

    def __init__(self, *tasks: Callable[[list[bytes]], None]) -> None:
        self._tasks = tasks
        self._pools = [ThreadPoolExecutor(1) for _ in tasks]
        self._waiting: deque[Future[None]] = deque()

    def __call__(self, chunks: list[bytes], *, wait: bool) -> None:
        """Pass chunks to the tasks. wait: process them here, so that a small file starts no thread."""
        if wait:
            self._wait_until(0)
            for task in self._tasks:
                task(chunks)
        else:
            self._wait_until(len(self._tasks) * _SHARES)
            self._waiting += [
                pool.submit(task, chunks) for pool, task in zip(self._pools, self._tasks, strict=True)
            ]

    def _wait_until(self, most: int) -> None:
        """Wait until at most that many are in progress."""
        while len(self._waiting) > most:
            self._waiting.popleft().result()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: object, *_: object) -> None:
        for pool in self._pools:
            pool.shutdown(cancel_futures=kind is not None)
        if kind is None:
            self._wait_until(0)


def gzip_chunks(chunks: Iterable[bytes]) -> Iterator[bytes]:
    """The bytes of a gzip file that holds the chunks, in order."""
    check = size = 0
    yield _HEAD
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        waiting: deque[Future[bytes]] = deque()
        for piece in join_chunks(chunks, PIECE):
            waiting.append(pool.submit(_deflate_piece, piece))
            check, size = zlib.crc32(piece, check), size + len(piece)
            if len(waiting) > _AHEAD:
                yield waiting.popleft().result()
        yield from (future.result() for future in waiting)
    yield _TAIL + struct.pack("<II", check, size & 0xFFFFFFFF)


def join_chunks(chunks: Iterable[bytes], least: int) -> Iterator[bytes]:
    """Join chunks to pieces of at least `least` bytes; the last may be shorter."""
    return (b"".join(parts) for parts, _ in gather_chunks(chunks, least))


def gather_chunks(chunks: Iterable[bytes], least: int) -> Iterator[tuple[list[bytes], int]]:
    """Collect chunks in lists of at least `least` bytes, each with its length; the last may be shorter."""
    parts: list[bytes] = []
    length = 0
    for chunk in chunks:
        parts.append(chunk)
        length += len(chunk)
        if length >= least:
            yield parts, length
            parts, length = [], 0
    if parts:
        yield parts, length


def _deflate_piece(piece: bytes) -> bytes:
    packer = zlib.compressobj(LEVEL, zlib.DEFLATED, -zlib.MAX_WBITS)
    return packer.compress(piece) + packer.flush(zlib.Z_FULL_FLUSH)
