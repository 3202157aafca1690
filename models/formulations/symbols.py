"""The symbols of the formulations: the quantity that each denotes, and its place on the grid.

A *quantity* (alpha, s, theta, ...) has one value per element of an index set: the pixels I, the stroke pixels
S_c, the neighbour pairs E, or the cycles C of pairs and strokes. A *slot* is a symbol in an expression over
such a set. It names a quantity and the way to it: over the pairs, alpha_i is alpha at the first pixel,
alpha_j at the second. The size of a sketch changes the length of the index arrays, never an expression. Over
the cycles, d_round is the sum of d along a cycle: `Family.unrolled` writes it as as many terms as it has.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cache
from typing import Any, Final, Literal

import numpy as np

from ..instance.domain import Ints
from ..instance.instance import Instance
from .expressions import ONE, PI, ZERO, Expression, Operand, Symbol, absolute, floor, parity

IndexSet = Literal["pixels", "strokes", "pairs", "cycles"]
IndexMap = Literal["itself", "first", "second", "stroke", "round", "start", "end"] | tuple[str, int]
"""The way from an element to a quantity: the same number, an end of a pair, the pixel of a stroke; of a cycle
the sum along it, the stroke at its start or end, and (`pair` or `place`, step).
"""


alpha, beta, gamma, psi = (Symbol(name) for name in ("alpha", "beta", "gamma", "psi"))
alpha_i, alpha_j, beta_i, beta_j = (Symbol(name) for name in ("alpha_i", "alpha_j", "beta_i", "beta_j"))
p, p1, p2, s, t, z, d, u = (Symbol(name) for name in ("p", "p1", "p2", "s", "t", "z", "d", "u"))
q, k, d_round, p_round, q_start, q_end = (
    Symbol(name) for name in ("q", "k", "d_round", "p_round", "q_start", "q_end")
)
d_max, q_max, k_min, k_max, holonomy = (
    Symbol(name) for name in ("d_max", "q_max", "k_min", "k_max", "holonomy")
)
p_min, p_max, theta, w = (Symbol(name) for name in ("p_min", "p_max", "theta", "w"))
alpha_lo, alpha_up, beta_lo, beta_up = (
    Symbol(name) for name in ("alpha_lo", "alpha_up", "beta_lo", "beta_up")
)
w_strokes, w_beta, kappa, omega = (Symbol(name) for name in ("w_strokes", "w_beta", "kappa", "omega"))
pi: Final = PI


def change_of_direction(jump: Operand) -> Expression:
    """Change of direction across a pair; kappa turns the frame of the first point into the second's."""
    return alpha_i - alpha_j + kappa + pi / 2 * jump


A: Final = change_of_direction(p1 + 2 * p2)
"""Change of direction across a pair, (8)."""
B: Final = (1 - 2 * p1) * beta_i - beta_j
"""Change of skew across a pair, bilinear, (8)."""
B_LIFTED: Final = beta_i - 2 * z - beta_j
"""Change of skew with z standing for p1 beta_i, section 4."""
R: Final = alpha + beta - theta
"""Deviation of line u from its stroke, (5)."""


@dataclass(frozen=True)
class Variable:
    """A block of columns: one variable per element of an index set.

    lower, upper: its bounds, expressions in data over its index set, or None. Every format, NumPy and the
    formulas of the docs are derived from them. value: the variable at a given field, as an expression over
    its index set. meaning: one line for the docs.
    """

    name: str
    over: IndexSet
    lower: Operand | None
    upper: Operand | None
    value: Operand
    meaning: str
    integer: bool = field(default=False, kw_only=True)


_QUARTER: Final = pi / 4

VARIABLES: Final = {
    variable.name: variable
    for variable in (
        Variable("alpha", "pixels", alpha_lo, alpha_up, alpha, "direction of the cross"),
        Variable("beta", "pixels", -_QUARTER, _QUARTER, beta, "skew of the cross"),
        Variable("p", "pairs", p_min, p_max, p, "jump between the labels of two neighbours", integer=True),
        Variable("p1", "pairs", ZERO, ONE, parity(p), "1 when the jump is odd", integer=True),
        Variable("p2", "pairs", floor(p_min / 2), floor(p_max / 2), floor(p / 2),
                 "half of the even part of the jump", integer=True),
        Variable("s", "pairs", ZERO, None, absolute(A), "absolute change of direction"),
        Variable("t", "pairs", ZERO, None, absolute(B), "absolute change of skew"),
        Variable("z", "pairs", -_QUARTER, _QUARTER, p1 * beta_i,
                 "the product of p1 and beta of the first pixel"),
        Variable("d", "pairs", None, None, A, "change of direction"),
        Variable("u", "pairs", None, None, B, "change of skew"),
        Variable("q", "strokes", -q_max, q_max, R, "deviation from a stroke"),
        Variable("k", "cycles", k_min, k_max, p_round, "quarter turns along a cycle", integer=True),
        Variable("gamma", "strokes", ZERO, None, absolute(R), "absolute deviation from a stroke"),
        Variable("psi", "pixels", ZERO, None, absolute(beta), "absolute skew"),
    )
}  # fmt: skip
"""Every variable of every formulation, in the order of columns."""

NARROWED: Final = VARIABLES | {"beta": replace(VARIABLES["beta"], lower=beta_lo, upper=beta_up)}
"""`VARIABLES` for windows that a proof has narrowed, so that bounds of beta are data too."""

BOUNDED: Final = VARIABLES | {"d": replace(VARIABLES["d"], lower=-d_max, upper=d_max)}
"""`VARIABLES` for orthogonal crosses, whose residuals have bounds in every optimum."""

