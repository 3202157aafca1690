"""Verification of every written file with every free program: read, compared, evaluated, optionally solved.

For a folder that `export` wrote, each manifest gives its problem, and each file goes to each program of its
format. The model that a program reads is compared with the problem by name: sense, constant, costs, quadratic
terms, types, bounds, rows; and as numbers at random points. With `seconds`, each solver solves it. The point
is checked against the problem, its field is evaluated, and the optima of one problem are compared with each
other across formats. If a format holds a relaxation only, its optimum may not exceed theirs. Every check that
was not tried is reported, with its reason.
"""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from ...models.errors import CrossfieldError, InputError, UnsupportedBySolverError, naming
from ...models.field.field import CrossField
from ...models.formulations.problem import Problem, Violation
from ...models.input_limits import MAX_SOLUTION
from ...models.orthogonal.energy import OrthogonalEnergy, field_of, integers_of
from ...models.packed import unpack
from ...models.processes.deadline import Deadline
from ...models.processes.limits import Limits
from ...models.storage import read_bytes, temporary_folder, write_bytes
from ...models.written_files import check_targets, sha256_of
from ..bundle.manifest import Manifest, read_manifest
from ..formats.registry import FORMATS, problem_in_format
from ..programs.comparison import algebra_difference, behaviour_difference
from ..programs.model_content import Points
from ..programs.protocol import NotReportedError, RefusedError, TooLargeError
from ..solutions.solution import Solution
from ..solvers_table import PROGRAMS, SOLVERS, Program, Stage
from ..solving.local import SolveFiles, Solvers
from ..statuses import Status
from .checks import Check, Verdict, Verification

RESULT: Final = "verify.json"
SEED: Final = 1
RANDOM_POINTS: Final = 4
"""Random points at which files are evaluated."""
FIELD_POINTS: Final = 2
"""Complete points of random fields at which files are evaluated as well."""
_SAVED: Final = 4.0
"""By how many violations of rows a column may be wrong that other columns determine."""
SAME_OPTIMUM: Final = 1e-6
"""Relative difference up to which optima agree (absolute below 1)."""
READING_SECONDS: Final = 80.0
"""Seconds for a program to read a file."""
LATE: Final = 20.0
"""Seconds after its limit at which a solver that ignores the clock is requested to stop."""


@dataclass(frozen=True, eq=False)
class _ModelFile:
    """A file to verify: its intended content, its unpacked copy, the points for comparison."""

    problem: Problem
    held: Problem
    name: str
    format: str
    path: Path
    points: Points

    def check(self, program: str, step: str, verdict: Verdict, reason: str = "", **numbers: Any) -> Check:
        held_hash, problem_hash = self.held.sha256[:16], self.problem.sha256[:16]
        group, relaxes = (
            (held_hash, problem_hash) if self.held.formulation.is_weakened else (problem_hash, "")
        )
        facts = (_title(self.problem), self.name, program, step, verdict, reason)
        return Check(*facts, **numbers, group=group, relaxes=relaxes)


def _title(problem: Problem) -> str:
    return f"{problem.instance.name} {problem.name}"


def verify(
    folder: str | Path,
    *,
    seconds: float | None = None,
    programs: list[str] | None = None,
    force: bool = False,
    progress: Callable[[str], None] = lambda _: None,
) -> Verification:
    """Check all the files in a folder with all installed programs.

    Also writes verify.json there. seconds: for each solve; None: nothing is solved. programs: names, all by
    default. force: whether to replace a verify.json that crossfield has not written or that has changed.
    progress: called with each file and program. Raises InputError when the folder holds no manifest,
    OutputError, and the errors of reading manifests.
    """
    folder = Path(folder)
    wanted = [PROGRAMS[name] for name in programs or PROGRAMS]
    manifests = [read_manifest(path) for path in sorted(folder.glob("*.manifest.json"))]
    if not manifests:
        raise InputError("holds no manifest; give the folder that `crossfield export` wrote", file=folder)
    check_targets(folder, [RESULT], force=force)
    absent = {program.name: program.missing for program in wanted if program.missing}
    verification = Verification(folder, absent=absent)
    with temporary_folder() as temporary:
        subjects, broken = _subjects(manifests, temporary)
        verification.checks.extend(broken)
        for program in wanted:
            if program.missing:
                continue
            chosen = [subject for subject in subjects if subject.format in program.formats]
            with Solvers() as solvers:
                bench = _ProgramChecks(program, solvers, seconds)
                verification.versions[program.name] = solvers.program_version(program.name)
                for subject in chosen:
                    progress(f"{subject.name}: {program.title}")
                    verification.checks.extend(bench.checks(subject))
    verification.checks[:] = judge_solves(verification.checks)
    write_bytes(folder / RESULT, (json.dumps(verification.document(), indent=1) + "\n").encode(), force=force)
    return verification


