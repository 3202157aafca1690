"""Solving with any installed program of the table: one way for all of them.

The problem is written to a file. The program solves that file in a child process and writes a solution file,
which is read like any external solution file. So a solve tests the files too.
"""

from __future__ import annotations

import time
from collections.abc import Iterable
from contextlib import ExitStack
from dataclasses import replace
from importlib.metadata import PackageNotFoundError
from importlib.metadata import version as installed
from itertools import chain
from pathlib import Path
from typing import Any, Final, NamedTuple, Self

import numpy as np

from ...models.arguments import check_choice
from ...models.errors import (
    InputError,
    MissingSolverError,
    SolutionError,
    SolverError,
    UnsupportedBySolverError,
)
from ...models.field.field import CrossField
from ...models.field.file import write_field
from ...models.formulations.problem import Problem
from ...models.instance.domain import Floats
from ...models.instance.instance import Instance
from ...models.processes.child import Child, KilledError
from ...models.processes.child_program import WorkerError
from ...models.processes.deadline import Deadline, Progress, Stop, silent, stop_function
from ...models.processes.limits import Limits
from ...models.storage import make_folder, replace_results, temporary_folder
from ..bundle.earlier import keep_better_answer, keep_better_field, objective_function
from ..bundle.manifest import add_to_manifest, file_stem, instance_file
from ..bundle.starts import LAYOUTS, STARTS, Start, write_start
from ..formats.registry import FORMATS, file_names, problem_in_format, write
from ..programs.protocol import (
    FEASIBILITY,
    FailedError,
    Job,
    Outcome,
    RefusedError,
    TooLargeError,
    call_program,
    part_path,
)
from ..solutions.read import read_solution, with_bounds
from ..solutions.solution import Solution
from ..solvers_table import BUNDLED, PROGRAMS, SOLVERS, Solver, Suitability, suitability_in_format
from ..statuses import Status
from ..writing.sink import save_file

VERSION_SECONDS: Final = 60.0
"""Seconds in which a program has to report its version."""
_LATE: Final = "returned no answer within its time; give it more, or a start"
_KILLED: Final = "did not end within its time; the answer is what it had written by then"
_NO_BETTER: Final = "nothing better than the start"


def solve(
    problem: Problem,
    solver: str | None = None,
    *,
    folder: str | Path | None = None,
    limits: Limits | None = None,
    start: CrossField | None = None,
    stop: Stop | None = None,
    force: bool = False,
) -> Solution:
    """Solve a problem with an installed solver, within the time limit, and check the answer.

    Ctrl-C ends the solver and returns its best point so far.

    Parameters
    ----------
    problem
        The problem.
    solver
        A name in the table of solvers. None: HiGHS, Ipopt or Bonmin, by the problem's class.
    folder
        The folder that keeps the written file, the log and the solution, with the manifest that reads the
        solution back. They appear together at the end. A better solution of the same problem by the same
        solver stays. None: they are deleted.
    limits
        Time limit, gap and threads; `Limits()` by default.
    start
        A field whose complete point is the incumbent or starting point.
    stop
        A function that returns whether to stop, or an event. The best point so far is then returned.
    force
        Whether to replace files that crossfield has not written or that have changed since, and a better
        solution.

    Returns
    -------
    Solution
        The answer, with everything recomputed from the instance.

    Raises
    ------
    InputError
        For an unknown solver, and for limits without a time limit.
    UnsupportedBySolverError
        When the solver does not take the problem.
    MissingSolverError
        When the program of the solver is not installed.
    SolverError
        When the solver fails.
    SolutionError
        When its answer cannot be read.
    OutputError
        When a file cannot be written, or if others are in the way.

    """
    chosen = choose_solver(problem, solver)
    with Solvers() as solvers:
        return solvers.solve(
            problem, chosen.name, folder=folder, limits=limits, start=start, stop=stop, force=force
        )


