"""The ledger: results of solvers, measured once and kept as an input of every build.

ledger.json holds records; `ENTRY.field.json` in the same folder holds the field of a record that improved a
point. A record carries the SHA-256 of its problem, and counts for that problem alone.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any, Final, Literal

from ....models.documents import read_document, schema_error
from ....models.errors import InputError, naming
from ....models.field.field import CrossField, Norm
from ....models.field.file import field_of_json, field_to_json
from ....models.processes.process_groups import catch_interrupts
from ....models.storage import read_bytes, write_bytes
from .. import documents
from ..plan.spec import describe_schema_error

FORMAT: Final = "crossfield-ledger"
VERSION: Final = 1
LEDGER: Final = "ledger.json"
RunStatus = Literal["optimal", "feasible", "limit", "no point"]


@dataclass(frozen=True)
class Record:
    """One run of a solver on an entry, or one submitted point.

    primal: recomputed objective of its point; bound: dual bound; by: who ran it; point: name of a
    file; date: as YYYY-MM-DD.
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
    machine: str | None = None
    date: str | None = None

    @property
    def rank(self) -> tuple[Any, ...]:
        """Sort key in the ledger: entry and solver first."""
        return (self.entry, self.solver, self.version, json.dumps(asdict(self)))

    def check(self) -> None:
        """Raise InputError that names the invalid value unless a ledger can hold the record."""
        for name in ("primal", "bound", "seconds", "time_limit"):
            value = getattr(self, name)
            if value is not None and not math.isfinite(value):
                raise InputError(f"{name} is {value}; give a finite number")
        error = schema_error(Ledger((self,)).document(), "library-ledger", documents.__name__)
        if error is not None:
            raise InputError(describe_schema_error(error).removeprefix("records[0]."))


@dataclass(frozen=True)
class SubmittedCertificate:
    """A submitted certificate. instance: its name."""

    instance: str
    norm: Norm
    instance_sha256: str
    file: str

    @property
    def key(self) -> tuple[str, str]:
        """The name of the instance and the norm, of which a ledger has one certificate."""
        return self.instance, str(self.norm)


@dataclass(frozen=True)
class Ledger:
    """Records and certificates in order, and the contents of their files by name."""

    records: tuple[Record, ...] = ()
    certificates: tuple[SubmittedCertificate, ...] = ()
    files: Mapping[str, bytes] = field(default_factory=dict)

    def record_with_field(self, entry: str) -> Record | None:
        """Return the record whose field is kept for an entry: the last one with a field."""
        return next(
            (record for record in reversed(self.records) if record.entry == entry and record.point), None
        )

    def read_field(self, record: Record) -> CrossField:
        """Return the field of a record. Raises InstanceError for a damaged file."""
        name = str(record.point)
        with naming(name):
            return field_of_json(self.files[name])

    def with_record(self, record: Record, field: CrossField | None = None) -> tuple[Ledger, Record]:
        """Return the ledger with one more record, and that record with its file.

        field: replaces the kept field of the entry if it is better. Raises InputError for a record that a
        ledger cannot hold.
        """
        record.check()
        records, files = list(self.records), dict(self.files)
        if field is not None and _is_better(record, self.record_with_field(record.entry)):
            name = f"{record.entry}.field.json"
            files[name] = field_to_json(field)
            record = replace(record, point=name)
            records = [_without_point(row) if row.entry == record.entry else row for row in records]
        records = sorted({*records, record}, key=lambda row: row.rank)
        return replace(self, records=tuple(records), files=files), record

    def with_certificate(self, instance: str, norm: Norm, instance_sha256: str, data: bytes) -> Ledger:
        """Return the ledger with a certificate that replaces the earlier one of the instance in the norm."""
        name = f"{instance}.{hashlib.sha256(data).hexdigest()[:12]}.certificate.npz"
        new = SubmittedCertificate(instance, norm, instance_sha256, name)
        others = [certificate for certificate in self.certificates if certificate.key != new.key]
        certificates = tuple(sorted([*others, new], key=lambda certificate: certificate.key))
        return replace(self, certificates=certificates, files={**self.files, name: data})

    def document(self) -> dict[str, Any]:
        """Return the ledger as JSON."""
        records, certificates = (
            [{key: value for key, value in vars(row).items() if value is not None} for row in rows]
            for rows in (self.records, self.certificates)
        )
        document = {"format": FORMAT, "version": VERSION, "records": records}
        return document | ({"certificates": certificates} if certificates else {})


