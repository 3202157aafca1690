"""The ledger: results of solvers, measured once and kept. It is an input of every build.

ledger.json holds records; the field of a record that improved a point lies beside it as `ENTRY.field.json`. A
record carries the SHA-256 of the problem it is about, and counts for that problem alone.
"""

from __future__ import annotations

import hashlib
import json
import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, field, replace
from datetime import date
from pathlib import Path
from typing import Any, Final, Literal, get_args

from ....models.errors import InputError, InstanceError, naming, shortened
from ....models.field.field import CrossField
from ....models.field.file import field_of_json, field_to_json
from ....models.instance.file import read_document, schema_error
from ....models.storage import read_bytes, write_bytes
from .. import documents

FORMAT: Final = "crossfield-ledger"
VERSION: Final = 1
FILE: Final = "ledger.json"
RunStatus = Literal["optimal", "feasible", "limit", "no point"]
"""Result of a run; `feasible` for a submitted point."""
Evidence = Literal["log", "word"]
"""Evidence of a submitted bound: a log that the library keeps, or only the statement of its submitter."""
_LATER: Final = ("machine", "date", "evidence", "log", "log_sha256", "trace")  # left out where there is none
_LONGEST: Final = 200  # characters of a text
_VERSION: Final = re.compile(r"[A-Za-z0-9][A-Za-z0-9 .,_+()-]{0,59}")


@dataclass(frozen=True)
class Record:
    """One run of a solver on an entry, or one submitted point.

    problem_sha256: of the entry's problem; primal: objective of its point, recomputed; bound: its dual bound;
    seconds, threads and time_limit as measured; by: who ran it; point: the field's file beside the ledger,
    with its SHA-256, or None. machine: what it ran on; date: as YYYY-MM-DD; evidence: None for a run that
    `library solve` measured; log: the log's file beside the ledger, with its SHA-256; trace: seconds, dual
    bound and best objective in the course of the run.
    """

    entry: str
    problem_sha256: str
    solver: str
    version: str
    status: RunStatus
    primal: float | None = None
    bound: float | None = None
    seconds: float | None = None
    threads: int | None = None
    time_limit: float | None = None
    by: str | None = None
    point: str | None = None
    point_sha256: str | None = None
    machine: str | None = None
    date: str | None = None
    evidence: Evidence | None = None
    log: str | None = None
    log_sha256: str | None = None
    trace: tuple[tuple[float | None, ...], ...] = ()

    @property
    def rank(self) -> tuple[Any, ...]:
        """Place in the ledger: by entry and solver, then by everything else."""
        return (self.entry, self.solver, self.version, json.dumps(asdict(self)))

    def check(self) -> None:
        """Raise InputError, naming the value at fault, unless a ledger can hold the record."""
        for name in ("solver", "by", "machine"):
            check_text(name, getattr(self, name))
        if not _VERSION.fullmatch(self.version):
            raise InputError(
                f"version is {shortened(self.version)!r}; give at most 60 letters, digits, blanks and "
                ". , _ + - ( ), beginning with a letter or a digit"
            )
        if self.status not in get_args(RunStatus):
            raise InputError(
                f"status is {shortened(self.status)!r}; choose one of {', '.join(get_args(RunStatus))}"
            )
        if self.date is not None and not _is_date(self.date):
            raise InputError(f"date is {shortened(self.date)!r}; give a day as YYYY-MM-DD")
        self._check_numbers()
        error = schema_error(_as_json(self), "library-ledger", documents.__name__)
        if error is not None:
            place = error.json_path.removeprefix("$.records[0].")
            raise InputError(f"{place}: {shortened(error.message)}; a ledger cannot hold this record")

    def _check_numbers(self) -> None:
        for name in ("primal", "bound"):
            value = getattr(self, name)
            if value is not None and not math.isfinite(value):
                raise InputError(f"{name} is {value}; give a finite number")
        measured = {"seconds": self.seconds, "threads": self.threads, "time limit": self.time_limit}
        for name, value in measured.items():
            if value is not None and not 0 <= value < math.inf:
                raise InputError(f"{name} is {value}; give a finite number that is not negative")


@dataclass(frozen=True)
class SubmittedCertificate:
    """A certificate that was submitted.

    instance, instance_sha256: name and SHA-256 of the instance; file, sha256: name and SHA-256 of the file
    beside the ledger; by: who submitted it.
    """

    instance: str
    instance_sha256: str
    file: str
    sha256: str
    by: str | None = None