def choose_solver(problem: Problem, name: str | None = None) -> Solver:
    """Return the solver of that name, or the preferred one of those that come with crossfield.

    A solver whose format holds a weaker relaxation of the problem comes after the others. Raises InputError
    for an unknown name, UnsupportedBySolverError when the solver does not take the problem,
    MissingSolverError when its program is not installed.
    """
    if name is not None:
        check_choice("solver", name, SOLVERS)
    candidates = (
        [SOLVERS[name]] if name else [s for s in BUNDLED.values() if problem.problem_class not in s.not_for]
    )
    taking = {solver.name: choose_format(problem, solver.name) for solver in candidates}
    willing = [solver for solver in candidates if taking[solver.name].answer == "yes"]
    if not willing:
        reasons = ", ".join(f"{solver} ({answer.reason})" for solver, answer in taking.items())
        raise UnsupportedBySolverError(
            f"{problem.name} is {_describe_class(problem)}, which is not for {reasons}; "
            "`crossfield list` shows the problems that each solver takes; or relax it"
        )
    present = [solver for solver in willing if not solver.missing]
    if not present:
        raise MissingSolverError(willing[0].missing)
    formats = {solver.name: FORMATS[taking[solver.name].format] for solver in present}
    return min(
        present, key=lambda solver: problem_in_format(problem, formats[solver.name]).formulation.is_weakened
    )


def choose_format(problem: Problem, solver: str) -> Suitability:
    """Return the format in which a solver gets a problem, or the reason why it does not take the problem.

    An answer without proof is accepted only from a solver that never proves anything.
    """
    entry = SOLVERS[solver]
    readable = [name for name in entry.formats if name in PROGRAMS[entry.program].formats]
    answers = [suitability_in_format(problem, solver, name) for name in readable]
    local = entry.proves == "local"
    for taking in answers:
        if taking.answer == "yes" or (local and taking.answer == "local"):
            return taking._replace(answer="yes")
    return answers[0]


def _describe_class(problem: Problem) -> str:
    return f"{'a convex' if problem.is_convex else 'a non-convex'} {problem.problem_class}"


class SolveFiles(NamedTuple):
    """The files of a solve: model, solution in the solver's own layout, log, and starting point."""

    model: Path
    solution: Path
    log: Path
    start: Path

    @classmethod
    def for_model(cls, model: Path, solver: str) -> Self:
        """Return the files of a solve in the folder of the model."""
        start = STARTS[solver].suffix if solver in STARTS else ""
        suffixes = (f".{solver}{SOLVERS[solver].answers}", f".{solver}.log", f".{solver}.start{start}")
        return cls(model, *(model.with_name(f"{model.stem}{suffix}") for suffix in suffixes))


