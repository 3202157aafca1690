"""The command `solve`: a field by one of the methods, or one formulation handed to a local solver."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ...models.errors import InputError, SolutionError
from ...models.processes.deadline import Deadline
from .inputs import choice_of, formulations_of, known, load, options_of
from .options import (
    BetaNorm,
    Curvature,
    Facet,
    Folder,
    Gap,
    GaugeName,
    Json,
    Mask,
    Outline,
    Quiet,
    Relax,
    SecondsInAll,
    Size,
    SkewWeight,
    Start,
    StrokeNorm,
    StrokeWeight,
    Threads,
    View,
    What,
)
from .output import complain, progress, say, say_json, show_facts, show_solution

if TYPE_CHECKING:
    from ..solutions.solution import Solution
    from ..solving.methods import Candidate, Request
    from ..solving.proven import Proven


def solve_command(
    instance: What,
    output: Folder,
    *,
    formulation: Annotated[
        str | None,
        typer.Option(
            "-f",
            "--formulation",
            metavar="NAME",
            help="Hand this formulation to a solver: {formulations}; in short {short names}.",
        ),
    ] = None,
    method: Annotated[
        str | None,
        typer.Option(
            "-m",
            "--method",
            metavar="NAME",
            help="Find a field in this way: {methods}; `crossfield list` describes them.",
        ),
    ] = None,
    solver: Annotated[
        str | None,
        typer.Option(
            "--solver",
            metavar="NAME",
            help="{all solvers}; by default one of {bundled solvers} that suits the formulation.",
        ),
    ] = None,
    size: Size = None,
    mask: Mask = None,
    silhouette: Outline = "none",
    curvature: Curvature = None,
    view: View = None,
    gauge: GaugeName = None,
    stroke_weight: StrokeWeight = None,
    skew_weight: SkewWeight = None,
    facet: Facet = None,
    stroke_norm: StrokeNorm = None,
    beta_norm: BetaNorm = None,
    relax: Relax = False,
    start: Start = None,
    time_limit: SecondsInAll = 60.0,
    gap: Gap = 1e-6,
    threads: Threads = 0,
    quiet: Quiet = False,
    as_json: Json = False,
) -> None:
    """Find a field, by a method (-m) or by a solver for one formulation (-f).

    The field, and what the solver read and wrote, is left in the folder. Both begin at a field
    that is found in some seconds, unless --start gives another.
    Ctrl-C ends the search and keeps the best so far.
    """
    deadline = Deadline.after(time_limit)  # the time that the libraries take to load is part of it
    from ...models.field.file import read_field
    from ...models.processes.limits import Limits
    from ..solving.methods import Request

    if (formulation is None) == (method is None):
        raise typer.BadParameter("give either --method NAME or --formulation NAME")
    with progress(quiet=quiet) as show:
        show("reading the sketch")
        choice = choice_of(silhouette, curvature, view)
        loaded = load(
            instance,
            size,
            mask,
            gauge,
            choice,
            stroke_weight=stroke_weight,
            skew_weight=skew_weight,
            quiet=quiet,
        )
        request = Request(
            loaded,
            output,
            options=options_of(facet, stroke_norm, beta_norm, relax=relax),
            start=None if start is None else read_field(start, on=loaded),
            progress=show,
            limits=Limits(time_limit, gap, threads).until(deadline),
        )
        if method is not None:
            _check_method(method, solver, relax=relax)
            candidate, proven, target = _by_method(method, request, deadline)
        else:
            solution, target = _by_solver(str(formulation), solver, request)
    if method is not None:
        _tell_candidate(candidate, proven, target, quiet=quiet, as_json=as_json)
        return
    tell_solution(solution, None if solution.doubt else target, quiet=quiet, as_json=as_json)
    if solution.point is None:
        words = f"{solution.status}: {solution.message}" if solution.message else str(solution.status)
        raise InputError(
            f"the solver found no point ({words}); give it more time or another start, and see its log",
            file=output,
        )
    if solution.doubt:
        raise SolutionError(f"the solver {solution.doubt}; no field was written", file=output)


def _check_method(name: str, solver: str | None, *, relax: bool) -> None:
    """Refuse an unknown method, and what goes with formulations alone."""
    from ...models.formulations.catalogue import FORMULATIONS, short_names
    from ..solving.methods import METHODS

    if name not in METHODS and name in {*FORMULATIONS, *short_names()}:
        raise typer.BadParameter(f"{name} is a formulation, no method; write -f {name}")
    known([name], METHODS, "method")
    if relax:
        raise typer.BadParameter("--relax goes with --formulation, not with a method")
    if solver is not None:
        raise typer.BadParameter(f"--solver {solver}: the method {name} has its own solvers")


def _by_method(name: str, request: Request, deadline: Deadline) -> tuple[Candidate, Proven | None, Path]:
    """The last field of a method, what is proven of it, and the file it now is in, a certificate beside."""
    from ...models.field.file import write_field
    from ...models.storage import make_folder
    from ..solving.methods import METHODS
    from ..solving.proven import Proven

    target = make_folder(request.folder) / f"{request.instance.name}.{name}.field.npz"
    *_, candidate = METHODS[name].find(request)
    write_field(candidate.field, target)
    certificate = target.with_name(f"{request.instance.name}.{name}.certificate.npz")
    return candidate, Proven.by(candidate.proof, certificate, deadline), target


def _by_solver(name: str, solver: str | None, request: Request) -> tuple[Solution, Path]:
    """The solution of one formulation, and the file of its field, which is there if it has a point."""
    from ...models.field.file import write_field
    from ...models.formulations.problem import formulate
    from ..bundle.manifest import fixed_jumps
    from ..solving.local import solve

    (name,) = formulations_of([name])
    instance, deadline = request.instance, Deadline.after(request.limits.time_limit)
    request.progress("greedy start")
    start = request.begin(deadline)
    problem = formulate(instance, name, p=fixed_jumps(instance, name, start), **request.options)
    limits = request.limits.until(deadline)
    request.progress(f"solving {name}, at most {limits.time_limit:.3g} s; Ctrl-C keeps the best point so far")
    solution = solve(problem, solver, folder=request.folder, limits=limits, start=start)
    target = request.folder / f"{instance.name}.{name}.field.npz"
    if solution.point is None or solution.doubt:
        target.unlink(missing_ok=True)  # that of an earlier call is not the answer to this one
    else:
        write_field(solution.field, target)
    return solution, target


def _tell_candidate(
    candidate: Candidate, proven: Proven | None, field: Path, *, quiet: bool, as_json: bool
) -> None:
    """Print the facts of a method's field and the path of its file."""
    from ..solving.proven import NOTHING

    facts = candidate.facts()
    if proven:
        facts |= proven.facts(facts["energy_2_norm"])
    if as_json:
        say_json(facts)
    elif not quiet:
        show_facts(candidate.field.instance.summary, facts)
        say(f"field: {field}")
        if proven:
            say(f"certificate: {proven.certificate}")
    if candidate.proof is not None and proven is None:
        complain(NOTHING)
    if candidate.interrupted:
        complain("interrupted; the best field so far was kept")


def tell_solution(solution: Solution, field: Path | None, *, quiet: bool, as_json: bool) -> None:
    """Print the facts of a solution; field: the file in which its field lies, None when there is none."""
    from ..solving.run import facts_with_energies

    facts = facts_with_energies(solution)
    if as_json:
        say_json(facts)
    elif not quiet:
        show_solution(solution, facts, field)
    if solution.interrupted:
        complain("interrupted; the best point so far was kept" if field else "interrupted")