def _subjects(manifests: list[Manifest], temporary: Path) -> tuple[list[_ModelFile], list[Check]]:
    """The files that match their manifests, and failed checks of those that do not."""
    subjects: list[_ModelFile] = []
    broken: list[Check] = []
    for number, manifest in enumerate(manifests):
        problem = manifest.problem()
        place = temporary / f"set{number}"
        place.mkdir()
        points: dict[int, Points] = {}
        for entry in manifest.document["files"]:
            about, source = (_title(problem), entry["name"], "", "read"), manifest.folder / entry["name"]
            if not source.is_file() or sha256_of(source) != entry["sha256"]:
                words = "is not the file that the manifest describes; export again"
                broken.append(Check(*about, Verdict.FAILED, words))
                continue
            path = _unpack_file(source, place)
            if not FORMATS[entry["format"]].is_model(path.name):
                continue
            held = problem_in_format(problem, FORMATS[entry["format"]])
            stated, holds = entry["lifted"], held.formulation.lifted
            if stated != holds:
                words = f"the manifest states {stated!r} for it, but it holds {holds!r}; export again"
                broken.append(Check(*about, Verdict.DIFFERS, words))
            if len(held.blocks) not in points:
                points[len(held.blocks)] = _test_points(held)
            subjects.append(
                _ModelFile(problem, held, entry["name"], entry["format"], path, points[len(held.blocks)])
            )
    return subjects, broken


def _unpack_file(source: Path, folder: Path) -> Path:
    """An uncompressed copy of the file."""
    path = folder / source.name.removesuffix(".gz")
    if source.suffix == ".gz":
        with naming(source):
            path.write_bytes(unpack(read_bytes(source), MAX_SOLUTION))
    else:
        shutil.copyfile(source, path)
    return path


def _test_points(problem: Problem) -> Points:
    """Arbitrary points, then complete points of random fields, which respect bounds, rows and integrality."""
    rng = np.random.default_rng(SEED)
    anywhere = rng.normal(size=(RANDOM_POINTS, problem.n_columns))
    seeds = range(FIELD_POINTS if problem.instance.indices is None else 0)  # which random fields have not
    feasible = [problem.point(random_field(problem, seed)) for seed in seeds]
    values = np.concatenate([anywhere, np.reshape(feasible, (-1, problem.n_columns))])
    objective = np.array([problem.objective_value(point) for point in values])
    return Points(problem.column_names, values, objective, RANDOM_POINTS)


def random_field(problem: Problem, seed: int) -> CrossField:
    """A random field on the problem's instance within all bounds; jumps that are data are kept."""
    rng, data = np.random.default_rng(seed), problem.data
    alpha = rng.uniform(data["alpha_lo"], data["alpha_up"])
    beta = rng.uniform(data["beta_lo"], data["beta_up"]) * (not problem.instance.orthogonal)
    jumps = rng.integers(data["p_min"], data["p_max"] + 1).astype(np.int32)
    field = CrossField(problem.instance, alpha, beta, jumps if problem.jumps is None else problem.jumps)
    if "d_max" not in data:
        return field
    if not problem.formulation.options.limits:
        return field.with_best_jumps()  # |A| is at most pi/4
    energy = OrthogonalEnergy.of(problem.instance)
    return field_of(problem.instance, energy.descend(integers_of(field)), energy)


