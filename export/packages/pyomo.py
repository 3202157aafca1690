"""Models of Pyomo."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from ...models.errors import SolutionError
from ...models.formulations.families import ANY_DEGREE
from ...models.formulations.problem import Problem
from ..statuses import Status
from .package import Claims, Package, Values, degrees


def _build(problem: Problem, **options: Any) -> Any:
    from .pyomo_model import to_pyomo

    return to_pyomo(problem, **options)


def _claims(model: Any) -> Claims:
    """The title alone: results are another object, of which the user states `status` and `bound`."""
    import pyomo.environ as pyo

    has_point = any(variable.value is not None for variable in model.component_data_objects(pyo.Var))
    return Claims(model.name, Status.FEASIBLE if has_point else Status.UNKNOWN, "", has_point=has_point)


def _values(model: Any, problem: Problem) -> Values:
    """The values of the components that are named as the blocks; columns in no term have none."""
    values = []
    for name in problem.blocks:
        block = model.component(name)
        if block is None:
            raise SolutionError(f"the model has no component {name}; give one of to_pyomo of {problem.name}")
        values += [variable.value for variable in block.values()]
    arbitrary = np.clip(0.0, problem.lower, problem.upper).tolist()
    return [one if value is None else value for value, one in zip(values, arbitrary, strict=False)]


PYOMO: Final = Package(
    "Pyomo",
    "pyomo.environ.ConcreteModel",
    "every problem",
    degrees(ANY_DEGREE, ANY_DEGREE),
    "",
    _build,
    _claims,
    _values,
    "pyomo.environ.SolverFactory(...).solve(model)",
)
