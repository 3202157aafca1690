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

from typing import Final
from xml.etree.ElementTree import Element, ParseError

from defusedxml import DefusedXmlException
from defusedxml.ElementTree import fromstring

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
_AGAIN: Final = "let CPLEX write the file again"
_POINTLESS: Final = {Status.INFEASIBLE, Status.UNBOUNDED}


def parse(data: bytes) -> RawSolution:
    """Read a file, with all solutions of a pool.

    Raises SolutionError for XML that is damaged or has entities, and for values that are not numbers.
    """
    try:
        root = fromstring(data, forbid_dtd=True)
    except ParseError as error:
        raise SolutionError(f"line {error.position[0]}: the XML is damaged or cut off; {_AGAIN}") from error
    except DefusedXmlException as error:
        raise SolutionError(
            "the XML has a DTD or entities, which CPLEX does not write; the file is refused"
        ) from error
    except (ValueError, LookupError) as error:  # an encoding that is unknown or does not fit
        raise SolutionError(f"the XML is not in its encoding; {_AGAIN}") from error
    return solution_pool([_solution(entry) for entry in root.iter("CPLEXSolution")] or [_solution(root)])


def _solution(entry: Element) -> RawSolution:
    head = entry.find("header")
    if head is None:
        raise SolutionError(f"the file has no header with a status; {_AGAIN}")
    header, status = head.attrib, _status(head.attrib)
    words = header.get("solutionStatusString", "")
    if name := header.get("solutionName"):
        words += f"; {name}"
    if status in _POINTLESS:
        return solution_without_point(status, words)
    level = header.get("writeLevel", "1")
    if level in _INTEGERS_ONLY:
        raise SolutionError(
            f"the file was written with writeLevel {level} and holds the integer columns only; "
            "use level 1 (AllVars)"
        )
    variables = entry.iterfind("variables/variable")
    columns = [(variable.get("name"), variable.get("value", "").encode()) for variable in variables]
    for number, (name, value) in enumerate(columns, 1):
        if name is None or not is_number(value):
            fault = f"variable {number} has no name, or a value that is not a number"
            raise SolutionError(f"{fault}; {_AGAIN}")
    names, values = named_values(
        [str(name) for name, _ in columns], [float_of(value) for _, value in columns]
    )
    omits = level == _OMITS_ZEROS
    if not (omits or len(values)):
        if not status.needs_point:
            return solution_without_point(status, words)
        raise SolutionError(f"the file holds no variables; {_AGAIN}")
    stated = header.get("objectiveValue", "").encode()
    objective = float_of(stated) if is_number(stated) else None
    return RawSolution(status, one_line(words.encode()), objective, names, values, omits_zeros=omits)


def _status(header: dict[str, str]) -> Status:
    status, _ = claim_of(header.get("solutionStatusValue", ""), "cplex")
    stopped = status is Status.LIMIT_WITH_POINT
    return status.without_point if stopped and header.get("primalFeasible") != "1" else status


READER: Final = Reader("cplex", "CPLEX .sol (XML)", starts_with(rb"(?s)\s*(?=<[?!C]).*<CPLEXSolution"), parse)
