"""A problem: a formulation bound to an instance, as arrays, with values and violations at points.

Writers, solvers and readers see a Problem and never a formulation's name. All arrays come from the
declaration: an expression is split into monomials once per family, index arrays do the rest.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from .. import above
from ..arguments import float_array, whole_numbers
from ..errors import FormulationError, InputError
from ..field.field import CrossField
from ..instance.angles import QUARTER
from ..instance.domain import Bools, Floats, Ints
from ..instance.instance import Instance
from .choice import declare, norm_of, reason_against
from .declaration import Family, Formulation
from .expressions import Operand, expression_of
from .families import ANY_DEGREE, Block, PlacedFamily, merge_terms
from .lifting import lift_products
from .residuals import angles_and_jumps, residual_data
from .symbols import NARROWED, SLOTS, VARIABLES, IndexSet, Variable, constants_of, count_elements, values_at
from .windows import Windows

if TYPE_CHECKING:
    from .arrays import ProblemArrays

STAMP_DIGITS: Final = 11
"""Digits of a hash in names: `ONE_` and these have 15 characters, the most that every program takes."""


@dataclass(frozen=True)
class Violation:
    """The worst violations of a point: of rows, of bounds, of integrality; zero without one."""

    rows: float
    bounds: float
    integrality: float
    worst_family: str

    @property
    def worst(self) -> float:
        """The largest of the three."""
        return max(self.rows, self.bounds, self.integrality)


@dataclass(frozen=True, eq=False)
class Problem:
    """A formulation bound to an instance; `formulate` makes it.

    Its columns are blocks of variables, one after the other, and its rows families of constraints.

    Parameters
    ----------
    instance
        The instance.
    formulation
        The declared formulation with its options.
    jumps
        Jumps that are data, shape (m,), for `qp-fixed`; else None.
    pinned
        Field at whose jumps the integer columns are fixed, or None.
    windows
        Windows narrower than those of the gauge, or None.

    Raises
    ------
    FormulationError
        For jumps that are missing, or that are given to a formulation in which they are variables; for a
        formulation of orthogonal crosses on another instance, or without windows on one of the gauge `box`;
        for one that cannot prescribe the indices of an instance.

    """

    instance: Instance
    formulation: Formulation
    jumps: Ints | None = None
    pinned: CrossField | None = None
    windows: Windows | None = None

    def __post_init__(self) -> None:
        """Check that jumps are given exactly where they are data, and that fixed values fit the instance."""
        if reason := reason_against(self.formulation, self.instance, narrowed=self.windows is not None):
            raise FormulationError(f"{self.name} {reason}")
        if (self.jumps is None) == bool(self.formulation.declaration.fixed):
            raise FormulationError(
                f"{self.formulation.name} takes the jumps of all pairs as data; give p=field.p"
                if self.formulation.declaration.fixed
                else f"{self.formulation.name} has the jumps as variables; leave p out"
            )
        if self.jumps is not None:
            jumps = whole_numbers(self.jumps, "p", FormulationError)
            pairs = count_elements(self.instance, "pairs")
            if jumps.shape != (pairs,):
                raise FormulationError(f"p has shape {jumps.shape}, but the grid has {pairs} pairs")
            object.__setattr__(self, "jumps", jumps)
        if self.pinned is not None:
            self.pinned.check_instance(self.instance)
        if self.windows is not None:
            self.windows.check(self.instance)

    def __repr__(self) -> str:
        return f"<Problem {self.summary}>"

    def _repr_latex_(self) -> str | None:
        """The formulation in formulas, for notebooks; None without SymPy."""
        if find_spec("sympy") is None:
            return None
        from .latex import model

        return f"$$\n{model(self.formulation)}\n$$"

    @property
    def summary(self) -> str:
        """Formulation, class, instance, and how many columns and rows."""
        integers = f" ({count} integer)" if (count := int(self.integer.sum())) else ""
        return (
            f"{self.name}, {self.problem_class} on {self.instance.name}: {self.n_columns} columns{integers}, "
            f"{self.n_rows} rows"
        )

    @property
    def name(self) -> str:
        """Name of its formulation."""
        return self.formulation.name

    @cached_property
    def data(self) -> dict[str, Any]:
        """Arrays that symbols may denote, besides columns."""
        data: dict[str, Any] = {
            "theta": self.instance.target,
            "w": self.instance.w,
            "alpha_lo": self.instance.alpha_lower,
            "alpha_up": self.instance.alpha_upper,
            "beta_lo": np.full(self.instance.domain.size, -QUARTER),
            "beta_up": np.full(self.instance.domain.size, QUARTER),
            "p_min": self.instance.p_min,
            "p_max": self.instance.p_max,
            "kappa": self._of_pairs(self.instance.domain.kappa, 0.0),
            "omega": self._of_pairs(self.instance.pair_weights, 1.0),
        }
        if self.formulation.declaration.orthogonal:
            has_cycles = "k" in self.formulation.variables
            data |= residual_data(self.instance, self.formulation.options.limits, cycles=has_cycles)
        if self.jumps is not None:
            data |= {"p1": self.jumps & 1, "p2": self.jumps >> 1}
        return data if self.windows is None else data | self.windows.data

    def _of_pairs(self, values: Floats | None, default: float) -> Floats:
        return np.full(count_elements(self.instance, "pairs"), default) if values is None else values

    def variable(self, name: str) -> Variable:
        """The declaration of a block of columns, with bounds in `data`."""
        return NARROWED[name] if name == "beta" and self.windows else self.formulation.variable(name)

    @property
    def tightened(self) -> str:
        """How its windows were narrowed, one line; empty if they were not."""
        if self.windows is None:
            return ""
        if self.formulation.options.relax:
            return f"{self.windows.summary}; the relaxation may rise"
        if norm_of(self.formulation.declaration, self.formulation.options) == self.windows.norm:
            return f"{self.windows.summary}; the optimum stays"
        return f"{self.windows.summary}; in another norm the optimum may rise"

    @property
    def limited(self) -> str:
        """A line on the fields that limits or prescribed indices exclude; empty without them."""
        if (indices := self.instance.indices) is not None:
            return f"the indices of {len(indices)} vertices are prescribed, and |A| and |R| are at most pi/4"
        if not self.formulation.options.limits:
            return ""
        effect = "the relaxation may rise" if self.formulation.options.relax else "the optimum stays"
        return (
            "|A| and |R| at most pi/4 (1 - r), r the effective resistance of the pair or stroke times its "
            f"conductance; this cuts off fields that a change of one jump improves, and {effect}"
        )

    @cached_property
    def blocks(self) -> dict[str, Block]:
        """Blocks of columns by name, in column order."""
        blocks: dict[str, Block] = {}
        offset = 0
        for name in self.formulation.variables:
            variable = self.variable(name)
            shape = (count_elements(self.instance, variable.over),)
            lower, upper = (
                np.broadcast_to(unbounded if bound is None else self._value(bound), shape)
                for bound, unbounded in ((variable.lower, -np.inf), (variable.upper, np.inf))
            )
            integer = variable.integer and not self.formulation.options.relax
            if self.pinned is not None and variable.integer:
                lower = upper = _at_field(self, name, _angles_and_jumps(self.pinned))
                integer = False
            blocks[name] = Block(name, variable.over, offset, lower, upper, integer)
            offset += shape[0]
        return blocks

    def _value(self, bound: Operand) -> Floats:
        """Values of a bound: one for each element, or one for all."""
        expression = expression_of(bound)
        values = {symbol: self.data[symbol.name] for symbol in expression.symbols}
        return np.asarray(expression.evaluate(values), np.float64)

    @property
    def n_columns(self) -> int:
        """Number of columns."""
        return sum(block.count for block in self.blocks.values())

    @property
    def column_names(self) -> list[str]:
        """Names of all columns, as in files."""
        from .names import column_names, decode_names

        names: list[str] = decode_names(column_names(self.instance, self.blocks)).tolist()
        return names

    @property
    def row_names(self) -> list[str]:
        """Names of all rows, as in files."""
        from .names import decode_names, row_names

        names: list[str] = decode_names(row_names(self.rows)).tolist()
        return names

    @cached_property
    def lower(self) -> Floats:
        """Lower bounds of all columns."""
        return np.concatenate([block.lower for block in self.blocks.values()])

    @cached_property
    def upper(self) -> Floats:
        """Upper bounds of all columns."""
        return np.concatenate([block.upper for block in self.blocks.values()])

    @cached_property
    def integer(self) -> Bools:
        """True for integer columns."""
        return np.concatenate([np.full(block.count, block.integer) for block in self.blocks.values()])

    @cached_property
    def objective(self) -> tuple[PlacedFamily, ...]:
        """Terms of the objective bound to the instance, empty ones left out."""
        return self._place_families(self.formulation.objective)

    @cached_property
    def rows(self) -> tuple[PlacedFamily, ...]:
        """Families of rows bound to the instance, in row order, empty ones left out."""
        return self._place_families(self.formulation.rows)

    def _place_families(self, families: tuple[Family, ...]) -> tuple[PlacedFamily, ...]:
        placed = (
            PlacedFamily(family, elements, self.instance, self.blocks, self.data)
            for family, elements in self._list_elements(families)
        )
        return tuple(family for family in placed if family.count)

    def _list_elements(self, families: tuple[Family, ...]) -> Iterator[tuple[Family, Ints]]:
        """The families with their elements; one family for each length of cycles."""
        for family in families:
            elements = self._elements(family)
            if family.over != "cycles":
                yield family, elements
                continue
            steps = np.diff(self.instance.cycles.start)[elements]
            for count in np.unique(steps).tolist():
                yield family.unrolled(count), elements[steps == count]

    def _elements(self, family: Family) -> Ints:
        if family.only is None:
            return self._index_sets[family.over]
        name, parity = family.only
        return np.flatnonzero(self.data[name] & 1 == parity).astype(np.int32)

    @cached_property
    def _index_sets(self) -> dict[IndexSet, Ints]:
        """The numbers of all elements by index set, shared by the families over it."""
        sets = {family.over for family in (*self.formulation.objective, *self.formulation.rows)}
        return {over: np.arange(count_elements(self.instance, over), dtype=np.int32) for over in sets}

    @property
    def n_rows(self) -> int:
        """Number of rows."""
        return sum(family.count for family in self.rows)

    @cached_property
    def objective_degree(self) -> int:
        """Degree of the objective; 99 if it is not a polynomial."""
        return max((family.degree for family in self.objective), default=0)

    @cached_property
    def row_degree(self) -> int:
        """Greatest degree of a row; 99 if one is not a polynomial, 0 without rows."""
        return max((family.degree for family in self.rows), default=0)

    @property
    def problem_class(self) -> str:
        """LP, MILP, QP, MIQP, QCP, MIQCP, NLP or MINLP; `is_convex` states whether a QP is."""
        integer = "MI" if self.integer.any() else ""
        if max(self.objective_degree, self.row_degree) > 2:
            return f"{integer}NLP"
        if self.row_degree == 2:
            return f"{integer}QCP"
        if self.objective_degree == 2:
            return f"{integer}QP"
        return f"{integer}LP"

    @property
    def is_convex(self) -> bool:
        """Whether its continuous relaxation is known to be convex."""
        return self.formulation.is_convex

    def merged_objective(self, degree: int, *, up_to: int = ANY_DEGREE) -> tuple[Ints, Floats]:
        """Monomials of the objective: columns (k, degree), each set once, sorted, and coefficients (k,).

        degree: 0 for the constant, whose k is 1. up_to: greatest degree of the terms that are counted.
        Coefficients that cancel are left out.
        """
        return merge_terms(self.objective, degree, self.n_columns, up_to=up_to)

    def with_integers_fixed(self, field: CrossField) -> Problem:
        """Return the problem with its integer columns fixed at the jumps of a field: a continuous problem.

        Fixed columns stay, with equal bounds; names and order do not change. Raises InstanceError for a field
        on another instance.
        """
        return replace(self, pinned=field)

    def to_arrays(self, *, names: bool = True) -> ProblemArrays:
        """Return the problem up to degree 2 as NumPy arrays and SciPy matrices.

        names: whether to make the names of columns and rows. `nonlinear` of the arrays lists the parts that
        they do not contain.
        """
        from .arrays import problem_arrays  # it loads SciPy, which files do not need
        from .names import column_names, row_names

        columns = self.lower, self.upper, self.integer
        named = (column_names(self.instance, self.blocks), row_names(self.rows)) if names else None
        return problem_arrays(self.objective, self.rows, columns, named)

    def to_highs(self) -> Any:
        """Return a `highspy.Highs` with the problem, passed by arrays; its output is switched off.

        This and the other conversions hold the same columns and rows, under the names of the files, and the
        stamp, so that `solution` identifies the problem. A QP without rows has one empty row, because HiGHS
        may otherwise stop far above the optimum. Raises MissingSolverError without the package, and
        UnsupportedBySolverError when the problem is neither an LP or MILP nor a convex QP.
        """
        return above.packages().convert("highs", self)

    def to_gurobi(self) -> Any:
        """Return a `gurobipy.Model` with the problem; its output is switched off.

        Products are lifted beyond degree 2. Raises as `to_highs`, here for cosines.
        """
        return above.packages().convert("gurobi", self)

    def to_scip(self) -> Any:
        """Return a `pyscipopt.Model` with the problem; its output is switched off.

        Raises MissingSolverError without the package.
        """
        return above.packages().convert("scip", self)

    def to_linopy(self) -> Any:
        """Return a `linopy.Model` with the problem, with one variable per block of columns.

        Products in rows and beyond degree 2 are lifted. Raises as `to_highs`, here for cosines.
        """
        return above.packages().convert("linopy", self)

    def to_pyomo(self, *, start: CrossField | None = None) -> Any:
        """Return a Pyomo model with the problem; its objective is `obj`.

        Variables have indices (row, column) of a pixel, or (row, column, side) of a pair, where side is `u`
        or `r`. On a mesh the indices are numbers of faces and pairs. `start` is a field whose point is the
        initial value of every variable. Raises InstanceError for a start on another instance.
        """
        return above.packages().convert("pyomo", self, start=start)

    def solution(
        self,
        values: Any,
        *,
        status: str = "",
        bound: float | None = None,
        gap: float | None = None,
        tolerance: float | None = None,
    ) -> Any:
        """Check an answer in memory as `read_solution` checks a file.

        Parameters
        ----------
        values
            Values in the order of the columns, a dictionary or pandas Series by name, or a model that was
            solved: a `highspy.Highs`, `gurobipy.Model`, `pyscipopt.Model` or `linopy.Model`, or the Pyomo
            model of `to_pyomo`.
        status
            Status or the program's word for it. By default that of the model; a Pyomo model has none.
        bound
            Dual bound that the program has proven. The greater of this one and the model's counts.
        gap
            Relative gap that the program was given, if it calls its point optimal without a bound.
        tolerance
            Largest violation of a feasible point, in units of a column; 1e-5 by default.

        Returns
        -------
        Solution
            The point, the claims, and the recomputed values. Only a bound that closes the gap proves an
            optimum, or the word of a program that searches to the end.

        Raises
        ------
        InputError
            For values that are none of these, and for a bound or gap out of range.
        SolutionError
            For values of another problem, and for a model that was not solved.

        """
        return above.packages().check_values(
            self, values, status=status, bound=bound, gap=gap, tolerance=tolerance
        )

    def objective_value(self, point: Floats) -> float:
        """The objective at a point (columns,). Raises InputError for another shape."""
        point = self._check_point(point)
        return float(sum(np.sum(family.values(point)) for family in self.objective))

    def violation(self, point: Floats) -> Violation:
        """The worst violations of rows, bounds and integrality at a point (columns,).

        Raises InputError for another shape.
        """
        point = self._check_point(point)
        worst = {family.family.tag: float(np.max(family.excess(point))) for family in self.rows}
        tag = max(worst, key=lambda name: worst[name], default="")
        bounds = np.maximum(np.maximum(self.lower - point, point - self.upper), 0.0)
        gaps = np.abs(point - np.round(point))[self.integer]
        return Violation(
            rows=max(worst.get(tag, 0.0), 0.0),
            bounds=float(bounds.max(initial=0.0)),
            integrality=float(gaps.max(initial=0.0)),
            worst_family=tag,
        )

    def point(self, field: CrossField) -> Floats:
        """The complete point of a field: angles, jumps, and every other column at its value for them.

        Raises InstanceError when the field is on another instance.
        """
        field.check_instance(self.instance)
        quantities = _angles_and_jumps(field)
        return np.concatenate([_at_field(self, name, quantities) for name in self.blocks])

    def field(self, point: Floats) -> CrossField:
        """The cross field of a point (columns,), jumps rounded.

        Raises InputError for another shape, and InstanceError for jumps beyond 32 bits.
        """
        point = self._check_point(point)
        if "k" in self.blocks:
            residuals = (point[self.blocks[name].slice] for name in ("d", "q"))
            alpha, turns = angles_and_jumps(self.instance, *residuals)
            return CrossField(self.instance, alpha, np.zeros(len(alpha)), whole_numbers(turns, "p"))
        if self.jumps is not None:
            jumps = self.jumps
        elif "p" in self.blocks:
            jumps = whole_numbers(np.round(point[self.blocks["p"].slice]), "p")
        else:
            halves = np.round(point[self.blocks["p2"].slice])
            jumps = whole_numbers(np.round(point[self.blocks["p1"].slice] + 2 * halves), "p")
        alpha = point[self.blocks["alpha"].slice]
        beta = np.zeros(len(alpha)) if self.instance.orthogonal else point[self.blocks["beta"].slice]
        return CrossField(self.instance, alpha, beta, jumps)

    def _check_point(self, point: Floats) -> Floats:
        values = float_array(point, "point")
        if values.shape != (self.n_columns,):
            raise InputError(
                f"point has shape {values.shape}; give one value for each of {self.n_columns} columns"
            )
        return values

    @cached_property
    def sha256(self) -> str:
        """64 hexadecimal digits that identify instance, formulation, options and jumps."""
        return self._digest(self.formulation.lifted)

    @cached_property
    def stamp(self) -> str:
        """`sha256_` and the first 11 digits of the hash before products were lifted.

        Manifests hold this hash; the stamp is short enough for names.
        """
        return f"sha256_{self._digest('')[:STAMP_DIGITS]}"

    @property
    def is_recordable(self) -> bool:
        """Whether formulation, options, jumps and windows determine it; nothing is fixed or lifted."""
        return self.pinned is None and not self.formulation.lifted

    @cached_property
    def lifted(self) -> Problem:
        """The problem with each p1 beta_i lifted to z, for formats up to quadratic.

        Relaxed, it is weaker (`Formulation.is_weakened`). Raises FormulationError for cosines.
        """
        if self.objective_degree == ANY_DEGREE:
            raise FormulationError(
                f"{self.name} has cosines, which no lifting removes; "
                f"choose {self.formulation.equivalent or 'another formulation'}"
            )
        return replace(self, formulation=lift_products(self.formulation))

    def _digest(self, lifting: str) -> str:
        text = f"{self.instance.sha256} {self.formulation.name} {self.formulation.options} {lifting}"
        digest = hashlib.sha256(text.encode())
        for jumps in (self.jumps, None if self.pinned is None else self.pinned.p):
            digest.update(b"" if jumps is None else jumps.astype("<i4").tobytes())
        if self.windows is not None:
            digest.update(self.windows.bytes)
        return digest.hexdigest()


def _angles_and_jumps(field: CrossField) -> dict[str, Any]:
    p = field.p.astype(np.int64)
    return {"alpha": field.alpha, "beta": field.beta, "p": p, "p1": p & 1, "p2": p >> 1}


def _at_field(problem: Problem, name: str, quantities: dict[str, Any]) -> Floats:
    """The block of columns `name` at given angles and jumps, by the variable's definition."""
    if name in quantities:
        return np.asarray(quantities[name], dtype=np.float64)
    variable = VARIABLES[name]
    value = expression_of(variable.value).substitute(constants_of(problem.instance))
    sources, slots = problem.data | quantities, SLOTS[variable.over]
    values = {
        symbol: values_at(problem.instance, kind, sources[quantity])
        for symbol in value.symbols
        for quantity, kind in [slots[symbol]]
    }
    return np.asarray(value.evaluate(values), dtype=np.float64)


def formulate(instance: Instance, name: str, *, p: Ints | None = None, **options: Any) -> Problem:
    """Bind a formulation to an instance. docs/formulations.md has the formulas.

    Parameters
    ----------
    instance
        The instance.
    name
        Full or short name of a formulation, as `crossfield list` shows them.
    p
        Jumps of the pairs, shape (m,), for `qp-fixed` only.
    options
        Where the formulation has them: `facet` (`hull` or `printed`), `stroke_norm` and `beta_norm` (1 or 2),
        `relax` (True makes integers continuous), and `limits` (True cuts off fields that a change of one jump
        improves).

    Raises
    ------
    FormulationError
        For an unknown name, option or value, and for a formulation that the instance cannot have.

    """
    return Problem(instance, declare(name, instance, **options), p)
