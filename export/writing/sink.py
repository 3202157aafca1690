"""Bytes on their way to a file: counted and hashed, or compressed.

A compressed file is one gzip member without name and time, so its bytes depend only on the content.
"""

from __future__ import annotations

import hashlib
import zlib
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

from ...models.storage import replacing

LEVEL: Final = 2
"""Level of zlib: twice as fast as its default, and files of repeated records are not larger."""
_GZIP: Final = zlib.MAX_WBITS + 16


def is_packed(path: Path) -> bool:
    """Whether a path names a compressed file: its suffix is `.gz`, in upper or lower case."""
    return path.suffix.lower() == ".gz"


def save_file(path: Path, chunks: Iterable[bytes]) -> dict[str, Any]:
    """Write a file, compressed if `is_packed(path)`; return its size and SHA-256. Raises OutputError."""
    with pending_file(path, chunks) as facts:
        return facts


@contextmanager
def pending_file(path: Path, chunks: Iterable[bytes], *, force: bool = False) -> Iterator[dict[str, Any]]:
    """Size and SHA-256 of a file that gets its name at the end of the context, as `save_file` writes it.

    The bytes are written, under a temporary name, when the context begins. An error inside it leaves no file.
    """
    digest, size = hashlib.sha256(), 0
    with replacing(path, force=force, sha256=digest.hexdigest) as stream:
        for chunk in _gzip_chunks(chunks) if is_packed(path) else chunks:
            digest.update(chunk)
            size += stream.write(chunk)
        yield {"bytes": size, "sha256": digest.hexdigest()}


def _gzip_chunks(chunks: Iterable[bytes]) -> Iterator[bytes]:
    """The bytes of a gzip file that holds the chunks."""
    packer = zlib.compressobj(LEVEL, zlib.DEFLATED, _GZIP)
    yield from map(packer.compress, chunks)
    yield packer.flush()
