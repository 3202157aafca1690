"""A problem as a Pyomo model: for users of Pyomo, and as an independent check of the files.

Every term and row is the declaration itself, evaluated over Pyomo variables. Components are named as in the
files, `alpha[row, column]`, `p1[row, column, side]` with side `u` (upper neighbour) or `r` (right one), row
families by their tag, the objective `obj`. Python work grows with the number of pixels here: the model is
meant for small sketches, `write` for large ones.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable
from typing import Any, Final

import numpy as np
import pyomo.environ as pyo

from ...models.field.field import CrossField
from ...models.formulations.expressions import IN_NUMPY
from ...models.formulations.families import Block, PlacedFamily
from ...models.formulations.names import element_numbers, is_numbered
from ...models.formulations.problem import Problem
from ...models.formulations.symbols import IndexSet, point_of
from ...models.instance.domain import Floats
from ...models.instance.instance import Instance
from ..writing.canonical import CanonicalForm
from .package import title_of

ElementIndex = tuple[Any, ...]
"""(row, column) of a pixel, (row, column, side) of a pair."""

_COMPARE: Final[dict[str, Callable[[Any, Any], Any]]] = {
    ">=": operator.ge,
    "<=": operator.le,
    "==": operator.eq,
}
_FUNCTIONS: Final = {**IN_NUMPY, "cos": pyo.cos}


def to_pyomo(problem: Problem, *, start: CrossField | None = None) -> pyo.ConcreteModel:
    """The model: `Problem.to_pyomo`. Variables are in the order of the columns, so values are a point."""
    model = pyo.ConcreteModel(name=title_of(problem))
    point = None if start is None else problem.point(start)
    form = CanonicalForm(problem)
    for block in problem.blocks.values():
        index = element_indices(problem.instance, block.over)
        model.add_component(block.name, _variables(block, index, _domain(form, block), point))
    columns = [
        variable for block in problem.blocks.values() for variable in model.component(block.name).values()
    ]
    for family in problem.rows:
        model.add_component(family.family.tag, _constraints(family, columns))
    terms = [
        term
        for family in problem.objective
        for term in family.over_objects(family.family.body, columns, _FUNCTIONS)
    ]
    model.obj = pyo.Objective(expr=pyo.quicksum(terms))
    return model


def element_indices(instance: Instance, over: IndexSet) -> list[ElementIndex]:
    """Positions of an index set's elements: (row, column), for a pair of its first pixel, and its side.

    On a mesh they are numbers of faces or of pairs, and of cycles on any domain.
    """
    if is_numbered(instance, over):
        return list(zip(element_numbers(instance, over).tolist(), strict=True))
    grid = instance.grid
    at = point_of(instance, over)
    coordinates = [grid.rows[at].tolist(), grid.columns[at].tolist()]
    if over == "pairs":
        coordinates.append(np.where(grid.upward, "u", "r").tolist())
    return list(zip(*coordinates, strict=True))


def _domain(form: CanonicalForm, block: Block) -> Any:
    """Pyomo's domain of a block; a binary column fixed at 0 or 1 stays binary: bounds are separate."""
    if not block.integer:
        return pyo.Reals
    return pyo.Binary if form.nl_order.binary[block.slice].all() else pyo.Integers


def _variables(block: Block, index: list[ElementIndex], domain: Any, point: Floats | None) -> pyo.Var:
    """The variables of a block of columns."""
    ends = (
        [value if math.isfinite(value) else None for value in bound.tolist()]
        for bound in (block.lower, block.upper)
    )
    bounds = dict(zip(index, zip(*ends, strict=True), strict=True))
    values = {} if point is None else dict(zip(index, point[block.slice].tolist(), strict=True))
    return pyo.Var(
        index,
        domain=domain,
        bounds=lambda _, *place: bounds[place],
        initialize=None if point is None else lambda _, *place: values[place],
    )


def _constraints(family: PlacedFamily, columns: list[Any]) -> pyo.Constraint:
    """The rows of a family, left and right side as declared."""
    declared = element_indices(family.instance, family.family.over)
    index = [declared[element] for element in family.elements.tolist()]
    relation = family.family.relation
    sides = (family.over_objects(side, columns, _FUNCTIONS) for side in (relation.left, relation.right))
    compare = _COMPARE[family.family.sense]
    rows = dict(zip(index, (compare(left, right) for left, right in zip(*sides, strict=True)), strict=True))
    return pyo.Constraint(index, rule=lambda _, *place: rows[place])
