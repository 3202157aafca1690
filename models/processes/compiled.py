"""Functions that Numba compiles on their first call and caches on disk.

Pip installs Numba without a compiler.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, Final, TypeVar, cast

import numba

_Work = TypeVar("_Work", bound=Callable[..., Any])
_MADE: Final[list[Any]] = []


def compiled(work: _Work) -> _Work:
    """The function compiled on its first call, and cached on disk where a folder is writable.

    It runs without Python's lock.
    """
    made: Any
    try:
        made = numba.njit(cache=True, error_model="numpy", nogil=True)(work)
    except RuntimeError:  # no folder is writable
        made = numba.njit(error_model="numpy", nogil=True)(work)
    _MADE.append(made)
    return cast("_Work", made)


def all_compiled() -> bool:
    """Whether every imported function is cached on disk where possible, so that it only has to be loaded."""
    return all(map(_is_kept, _MADE))


def place() -> Path:
    """The folder with the cache of the first function. Raises IndexError without a function."""
    return Path(_MADE[0].stats.cache_path)


def _is_kept(made: Any) -> bool:
    """Whether there is an index of compiled code for the function (`*.nbi`, named after its first line)."""
    code, folder = made.py_func.__code__, made.stats.cache_path
    named = f"*.{code.co_name}-{code.co_firstlineno}.*.nbi"
    return folder is None or any(Path(folder).glob(named))
