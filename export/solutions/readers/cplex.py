"""Solution files of CPLEX, XML: one solution, or a pool, which begins with the incumbent.

    <CPLEXSolution version="1.2">          a pool has <CPLEXSolutions> around several of these
     <header objectiveValue="-14.4" writeLevel="1"
      solutionStatusValue="101" solutionStatusString="integer optimal solution"/>
     <linearConstraints> ...               rows are not needed here
     <variables>
      <variable name="x" index="0" value="10"/>

writeLevel 1 writes every column and 3 omits those at 0; 2 and 4 (and a .mst) hold only the integer columns.
Status codes are those of CPXgetstat: 1 to 25 for continuous problems, from 101 for integer ones. A file of an
infeasible problem also has values, which are not a point. Without any solution CPLEX writes no file (error
1217). Only elements are accepted: no DTD and no entities. Layouts: CPLEX 22.2.0.
"""

from __future__ import annotations

import sys
from array import array
from dataclasses import dataclass, field
from typing import Any, Final
from xml.etree.ElementTree import ParseError

from defusedxml import DefusedXmlException
from defusedxml.ElementTree import DefusedXMLParser

from ....models.errors import SolutionError
from ...statuses import Status, claim_of
from .grammar import float_of, is_number
from .text import (
    RawSolution,
    Reader,
    named_values,
    one_line,
    solution_pool,
    solution_without_point,
    starts_with,
)

_OMITS_ZEROS: Final = "3"
_INTEGERS_ONLY: Final = {"2", "4"}
_CHUNK: Final = 1 << 20
_POINTLESS: Final = {Status.INFEASIBLE, Status.UNBOUNDED}


def parse(data: bytes) -> RawSolution:
    """Read a file, with all solutions of a pool.

    Raises SolutionError, with the line, for XML that is damaged or has entities, and for values that are not
    numbers.
    """
    return solution_pool([_solution(entry) for entry in _parse_xml(data)])


def _solution(entry: _SolutionEntry) -> RawSolution:
    if entry.header is None:
        raise SolutionError("the file has no header with a status; let CPLEX write it again")
    status = _status(entry.header)
    words = entry.header.get("solutionStatusString", "")
    if name := entry.header.get("solutionName"):
        words += f"; {name}"
    if status in _POINTLESS:
        return solution_without_point(status, words)
    return _with_point(entry, status, words)


def _with_point(entry: _SolutionEntry, status: Status, words: str) -> RawSolution:
    header = entry.header or {}
    level = header.get("writeLevel", "1")
    if level in _INTEGERS_ONLY:
        raise SolutionError(
            f"the file was written with writeLevel {level} and holds the integer columns only; "
            "use level 1 (AllVars)"
        )
    names, values = named_values(entry.names, entry.values)
    omits = level == _OMITS_ZEROS
    if not (omits or len(values)):
        if not status.needs_point:
            return solution_without_point(status, words)
        raise SolutionError("the file holds no variables; let CPLEX write it again")
    stated = header.get("objectiveValue", "").encode(errors="replace")
    objective = float_of(stated) if is_number(stated) else None
    return RawSolution(status, one_line(words.encode()), objective, names, values, omits_zeros=omits)


def _status(header: dict[str, str]) -> Status:
    status, _ = claim_of(header.get("solutionStatusValue", ""), "cplex")
    stopped = status is Status.LIMIT_WITH_POINT
    return status.without_point if stopped and header.get("primalFeasible") != "1" else status


@dataclass
class _SolutionEntry:
    """One solution of a file."""

    header: dict[str, str] | None = None
    names: list[str] = field(default_factory=list)
    values: array[float] = field(default_factory=lambda: array("d"))


class _XmlTarget:
    """Receives elements as they are parsed and keeps headers and variables, so that no tree is built."""

    def __init__(self) -> None:
        self.solutions: list[_SolutionEntry] = []

    def start(self, tag: str, attributes: dict[str, str]) -> None:
        """Process the start of an element."""
        if tag == "CPLEXSolution":
            self.solutions.append(_SolutionEntry())
        elif tag == "variable" and self.solutions:
            self._variable(attributes.get("name"), attributes.get("value", ""))
        elif tag == "header" and self.solutions:
            self.solutions[-1].header = attributes

    def _variable(self, name: str | None, text: str) -> None:
        word = text.encode(errors="replace")
        if name is None or not is_number(word):
            raise SolutionError("a variable has no name, or a value that is not a number")
        self.solutions[-1].names.append(sys.intern(name))
        self.solutions[-1].values.append(float_of(word))

    def close(self) -> list[_SolutionEntry]:
        """Return all solutions, at the end of the document."""
        return self.solutions


def _parse_xml(data: bytes) -> list[_SolutionEntry]:
    parser: Any = DefusedXMLParser(target=_XmlTarget(), forbid_dtd=True)
    try:
        for start in range(0, len(data), _CHUNK):
            parser.feed(data[start : start + _CHUNK])
        solutions: list[_SolutionEntry] = parser.close()
    except ParseError as error:
        raise SolutionError(
            f"line {error.position[0]}: the XML is damaged or cut off; let CPLEX write the file again"
        ) from error
    except DefusedXmlException as error:
        raise SolutionError(
            "the XML has a DTD or entities, which CPLEX does not write; the file is refused"
        ) from error
    except (ValueError, LookupError) as error:  # an encoding that is unknown or does not fit
        raise SolutionError("the XML is not in its encoding; let CPLEX write the file again") from error
    except SolutionError as error:
        line = parser.parser.CurrentLineNumber
        raise SolutionError(f"line {line}: {error}; let CPLEX write the file again") from error
    return solutions or [_SolutionEntry()]


READER: Final = Reader("cplex", "CPLEX .sol (XML)", starts_with(rb"(?s)\s*(?=<[?!C]).*<CPLEXSolution"), parse)
