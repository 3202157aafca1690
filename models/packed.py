"""Content of files that may be packed with gzip, bzip2 or xz, no larger than honest files are."""

from __future__ import annotations

import bz2
import gzip
import io
import lzma
import zlib
from collections.abc import Callable
from itertools import islice
from typing import Any, Final

from .errors import InputError
from .memory import available_memory

MOST_PER_BYTE: Final = 200
"""Largest content of a packed byte. A list of a million columns at 0 reaches 81 with xz, its JSON 65."""

_SMALL: Final = 1 << 20
"""Content that any file may have, however well it is packed."""

_COPIES: Final = 10  # of a text, in memory while it is read
_PIECE: Final = 1 << 16
_OPENED: Final[dict[bytes, Callable[[io.BytesIO], Any]]] = {
    b"\x1f\x8b": lambda stream: gzip.GzipFile(fileobj=stream),
    b"BZh": bz2.BZ2File,
    b"\xfd7zXZ\0": lzma.LZMAFile,
}
"""How files that begin so are unpacked."""


def unpack(data: bytes, most: int, remedy: str = "pack less into it") -> bytes:
    """The content of a packed file, or the data themselves.

    Raises InputError for a file that is damaged, or whose content exceeds `most` bytes, the usual content of
    so many packed bytes, or the memory to read it; `remedy` completes the message.
    """
    limit, free = min(most, _SMALL + MOST_PER_BYTE * len(data)), available_memory()
    content = unpack_start(data, limit + 1)
    if len(content) > limit:
        raise InputError(f"unpacks to more than {limit} bytes, which is suspicious or too much; {remedy}")
    if free is not None and _COPIES * len(content) > free:
        raise InputError(f"has {len(content)} bytes of text, too many for {free / 1e9:.1f} GB; {remedy}")
    return content


def unpack_start(data: bytes, most: int) -> bytes:
    """At most `most` bytes of a packed file, or of the data themselves. Raises InputError."""
    opened = next((opened for start, opened in _OPENED.items() if data.startswith(start)), None)
    if opened is None:
        return data[:most]
    try:
        stream = opened(io.BytesIO(data))
        # Piece by piece: to read a length makes room for all of it.
        pieces = islice(iter(lambda: stream.read(_PIECE), b""), -(-most // _PIECE))
        return b"".join(pieces)[:most]
    except (OSError, EOFError, zlib.error, lzma.LZMAError) as error:
        raise InputError("the packed file is damaged or cut off; pack it again") from error
