"""The command `solve`: a field by one of the methods, or one formulation solved by a local solver."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from ...models.errors import InputError, SolutionError
from ...models.processes.deadline import Deadline
from . import options
from .inputs import check_names, find_drawing, full_formulation_names, read_source, read_start
from .output import print_facts, print_notice, show_progress

if TYPE_CHECKING:
    from ..runs.methods import Candidate, Request
    from ..solutions.solution import Solution


def solve_command(
    source: options.Input,
    output: options.Folder,
    *,
    formulation: options.FormulationName = None,
    method: options.MethodName = None,
    solver: options.SolverName = None,
    size: options.Size = None,
    relax: options.Relax = False,
    start: options.Start = None,
    time_limit: options.SecondsInAll = 60.0,
    threads: options.Threads = 0,
    force: options.Force = False,
    as_json: options.Json = False,
) -> None:
    """Compute a field by a method (-m), or solve one formulation with a solver (-f).

    The folder receives the field and all files that the solver reads and writes. Both ways start from a fast
    approximate field, unless --start gives another. Ctrl-C ends the search and keeps the best field so far.
    """
    deadline = Deadline.after(time_limit)  # the time to load libraries counts
    from ...models.processes.limits import Limits
    from ..runs.methods import Request

    if (formulation is None) == (method is None):
        raise typer.BadParameter("give either --method NAME or --formulation NAME")
    with show_progress() as show:
        show("reading the sketch")
        instance = read_source(source, sketch={"size": size})
        request = Request(
            instance,
            output,
            start=read_start(start, instance),
            progress=show,
            limits=Limits(time_limit, threads=threads).until(deadline),
        )
        reads = [path for path in (find_drawing(source), start) if path is not None]
        if method is not None:
            _check_method(method, solver, relax=relax)
            candidate, target = _solve_by_method(method, request, reads, force=force)
        else:
            solution, target = _solve_by_solver(
                str(formulation), solver, request, reads, relax=relax, force=force
            )
    if method is not None:
        _print_candidate(candidate, target, as_json=as_json)
        return
    print_solution(solution, target, as_json=as_json)
    if solution.point is None:
        words = f"{solution.status}: {solution.message}" if solution.message else str(solution.status)
        raise InputError(
            f"the solver found no point ({words}); give it more time or another start, and see its log",
            file=output,
        )
    if solution.doubt:
        raise SolutionError(f"the solver {solution.doubt}; no field was written", file=output)


def _check_method(name: str, solver: str | None, *, relax: bool) -> None:
    """Raise an error for an unknown method, or for an option of formulations."""
    from ...models.formulations.catalogue import FORMULATIONS, short_names
    from ..runs.methods import METHODS

    if name not in METHODS and name in {*FORMULATIONS, *short_names()}:
        raise typer.BadParameter(f"{name} is a formulation, not a method; write -f {name}")
    check_names([name], METHODS, "method")
    if name == "prove":
        raise typer.BadParameter("the method prove has a command of its own; write crossfield prove")
    if relax or solver is not None:
        raise typer.BadParameter("--relax and --solver need --formulation; no method takes them")


def _solve_by_method(
    name: str, request: Request, reads: list[str | Path], *, force: bool
) -> tuple[Candidate, Path]:
    """Final field of a method, and its file."""
    from ...models.field.file import write_field
    from ...models.storage import replace_results
    from ..bundle.earlier import keep_better_field
    from ..runs.methods import find_method

    instance, folder = request.instance, request.folder
    method = find_method(name, instance)
    field = f"{instance.name}.{name}.field.npz"
    names = [*method.file_names(instance), field]
    with replace_results(folder, names, reads=reads, force=force) as new:
        *_, candidate = method.find(replace(request, folder=new.path))
        write_field(candidate.field, new.path / field)
        if not force:
            keep_better_field(new, field, candidate.field, print_notice, on=instance)
        if field in new.kept:
            new.kept.update(names)
    return candidate, folder / field


def _solve_by_solver(
    name: str, solver: str | None, request: Request, reads: list[str | Path], *, relax: bool, force: bool
) -> tuple[Solution, Path]:
    """Solution of one formulation, and the path of its field, which exists if the solution has a point."""
    from ...models.formulations.problem import formulate
    from ...models.written_files import check_targets
    from ..bundle.problem_files import jumps_as_data
    from ..solvers_table import BUNDLED, SOLVERS
    from ..solving.local import Solvers, choose_solver, names_of_solve

    (name,) = full_formulation_names([name])
    instance, folder, deadline = request.instance, request.folder, Deadline.after(request.limits.time_limit)
    field = f"{instance.name}.{name}.field.npz"
    for possible in [solver] if solver in SOLVERS else BUNDLED:
        names = names_of_solve(instance, name, possible, SOLVERS[possible].formats)
        check_targets(folder, [*names, field], reads=reads, force=force)
    request.progress("greedy start")
    start = request.starting_field(deadline)
    problem = formulate(instance, name, p=jumps_as_data(instance, name, start), relax=relax)
    limits = request.limits.until(deadline)
    request.progress(f"solving {name}, at most {limits.time_limit:.3g} s; Ctrl-C keeps the best point so far")
    chosen = choose_solver(problem, solver)
    with Solvers() as solvers:
        solution = solvers.solve(
            problem,
            chosen.name,
            folder=folder,
            limits=limits,
            start=start,
            force=force,
            reads=reads,
            field_name=field,
            notice=print_notice,
        )
    return solution, folder / field


def _print_candidate(candidate: Candidate, field: Path, *, as_json: bool) -> None:
    """Print the facts of a method's field and the path of its file."""
    print_facts(candidate.field.instance.summary, candidate.facts(), f"field: {field}", as_json=as_json)
    if candidate.interrupted:
        print_notice("interrupted; the best field so far was kept")


def print_solution(solution: Solution, field: Path, *, as_json: bool) -> None:
    """Print the facts of a solution, and the path of its field, which exists unless there is a doubt."""
    facts = solution.facts()
    if solution.point is not None:
        facts |= solution.field.facts()
    written = solution.point is not None and not solution.doubt

    lines = [f"field: {field}"] if written else []
    print_facts(solution.problem.instance.summary, facts, *lines, as_json=as_json)
    if solution.interrupted:
        print_notice("interrupted; the best point so far was kept" if written else "interrupted")
