"""Checking a run of the ledger against its log, which is read again."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from ....models.errors import CrossfieldError
from ...solutions.logs.registry import parse_log
from ...solvers_table import SOLVERS
from ..ledger.ledger import FILE as LEDGER
from ..ledger.ledger import Ledger, Record
from ..ledger.standing import MAKERS
from .finding import Finding, of_error

_SUBMIT: Final = "restore it, or submit the run again"


def run_findings(ledger: Ledger, record: Record) -> Iterator[Finding]:
    """What is wrong with the record of a run: its log is missing or damaged, or says something else."""
    if record.log is None:
        if record.evidence == "log":
            yield Finding(LEDGER, f"says that a log shows a bound of {record.entry}, and names none", _SUBMIT)
        return
    if record.evidence is None and record.bound is not None:
        yield Finding(LEDGER, f"does not say whether {record.log} shows the bound of its run", _SUBMIT)
    try:
        told = parse_log(ledger.log(record))
    except CrossfieldError as error:
        yield of_error(error, record.log)
        return
    if MAKERS.get(record.solver) != SOLVERS[told.solver].maker:
        yield Finding(LEDGER, f"says that {record.log} is of {record.solver}, and it is not", _SUBMIT)
    if record.evidence == "log" and record.bound != told.bound:
        yield Finding(LEDGER, f"tells another bound than {record.log} does", _SUBMIT)
    if record.trace != told.trace:
        yield Finding(LEDGER, f"tells another course of the run than {record.log} does", _SUBMIT)
    if record.status == "optimal" and told.ended == "limit":
        yield Finding(LEDGER, f"says that the run of {record.log} proved an optimum, and it did not", _SUBMIT)
