"""Parts of a declared formulation: families of terms and rows, options, and their table.

A formulation is a function that yields its families from top to bottom. Its parameters are its options, the
first line of its docstring is its summary, and the decorator `formulation` states everything else about it.
This is the only place that describes a formulation.
"""

from __future__ import annotations

import difflib
import inspect
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cache, cached_property
from types import MappingProxyType
from typing import Any, Final, Literal, get_args

from ..arguments import check_choice, check_flag
from ..errors import FormulationError, shortened
from .expressions import Expression, Operand, Relation, Symbol, Term, expression_of, sum_of
from .symbols import (
    BOUNDED,
    SLOTS,
    VARIABLES,
    IndexMap,
    IndexSet,
    Variable,
    d_round,
    step_slots,
)

Facet = Literal["hull", "printed"]
FACETS: Final[tuple[str, ...]] = get_args(Facet)
TERM_NORMS: Final = (1, 2)

I: Final[IndexSet] = "pixels"  # noqa: E741 - the paper's letter
S_C: Final[IndexSet] = "strokes"
E: Final[IndexSet] = "pairs"
C: Final[IndexSet] = "cycles"


@dataclass(frozen=True)
class Family:
    """One expression over one index set: a term of the objective, or a row.

    tag: short name, the stem of row names; a row's expression is a relation. paper: its place in the paper.
    only: (`p_min`, `p_max` or `is_open`, parity) for rows that are needed only where it has this parity, else
    None. steps, rolled: for cycles of so many steps, as `unrolled` returns it, and the family before.
    """

    tag: str
    over: IndexSet
    expression: Expression | Relation
    paper: str
    only: tuple[str, int] | None = None
    steps: int = 0
    rolled: Family | None = None

    def unrolled(self, steps: int) -> Family:
        """The family for cycles of so many steps alone, with a term for each step."""
        symbols = list(step_slots(steps))
        steps_along = (d * sign for d, sign in zip(symbols[:steps], symbols[steps:], strict=True))
        expression = self.expression.substitute({d_round: sum_of(steps_along)})
        return replace(self, tag=f"{self.tag}{steps}", expression=expression, steps=steps, rolled=self)

    @property
    def slots(self) -> dict[Symbol, tuple[str, IndexMap]]:
        """What its symbols mean: quantity and way to it."""
        return step_slots(self.steps) | SLOTS[self.over] if self.steps else SLOTS[self.over]

    @property
    def is_row(self) -> bool:
        """Whether the family is a row; otherwise it is a term of the objective."""
        return isinstance(self.expression, Relation)

    @property
    def relation(self) -> Relation:
        """The expression of a row."""
        assert isinstance(self.expression, Relation)
        return self.expression

    @property
    def body(self) -> Expression:
        """The term itself, or left minus right side of a row."""
        e = self.expression
        return e.left - e.right if isinstance(e, Relation) else e

    @property
    def sense(self) -> str:
        """Relation `>=`, `<=` or `==` of a row, empty for a term of the objective."""
        return self.expression.sense if isinstance(self.expression, Relation) else ""

    @property
    def symbols(self) -> list[Symbol]:
        """Its symbols that are quantities on the grid, in the order of the notation."""
        present = self.expression.symbols
        return [symbol for symbol in self.slots if symbol in present]

    def unknowns(self, fixed: tuple[str, ...] = ()) -> list[Symbol]:
        """Its symbols that denote variables, without the fixed ones."""
        return [
            symbol
            for symbol in self.symbols
            if (quantity := self.slots[symbol][0]) in VARIABLES and quantity not in fixed
        ]


def term(tag: str, over: IndexSet, expression: Operand, paper: str = "") -> Family:
    """A term of the objective: the sum over an index set. paper: by default the formulation's section."""
    return Family(tag, over, expression_of(expression), paper)


def row(
    number: int | str,
    over: IndexSet,
    relation: Relation,
    paper: str = "",
    *,
    only: tuple[str, int] | None = None,
) -> Family:
    """A row for each element of an index set; number: the paper's equation, or a tag."""
    tag = f"c{number}" if isinstance(number, int) else number
    return Family(tag, over, relation, paper or f"({number})", only)


