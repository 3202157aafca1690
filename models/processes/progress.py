"""Progress callbacks of running work."""

from __future__ import annotations

from collections.abc import Callable

Progress = Callable[[str], None]
"""Receives one line that describes the current step."""


def silent(_line: str) -> None:
    """Show no progress: for work without an observer."""
