"""The formulations, each one function that reads from top to bottom like the paper.

Each yields the terms of its objective and its rows as expressions over the pixels I, the stroke pixels S_c or
the neighbour pairs E. Files, NumPy evaluation, Pyomo models and the formulas of the docs are all derived from
these expressions. Equation numbers are the paper's. Parts of a formulation: declaration.py; symbols:
symbols.py; operators and functions: expressions.py.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from .declaration import (
    FORMULATIONS,
    S_C,
    C,
    E,
    Facet,
    Family,
    I,
    declaration_of,
    formulation,
    row,
    short_names,
    term,
)
from .expressions import Operand, cos, equal
from .symbols import (
    B_LIFTED,
    A,
    B,
    R,
    beta,
    beta_i,
    beta_j,
    change_of_direction,
    d,
    d_round,
    gamma,
    holonomy,
    k,
    omega,
    p,
    p1,
    p2,
    p_max,
    p_min,
    pi,
    psi,
    q,
    q_end,
    q_start,
    s,
    t,
    u,
    w,
    w_beta,
    w_strokes,
    z,
)

TWO_NORM: Final = "the 2-norm energy"
MIXED_NORM: Final = "the 1-norm of the smoothness with squares of stroke and skew terms"
ONE_NORM: Final = "the 1-norm energy"
AT_JUMPS: Final = "the 2-norm energy at given jumps"
RIGHT_TWO_NORM: Final = "the 2-norm energy of orthogonal crosses"
RIGHT_ONE_NORM: Final = "the 1-norm energy of orthogonal crosses"

BY_HULL: Final = "z = p1 beta_i at every point with binary p1, by the four facets of its hull"
BY_ROWS: Final = "the products p1 beta_i stand in the rows"

A_WHOLE: Final = change_of_direction(p)
"""Change of direction across a pair, with one integer jump."""
PARITY: Final = omega * (2 * (A_WHOLE**2 + (cos(pi * p) * beta_i - beta_j) ** 2))
"""The smoothness of a pair with one integer jump, (1)-(4)."""
QUARTIC: Final = omega * (2 * (A**2 + B**2))
"""The smoothness of a pair, (8)."""
CUBIC: Final = QUARTIC.expanded(p1)
"""(8) expanded, with p1^2 = p1: (9)."""

Families = Iterator[Family]


@formulation(
    "minlp-parity", paper="1, (1)-(6)", kind="non-convex MINLP", short="parity",
    minimises=TWO_NORM, how="p = p1 + 2 p2, and cos(pi p) = 1 - 2 p1",
)  # fmt: skip
def minlp_parity() -> Families:
    """One integer jump per pair, its parity as cos(pi p)."""
    yield term("smooth", E, PARITY)
    yield from strokes(norm=2)
    yield from skew(norm=2)


@formulation(
    "minlp-quartic", paper="2, (8)", kind="polynomial MINLP of degree 4", short="quartic",
    minimises=TWO_NORM,
    how="squares of alpha_i - alpha_j + pi/2 (p1 + 2 p2) and of (1 - 2 p1) beta_i - beta_j",
)  # fmt: skip
def minlp_quartic() -> Families:
    """Parity bit p1 and even part p2, squares kept as squares."""
    yield term("smooth", E, QUARTIC)
    yield from jump_bounds()
    yield from strokes(norm=2)
    yield from skew(norm=2)


@formulation(
    "minlp-cubic", paper="2, (9)", kind="polynomial MINLP of degree 3", short="cubic",
    minimises=TWO_NORM, how="the expanded squares with p1^2 = p1, which holds for binary p1 only",
)  # fmt: skip
def minlp_cubic() -> Families:
    """The full model of section 2, expanded."""
    yield term("smooth", E, CUBIC)
    yield from jump_bounds()
    yield from strokes(norm=2)
    yield from skew(norm=2)


@formulation(
    "miqcp-bilinear", paper="3, (10)-(17)", kind="non-convex MIQCP", short="bilin",
    minimises=MIXED_NORM, how=BY_ROWS,
)  # fmt: skip
def miqcp_bilinear(stroke_norm: int = 2, beta_norm: int = 2) -> Families:
    """1-norm smoothness with bilinear rows."""
    yield term("smooth", E, omega * (2 * s + 2 * t))
    yield row(14, E, s >= A)
    yield row(15, E, s >= -A)
    yield row(16, E, t >= B)
    yield row(17, E, t >= -B)
    yield from jump_bounds()
    yield from strokes(stroke_norm)
    yield from skew(beta_norm)


@formulation(
    "miqcp-bilinear-l1", paper="3, (10)-(25)", kind="non-convex MIQCP, linear objective", short="bilin1",
    minimises=ONE_NORM, how=BY_ROWS,
)  # fmt: skip
def miqcp_bilinear_l1(stroke_norm: int = 1, beta_norm: int = 1) -> Families:
    """1-norm throughout with bilinear rows."""
    yield from miqcp_bilinear.families(stroke_norm, beta_norm)


@formulation(
    "miqp-mccormick", paper="4, for Bonmin", kind="convex MIQP", short="miqp",
    minimises=MIXED_NORM, how=BY_HULL,
)  # fmt: skip
def miqp_mccormick(facet: Facet = "hull", stroke_norm: int = 2, beta_norm: int = 2) -> Families:
    """1-norm smoothness, products replaced by their facets."""
    yield term("smooth", E, omega * (2 * s + 2 * t))
    yield row(14, E, s >= A)
    yield row(15, E, s >= -A)
    yield row(16, E, t >= B_LIFTED)
    yield row(17, E, t >= -B_LIFTED)
    yield from facets_of_z(facet)
    yield from jump_bounds()
    yield from strokes(stroke_norm)
    yield from skew(beta_norm)


@formulation(
    "milp-mccormick", paper="4 and 5, the MILO model", kind="MILP", short="milp",
    minimises=ONE_NORM, how=BY_HULL,
)  # fmt: skip
def milp_mccormick(facet: Facet = "hull", stroke_norm: int = 1, beta_norm: int = 1) -> Families:
    """1-norm throughout, products replaced by their facets."""
    yield from miqp_mccormick.families(facet, stroke_norm, beta_norm)


@formulation(
    "qp-fixed", paper="5, second stage", kind="box-constrained convex QP", short="qp",
    minimises=AT_JUMPS, how="the jumps are data", fixed=("p1", "p2"),
)  # fmt: skip
def qp_fixed() -> Families:
    """2-norm with the jumps as data."""
    yield term("smooth", E, QUARTIC)
    yield from strokes(norm=2)
    yield from skew(norm=2)


@formulation(
    "miqp-exact", paper="ours", kind="convex MIQP", short="exact",
    minimises=TWO_NORM, how=BY_HULL,
)  # fmt: skip
def miqp_exact() -> Families:
    """2-norm with z = p1 beta by its hull: exactly (8), and convex."""
    yield term("smooth", E, omega * (2 * (d**2 + u**2)))
    yield row("cd", E, equal(d, A), "residual of (8)")
    yield row("cu", E, equal(u, B_LIFTED), "residual of (8), lifted")
    yield from facets_of_z("hull")
    yield from jump_bounds()
    yield from strokes(norm=2)
    yield from skew(norm=2)


BY_WINDOWS: Final = "beta is 0, and the windows of alpha hold every cross"
BY_CYCLES: Final = "jumps matter only through their sums along a basis of the cycles"


@formulation(
    "miqp-orthogonal", paper="ours", kind="convex MIQP", short="ortho",
    minimises=RIGHT_TWO_NORM, how=BY_WINDOWS, orthogonal=True,
)  # fmt: skip
def miqp_orthogonal(limits: bool = False) -> Families:  # noqa: ARG001 - the bounds of d depend on it
    """Orthogonal crosses as in mixed-integer quadrangulation: one integer per pair."""
    yield term("smooth", E, omega * (2 * d**2))
    yield row("cd", E, equal(d, A_WHOLE), "residual of (1)")
    yield from strokes(norm=2)


@formulation(
    "milp-orthogonal", paper="ours", kind="MILP", short="ortho1",
    minimises=RIGHT_ONE_NORM, how=BY_WINDOWS, orthogonal=True,
)  # fmt: skip
def milp_orthogonal(stroke_norm: int = 1) -> Families:
    """Orthogonal crosses in the 1-norm: one integer per pair."""
    yield term("smooth", E, omega * (2 * s))
    yield row(14, E, s >= A_WHOLE)
    yield row(15, E, s >= -A_WHOLE)
    yield from strokes(stroke_norm)


@formulation(
    "miqp-cycle", paper="ours", kind="convex MIQP", short="cycle",
    minimises=RIGHT_TWO_NORM, how=BY_CYCLES, orthogonal=True,
)  # fmt: skip
def miqp_cycle(limits: bool = False) -> Families:  # noqa: ARG001 - the bounds of d depend on it
    """Orthogonal crosses without windows and alpha: one integer per cycle."""
    yield term("smooth", E, omega * (2 * d**2))
    yield from strokes(2, q)
    yield from cycles()


@formulation(
    "milp-cycle", paper="ours", kind="MILP", short="cycle1",
    minimises=RIGHT_ONE_NORM, how=BY_CYCLES, orthogonal=True,
)  # fmt: skip
def milp_cycle(stroke_norm: int = 1) -> Families:
    """Orthogonal crosses in the 1-norm without windows and alpha: one integer per cycle."""
    yield term("smooth", E, omega * (2 * s))
    yield row(14, E, s >= d)
    yield row(15, E, s >= -d)
    yield from strokes(stroke_norm, q)
    yield from cycles()


# Parts that several formulations share.


def cycles() -> Families:
    """Residuals add up to the holonomy and whole quarter turns, along closed walks and from stroke to stroke.

    They are residuals of a field exactly then.
    """
    turns = holonomy + pi / 2 * k
    yield row("cyc", C, equal(d_round, turns), "closed", only=("is_open", 0))
    yield row(
        "path", C, equal(d_round + q_end - q_start, turns), "from stroke to stroke", only=("is_open", 1)
    )


def strokes(norm: int, residual: Operand = R) -> Families:
    """The stroke term, (5) or (20), and for the 1-norm its rows (22), (23)."""
    if norm == 2:
        yield term("strokes", S_C, w_strokes * w * residual**2, "(5)")
        return
    yield term("strokes", S_C, w_strokes * w * gamma, "(20)")
    yield row(22, S_C, gamma >= residual)
    yield row(23, S_C, gamma >= -residual)


def skew(norm: int) -> Families:
    """The skew term, (6) or (21), and for the 1-norm its rows (24), (25). w_beta enters once."""
    if norm == 2:
        yield term("skew", I, w_beta * beta**2, "(6)")
        return
    yield term("skew", I, w_beta * psi, "(21)")
    yield row(24, I, psi >= beta)
    yield row(25, I, psi >= -beta)


def jump_bounds() -> Families:
    """Rows p_min <= p1 + 2 p2 <= p_max, where the bounds of p1 and p2 do not imply them."""
    yield row("jlo", E, p1 + 2 * p2 >= p_min, "(7), bounded", only=("p_min", 1))
    yield row("jup", E, p1 + 2 * p2 <= p_max, "(7), bounded", only=("p_max", 0))


def facets_of_z(facet: Facet) -> Families:
    """The facets of z = p1 beta_i: (26)-(29). With `printed`, (26) is the lower bound of z, not a row."""
    if facet == "hull":
        yield row(26, E, z >= -pi / 4 * p1, "(26), corrected")
    yield row(27, E, z <= beta_i - pi / 4 * p1 + pi / 4)
    yield row(28, E, z <= pi / 4 * p1)
    yield row(29, E, z >= beta_i + pi / 4 * p1 - pi / 4)


__all__ = ["FORMULATIONS", "declaration_of", "short_names"]  # the table and its names come from there
