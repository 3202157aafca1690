"""Memory that is free for this process, where the system reports it."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Final

from .errors import InputError

BYTES_PER_PIXEL: Final = 5000
"""Memory that a pixel of a grid needs while its problem is written."""


def check_memory(pixels: int) -> None:
    """Raise InputError if a grid needs more memory than is available; do nothing where that is unknown."""
    needed, available = pixels * BYTES_PER_PIXEL, available_memory()
    if available is not None and needed > available:
        raise InputError(
            f"a grid of {pixels} pixels needs about {needed / 1e9:.1f} GB to be written, "
            f"but {available / 1e9:.1f} GB are free; choose a smaller size"
        )


def available_memory(root: Path = Path("/")) -> int | None:
    """Bytes available without swapping, or None where the system does not report them, as on Windows.

    On Linux, the least of what the machine and each control group of the process have left: the group limits
    a container. Elsewhere, all memory of the machine. root: folder that holds `proc` and `sys`.
    """
    try:
        text = (root / "proc/meminfo").read_text("ascii")
        machine = 1024 * int(re.findall(r"^MemAvailable:\s*(\d+) kB", text, re.MULTILINE)[0])
    except (OSError, ValueError, IndexError):
        return _all_memory()
    return min([machine, *_free_in_groups(root)])


def _all_memory() -> int | None:
    try:
        return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    except (AttributeError, OSError, ValueError):
        return None


def _free_in_groups(root: Path) -> Iterator[int]:
    """Free bytes of each control group with a limit, versions 2 and 1, from the inside out."""
    try:
        lines = (root / "proc/self/cgroup").read_text("utf-8").splitlines()
    except (OSError, ValueError):
        return
    for line in lines:
        _, controllers, path = line.split(":", 2)
        if not controllers:
            names = ("memory.max", "memory.current", "inactive_file")
            yield from _free_in_group(root / "sys/fs/cgroup", path, *names)
        elif "memory" in controllers.split(","):
            names = ("memory.limit_in_bytes", "memory.usage_in_bytes", "total_inactive_file")
            yield from _free_in_group(root / "sys/fs/cgroup/memory", path, *names)


def _free_in_group(top: Path, path: str, limit: str, used: str, cache: str) -> Iterator[int]:
    """Free bytes of the group at a path below `top` and of its parents; cached files count as free."""
    inner = top / path.lstrip("/")
    for folder in (inner, *inner.parents):
        if folder.is_relative_to(top):
            try:
                most, now = (int((folder / name).read_text("ascii")) for name in (limit, used))
                cached = re.findall(
                    rf"^{cache} (\d+)$", (folder / "memory.stat").read_text("ascii"), re.MULTILINE
                )
            except (OSError, ValueError):  # "max" for no limit, or no such group in this container
                continue
            yield max(0, most - now + int(cached[0] if cached else 0))