@dataclass(frozen=True, eq=False)
class _ProgramChecks:
    """A running program: its child process, and the seconds for a solve."""

    program: Program
    solvers: Solvers
    seconds: float | None
    solved: set[tuple[str, str]] = field(default_factory=set)

    def checks(self, subject: _ModelFile) -> Iterator[Check]:
        """Check how the program reads a file and solves it; files of the same problem are solved once."""
        read = self._read(subject)
        yield read
        if self.seconds is None:
            return
        for solver in self.program.solvers:
            key = (solver, subject.held.sha256)
            if read.verdict in {Verdict.AGREES, Verdict.NOT_TRIED} and key not in self.solved:
                self.solved.add(key)
                yield self._solve(subject, solver, self.seconds)

    def _read(self, subject: _ModelFile) -> Check:
        refusal = _refusal(self.program.name, subject, "read")
        try:
            wrong = self._difference(subject)
        except TooLargeError:
            verdict, words = Verdict.NOT_TRIED, self._too_large(subject)
        except NotReportedError as error:
            verdict, words = Verdict.NOT_TRIED, str(error)
        except RefusedError as error:
            verdict, words = (Verdict.REFUSED, refusal) if refusal else (Verdict.FAILED, str(error))
        except CrossfieldError as error:
            verdict, words = Verdict.FAILED, str(error)
        else:
            wrong = f"it was read, though {refusal}" if refusal else wrong
            verdict, words = (Verdict.DIFFERS if wrong else Verdict.AGREES), wrong
        return subject.check(self.program.name, "read", verdict, words)

    def _difference(self, subject: _ModelFile) -> str:
        """Return how the model that the program reads differs from the problem; empty if it does not."""
        program, points = self.program, subject.points
        if subject.format in program.algebra:
            model = self.solvers.ask(program.name, "read", subject.path, seconds=READING_SECONDS)
            one = FORMATS[subject.format].has_constant_column
            return algebra_difference(model, subject.held, program.tolerance, one=one)
        behaviour = self.solvers.ask(program.name, "evaluate", subject.path, points, seconds=READING_SECONDS)
        return behaviour_difference(behaviour, subject.held, points)

    def _too_large(self, subject: _ModelFile) -> str:
        held = subject.held
        return f"{held.n_columns} columns and {held.n_rows} rows; the free edition takes {self.program.free}"

    def _solve(self, subject: _ModelFile, solver: str, seconds: float) -> Check:
        def result(verdict: Verdict, words: str) -> Check:
            return subject.check(solver, "solve", verdict, words)

        if refusal := _refusal(solver, subject, "solve"):
            return result(Verdict.REFUSED, refusal)
        if local := _refusal(solver, subject, "local"):
            return result(Verdict.NOT_TRIED, local)
        if missing := SOLVERS[solver].missing:
            return result(Verdict.NOT_TRIED, missing)
        files = SolveFiles.for_model(subject.path, solver)
        limits = Limits(seconds, gap=0.0, threads=1)  # so that optima can be compared
        try:
            solution = self.solvers.solve_file(
                subject.held, solver, files, limits, Deadline.after(seconds + LATE), precise=True
            )
        except UnsupportedBySolverError:
            return result(Verdict.NOT_TRIED, self._too_large(subject))
        except CrossfieldError as error:
            return result(Verdict.FAILED, str(error))
        return _judge_answer(subject, solver, solution)


def _refusal(solver: str, subject: _ModelFile, stage: Stage) -> str:
    """Reason why the solver refuses at that stage, by the table of solvers; empty without a refusal."""
    refusal = SOLVERS[solver].refusal(subject.held, stage) if solver in SOLVERS else None
    return "" if refusal is None else refusal.reason


