"""Taking a solver's solution into a library: checked, compared, and kept when it is better.

The ledger comes first and the rest of the library follows from it by a rebuild, which SHA256SUMS ends. So a
submission that was stopped can be told by the checksum of ledger.json, and the next submission or build
brings it to its end.
"""

from __future__ import annotations

import hashlib
import re
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

from ....models.errors import CrossfieldError, InputError, SolutionError
from ....models.field.field import CrossField
from ....models.formulations.problem import Problem, Violation
from ....models.processes.progress import Progress, silent
from ....models.storage import read_bytes
from ...formats.registry import FORMATS, generator
from ...solutions.readers.registry import read_raw
from ...solutions.readers.text import RawSolution
from ...solutions.solution import Solution, read_solution
from ..building.build import rebuilt
from ..building.index import SUMS
from ..checking.finding import FEASIBLE, SAME
from ..documents.documents import Library, problem_of, read_library
from ..documents.lock import locked
from ..ledger.dual_bounds import contradicts
from ..ledger.ledger import FILE as LEDGER
from ..ledger.ledger import Record, add_record
from ..ledger.points import complete_point, field_of

UNKNOWN: Final = "unknown"
_TOLD: Final = 4  # names in a message


@dataclass(frozen=True)
class Submission:
    """What happened to a point: its entry, both objectives, whether it was better and is kept."""

    entry: str
    known: float
    objective: float
    better: bool

    def __str__(self) -> str:
        """One line."""
        if self.better:
            return (
                f"{self.entry}: better, and now the best known point: {self.objective!r}, "
                f"before {self.known!r}"
            )
        return f"{self.entry}: not better: {self.objective!r}, and {self.known!r} is known"


def submit_point(
    file: str | Path,
    folder: str | Path,
    *,
    entry: str | None = None,
    solver: str | None = None,
    version: str | None = None,
    seconds: float | None = None,
    by: str | None = None,
    progress: Progress = silent,
) -> Submission:
    """What happened to the point in a solution file of any kind that is read.

    entry: name of the entry; by default the one with which the file's name begins, or the only one whose
    columns the file has. solver, version, seconds, by: who found it, as the ledger keeps it. Angles and jumps
    are taken as they are, integers rounded, and all else computed again. Raises InputError for a version,
    text or time that a ledger cannot hold. Raises SolutionError for a point of another entry, one that is not
    feasible to within 1e-8, and one that a dual bound of the library contradicts.
    """
    file = Path(file)
    library = writable_library(folder)
    with locked(library.folder, f"a submission of {file.name}", progress):
        library = settled(library, progress)
        progress("checking the point")
        sidecar, problem, field, objective = checked_point(file, library, entry)
        record = Record(
            entry=sidecar["name"],
            problem_sha256=problem.sha256,
            solver=solver or UNKNOWN,
            version=version or UNKNOWN,
            status="feasible",
            primal=objective,
            seconds=seconds,
            by=by,
        )
        record.check()
        known = sidecar["best"]["objective"]
        better = is_better(objective, known)
        if better:
            add_record(library.folder, record, field)
            rebuilt(library.folder, progress=progress)
        return Submission(sidecar["name"], known, objective, better)


def is_better(objective: float, known: float) -> bool:
    """Whether an objective is lower than the best known one by more than rounding."""
    return known - objective > SAME * max(abs(known), SAME)


def writable_library(folder: str | Path) -> Library:
    """The library in a folder. Raises InputError for an archive, and for a library of another version."""
    if Path(folder).is_file():
        raise InputError("is a file; unpack the archive and give its folder", file=folder)
    library = read_library(folder)
    if library.document["generator"] != generator():
        made = library.document["generator"]
        raise InputError(f"was built by {made}; submit with that version, or build it again", file=folder)
    return library


def settled(library: Library, progress: Progress) -> Library:
    """The library, after what an earlier submission that was stopped has left to do."""
    digest = hashlib.sha256(read_bytes(library.folder / LEDGER)).hexdigest()
    sums = read_bytes(library.folder / SUMS).decode("utf-8", "replace").splitlines()
    return library if f"{digest}  {LEDGER}" in sums else rebuilt(library.folder, progress=progress)


