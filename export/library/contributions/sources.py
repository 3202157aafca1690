"""Files given to `library submit`, by kind, each solution with the log of its run."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

from ....models.errors import CrossfieldError, InputError
from ...solutions.readers.registry import read_raw
from .matching import Kind, kinds_of
from .run_record import LogFile, RunFacts


@dataclass(frozen=True)
class Source:
    """A submitted file, or the solution and the log of one run. listed: not only found in a folder."""

    kind: Kind | Literal["bound", ""]
    path: Path | None = None
    log: Path | None = None
    listed: bool = True
    error: CrossfieldError | None = None

    @property
    def files(self) -> tuple[Path, ...]:
        """The solution and the log, or the one file."""
        return tuple(dict.fromkeys(each for each in (self.path, self.log) if each is not None))

    @property
    def name(self) -> str:
        """Names of the files, for messages."""
        return " and ".join(each.name for each in self.files) or "the bound"


def sources_of(files: Sequence[str | Path], facts: RunFacts) -> list[Source]:
    """Return files by kind, solutions with their logs. Raises InputError for facts that do not fit them."""
    found = [_source(path, listed) for path, listed in _expanded(files)]
    logs = {each.path.with_suffix(""): each for each in found if each.kind == "log" and each.path}
    paired = []
    for each in found:
        log = logs.get(each.path.with_suffix("")) if each.kind == "solution" and each.path else None
        paired.append(replace(each, log=log.path) if log and each.log is None else each)
    used = {each.log for each in paired}
    left = [
        replace(each, path=None, log=each.path) if each.kind == "log" else each
        for each in paired
        if each.kind != "log" or each.path not in used
    ]
    if not files and facts.bound is not None:
        return [Source("bound")]
    if not left:
        raise InputError("there is nothing to submit; give files, or an entry and a bound")
    is_run = len(left) == 1 and left[0].kind not in ("field", "certificate", "ledger")
    if not is_run and (facts.bound, facts.status) != (None, None):
        raise InputError("a bound or status belongs to one run; submit the files of that run alone")
    return left


def _expanded(files: Iterable[str | Path]) -> Iterator[tuple[Path, bool]]:
    """The files with those in folders, and whether each was listed by itself."""
    for path in map(Path, files):
        if path.is_dir():
            inside = (each for each in sorted(path.rglob("*")) if not each.name.startswith("."))
            yield from ((each, False) for each in inside if each.is_file())
        else:
            yield path, True


def _source(path: Path, listed: bool) -> Source:
    try:
        kinds = kinds_of(path)
    except CrossfieldError as error:
        return Source("", path, error=error)
    if kinds != {"solution", "log"}:
        return Source(next(iter(kinds), ""), path, listed=listed)
    has_log = has_point = False
    with suppress(CrossfieldError):
        has_log = bool(LogFile.read(path))
    with suppress(CrossfieldError):
        has_point = read_raw(path).has_point
    if has_log and not has_point:
        return Source("log", path)
    return Source("solution", path, path if has_log else None)