def _judge_answer(subject: _ModelFile, solver: str, solution: Solution) -> Check:
    """Judge a solver's answer: check its point and its field."""
    numbers = {"seconds": round(solution.seconds or 0.0, 2), "bound": solution.claimed_bound}
    objective, worst = solution.objective, solution.violation
    if objective is None or worst is None:
        limit = solution.claimed == Status.LIMIT_WITHOUT_POINT
        verdict = Verdict.LIMIT if limit else Verdict.FAILED
        return subject.check(solver, "solve", verdict, f"no point: {solution.message}", **numbers)
    attained = attained_objective(solution, objective, worst)
    numbers |= {"objective": objective, "attained": attained}
    wrong = ""
    if worst.worst > SOLVERS[solver].feasible_within:
        wrong = f"its point violates {worst.worst_family or 'bounds'} by {worst.worst:.2g}"
    proven = solution.claimed.is_optimal  # the gap that it was given is 0
    claim = solution.reported
    if (
        not wrong
        and claim is not None
        and not is_same_optimum(claim, objective)
        and (proven or claim < objective)
    ):
        # Before the end, a solver's own variable for the objective may differ.
        wrong = f"it reports {claim:.9g} for a point of {objective:.9g}"
    if not wrong and proven and attained < objective and not is_same_optimum(attained, objective):
        wrong = f"its objective is {objective:.9g}, but its field has {attained:.9g}"
    if wrong:
        return subject.check(solver, "solve", Verdict.DIFFERS, wrong, **numbers)
    verdict, words = (Verdict.AGREES, "") if proven else (Verdict.LIMIT, solution.message)
    return subject.check(solver, "solve", verdict, words, proven=proven, **numbers)


def attained_objective(solution: Solution, objective: float, violation: Violation) -> float:
    """An objective that a feasible point has: a solver's point may save some by rows that it breaks.

    It is that of the field, where points are fields. Elsewhere each column may be wrong by the violation.
    """
    of_field = solution.objective_of_field
    if of_field is not None:
        return of_field
    sizes = sum(float(np.sum(family.scale)) for family in solution.problem.objective)
    return objective + _SAVED * violation.worst * sizes


def is_same_optimum(first: float, second: float) -> bool:
    """Whether two optima agree."""
    return abs(first - second) <= SAME_OPTIMUM * max(1.0, abs(second))


def _is_above(value: float, best: float) -> bool:
    """Whether an optimum or a bound lies above a point's objective by more than rounding."""
    return value > best and not is_same_optimum(value, best)


def judge_solves(checks: list[Check]) -> list[Check]:
    """The checks, in which a solve that contradicts the best point of its problem now differs."""
    return [_judge_solve(check, checks) for check in checks]


def _judge_solve(check: Check, checks: list[Check]) -> Check:
    if check.step != "solve" or check.verdict not in {Verdict.AGREES, Verdict.LIMIT}:
        return check
    wrong = _contradiction(check, _best(checks, check.group), _best(checks, check.relaxes))
    if wrong:
        return replace(check, verdict=Verdict.DIFFERS, reason=wrong)
    return replace(check, reason=_as_relaxation(check, checks)) if check.relaxes else check


def _contradiction(check: Check, same_problem: float | None, relaxed: float | None) -> str:
    """How an optimum or a bound contradicts the best point of its problem, or of the problem it relaxes."""
    optimum = check.objective if check.proven else None
    if same_problem is not None and optimum is not None and _is_above(optimum, same_problem):
        return f"its optimum is {optimum:.9g}, another has {same_problem:.9g}"
    if same_problem is not None and check.bound is not None and _is_above(check.bound, same_problem):
        return f"its bound {check.bound:.9g} is above a point of {same_problem:.9g}"
    lower = optimum if check.proven else check.bound
    if relaxed is not None and lower is not None and _is_above(lower, relaxed):
        return (
            f"it holds a relaxation, and its optimum is at least {lower:.9g}, above a point of {relaxed:.9g}"
        )
    return ""


def _as_relaxation(check: Check, checks: list[Check]) -> str:
    """Note on the solve of a relaxation, with the best point of the problem itself, if any."""
    best, reason = _best(checks, check.relaxes), f"; {check.reason}" if check.reason else ""
    known = best is not None and check.proven
    comparison = f", no higher than {best:.9g} of the problem itself" if known else ""
    return f"a relaxation: products lifted without integrality{comparison}{reason}"


def _best(checks: list[Check], group: str) -> float | None:
    """The least objective in a group that a feasible point has."""
    same_group = [check for check in checks if check.group == group]
    values = [check.attained for check in same_group if check.attained is not None]
    return min(values, default=None)
