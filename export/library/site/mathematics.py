"""MathML of a formulation, in pieces between which lines may break."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from typing import Any, Final

from ....models.formulations.catalogue import declare
from ....models.formulations.latex import latex

_BREAKS: Final = frozenset({" + ", " - ", r" \ge ", r" \le ", " = "})
_TOKENS: Final = re.compile(r"\\left|\\right|[{}]| [+-] | \\[gl]e | = ")
_LABEL: Final = re.compile(r" \\quad \\text\{(.*)\}$")
_FIRST_OPERATOR: Final = re.compile(r"^(<math[^>]*><mrow>)<mo>")


@dataclass(frozen=True)
class Line:
    """A line of a model.

    role: `minimise`, `subject to`, `where`, or empty as on the line before; pieces: of the formula, as
    MathML made from our declarations alone.
    """

    role: str
    pieces: tuple[str, ...]
    over: str
    label: str


@dataclass(frozen=True)
class Model:
    """A formulation as mathematics: its LaTeX and the same line by line."""

    latex: str
    lines: tuple[Line, ...]


def model(formulation: str, options: dict[str, Any]) -> Model:
    """Return the mathematics of a formulation with options. Raises FormulationError."""
    return _model(formulation, tuple(sorted(options.items())))


@cache
def _model(formulation: str, options: tuple[tuple[str, Any], ...]) -> Model:
    source = latex(declare(formulation, **dict(options)))
    return Model(source, tuple(_lines(source.split("\n")[1:-1])))


def _lines(rows: list[str]) -> Iterator[Line]:
    """Lines of an `aligned` environment, lead & formula && set, label; domains have no label."""
    last = ""
    for row in rows:
        lead, formula, *rest = (part.strip() for part in row.removesuffix(r" \\").split("&", maxsplit=2))
        over = rest[0].removeprefix("&").strip() if rest else ""
        found = _LABEL.search(over)
        label = found[1] if found else ""
        role = "minimise" if lead or not rest else "subject to" if label else "where"
        yield Line("" if role == last else role, _formula(formula), _converted(_LABEL.sub("", over)), label)
        last = role


def _pieces(formula: str) -> Iterator[str]:
    """The formula cut before its relation and before the signs between its terms, except in brackets."""
    depth, start = 0, 0
    for token in _TOKENS.finditer(formula):
        depth += (token[0] in {"{", r"\left"}) - (token[0] in {"}", r"\right"})
        if depth == 0 and token[0] in _BREAKS and token.start() > start:
            yield formula[start : token.start()]
            start = token.start() + 1
    yield formula[start:]


def _formula(formula: str) -> tuple[str, ...]:
    """The pieces as MathML; a leading operator keeps the space of one between two terms."""
    first, *others = map(_converted, _pieces(formula))
    return (first, *(_FIRST_OPERATOR.sub(r'\1<mo form="infix">', piece) for piece in others))


def _converted(formula: str) -> str:
    """LaTeX of our own declarations, never of a file, as inline MathML in display style."""
    from latex2mathml.converter import convert

    return (
        convert(formula, display="block").replace(' display="block"', ' displaystyle="true"')
        if formula
        else ""
    )
