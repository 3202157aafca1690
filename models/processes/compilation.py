"""Functions that Numba compiles on their first call and caches on disk, and threads that share their work.

Caches are in the user's cache folder, or in NUMBA_CACHE_DIR where it is set. In the package they would
outlive it: pip leaves folders with unknown files, and such a folder hides an editable installation.

Parallel loops of Numba are the alternative. But their threads spin while they wait, which doubled the time on
a busy machine. The OpenMP threads do not survive a fork, and the built-in ones allow no second thread of
Python.
"""

from __future__ import annotations

import hashlib
import os
import re
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import Any, Final, TypeVar, cast

import numba
import numpy as np
from numba.misc.appdirs import AppDirs

from .job_counts import check_jobs

_Part = TypeVar("_Part")
_Work = TypeVar("_Work", bound=Callable[..., Any])
_NUMBA: Final[Any] = numba.config
_FOLDERS: Final = cast("Any", AppDirs)("crossfield", appauthor=False)
_DISPATCHERS: Final[list[Any]] = []
_CACHED: Final[set[Any]] = set()  # those that were cached on disk when somebody asked
_ANY_ORDER: Final = {"reassoc", "nnan", "nsz"}
_COMPILED: Final = re.compile(rb"^@(compiled|inlined)|NamedTuple", re.MULTILINE)
_PARTS: Final = 2  # of shared work for each thread: one that takes longer than expected then costs less


def compiled(work: _Work) -> _Work:
    """The function compiled on its first call, and cached on disk where a folder is writable."""
    return _make_dispatcher(work, fastmath=False)


def compiled_in_any_order(work: _Work) -> _Work:
    """As `compiled`, for a function without nan whose result does not depend on the order of its terms."""
    return _make_dispatcher(work, fastmath=_ANY_ORDER)


def compiled_inside(work: _Work) -> _Work:
    """As `compiled`, for calls by compiled functions alone, without code that unpacks its arguments."""
    return _make_dispatcher(work, fastmath=False, no_cpython_wrapper=True)


def inlined(work: _Work) -> _Work:
    """The function as a part of each compiled function that calls it, without code of its own.

    Numba optimises and translates all code below a function again with the function, so each level of calls
    costs as much as the first.
    """
    return cast("_Work", numba.njit(inline="always")(work))


def _make_dispatcher(work: _Work, *, fastmath: bool | set[str], no_cpython_wrapper: bool = False) -> _Work:
    options: Any = {"no_cfunc_wrapper": True, "no_cpython_wrapper": no_cpython_wrapper}
    dispatcher: Any = numba.njit(error_model="numpy", nogil=True, fastmath=fastmath, **options)(work)
    folder = _cache_root(Path(work.__code__.co_filename).parent)
    if folder is not None:
        chosen, _NUMBA.CACHE_DIR = _NUMBA.CACHE_DIR, str(folder)
        with suppress(RuntimeError):  # the disk is full
            dispatcher.enable_caching()
        _NUMBA.CACHE_DIR = chosen
    _DISPATCHERS.append(dispatcher)
    return cast("_Work", dispatcher)


@cache
def _cache_root(modules: Path) -> Path | None:
    """The folder for compiled code of the modules in a folder; None where the user can write to none.

    Its name depends on the version of Numba and on all modules with compiled functions or with the tuples
    that these take. Numba itself compares only the module of a function, not those of the functions it calls.
    """
    content = hashlib.sha256(numba.__version__.encode())
    for path in sorted(modules.glob("*.py")):
        source = path.read_bytes()
        if _COMPILED.search(source):
            content.update(source)
    user = _NUMBA.CACHE_DIR or _FOLDERS.user_cache_dir
    folder = Path(user) / f"crossfield-{content.hexdigest()[:16]}"
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        return None
    return folder if os.access(folder, os.W_OK) else None


def is_all_compiled(modules: Callable[[str], bool] = lambda _: True) -> bool:
    """Whether each function of `compiled` is cached on disk where possible: it then only has to be loaded.

    modules: returns whether the functions of a module, named in full, count.
    """
    chosen = [dispatcher for dispatcher in _DISPATCHERS if modules(dispatcher.py_func.__module__)]
    _CACHED.update(
        dispatcher for dispatcher in chosen if dispatcher not in _CACHED and _is_cached(dispatcher)
    )
    return _CACHED.issuperset(chosen)


def cache_folder() -> Path:
    """The folder with the cache of the first function. Raises IndexError without a function."""
    return Path(_DISPATCHERS[0].stats.cache_path)


def _is_cached(dispatcher: Any) -> bool:
    """Whether there is an index of compiled code for the function (`*.nbi`, named after its first line)."""
    code, folder = dispatcher.py_func.__code__, dispatcher.stats.cache_path
    named = f"*.{code.co_name}-{code.co_firstlineno}.*.nbi"
    return folder is None or any(Path(folder).glob(named))


class Crew:
    """A thread pool that includes the calling thread."""

    def __init__(self, count: int, others: ThreadPoolExecutor) -> None:
        self._count, self._others = count, others

    def parts(self, work: np.ndarray[Any, Any]) -> list[slice]:
        """Consecutive items, some parts for each thread, as equal in work as whole items allow."""
        done = np.concatenate([[0.0], np.cumsum(work, dtype=np.float64)])
        goals = np.linspace(0.0, done[-1], (_PARTS * self._count if self._count > 1 else 1) + 1)
        ends = np.abs(done[:, None] - goals).argmin(axis=0)
        ends[0], ends[-1] = 0, len(work)
        return [slice(a, b) for a, b in pairwise(ends) if a < b]

    def equal_parts(self, many: int) -> list[slice]:
        """Consecutive items, an equal number for each thread."""
        ends = [many * number // self._count for number in range(self._count + 1)]
        return [slice(a, b) for a, b in pairwise(ends)]

    def run(self, work: Callable[[_Part], object], parts: Sequence[_Part]) -> None:
        """Do the work on all parts; each thread takes the next part when it has done one."""
        waiting = iter(parts)

        def work_on() -> None:
            for part in waiting:
                work(part)

        others = [self._others.submit(work_on) for _ in range(min(self._count, len(parts)) - 1)]
        work_on()
        for helper in others:
            helper.result()


@contextmanager
def crew(count: int) -> Iterator[Crew]:
    """A thread pool that ends with the block. Raises InputError for a number of threads out of range."""
    with ThreadPoolExecutor(max(1, check_jobs(count) - 1)) as others:
        yield Crew(count, others)
