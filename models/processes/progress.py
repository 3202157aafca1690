"""What is told of work under way."""

from __future__ import annotations

from collections.abc import Callable

Progress = Callable[[str], None]
"""Is told in a line what is done now."""


def silent(_line: str) -> None:
    """Nothing is shown: for work that nobody watches."""