SLOTS: Final[dict[IndexSet, dict[Symbol, tuple[str, IndexMap]]]] = {
    "pixels": {
        symbol: (symbol.name, "itself") for symbol in (alpha, beta, psi, alpha_lo, alpha_up, beta_lo, beta_up)
    },
    "strokes": {
        alpha: ("alpha", "stroke"),
        beta: ("beta", "stroke"),
        gamma: ("gamma", "itself"),
        q: ("q", "itself"),
        q_max: ("q_max", "itself"),
        theta: ("theta", "itself"),
        w: ("w", "itself"),
    },
    "pairs": {
        alpha_i: ("alpha", "first"),
        alpha_j: ("alpha", "second"),
        beta_i: ("beta", "first"),
        beta_j: ("beta", "second"),
        **{
            symbol: (symbol.name, "itself")
            for symbol in (p, p1, p2, s, t, z, d, u, p_min, p_max, kappa, omega, d_max)
        },
    },
    "cycles": {
        d_round: ("d", "round"),
        p_round: ("p", "round"),
        q_start: ("q", "start"),
        q_end: ("q", "end"),
        **{symbol: (symbol.name, "itself") for symbol in (k, k_min, k_max, holonomy)},
    },
}
"""For each index set: symbol -> (quantity, way to it)."""


@cache
def step_slots(count: int) -> dict[Symbol, tuple[str, IndexMap]]:
    """The slots of d at each of some steps of a cycle, and then of the signs of these steps."""
    numbers = range(count)
    return {
        Symbol(f"{name}_{step:04d}"): (name, (way, step))
        for name, way in (("d", "pair"), ("sign", "place"))
        for step in numbers
    }


OF_SKEW: Final = (z, t, u, psi)
"""Variables that measure beta and nothing else: rows with one of them hold where beta is 0."""

SCALARS: Final = {w_strokes: "stroke_coefficient", w_beta: "skew_coefficient"}
"""Symbols with one value for the whole instance, and the instance's attribute that holds it."""

LATEX: Final = {
    **{symbol: f"{symbol.name}_{{ij}}" for symbol in (p, s, t, z, d, u)},
    d_round: r"\sum_{(i,j) \in c} \pm d_{ij}",
    d_max: r"d^{\max}_{ij}",
    q: "q_i",
    q_max: r"q^{\max}_i",
    q_start: "q_i",
    q_end: "q_j",
    k: "k_c",
    k_min: r"k^{\min}_c",
    k_max: r"k^{\max}_c",
    holonomy: "H_c",
    kappa: r"\kappa_{ij}",
    omega: r"\omega_{ij}",
    alpha: r"\alpha_i",
    beta: r"\beta_i",
    gamma: r"\gamma_i",
    psi: r"\psi_i",
    alpha_i: r"\alpha_i",
    alpha_j: r"\alpha_j",
    beta_i: r"\beta_i",
    beta_j: r"\beta_j",
    p1: r"p_{ij,1}",
    p2: r"p_{ij,2}",
    p_min: r"p^{\min}_{ij}",
    p_max: r"p^{\max}_{ij}",
    alpha_lo: r"\underline{\alpha}_i",
    alpha_up: r"\overline{\alpha}_i",
    theta: r"\theta_i",
    w: r"w_i",
    w_strokes: r"w_{\mathrm{strokes}}",
    w_beta: r"w_{\beta}",
}


def count_elements(instance: Instance, over: IndexSet) -> int:
    """Number of elements of an index set."""
    if over == "cycles":
        return len(instance.cycles.ends)
    sizes = {
        "pixels": instance.domain.size,
        "strokes": len(instance.theta),
        "pairs": len(instance.domain.first),
    }
    return sizes[over]


def constants_of(instance: Instance | None, *, orthogonal: bool = False) -> dict[Symbol, int]:
    """Symbols that are numbers on this instance's domain, and these numbers.

    On a grid, and without an instance, kappa is 0; without weights of pairs omega is 1. Where crosses are
    orthogonal, beta is 0, and so are the variables that only measure it. orthogonal: whether they are without
    an instance.
    """
    constants: dict[Symbol, int] = {}
    if instance is None or instance.domain.kappa is None:
        constants[kappa] = 0
    if instance is None or instance.pair_weights is None:
        constants[omega] = 1
    if orthogonal or (instance is not None and instance.orthogonal):
        constants |= dict.fromkeys((beta, beta_i, beta_j, *OF_SKEW), 0)
    return constants


def index_map(instance: Instance, kind: IndexMap) -> Ints | slice:
    """Index array from the elements of a family to the elements of a quantity."""
    if isinstance(kind, tuple):
        way, step = kind
        places = instance.cycles.places(step)
        return instance.cycles.pair[places] if way == "pair" else places
    if kind in {"start", "end"}:
        return instance.cycles.ends[:, ("start", "end").index(kind)]
    if kind == "first":
        return instance.domain.first
    if kind == "second":
        return instance.domain.second
    return instance.stroke_index if kind == "stroke" else slice(None)


def values_at(instance: Instance, kind: IndexMap, values: Any) -> Any:
    """The values of a quantity at the elements of a family."""
    return instance.cycles.sums(values) if kind == "round" else values[index_map(instance, kind)]


def point_of(instance: Instance, over: IndexSet) -> Ints:
    """Number of the point at each element of an index set (for a pair: its first point)."""
    if over == "pixels":
        return np.arange(instance.domain.size, dtype=np.int32)
    if over == "pairs":
        return instance.domain.first
    return instance.stroke_index
