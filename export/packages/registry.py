"""The one table of packages in memory, conversions to their models, and the check of their answers.

Models hold columns and rows under the names of the files, and the stamp of the problem.
`check_values` applies the checks of files to answers in memory (export/solutions/read.py).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Final

from ...models.arguments import float_array
from ...models.errors import InputError, MissingSolverError, SolutionError, UnsupportedBySolverError
from ...models.formulations.problem import Problem
from ..solutions.read import check_answer
from ..solutions.readers.text import RawSolution, named_values, solution_without_point
from ..solutions.solution import TRUSTED, Solution
from ..statuses import Status, claim_of
from ..writing.stamps import digits_in_columns, digits_in_text, is_identified
from .gurobi import GUROBI
from .highs import HIGHS
from .linopy import LINOPY
from .package import Package
from .pyomo import PYOMO
from .scip import SCIP

PACKAGES: Final = {package.title.lower(): package for package in (HIGHS, GUROBI, SCIP, LINOPY, PYOMO)}
"""The packages by the name of the method, as in `Problem.to_highs`."""


def convert(name: str, problem: Problem, **options: Any) -> Any:
    """A problem as a model of a package, with products lifted if it needs that.

    Raises MissingSolverError and UnsupportedBySolverError, each with the remedy.
    """
    package = PACKAGES[name]
    if find_spec(package.name) is None:
        raise MissingSolverError(f"{package.title} is not installed; run pip install {package.name}")
    if package.can_hold(problem):
        return package.build(problem, **options)
    if (
        package.lifts
        and "p1" in problem.blocks
        and "z" not in problem.blocks
        and package.can_hold(problem.lifted)
    ):
        return package.build(problem.lifted, **options)
    kind = f"{'a convex' if problem.is_convex else 'a non-convex'} {problem.problem_class}"
    raise UnsupportedBySolverError(
        f"{package.title} takes {package.holds}, but this is {kind}; {package.remedy}"
    )


def check_values(
    problem: Problem,
    values: object,
    *,
    status: str,
    bound: float | None,
    gap: float | None,
    tolerance: float | None,
) -> Solution:
    """Check an answer in memory: `Problem.solution`, which describes the arguments."""
    raw = _read_answer(values, problem, unsolved=bool(status))
    if status:
        claimed = Status(status) if status in {*Status} else claim_of(str(status), "other")[0]
        raw = replace(raw, status=claimed if raw.has_point else claimed.without_point, message=str(status))
    return check_answer(
        raw,
        problem,
        identified=True,
        tolerance=TRUSTED if tolerance is None else tolerance,
        stated_gap=gap,
        stated_bound=bound,
    )


def _read_answer(values: object, problem: Problem, *, unsolved: bool) -> RawSolution:
    """Read values or a model. unsolved: whether the model may be without any claim.

    Raises SolutionError for a model of another problem, and InputError for values that are none.
    """
    package = _package_of(values)
    if package is None:
        return _read_values(values, problem)
    claims = package.claims(values)
    title = claims.title.encode()
    is_identified(digits_in_text(title) | digits_in_columns(title.split()), problem.stamp)
    if not (claims.has_point or unsolved) and claims.status is Status.UNKNOWN:
        raise SolutionError(f"the model has no values yet; solve it with {package.solve}")
    if claims.has_point:
        raw = _read_values(package.values(values, problem), problem)
    else:
        raw = solution_without_point(claims.status.without_point, claims.words)
    return replace(
        raw,
        status=claims.status if claims.has_point else raw.status,
        message=claims.words,
        objective=claims.objective if claims.has_point else None,
        bound=claims.bound,
        reader=package.name,
    )


def _package_of(thing: object) -> Package | None:
    return next((package for package in PACKAGES.values() if package.is_model(thing)), None)


def _read_values(values: Any, problem: Problem) -> RawSolution:
    """Read values by name or in the order of the columns. Raises InputError for anything else."""
    if isinstance(values, str | Path):
        raise InputError("this names a file; cf.read_solution(path, problem) reads it")
    if hasattr(values, "index") and hasattr(values, "to_numpy"):  # a pandas Series
        values = dict(zip(values.index, values.to_numpy(), strict=True))
    if isinstance(values, Mapping):
        names, array = list(map(str, values)), float_array(list(values.values()), "values")
    else:
        names, array = problem.column_names, float_array(values, "values")
        if array.shape != (problem.n_columns,):
            raise InputError(
                f"values have the shape {array.shape}; give one for each of {problem.n_columns} columns"
            )
    listed, numbers = named_values(names, array)
    stamps = digits_in_columns(listed.tolist())
    return RawSolution(Status.FEASIBLE, "", None, listed, numbers, stamps=stamps)
