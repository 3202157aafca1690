"""Access of the mathematics to the parts above it.

`Problem.to_highs`, the other conversions and `Problem.solution` need solver packages and the checks of
answers; notebooks show instances and fields as pictures. No module here imports those parts: the top module
of crossfield, which is above all of them, sets these functions.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

packages: Callable[[], Any]
"""Returns the module with `convert` and `check_values`: export/packages/registry.py."""
pictures: Callable[[], Any]
"""Returns the module with `preview`: export/pictures/draw.py."""
