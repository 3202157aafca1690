"""Memory that is free for this process, where the system reports it."""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import Final

from .errors import InputError

BYTES_PER_POINT: Final = 5000
"""Memory that a pixel of a grid or a face of a mesh needs while its problem is written."""


def check_memory(points: int, kind: str = "pixel") -> None:
    """Raise InputError if so many points of a kind, pixels or faces, need more memory than is available.

    Do nothing where that is unknown.
    """
    what, remedy = {"pixel": ("a grid", "smaller size"), "face": ("a mesh", "coarser mesh")}[kind]
    needed, available = points * BYTES_PER_POINT, available_memory()
    if available is not None and needed > available:
        raise InputError(
            f"{what} of {points} {kind}s needs about {needed / 1e9:.1f} GB to be written, "
            f"but {available / 1e9:.1f} GB are free; choose a {remedy}"
        )


def available_memory() -> int | None:
    """Bytes of memory that Linux has available without swapping; elsewhere all memory, or None if unknown."""
    try:
        text = Path("/proc/meminfo").read_text("ascii")
        return 1024 * int(re.findall(r"^MemAvailable:\s*(\d+) kB", text, re.MULTILINE)[0])
    except (OSError, ValueError, IndexError):
        pass
    try:
        return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    except (AttributeError, OSError, ValueError):
        return None