@dataclass(frozen=True)
class Ledger:
    """Records and certificates in order, and the folder that holds their files.

    unwritten: content of files that are not in the folder yet, by name.
    """

    folder: Path
    records: tuple[Record, ...] = ()
    certificates: tuple[SubmittedCertificate, ...] = ()
    unwritten: Mapping[str, bytes] = field(default_factory=dict)

    def of(self, entry: str, problem_sha256: str) -> list[Record]:
        """Return the records of an entry that are about this very problem."""
        return [each for each in self.records if (each.entry, each.problem_sha256) == (entry, problem_sha256)]

    def with_point(self, entry: str) -> Record | None:
        """Return the record whose field is kept for an entry: the last one that has a field."""
        found = [each for each in self.records if each.entry == entry and each.point is not None]
        return found[-1] if found else None

    def certificate(self, instance: str) -> SubmittedCertificate | None:
        """Return the certificate of the instance of a name."""
        return next((each for each in self.certificates if each.instance == instance), None)

    @property
    def files(self) -> list[str]:
        """Names of all files that records and certificates refer to."""
        names = [name for each in self.records for name in (each.point, each.log)]
        return [name for name in [*names, *(each.file for each in self.certificates)] if name is not None]

    def content(self, name: str, sha256: str | None) -> bytes:
        """Return the content of a file. Raises InputError if it is missing, InstanceError if it differs."""
        data = self.unwritten[name] if name in self.unwritten else read_bytes(self.folder / name)
        if hashlib.sha256(data).hexdigest() != sha256:
            raise InstanceError(
                "is another file than the one its ledger names; restore it, or submit it again",
                file=self.folder / name,
            )
        return data

    def field(self, record: Record) -> CrossField:
        """Return the field of a record. Raises InputError, InstanceError for a missing or another file."""
        data = self.content(str(record.point), record.point_sha256)
        with naming(self.folder / str(record.point)):
            return field_of_json(data)

    def log(self, record: Record) -> bytes:
        """Return the log of a record. Raises as `content`."""
        return self.content(str(record.log), record.log_sha256)

    def added(
        self, record: Record, field: CrossField | None = None, log: bytes | None = None
    ) -> tuple[Ledger, Record]:
        """Return the ledger with one more record, and that record as the ledger has it.

        field: replaces the kept field of the entry if it is better; the records that named the kept field
        lose it. log: content of the file that the record names. Raises InputError for a record that a ledger
        cannot hold.
        """
        record.check()
        records, unwritten = list(self.records), dict(self.unwritten)
        if log is not None:
            unwritten[str(record.log)] = log
        if field is not None and _is_better(record, self.with_point(record.entry)):
            name, data = f"{record.entry}.field.json", field_to_json(field)
            unwritten[name] = data
            record = replace(record, point=name, point_sha256=hashlib.sha256(data).hexdigest())
            records = [_without_point(each) if each.entry == record.entry else each for each in records]
        records = sorted({*records, record}, key=lambda each: each.rank)
        return replace(self, records=tuple(records), unwritten=unwritten), record

    def certified(self, instance: str, instance_sha256: str, data: bytes, by: str | None = None) -> Ledger:
        """Return the ledger with the bytes of a certificate in place of the instance's earlier one."""
        check_text("by", by)
        sha256 = hashlib.sha256(data).hexdigest()
        name = f"{instance}.{sha256[:12]}.certificate.npz"
        new = SubmittedCertificate(instance, instance_sha256, name, sha256, by)
        others = [each for each in self.certificates if each.instance != instance]
        certificates = tuple(sorted([*others, new], key=lambda each: each.instance))
        return replace(self, certificates=certificates, unwritten={**self.unwritten, name: data})

    def document(self) -> dict[str, Any]:
        """Return the ledger as JSON."""
        certificates = [_without_none(asdict(each)) for each in self.certificates]
        return {
            "format": FORMAT,
            "version": VERSION,
            "records": list(map(_document, self.records)),
            **({"certificates": certificates} if certificates else {}),
        }


def check_text(name: str, text: str | None) -> None:
    """Raise InputError, naming the value, unless a ledger can hold the text."""
    if text is not None and (not text.isprintable() or not 0 < len(text) <= _LONGEST):
        raise InputError(f"{name} must be one line of at most {_LONGEST} printable characters")