class Solvers:
    """Running solvers: a child process for each program, started at its first use.

    A context that ends the processes. For many solves it saves the time to start a process for each.
    """

    def __init__(self) -> None:
        """Prepare without starting a process."""
        self._stack = ExitStack()
        self._children: dict[str, Child] = {}

    def __enter__(self) -> Self:
        """Create the folder for the programs' own files."""
        self._folder = Path(self._stack.enter_context(temporary_folder()))
        return self

    def __exit__(self, *_: object) -> None:
        """End every child process."""
        self._stack.close()

    def child(self, program: str) -> Child:
        """Return the child process of a program, with a folder of its own."""
        if program not in self._children:
            folder = make_folder(self._folder / program)
            self._children[program] = self._stack.enter_context(Child(folder))
        return self._children[program]

    def version(self, solver: str) -> str:
        """Return the version of a solver, or of the package that contains it, with its name.

        Raises SolverError when the program does not report it.
        """
        program = PROGRAMS[SOLVERS[solver].program]
        if program.name != solver:
            try:
                return f"{program.needs} {installed(program.needs)}"
            except PackageNotFoundError:
                return "not installed"
        return self.program_version(program.name)

    def ask(self, program: str, step: str, *arguments: Any, seconds: float) -> Any:
        """Run a step (see protocol.py) of a program and return its result. Raises its errors."""
        log, deadline = self._folder / f"{program}.log", Deadline.after(seconds)
        return (
            self.child(program)
            .call(call_program, program, step, *arguments, deadline=deadline, log=log)
            .value
        )

    def program_version(self, program: str) -> str:
        """Return the version that a program reports. Raises SolverError."""
        try:
            return str(self.ask(program, "version", seconds=VERSION_SECONDS))
        except (WorkerError, RefusedError, FailedError) as error:
            raise SolverError(f"{PROGRAMS[program].title} does not report its version: {error}") from error

    def solve(
        self,
        problem: Problem,
        solver: str,
        *,
        folder: str | Path | None = None,
        limits: Limits | None = None,
        start: CrossField | None = None,
        stop: Stop | None = None,
        force: bool = False,
        field_name: str | None = None,
        reads: Iterable[str | Path] = (),
        notice: Progress = silent,
    ) -> Solution:
        """Solve a problem; parameters, result and errors are those of the function `solve`.

        field_name: of the file in the folder that receives the field of a point without a doubt. reads: files
        that are never replaced. notice: receives a line about each better result that stays.
        """
        limits = Limits.finite_or_default(limits)
        deadline = Deadline.after(limits.time_limit)
        taking = FORMATS[choose_format(problem, solver).format]
        model = f"{file_stem(problem)}{taking.suffix}"

        def solve_in(place: Path) -> Solution:
            files = SolveFiles.for_model(place / model, solver)
            written = write(problem, files.model, start=start if taking.has_start else None)
            if folder is not None and problem.is_recordable:
                add_to_manifest(problem, written, place, Path(folder))
            # Reading the answer takes about as long as writing the problem did.
            search = deadline.later(deadline.left() - limits.time_limit)
            return self.solve_file(written.problem, solver, files, limits, search, start=start, stop=stop)

        if folder is None:
            with temporary_folder() as place:
                return solve_in(place)
        names = names_of_solve(problem.instance, problem.name, solver, [taking.name])
        (log_name, solution_name), failure = names[-2:], None
        names += [] if field_name is None else [field_name]
        with replace_results(folder, names, reads=reads, force=force) as new:
            try:
                solution = solve_in(new.path.resolve())
            except SolverError as error:  # its log stays, unless there are earlier results
                failure = error
                new.kept.update(name for name in names if (Path(folder) / name).exists())
            else:
                field = None if solution.point is None or solution.doubt else solution.field
                if field_name is not None and field is not None:
                    write_field(field, new.path / field_name)
                if not force:
                    keep_better_answer(new, problem, log_name, solution_name, notice)
                if field_name is not None and not force:
                    keep_better_field(
                        new, field_name, field, notice, on=problem.instance, value=objective_function(problem)
                    )
        if failure is not None:
            raise failure
        return solution

    def solve_file(
        self,
        held: Problem,
        solver: str,
        files: SolveFiles,
        limits: Limits,
        deadline: Deadline,
        *,
        start: CrossField | None = None,
        stop: Stop | None = None,
        precise: bool = False,
    ) -> Solution:
        """Solve a model file that was written for a solver, and read the answer.

        held: the problem as the file holds it. deadline: time of the request to stop, for a solver that does
        not end by itself; `limits` hold for the search. precise: whether tolerances are as tight as the
        solver allows.
        """
        entry = SOLVERS[solver]
        for stale in (files.solution, files.log, files.start):
            stale.unlink(missing_ok=True)
        begins = None
        if start is not None and solver in STARTS and held.integer.any():  # files of .nl and GAMS hold it
            begins = None if write_start(held, start, files.start, solver) is None else files.start
        job = Job(
            solver,
            files.model,
            files.solution,
            begins,
            limits.time_limit,
            deadline,
            limits.gap,
            limits.threads,
            precise,
            held.stamp,
        )
        point = None if start is None else held.point(start)
        begin = time.perf_counter()
        try:
            outcome, interrupted = self.child(entry.program).call(
                call_program,
                entry.program,
                "solve",
                job,
                deadline=deadline,
                log=files.log,
                stop=stop_function(stop),
            )
        except TooLargeError as error:
            raise UnsupportedBySolverError(
                f"{entry.title}: {held.n_columns} columns and {held.n_rows} rows are too many for its free "
                f"edition, which takes {PROGRAMS[entry.program].free}"
            ) from error
        except (RefusedError, FailedError) as error:
            raise SolverError(f"{entry.title}: {error}", file=files.model.name) from error
        except KilledError as error:
            outcome, interrupted = _outcome_of_killed(files, held), error.interrupted
        except WorkerError as error:
            raise SolverError(
                f"{entry.title}: {error}; its log is {files.log.name}", file=files.model.name
            ) from error
        finally:
            files.start.unlink(missing_ok=True)
        solution = _read_answer(held, files, outcome, entry)
        if solution.status is Status.OPTIMAL_IN_GAP:
            solution = with_bounds(solution, limits.gap)
        unsolved = solution.status == Status.LIMIT_WITHOUT_POINT
        if unsolved and point is not None and held.violation(point).worst <= FEASIBILITY:
            solution = _write_start_as_answer(held, point, files, outcome, entry)
        return replace(
            solution,
            interrupted=interrupted,
            seconds=time.perf_counter() - begin,
            start_returned=_is_start(solution.point, point),
        )


