"""Memory that is free for this process, where the system reports it."""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Final

from .errors import InputError

_BYTES: Final = {"read": 150, "written": 1500}
"""Memory for each pixel or face while it is read from a sketch, or written in a formulation.

Measured were 100 bytes, and 1,400 for `qp-fixed` as LP.
"""


def check_memory(points: int, act: str, kind: str = "pixel") -> None:
    """Raise InputError if so many points of a kind, pixels or faces, need more memory than is available.

    act: `read` or `written`. Do nothing where it is unknown what is available.
    """
    what, remedy = {"pixel": ("a grid", "smaller size"), "face": ("a mesh", "coarser mesh")}[kind]
    needed, available = points * _BYTES[act], available_memory()
    if available is not None and needed > available:
        raise InputError(
            f"{what} of {points} {kind}s needs about {needed / 1e9:.1f} GB to be {act}, "
            f"but {available / 1e9:.1f} GB are free; choose a {remedy}"
        )


def available_memory() -> int | None:
    """Bytes that this process can still take without swapping, None if unknown.

    The least of what Linux has available, what the control groups of a container leave, and what the
    process itself may still map; on other systems all memory.
    """
    free = []
    with suppress(OSError, ValueError, IndexError):
        text = Path("/proc/meminfo").read_text("ascii")
        free.append(1024 * int(re.findall(r"^MemAvailable:\s*(\d+) kB", text, re.MULTILINE)[0]))
    if not free and sys.platform != "win32":
        with suppress(OSError, ValueError):
            free.append(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES"))
    with suppress(OSError):
        free += free_in_groups(Path("/proc/self/cgroup").read_text("utf-8"), Path("/sys/fs/cgroup"))
    if sys.platform == "linux":
        import resource

        most, _ = resource.getrlimit(resource.RLIMIT_AS)
        with suppress(OSError, ValueError):
            mapped = int(Path("/proc/self/statm").read_text("ascii").split()[0]) * resource.getpagesize()
            free += [most - mapped] if most != resource.RLIM_INFINITY else []
    return max(min(free), 0) if free else None


def free_in_groups(groups: str, root: Path) -> Iterator[int]:
    """Bytes that each control group with a limit of memory leaves; caches of files count as free.

    groups: content of /proc/self/cgroup. root: folder of all groups, of version 1 or 2. In a container the
    paths may be those of the host, so groups without files are left out.
    """
    for line in groups.splitlines():
        _, controllers, path = line.split(":", 2)
        if controllers and "memory" not in controllers.split(","):
            continue
        top = root / "memory" if controllers else root
        names = ("limit_in_bytes", "usage_in_bytes") if controllers else ("max", "current")
        cache = "total_inactive_file" if controllers else "inactive_file"
        parts = Path(path).parts[1:]
        for group in (top.joinpath(*parts[:depth]) for depth in range(len(parts) + 1)):
            with suppress(OSError, ValueError):  # `max` is no limit
                most, used = (int((group / f"memory.{name}").read_text("ascii")) for name in names)
                facts = (group / "memory.stat").read_text("ascii")
                cached = re.search(rf"^{cache} (\d+)", facts, re.MULTILINE)
                yield most - used + (int(cached[1]) if cached else 0)