def _is_date(text: str) -> bool:
    try:
        return date.fromisoformat(text).isoformat() == text
    except ValueError:
        return False


def _as_json(record: Record) -> dict[str, Any]:
    """A ledger of one record as a reader of its file sees it: with lists in place of tuples."""
    document: dict[str, Any] = json.loads(json.dumps(Ledger(Path(), (record,)).document()))
    return document


def _without_none(document: dict[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in document.items() if value is not None}


def _document(record: Record) -> dict[str, Any]:
    return {key: value for key, value in asdict(record).items() if key not in _LATER or value}


def log_file(entry: str, solver: str, sha256: str) -> str:
    """Return the name of the file of a log. solver: its name in the table of solvers."""
    return f"{entry}.{solver}.{sha256[:12]}.log"


def read_ledger(folder: str | Path, name: str = FILE) -> Ledger:
    """Read the ledger of a folder; an empty one without a file. Raises InputError, InstanceError."""
    path = Path(folder) / name
    if not path.exists():
        return Ledger(Path(folder))
    schema, remedy = documents.__name__, "give the ledger.json of a library"
    given = read_document(path, FORMAT, VERSION, "library-ledger", schema, remedy=remedy)
    certificates = tuple(SubmittedCertificate(**each) for each in given.get("certificates", ()))
    return Ledger(Path(folder), tuple(map(_record, given["records"])), certificates)


def _record(given: dict[str, Any]) -> Record:
    return Record(**given | {"trace": tuple(map(tuple, given.get("trace", ())))})


def write_ledger(ledger: Ledger) -> None:
    """Write a ledger and, before it, the files that are not in its folder yet. Raises OutputError."""
    for name, data in ledger.unwritten.items():
        write_bytes(ledger.folder / name, data)
    path = ledger.folder / FILE
    data = (json.dumps(ledger.document(), indent=1, allow_nan=False) + "\n").encode()
    if not path.exists() or read_bytes(path) != data:
        write_bytes(path, data)


def add_record(
    folder: str | Path, record: Record, field: CrossField | None = None, log: bytes | None = None
) -> Record:
    """Add a record to the ledger of a folder as `Ledger.added` does, and write that ledger.

    The caller holds the lock of the library. Raises InputError, before anything is written, for a record
    that a ledger cannot hold; OutputError.
    """
    ledger, record = read_ledger(folder).added(record, field, log)
    write_ledger(ledger)
    return record


def _is_better(record: Record, kept: Record | None) -> bool:
    """Whether a record's field is better than the kept one, which may have come meanwhile."""
    if kept is None or kept.problem_sha256 != record.problem_sha256 or kept.primal is None:
        return True
    return record.primal is None or record.primal < kept.primal


def _without_point(record: Record) -> Record:
    return replace(record, point=None, point_sha256=None)


def merged(folder: Path, other: Ledger, entries: Iterable[str], instances: Iterable[str]) -> Ledger:
    """Return the ledger of a folder with another's records and certificates; nothing is written.

    entries, instances: names of those whose records and certificates are taken over. A field or certificate
    that the folder has already stays.
    """
    ledger, wanted = read_ledger(folder), set(entries)
    have = {_without_point(record) for record in ledger.records}
    fresh: list[Record] = []
    unwritten: dict[str, bytes] = {}
    for record in other.records:
        if record.entry not in wanted or _without_point(record) in have:
            continue
        if record.point is not None and ledger.with_point(record.entry) is None:
            other.field(record)  # checked before it is taken over
            unwritten[record.point] = other.content(record.point, record.point_sha256)
            fresh.append(record)
        else:
            fresh.append(_without_point(record))
        if record.log is not None:
            unwritten[record.log] = other.log(record)
    missing = set(instances) - {each.instance for each in ledger.certificates}
    certificates = [each for each in other.certificates if each.instance in missing]
    unwritten |= {each.file: other.content(each.file, each.sha256) for each in certificates}
    return replace(
        ledger,
        records=tuple(sorted({*ledger.records, *fresh}, key=lambda each: each.rank)),
        certificates=tuple(sorted([*ledger.certificates, *certificates], key=lambda each: each.instance)),
        unwritten=unwritten,
    )
