"""Many cases of one thought in one test."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import pytest

Test = Callable[..., None]


def for_each(names: str, cases: Iterable[Any]) -> Callable[[Test], Test]:
    """A decorator like `pytest.mark.parametrize`, of which all cases are subtests of one test.

    A case that fails is named and the others still run, but there is one test to collect, to send to a
    process and to report. Two of them above one test are all pairs of cases. Each case has a `tmp_path` of
    its own.
    """
    keys = [name.strip() for name in names.split(",")]
    rows = [dict(zip(keys, row if len(keys) > 1 else (row,), strict=True)) for row in cases]

    def decorate(test: Test) -> Test:
        plain, inner = getattr(test, "looped", (test, [{}]))
        return _looped(plain, [row | case for row in rows for case in inner])

    return decorate


def _looped(test: Test, cases: list[dict[str, Any]]) -> Test:
    parameters = inspect.signature(test).parameters

    @functools.wraps(test)
    def run(subtests: pytest.Subtests, **fixtures: Any) -> None:
        for number, case in enumerate(cases):
            label = " ".join(f"{name}={str(value)[:60]}" for name, value in case.items())
            with subtests.test(f"case {number}: {label}"):
                own = {"tmp_path": _folder(fixtures["tmp_path"], number)} if "tmp_path" in parameters else {}
                test(**fixtures | own | case)

    fixtures = [parameter for name, parameter in parameters.items() if name not in cases[0]]
    subtests = inspect.Parameter("subtests", inspect.Parameter.POSITIONAL_OR_KEYWORD)
    run.looped = test, cases
    run.__signature__ = inspect.Signature([subtests, *fixtures])
    return run


def _folder(parent: Path, number: int) -> Path:
    path = parent / str(number)
    path.mkdir()
    return path
