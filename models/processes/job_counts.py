"""Numbers of threads and processes that work at the same time."""

from __future__ import annotations

import os
from typing import Final

from ..errors import InputError

MOST_JOBS: Final = max(16, 2 * (os.cpu_count() or 1))
"""Most threads or processes: beyond twice the cores there is no gain, and each takes memory."""


def check_jobs(count: int, name: str = "jobs", *, least: int = 1) -> int:
    """The number of threads or processes. Raises InputError if it is out of range."""
    if not least <= count <= MOST_JOBS or count % 1:
        raise InputError(f"{name} must be between {least} and {MOST_JOBS}, got {count}")
    return count


def cores() -> int:
    """The number of processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