@dataclass(frozen=True)
class Options:
    """Choices that a formulation leaves open.

    facet of z; norms of the two terms; relax: integrality dropped; limits: whether residuals are limited to
    what no change of one jump improves (`limit_residuals`).
    """

    facet: Facet = "hull"
    stroke_norm: int = 2
    beta_norm: int = 2
    relax: bool = False
    limits: bool = False

    @property
    def document(self) -> dict[str, Any]:
        """The options as files record them: the last one only where it is chosen, for older files."""
        return {k: value for k, value in vars(self).items() if k != "limits" or value}

    def __repr__(self) -> str:
        return f"Options({', '.join(f'{name}={value!r}' for name, value in self.document.items())})"


@dataclass(frozen=True)
class Declaration:
    """A line of the table of formulations.

    name; paper: its section, or `ours`; kind: the usual name of its class; short: its name in identifiers of
    library entries; minimises: its objective, in the same words for formulations with the same optimum;
    how: why it is equivalent to the others with these words; families: function that yields terms, rows for
    the options that it takes; fixed: variables that are data; orthogonal: whether it is for orthogonal
    crosses only.
    """

    name: str
    paper: str
    kind: str
    short: str
    minimises: str
    how: str
    families: Callable[..., Iterator[Family]]
    fixed: tuple[str, ...] = ()
    orthogonal: bool = False

    @property
    def source(self) -> str:
        """Origin: a section of the paper, or `ours`."""
        return f"section {self.paper}" if self.paper[0].isdigit() else self.paper

    @property
    def summary(self) -> str:
        """One line on the feature that distinguishes the formulation."""
        first = (inspect.getdoc(self.families) or "").splitlines()[0].rstrip(".")
        return first[0].lower() + first[1:]

    @cached_property
    def defaults(self) -> Options:
        """The default options."""
        parameters = inspect.signature(self.families).parameters.values()
        return Options(**{parameter.name: parameter.default for parameter in parameters})

    @cached_property
    def option_names(self) -> frozenset[str]:
        """Names of the options that may be chosen; `relax` if a variable is an integer."""
        return frozenset(inspect.signature(self.families).parameters) | (
            {"relax"} if not self.fixed else set()
        )

    @property
    def equivalent(self) -> str:
        """The first other formulation with the same optimum, empty if there is none."""
        same = (
            declaration.name
            for declaration in FORMULATIONS.values()
            if declaration.minimises == self.minimises
        )
        return next((name for name in same if name != self.name), "")

    def with_options(self, options: Options) -> Formulation:
        """The formulation with options that `options` returned."""
        arguments = {name: getattr(options, name) for name in inspect.signature(self.families).parameters}
        families = [
            family if family.paper else replace(family, paper=self.paper)
            for family in self.families(**arguments)
        ]
        objective = tuple(family for family in families if not family.is_row)
        return Formulation(self, options, objective, tuple(family for family in families if family.is_row))

    def options(self, chosen: Mapping[str, Any]) -> Options:
        """The default options and the chosen ones. Raises FormulationError for a wrong option."""
        known = Options.__dataclass_fields__
        for key, value in chosen.items():
            check_choice("option", key, known, FormulationError)
            if key not in self.option_names and value != getattr(self.defaults, key):
                raise FormulationError(
                    f"{self.name} has no option {key}; it is always {getattr(self.defaults, key)}"
                )
        options = replace(self.defaults, **chosen)
        for name in ("relax", "limits"):
            check_flag(name, getattr(options, name), FormulationError)
        check_choice("facet", options.facet, FACETS, FormulationError)
        for name in ("stroke_norm", "beta_norm"):
            if getattr(options, name) not in TERM_NORMS:
                raise FormulationError(f"{name} is {getattr(options, name)}; give 1 or 2")
        # NumPy's numbers are written differently, and the options are a part of the problem's hash.
        norms = int(options.stroke_norm), int(options.beta_norm)
        return Options(options.facet, *norms, bool(options.relax), bool(options.limits))