def read_ledger(folder: str | Path, name: str = LEDGER, *, omit_missing: bool = False) -> Ledger:
    """Read the ledger of a folder; an empty one without a file. Raises InputError, InstanceError.

    omit_missing: whether records lose a field whose file is missing, and such certificates are left out.
    """
    path = Path(folder) / name
    if not path.exists():
        return Ledger()
    schema, remedy = documents.__name__, "give the ledger.json of a library"
    document = read_document(path, FORMAT, VERSION, "library-ledger", schema, remedy=remedy)
    records = tuple(Record(**row) for row in document["records"])
    certificates = tuple(SubmittedCertificate(**row) for row in document.get("certificates", ()))
    if omit_missing:
        records = tuple(
            _without_point(record) if record.point and not path.with_name(record.point).exists() else record
            for record in records
        )
        certificates = tuple(row for row in certificates if path.with_name(row.file).exists())
    names = [record.point for record in records if record.point] + [row.file for row in certificates]
    return Ledger(records, certificates, {name: read_bytes(path.with_name(name)) for name in names})


def write_ledger(folder: Path, ledger: Ledger) -> None:
    """Write a ledger into a folder and, before it, the files that are not there yet. Raises OutputError.

    Ctrl-C is raised at the end, because a ledger does not fit a part of its files.
    """
    data = (json.dumps(ledger.document(), indent=1, allow_nan=False) + "\n").encode()
    with catch_interrupts() as pressed:
        for name, content in {**ledger.files, LEDGER: data}.items():
            if not (folder / name).exists() or read_bytes(folder / name) != content:
                write_bytes(folder / name, content)
    if pressed():
        raise KeyboardInterrupt


def add_record(folder: str | Path, record: Record, field: CrossField | None = None) -> Record:
    """Add a record to the ledger of a folder, whose lock the caller holds, and write the ledger."""
    ledger, record = read_ledger(folder).with_record(record, field)
    write_ledger(Path(folder), ledger)
    return record


def _is_better(record: Record, earlier: Record | None) -> bool:
    """Whether a record's field is better than the kept one."""
    if earlier is None or earlier.problem_sha256 != record.problem_sha256 or earlier.primal is None:
        return True
    return record.primal is None or record.primal < earlier.primal


def _without_point(record: Record) -> Record:
    return replace(record, point=None)


def merge_ledgers(ledger: Ledger, source: Ledger, entries: Iterable[str], instances: Iterable[str]) -> Ledger:
    """Return a ledger with another's records on these entries and certificates of these instances.

    A field or certificate that the ledger has already stays. Raises InstanceError for a damaged field.
    """
    wanted, known = set(entries), {_without_point(record) for record in ledger.records}
    fresh = [
        _without_point(record) if ledger.record_with_field(record.entry) else record
        for record in source.records
        if record.entry in wanted and _without_point(record) not in known
    ]
    for record in fresh:
        if record.point is not None:
            source.read_field(record)  # checked before it is taken over
    wanted, known_keys = set(instances), {certificate.key for certificate in ledger.certificates}
    certificates = [
        certificate
        for certificate in source.certificates
        if certificate.instance in wanted and certificate.key not in known_keys
    ]
    names = [record.point for record in fresh if record.point] + [row.file for row in certificates]
    return Ledger(
        tuple(sorted({*ledger.records, *fresh}, key=lambda row: row.rank)),
        tuple(sorted([*ledger.certificates, *certificates], key=lambda row: row.key)),
        {**ledger.files, **{name: source.files[name] for name in names}},
    )
