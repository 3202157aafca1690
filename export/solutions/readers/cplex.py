"""Solution files of CPLEX, XML: one solution, or a pool whose first solution is the incumbent.

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

import re
from array import array
from typing import Any, Final
from xml.etree.ElementTree import ParseError

from defusedxml import DefusedXmlException
from defusedxml.ElementTree import DefusedXMLParser

from ....models.errors import SolutionError
from ..statuses import CPLEX, CPLEX_STOPPED, Status
from .text import RawSolution, Reader, begins, named_pairs, number_of, one_line, without_point

_OMITS_ZEROS: Final = "3"
_INTEGERS_ONLY: Final = {"2", "4"}
_CHUNK: Final = 1 << 20


def parse(data: bytes) -> RawSolution:
    """Read a file; of a pool, the first solution, which the message then states.

    Raises SolutionError, with the line, for XML that is damaged or has entities, and for values that are not
    numbers.
    """
    first = _parsed(data)
    if first.header is None:
        raise SolutionError("the file has no header with a status; let CPLEX write it again")
    status = _status(first.header)
    words = first.header.get("solutionStatusString", "")
    if first.solutions > 1:
        name = first.header.get("solutionName", "without a name")
        words += f"; {name}, the first of {first.solutions} solutions"
    if not status.promises_point:
        return without_point(status, words)
    return _with_point(first, status, words)


def _with_point(first: _FirstSolution, status: Status, words: str) -> RawSolution:
    header = first.header or {}
    level = header.get("writeLevel", "1")
    if level in _INTEGERS_ONLY:
        raise SolutionError(
            f"the file was written with writeLevel {level} and holds the integer columns only; "
            "use level 1 (AllVars)"
        )
    names, values = named_pairs(first.names, first.values)
    omits = level == _OMITS_ZEROS
    if not (omits or len(values)):
        raise SolutionError("the file holds no variables; let CPLEX write it again")
    objective = number_of(header.get("objectiveValue", "").encode(errors="replace"))
    return RawSolution(status, one_line(words.encode()), objective, names, values, omits_zeros=omits)


def _status(header: dict[str, str]) -> Status:
    text = header.get("solutionStatusValue", "")
    code = int(text) if re.fullmatch(r"[0-9]{1,6}", text) else -1
    if code in CPLEX_STOPPED:
        feasible = header.get("primalFeasible") == "1"
        return Status.LIMIT_WITH_POINT if feasible else Status.LIMIT_WITHOUT_POINT
    return CPLEX.get(code, Status.ERROR)


class _FirstSolution:
    """Receives elements as they are parsed and keeps the first solution, so that no tree is built."""

    def __init__(self) -> None:
        self.header: dict[str, str] | None = None
        self.names: list[str] = []
        self.values = array("d")
        self.solutions = 0

    def start(self, tag: str, attributes: dict[str, str]) -> None:
        """Process the start of an element."""
        if tag == "variable":
            if self.solutions == 1:
                self._variable(attributes.get("name"), attributes.get("value", ""))
        elif tag == "CPLEXSolution":
            self.solutions += 1
        elif tag == "header" and self.solutions == 1:
            self.header = attributes

    def _variable(self, name: str | None, text: str) -> None:
        value = number_of(text.encode(errors="replace"))
        if name is None or value is None:
            raise SolutionError("a variable has no name, or a value that is not a number")
        self.names.append(name)
        self.values.append(value)

    def close(self) -> _FirstSolution:
        """Return the first solution, at the end of the document."""
        return self


def _parsed(data: bytes) -> _FirstSolution:
    parser: Any = DefusedXMLParser(target=_FirstSolution(), forbid_dtd=True)
    try:
        for start in range(0, len(data), _CHUNK):
            parser.feed(data[start : start + _CHUNK])
        first: _FirstSolution = parser.close()
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
    return first


READERS: Final = (Reader("cplex", "CPLEX .sol (XML)", begins(rb"(?s)\s*(?=<[?!C]).*<CPLEXSolution"), parse),)