@dataclass(frozen=True)
class Formulation:
    """A declared formulation with its options chosen: terms of the objective and rows, in order.

    lifted: how products were lifted, empty if they were not.
    """

    declaration: Declaration
    options: Options
    objective: tuple[Family, ...]
    rows: tuple[Family, ...]
    lifted: str = ""

    @property
    def name(self) -> str:
        """Its name in the table."""
        return self.declaration.name

    @property
    def variables(self) -> tuple[str, ...]:
        """Names of the blocks of columns, in the order of VARIABLES."""
        used = {
            family.slots[symbol][0] for family in (*self.objective, *self.rows) for symbol in family.symbols
        }
        return tuple(name for name in VARIABLES if name in used and name not in self.declaration.fixed)

    def variable(self, name: str) -> Variable:
        """The declaration of a block of columns."""
        return (BOUNDED if self.declaration.orthogonal else VARIABLES)[name]

    @property
    def equivalent(self) -> str:
        """Another formulation of the same problem, empty if there is none; relaxations have none."""
        return "" if self.options.relax else self.declaration.equivalent

    @property
    def has_only_fields(self) -> bool:
        """Whether every feasible point is a field's; a relaxation and the printed facet allow other z."""
        return not self.options.relax and self.options.facet != "printed"

    @property
    def is_weakened(self) -> bool:
        """Whether lifting has made the formulation a relaxation of itself.

        Between its facets z is p1 beta_i only at p1 = 0 and 1, and here p1 may lie between.
        """
        return bool(self.lifted) and self.options.relax

    @property
    def is_convex(self) -> bool:
        """Whether its continuous relaxation is convex as written: linear rows, a sum of squares."""
        return _is_convex(self.objective, self.rows, self.declaration.fixed)

    @property
    def has_convex_objective(self) -> bool:
        """Whether its objective is a sum of squares as written."""
        return _is_convex(self.objective, (), self.declaration.fixed)


@cache
def _is_convex(objective: tuple[Family, ...], rows: tuple[Family, ...], fixed: tuple[str, ...]) -> bool:
    """Whether families are convex as written; cached, because the sets of families are few."""
    return all(_degree(family.body, family.unknowns(fixed)) <= 1 for family in rows) and all(
        _is_sum_of_squares(family.body, family.unknowns(fixed)) for family in objective
    )


def _is_sum_of_squares(expression: Expression, unknowns: list[Symbol]) -> bool:
    """Whether every term is linear, or a square of a linear expression that is added."""
    return all(_is_square(summand, unknowns) for summand in expression.terms)


def _is_square(summand: Term, unknowns: list[Symbol]) -> bool:
    if _degree(Expression((summand,)), unknowns) <= 1:
        return True
    factors = [factor for factor in summand.factors if factor[0].symbols & set(unknowns)]
    if len(factors) != 1 or summand.constant.ratio < 0:
        return False
    base, power = factors[0]
    if power == 1 and isinstance(base, Expression):  # times a weight
        return _is_sum_of_squares(base, unknowns)
    return power == 2 and _degree(expression_of(base), unknowns) == 1


def _degree(expression: Expression, unknowns: list[Symbol]) -> float:
    """Degree in the unknowns; infinite for an expression that is not a polynomial."""
    terms = expression.polynomial(unknowns)
    return float("inf") if terms is None else max(map(len, terms), default=0)


_TABLE: Final[dict[str, Declaration]] = {}

FORMULATIONS: Final[Mapping[str, Declaration]] = MappingProxyType(_TABLE)
"""The table of formulations by name; command line, library, docs and tests are generated from it."""


def declaration_of(name: str) -> Declaration:
    """The formulation of a full or short name: `milp` means `milp-mccormick`.

    Raises FormulationError for another word, with the nearest of these names.
    """
    by_name = {declaration.short: declaration for declaration in FORMULATIONS.values()} | dict(FORMULATIONS)
    if name in by_name:
        return by_name[name]
    near = difflib.get_close_matches(name.lower(), by_name, 1)
    raise FormulationError(
        f"there is no formulation {shortened(name)!r}{f' (is it {near[0]}?)' if near else ''}; "
        f"choose one of {', '.join(FORMULATIONS)}, or in short {', '.join(short_names())}"
    )


def short_names() -> list[str]:
    """The short names of all formulations, in the order of the table."""
    return [declaration.short for declaration in FORMULATIONS.values()]


def formulation(
    name: str,
    *,
    paper: str,
    kind: str,
    short: str,
    minimises: str,
    how: str,
    fixed: tuple[str, ...] = (),
    orthogonal: bool = False,
) -> Callable[[Callable[..., Iterator[Family]]], Declaration]:
    """Return a decorator that enters a function that yields families into the table, as its `Declaration`."""

    def enter(families: Callable[..., Iterator[Family]]) -> Declaration:
        assert not {name, short} & {*_TABLE, *short_names()}, f"there are two formulations {name} or {short}"
        _TABLE[name] = Declaration(name, paper, kind, short, minimises, how, families, fixed, orthogonal)
        return _TABLE[name]

    return enter