def names_of_solve(instance: Instance, name: str, solver: str, forms: Iterable[str]) -> list[str]:
    """Names of the files of a solve of a formulation, in some formats; log and solution are the last."""
    stem = f"{instance.name}.{name}"
    models = [file_names(f"{stem}{FORMATS[form].suffix}", form) for form in forms]
    files = SolveFiles.for_model(Path(f"{stem}{FORMATS['nl'].suffix}"), solver)
    others = [instance_file(instance), f"{stem}.manifest.json", files.log.name, files.solution.name]
    return [*chain.from_iterable(models), *others]


def _outcome_of_killed(files: SolveFiles, held: Problem) -> Outcome:
    """Outcome of a solver that was killed: its solution file counts if the solver completed it."""
    part_path(files.solution).unlink(missing_ok=True)
    try:
        status = read_solution(files.solution, held).claimed
    except (InputError, SolutionError):  # there is none, or one that cannot be read
        files.solution.unlink(missing_ok=True)
        return Outcome(Status.LIMIT_WITHOUT_POINT, _LATE)
    return Outcome(Status.LIMIT_WITH_POINT if status is Status.FEASIBLE else None, _KILLED)


def _write_start_as_answer(
    held: Problem, point: Floats, files: SolveFiles, outcome: Outcome, entry: Solver
) -> Solution:
    """Write the feasible start as the solution of a solver that ended without a point, and read it."""
    save_file(files.solution, LAYOUTS["highs"](Start(held, point)))
    message = f"{entry.name}: stopped at its limit or by Ctrl-C, {_NO_BETTER}"
    return _read_answer(held, files, outcome._replace(status=Status.LIMIT_WITH_POINT, message=message), entry)


def _read_answer(held: Problem, files: SolveFiles, outcome: Outcome, entry: Solver) -> Solution:
    """Read the solution file; other reports of the solver override the file."""
    if not files.solution.exists():
        status = outcome.status or Status.NO_POINT
        return Solution(
            held,
            None,
            status,
            outcome.message,
            entry.title,
            identified=True,
            claimed_bound=outcome.bound,
            nodes=outcome.nodes,
        )
    try:
        solution = read_solution(files.solution, held, identified=True)
    except SolutionError:
        files.solution.unlink(missing_ok=True)  # cut off, for example by a full disk: it must not be used
        raise
    reported: dict[str, Any] = {
        "claimed": outcome.status,
        "message": outcome.message,
        "claimed_bound": outcome.bound,
        "nodes": outcome.nodes,
    }
    return replace(solution, **{key: value for key, value in reported.items() if value not in (None, "")})


def _is_start(point: Floats | None, start: Floats | None) -> bool | None:
    """Whether the answer is the start up to rounding; None without either of them."""
    if point is None or start is None:
        return None
    return bool(np.abs(point - start).max(initial=0.0) <= FEASIBILITY)
