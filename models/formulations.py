"""The nine formulations, each declared once in the paper's notation.

A declaration is a tuple of families: an objective term or a row as a SymPy expression, and the index set it runs over. Files,
NumPy evaluation, Pyomo models and the formulas of the docs are all readings of these expressions. Equation numbers are the paper's.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any, Final, Literal, get_args

import sympy as sp

from .errors import FormulationError
from .notation import (
    B_LIFTED,
    SLOTS,
    VARIABLES,
    A,
    B,
    IndexSet,
    R,
    beta,
    beta_i,
    beta_j,
    d,
    gamma,
    p,
    p1,
    p2,
    p_max,
    p_min,
    pi,
    psi,
    s,
    t,
    u,
    w,
    w_beta,
    w_strokes,
    z,
)

Facet = Literal["hull", "printed"]
FACETS: Final[tuple[str, ...]] = get_args(Facet)
NORMS: Final = (1, 2)


@dataclass(frozen=True)
class Family:
    """One expression over one index set: a term of the objective, or a row.

    tag: short name, the stem of row names; a row's expression is a relation. paper: where it comes from.
    only: (`p_min` or `p_max`, parity) for rows that are needed only where it has this parity, else None.
    """

    tag: str
    over: IndexSet
    expression: sp.Expr
    paper: str
    only: tuple[str, int] | None = None

    @property
    def body(self) -> sp.Expr:
        """The term itself, or left minus right side of a row."""
        e = self.expression
        return e.lhs - e.rhs if e.is_Relational else e

    @property
    def sense(self) -> str:
        """`>=`, `<=` or `==` for a row, empty for a term of the objective."""
        e = self.expression
        return {"Eq": "=="}.get(e.func.__name__, e.rel_op) if e.is_Relational else ""

    @property
    def symbols(self) -> list[sp.Symbol]:
        """Its symbols that are quantities on the grid, in the order of the notation."""
        present = self.expression.free_symbols
        return [symbol for symbol in SLOTS[self.over] if symbol in present]


@dataclass(frozen=True)
class Options:
    """What a formulation leaves open: facet of z, norms of the stroke and the skew term, integrality dropped."""

    facet: Facet = "hull"
    stroke_norm: int = 2
    beta_norm: int = 2
    relax: bool = False


@dataclass(frozen=True)
class Formulation:
    """A declared formulation: names, families, and what is known of it.

    fixed: variables that are data (p1, p2 of `qp-fixed`); convex: of the continuous relaxation;
    equivalent: another formulation of the very same problem, empty for a relaxation; lifted: how products were lifted, empty when they were not.
    """

    name: str
    paper: str
    summary: str
    options: Options
    objective: tuple[Family, ...]
    rows: tuple[Family, ...]
    convex: bool
    fixed: tuple[str, ...] = ()
    equivalent: str = ""
    lifted: str = ""

    @property
    def variables(self) -> tuple[str, ...]:
        """Names of the blocks of columns, in the order of VARIABLES."""
        used = {
            SLOTS[family.over][symbol][0]
            for family in (*self.objective, *self.rows)
            for symbol in family.symbols
        }
        return tuple(name for name in VARIABLES if name in used and name not in self.fixed)

    @property
    def weakened(self) -> bool:
        """Whether lifting made it a relaxation of itself: z between its facets is p1 beta_i at p1 = 0 and 1 alone, and here p1 may lie between."""
        return bool(self.lifted) and self.options.relax


def on_pairs(tag: str, expression: sp.Expr, paper: str, only: tuple[str, int] | None = None) -> Family:
    """A family over the neighbour pairs E."""
    return Family(tag, "pairs", expression, paper, only)


def on_strokes(tag: str, expression: sp.Expr, paper: str) -> Family:
    """A family over the stroke pixels S_c."""
    return Family(tag, "strokes", expression, paper)


def on_pixels(tag: str, expression: sp.Expr, paper: str) -> Family:
    """A family over the pixels I."""
    return Family(tag, "pixels", expression, paper)


# The smoothness term, in every way the paper and we write it: (objective term, rows).

JUMP_ROWS: Final = (
    on_pairs("jlo", sp.Ge(p1 + 2 * p2, p_min, evaluate=False), "(7), bounded", only=("p_min", 1)),
    on_pairs("jup", sp.Le(p1 + 2 * p2, p_max, evaluate=False), "(7), bounded", only=("p_max", 0)),
)
PARITY: Final = 2 * ((A.subs(p1 + 2 * p2, p)) ** 2 + (sp.cos(pi * p) * beta_i - beta_j) ** 2)
QUARTIC: Final = 2 * (A**2 + B**2)
CUBIC: Final = sp.expand(sp.expand(QUARTIC).subs(p1**2, p1))
LINEAR: Final = 2 * s + 2 * t
SEPARABLE: Final = 2 * (d**2 + u**2)

S_ROWS: Final = (
    on_pairs("c14", sp.Ge(s, A, evaluate=False), "(14)"),
    on_pairs("c15", sp.Ge(s, -A, evaluate=False), "(15)"),
)


def t_rows(change: sp.Expr) -> tuple[Family, ...]:
    """The rows t >= B and t >= -B for a change of skew B: (16), (17)."""
    return (
        on_pairs("c16", sp.Ge(t, change, evaluate=False), "(16)"),
        on_pairs("c17", sp.Ge(t, -change, evaluate=False), "(17)"),
    )


def product_rows(facet: Facet) -> tuple[Family, ...]:
    """The facets of z = p1 beta_i: (26)-(29). With `printed`, (26) is the lower bound of z and no row."""
    quarter = pi / 4
    hull = on_pairs("c26", sp.Ge(z, -quarter * p1, evaluate=False), "(26), corrected")
    return (
        *((hull,) if facet == "hull" else ()),
        on_pairs("c27", sp.Le(z, beta_i - quarter * p1 + quarter, evaluate=False), "(27)"),
        on_pairs("c28", sp.Le(z, quarter * p1, evaluate=False), "(28)"),
        on_pairs("c29", sp.Ge(z, beta_i + quarter * p1 - quarter, evaluate=False), "(29)"),
    )


RESIDUAL_ROWS: Final = (
    on_pairs("cd", sp.Eq(d, A, evaluate=False), "residual of (8)"),
    on_pairs("cu", sp.Eq(u, B_LIFTED, evaluate=False), "residual of (8), lifted"),
)


def stroke_families(norm: int) -> tuple[Family, tuple[Family, ...]]:
    """The stroke term, (5) or (20), and its rows (22), (23)."""
    if norm == 2:
        return on_strokes("strokes", w_strokes * w * R**2, "(5)"), ()
    rows = (
        on_strokes("c22", sp.Ge(gamma, R, evaluate=False), "(22)"),
        on_strokes("c23", sp.Ge(gamma, -R, evaluate=False), "(23)"),
    )
    return on_strokes("strokes", w_strokes * w * gamma, "(20)"), rows


def beta_families(norm: int) -> tuple[Family, tuple[Family, ...]]:
    """The skew term, (6) or (21), and its rows (24), (25). w_beta is meant once."""
    if norm == 2:
        return on_pixels("skew", w_beta * beta**2, "(6)"), ()
    rows = (
        on_pixels("c24", sp.Ge(psi, beta, evaluate=False), "(24)"),
        on_pixels("c25", sp.Ge(psi, -beta, evaluate=False), "(25)"),
    )
    return on_pixels("skew", w_beta * psi, "(21)"), rows


@dataclass(frozen=True)
class Recipe:
    """A line of the table of formulations.

    smooth, smooth_rows: the smoothness term and its rows for a facet; options: those that may be set;
    defaults: of the options; kind: the class as people call it; equivalent: another formulation of the very same problem.
    """

    name: str
    paper: str
    summary: str
    kind: str
    smooth: sp.Expr
    smooth_rows: Callable[[Facet], tuple[Family, ...]]
    convex: bool
    defaults: Options = field(default_factory=Options)
    settable: frozenset[str] = frozenset({"relax"})
    fixed: tuple[str, ...] = ()
    equivalent: str = ""


_NORMS: Final = frozenset({"stroke_norm", "beta_norm", "relax"})

FORMULATIONS: Final = {
    recipe.name: recipe
    for recipe in (
        Recipe(
            "minlp-parity", "1, (1)-(6)", "one integer jump per pair, its parity as cos(pi p)", "non-convex MINLP",
            PARITY, lambda _: (), convex=False, equivalent="minlp-quartic",
        ),
        Recipe(
            "minlp-quartic", "2, (8)", "parity bit p1 and even part p2, squares kept as squares", "polynomial MINLP of degree 4",
            QUARTIC, lambda _: JUMP_ROWS, convex=False,
        ),
        Recipe(
            "minlp-cubic", "2, (9)", "expanded, p1^2 replaced by p1: the full model of section 2", "polynomial MINLP of degree 3",
            CUBIC, lambda _: JUMP_ROWS, convex=False,
        ),
        Recipe(
            "miqcp-bilinear", "3, (10)-(17)", "1-norm smoothness with bilinear rows", "non-convex MIQCP",
            LINEAR, lambda _: (*S_ROWS, *t_rows(B), *JUMP_ROWS), convex=False, settable=_NORMS,
        ),
        Recipe(
            "miqcp-bilinear-l1", "3, (10)-(25)", "1-norm throughout with bilinear rows", "non-convex MIQCP, linear objective",
            LINEAR, lambda _: (*S_ROWS, *t_rows(B), *JUMP_ROWS), convex=False,
            defaults=Options(stroke_norm=1, beta_norm=1), settable=_NORMS,
        ),
        Recipe(
            "miqp-mccormick", "4, for Bonmin", "1-norm smoothness, products replaced by their facets", "convex MIQP",
            LINEAR, lambda facet: (*S_ROWS, *t_rows(B_LIFTED), *product_rows(facet), *JUMP_ROWS), convex=True,
            settable=_NORMS | {"facet"},
        ),
        Recipe(
            "milp-mccormick", "4 and 5, the MILO model", "1-norm throughout, products replaced by their facets", "MILP",
            LINEAR, lambda facet: (*S_ROWS, *t_rows(B_LIFTED), *product_rows(facet), *JUMP_ROWS), convex=True,
            defaults=Options(stroke_norm=1, beta_norm=1), settable=_NORMS | {"facet"},
        ),
        Recipe(
            "qp-fixed", "5, second stage", "2-norm with the jumps as data", "box-constrained convex QP",
            QUARTIC, lambda _: (), convex=True, settable=frozenset(), fixed=("p1", "p2"),
        ),
        Recipe(
            "miqp-exact", "ours", "2-norm with z = p1 beta by its hull: exactly (8), and convex", "convex MIQP",
            SEPARABLE, lambda facet: (*RESIDUAL_ROWS, *product_rows(facet), *JUMP_ROWS), convex=True,
        ),
    )
}  # fmt: skip
"""The table of formulations; command line, docs and tests are generated from it."""


def declare(name: str, **chosen: Any) -> Formulation:
    """The formulation of that name with the chosen options: facet, stroke_norm, beta_norm, relax.

    An option that is None keeps its default. Raises FormulationError for an unknown name, option or value.
    """
    if name not in FORMULATIONS:
        raise FormulationError(f"there is no formulation {name!r}; choose one of {', '.join(FORMULATIONS)}")
    recipe = FORMULATIONS[name]
    options = _options(recipe, {key: value for key, value in chosen.items() if value is not None})
    strokes, stroke_rows = stroke_families(options.stroke_norm)
    skew, skew_rows = beta_families(options.beta_norm)
    return Formulation(
        name=name,
        paper=recipe.paper,
        summary=recipe.summary,
        options=options,
        objective=(on_pairs("smooth", recipe.smooth, recipe.paper), strokes, skew),
        rows=(*recipe.smooth_rows(options.facet), *stroke_rows, *skew_rows),
        convex=recipe.convex,
        fixed=recipe.fixed,
        equivalent="" if options.relax else recipe.equivalent,
    )


def _options(recipe: Recipe, chosen: dict[str, Any]) -> Options:
    for key, value in chosen.items():
        if key not in Options.__dataclass_fields__:
            raise FormulationError(
                f"there is no option {key!r}; the options are {', '.join(Options.__dataclass_fields__)}"
            )
        if key not in recipe.settable and value != getattr(recipe.defaults, key):
            raise FormulationError(
                f"{recipe.name} has no option {key}; it is always {getattr(recipe.defaults, key)}"
            )
    options = replace(recipe.defaults, **chosen)
    if options.facet not in FACETS:
        raise FormulationError(f"there is no facet {options.facet!r}; choose one of {', '.join(FACETS)}")
    if options.stroke_norm not in NORMS or options.beta_norm not in NORMS:
        raise FormulationError("a norm is 1 or 2")
    return options


_EXACT: Final = "z = p1 beta_i with the hull facets (26)-(29), exact"
_WEAKER: Final = "z for p1 beta_i between the hull facets (26)-(29), a relaxation: p1 is not only 0 or 1 here; .nl and .gms hold the products"


def lift_products(formulation: Formulation) -> Formulation:
    """The formulation with z for every product p1 beta_i, and its hull facets: the same problem while p1 is 0 or 1.

    For formats that hold nothing beyond quadratic. With integrality dropped the result is a relaxation (see `weakened`). A square stays a square of a linear expression, so that (8) becomes convex;
    (9) stays the expanded polynomial with 4 z beta_j.
    """
    lifted = tuple(replace(family, expression=_lift(family.expression)) for family in formulation.objective)
    return replace(
        formulation,
        objective=lifted,
        rows=(*product_rows("hull"), *formulation.rows),
        convex=all(map(_is_sum_of_squares, lifted)),
        lifted=_WEAKER if formulation.options.relax else _EXACT,
    )


def _lift(expression: sp.Expr) -> sp.Expr:
    squares_kept = expression.replace(
        lambda e: e.is_Pow and e.base.is_Add, lambda e: sp.expand(e.base).subs(p1 * beta_i, z) ** e.exp
    )
    return squares_kept.subs(p1 * beta_i, z)


def _is_sum_of_squares(family: Family) -> bool:
    """Whether a term of an objective is, as written, a sum of squares of linear expressions (or linear)."""
    unknown = [symbol for symbol in family.symbols if SLOTS[family.over][symbol][0] in VARIABLES]

    def is_square(term: sp.Expr) -> bool:
        factors = [factor for factor in sp.Mul.make_args(term) if factor.free_symbols & set(unknown)]
        return all(e.is_Pow and e.exp == 2 and sp.Poly(e.base, *unknown).total_degree() == 1 for e in factors)

    return all(is_square(term) for term in sp.Add.make_args(family.expression))