def checked_point(
    file: Path, library: Library, entry: str | None
) -> tuple[dict[str, Any], Problem, CrossField, float]:
    """The entry of a solution file, its problem, the field of its point, and the objective of that.

    Raises SolutionError for a point that is not feasible, or that a dual bound of the library contradicts.
    """
    sidecar, problem, solution = _found_in(file, library, entry)
    _check_feasible(file, sidecar["name"], problem, solution)
    assert solution.point is not None
    field = field_of(solution.problem, solution.point)
    objective = problem.objective_value(complete_point(problem, field))
    _check_bound(file, sidecar, objective)
    return sidecar, problem, field, objective


def _found_in(file: Path, library: Library, entry: str | None) -> tuple[dict[str, Any], Problem, Solution]:
    """The sidecar and the problem of the entry that a file is of, and the solution that it holds."""
    raw = read_raw(file)
    if not raw.has_point:
        raise SolutionError(f"holds no point ({raw.status}); there is nothing to submit", file=file)
    name = entry or by_name(file, library) or _by_columns(file, raw, library)
    sidecar = library.entry(name)
    problem = problem_of(library, sidecar)
    solution = read_solution(file, problem)
    if solution.unknown:
        raise SolutionError(
            f"{solution.unknown} of its names are not in {name}; it is a point of another entry, "
            "name that entry",
            file=file,
        )
    return sidecar, problem, solution


def by_name(file: Path, library: Library) -> str:
    """The entry with whose name a file's name begins, the longest one; empty when there is none."""
    known = (name for name in library.document["entries"] if re.match(rf"{name}([._-]|$)", file.name))
    return max(known, key=len, default="")


def _by_columns(file: Path, raw: RawSolution, library: Library) -> str:
    """The only entry that has the columns of a file."""
    fitting = [sidecar["name"] for sidecar in library.entries if _fits(raw, file, sidecar, library)]
    if len(fitting) == 1:
        return str(fitting[0])
    if not fitting:
        raise SolutionError("fits no entry of the library; name the entry if it should", file=file)
    told = ", ".join(fitting[:_TOLD]) + (", ..." if len(fitting) > _TOLD else "")
    raise SolutionError(f"fits {len(fitting)} entries of the library ({told}); name the entry", file=file)


def _fits(raw: RawSolution, file: Path, sidecar: dict[str, Any], library: Library) -> bool:
    """Whether a file may be of an entry: it has exactly the columns of one of its model files."""
    if raw.names is None:
        return False
    counts, pairs = sidecar["counts"], sidecar["instance"]["pairs"]
    most = counts["variables"] + pairs + _TOLD  # products that were lifted, and what solvers add
    least = 0 if raw.omits_zeros else counts["variables"]
    if not least <= len(raw.values) <= most:
        return False
    try:
        problem = problem_of(library, sidecar)
        found = read_solution(file, problem)
    except CrossfieldError:
        return False
    beyond = max(problem.objective_degree, problem.row_degree) > FORMATS["mps"].degree
    return found.unknown == 0 and (beyond or not found.problem.formulation.lifted)


def _check_feasible(file: Path, entry: str, problem: Problem, solution: Solution) -> None:
    """Nothing, when angles and jumps are feasible. Raises SolutionError with the worst violations.

    Every other column follows from them and is computed again, so that a solver's tolerance in those rows
    does not count.
    """
    found = _violation(problem, solution)
    if found.worst <= FEASIBLE:
        return
    worst = f" (family {found.worst_family})" if found.rows > FEASIBLE else ""
    raise SolutionError(
        f"is not a feasible point of {entry}: violations of rows {found.rows:.3g}{worst}, "
        f"bounds {found.bounds:.3g}, integrality "
        f"{found.integrality:.3g}, and {FEASIBLE:g} is allowed; let the solver use tighter tolerances",
        file=file,
    )


def _violation(problem: Problem, solution: Solution) -> Violation:
    """The worst violations of the file's angles and jumps, all other columns derived from them."""
    assert solution.point is not None
    assert solution.violation is not None
    completed = problem.violation(complete_point(problem, solution.field))
    return replace(completed, integrality=solution.violation.integrality)


def _check_bound(file: Path, sidecar: dict[str, Any], objective: float) -> None:
    """Nothing, when no dual bound lies above the objective of a feasible point. Raises SolutionError."""
    bound = sidecar["bound"]
    if bound is not None and contradicts(bound, objective):
        raise SolutionError(
            f"is feasible with objective {objective!r}, "
            f"but the library has the dual bound {bound!r} of {sidecar['name']}; "
            f"that bound is wrong, take its record out of {LEDGER} first",
            file=file,
        )
