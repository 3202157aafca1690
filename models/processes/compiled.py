"""What Numba compiles on its first call, and keeps on disk. Pip installs it without a compiler."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, Final, TypeVar, cast

import numba

_Work = TypeVar("_Work", bound=Callable[..., Any])
_MADE: Final[list[Any]] = []


def compiled(work: _Work) -> _Work:
    """The function compiled on its first call, and kept on disk where there is a place for it.

    It runs without Python's lock.
    """
    made: Any
    try:
        made = numba.njit(cache=True, error_model="numpy", nogil=True)(work)
    except RuntimeError:  # no folder may be written to
        made = numba.njit(error_model="numpy", nogil=True)(work)
    _MADE.append(made)
    return cast("_Work", made)


def all_compiled() -> bool:
    """Whether each function that is imported by now is kept on disk, if it can be: then it is only loaded."""
    return all(map(_is_kept, _MADE))


def place() -> Path:
    """The folder in which the first of these functions is kept. Raises IndexError where there is none."""
    return Path(_MADE[0].stats.cache_path)


def _is_kept(made: Any) -> bool:
    """Whether there is an index of compiled code for the function (`*.nbi`, named after its first line)."""
    code, folder = made.py_func.__code__, made.stats.cache_path
    named = f"*.{code.co_name}-{code.co_firstlineno}.*.nbi"
    return folder is None or any(Path(folder).glob(named))
