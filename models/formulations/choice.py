"""The formulation of a name for an instance, with options chosen."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

from ..field.field import Norm
from ..instance.instance import Instance
from .catalogue import AT_JUMPS, RIGHT_TWO_NORM, TWO_NORM
from .declaration import FORMULATIONS, Declaration, Formulation, Options, declaration_of
from .expressions import Symbol
from .symbols import OF_SKEW, constants_of


def declare(name: str, on: Instance | None = None, **chosen: Any) -> Formulation:
    """The formulation of a name, full or short, with options (`Options`).

    on: the instance whose domain it is written for, None for the pixels of a sketch. An option that is None
    keeps its default. Raises FormulationError for an unknown name, option or value.
    """
    declaration = declaration_of(name)
    options = declaration.options({key: value for key, value in chosen.items() if value is not None})
    constants = constants_of(on, orthogonal=declaration.orthogonal)
    return _declare(declaration, options, tuple(constants.items()))


def reason_against(formulation: Formulation, instance: Instance | None, *, narrowed: bool = False) -> str:
    """Why an instance, None for the pixels of a sketch, cannot have a formulation; empty if it can.

    narrowed: whether its windows are narrower than those of its gauge.
    """
    has_windows = "alpha" in formulation.variables
    if instance is not None and instance.indices is not None:
        if "k" not in formulation.variables:
            return "lets vertices have any index, and some are prescribed; choose miqp-cycle or milp-cycle"
        if formulation.options.limits:
            return "has limits only where every jump may change, and indices are prescribed; leave limits out"
    if not formulation.declaration.orthogonal:
        return ""
    if instance is None or not instance.orthogonal:
        return "is for orthogonal crosses only; make the instance with orthogonal=True"
    if instance.gauge == "box" and (formulation.options.limits or not has_windows):
        return (
            "lets crosses have every label, and the gauge box does not at strokes; choose the gauge strokes"
        )
    return "has no windows to narrow; choose miqp-orthogonal" if narrowed and not has_windows else ""


def list_formulations(instance: Instance | None = None, *, narrowed: bool = False) -> list[str]:
    """The names of all formulations that an instance can have."""
    return [name for name in FORMULATIONS if not reason_against(declare(name), instance, narrowed=narrowed)]


@cache
def _declare(
    declaration: Declaration, options: Options, constants: tuple[tuple[Symbol, int], ...]
) -> Formulation:
    """The formulation with numbers for symbols, without the terms and rows that vanish."""
    formulation, numbers = declaration.with_options(options), dict(constants)
    vanishing = set(OF_SKEW) & numbers.keys()
    families = [
        replace(family, expression=family.expression.substitute(numbers))
        for family in (*formulation.objective, *formulation.rows)
        if not (family.is_row and vanishing & family.expression.symbols)
    ]
    return replace(
        formulation,
        objective=tuple(family for family in families if not family.is_row and family.body.terms),
        rows=tuple(family for family in families if family.is_row),
    )


def norm_of(declaration: Declaration, options: Options) -> Norm | None:
    """The norm whose energy a formulation minimises with some options; None for another objective."""
    if declaration.minimises in {TWO_NORM, AT_JUMPS, RIGHT_TWO_NORM}:
        return 2
    if declaration.orthogonal:
        return 1 if options.stroke_norm == 1 else "mixed"
    norms: dict[tuple[int, int], Norm] = {(1, 1): 1, (2, 2): "mixed"}
    return norms.get((options.stroke_norm, options.beta_norm)) if options.facet == "hull" else None
