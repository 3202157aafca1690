"""Statistics of a problem: columns, rows and terms by kind as in MINLPLib, and curvature."""

from __future__ import annotations

from collections import Counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ....models.formulations.arrays import ProblemArrays
from ....models.formulations.families import PlacedFamily
from ....models.formulations.problem import Problem
from ....models.instance.grid import Bools, Floats
from ....models.instance.instance import Instance
from ...writing.canonical import Canonical
from ...writing.curvature import of_objective, of_rows


def sizes(instance: Instance) -> dict[str, int]:
    """Return the numbers of pixels, stroke pixels and pairs."""
    grid = instance.grid
    return {"pixels": grid.size, "strokes": len(instance.theta), "pairs": len(grid.first)}


def density(instance: Instance) -> float:
    """Return the share of the pixels that are strokes, to four decimals."""
    return round(len(instance.theta) / instance.grid.size, 4)


def counts(problem: Problem) -> dict[str, int]:
    """Return the numbers of columns, rows, nonzeros and terms by kind."""
    return _columns(problem) | _rows(problem) | _terms(problem)


def _columns(problem: Problem) -> dict[str, int]:
    form = Canonical(problem)
    binary, integer = form.binary, problem.integer
    nonlinear = form.layout.in_objective | form.layout.in_rows
    return {
        "variables": problem.n_columns,
        "continuous": int((~integer).sum()),
        "binary": int(binary.sum()),
        "integer": int((integer & ~binary).sum()),
        "nonlinear_variables": int(nonlinear.sum()),
        "nonlinear_binary": int((nonlinear & binary).sum()),
        "nonlinear_integer": int((nonlinear & integer & ~binary).sum()),
    }


def _rows(problem: Problem) -> dict[str, int]:
    kinds = ("linear", "quadratic", "polynomial", "general")
    by_kind = Counter({f"{kind}_constraints": 0 for kind in kinds})
    for family in problem.rows:
        degree = family.degree  # 99 for other families than polynomials
        kind = kinds[0 if degree <= 1 else 1 if degree == 2 else 2 if degree < 99 else 3]
        by_kind[f"{kind}_constraints"] += family.count
    return {
        "constraints": problem.n_rows,
        "equalities": sum(f.count for f in problem.rows if f.family.sense == "=="),
        **by_kind,
        "nonzeros": sum(len(f.variables) * f.count for f in problem.rows),
        "nonlinear_nonzeros": sum(_nonlinear_variables(f) * f.count for f in problem.rows),
    }


def _nonlinear_variables(family: PlacedFamily) -> int:
    """Columns in nonlinear terms of each row of a family."""
    if family.terms is None:
        return len(family.variables)
    return len({symbol for term in family.terms if term.degree > 1 for symbol in term.symbols})


def row_classes(problem: Problem) -> dict[str, int]:
    """Return the numbers of linear rows by the class that MIPLIB 2017 gives them, by name.

    A row belongs to the first class that fits, with binary columns replaced by their complements if needed.
    """
    arrays = problem.to_arrays(names=False)
    linear = np.zeros(problem.n_rows, dtype=bool)
    for family in problem.rows:
        linear[arrays.family_rows[family.family.tag]] = family.degree <= 1
    names, numbers = np.unique(classes_of_rows(arrays)[linear], return_counts=True)
    return dict(zip(names.tolist(), numbers.tolist(), strict=True))


def classes_of_rows(arrays: ProblemArrays) -> NDArray[np.str_]:
    """Return the class of each row, as if it were linear."""
    rows, m = arrays.a.tocoo(), arrays.a.shape[0]
    at, column = rows.coords
    above = np.isfinite(arrays.row_upper)
    value = rows.data * np.where(above, 1.0, -1.0)[at]  # all rows as equations or with an upper side
    side = np.where(above, arrays.row_upper, -arrays.row_lower)
    equal = arrays.row_lower == arrays.row_upper
    is_binary = (arrays.integer & (arrays.lower == 0) & (arrays.upper == 1))[column]

    def number(which: Bools) -> NDArray[np.intp]:
        return np.bincount(at[which], minlength=m)

    count, binary, integer = number(value != 0), number(is_binary), number(arrays.integer[column])
    units, whole = number(np.abs(value) == 1) == count, number(value == np.round(value)) == count
    complement = side + np.bincount(at, np.where(is_binary & (value < 0), -value, 0.0), m)
    opposite = np.bincount(at, value, m) == 0
    same = (binary == count) | (integer == 0) | ((integer == count) & (binary == 0))
    largest = np.zeros(m)
    np.maximum.at(largest, at, np.abs(value))
    two, all_binary = count == 2, binary == count
    sets, sums = all_binary & units, all_binary & whole
    fits = {
        "empty": count == 0,
        "singleton": count == 1,
        "aggregation": equal & two,
        "precedence": ~equal & two & opposite & same,
        "variable bound": ~equal & two & (binary > 0),
        "set partitioning": sets & equal & (complement == 1),
        "set packing": sets & ~equal & (complement == 1),
        "set covering": sets & ~equal & (complement == count - 1),
        "cardinality": sets & equal,
        "invariant knapsack": sets & ~equal,
        "equation knapsack": sums & equal,
        "bin packing": sums & ~equal & (largest == complement),
        "knapsack": sums & ~equal,
        "integer knapsack": (integer == count) & ~equal & whole,
        "mixed binary": (binary > 0) & (integer == binary),
    }
    return np.select(list(fits.values()), list(fits), default="general linear")


def _terms(problem: Problem) -> dict[str, int]:
    degree = problem.objective_degree
    higher = range(3, degree + 1) if degree < 99 else range(3, 5)
    general = sum(family.count for family in problem.objective if family.terms is None)
    return {
        "objective_linear_terms": len(problem.merged_objective(1)[1]),
        "objective_quadratic_terms": len(problem.merged_objective(2)[1]),
        "objective_higher_terms": sum(len(problem.merged_objective(each)[1]) for each in higher),
        "objective_general_terms": general,
    }


def curvature(problem: Problem) -> dict[str, Any]:
    """Return the curvature of objective and rows, and the reason for the former."""
    objective, reason = of_objective(problem)
    return {"objective": objective, "constraints": of_rows(problem), "reason": reason}


def tangent_bound(problem: Problem, point: Floats) -> float | None:
    """A lower bound of a convex quadratic objective over finite bounds, from a tangent, or None.

    f(x) >= f(x0) + g (x - x0), whose least value over the box is found coordinate by coordinate.
    """
    if problem.rows or problem.integer.any() or of_objective(problem)[0] != "convex":
        return None
    slope = np.zeros(problem.n_columns)
    index, cost = problem.merged_objective(1)
    slope[index[:, 0]] += cost
    index, value = problem.merged_objective(2)
    np.add.at(slope, index[:, 0], value * point[index[:, 1]])
    np.add.at(slope, index[:, 1], value * point[index[:, 0]])
    falls = np.minimum(slope * (problem.lower - point), slope * (problem.upper - point))
    return problem.objective_value(point) + float(np.minimum(falls, 0.0).sum())
