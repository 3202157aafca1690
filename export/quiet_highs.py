"""Models of HiGHS without its banner, which version 1.16 prints when a process makes its first model."""

from __future__ import annotations

import os
from functools import cache
from pathlib import Path
from typing import Any

import highspy

from ..models.processes.child_program import output_to


def new_model() -> Any:
    """A new `highspy.Highs`."""
    _swallow_banner()
    return highspy.Highs()  # type: ignore[no-untyped-call]


@cache
def _swallow_banner() -> None:
    """Make the first model of this process while its output goes nowhere; no option prevents the banner."""
    with output_to(Path(os.devnull)):
        highspy.Highs()  # type: ignore[no-untyped-call]
