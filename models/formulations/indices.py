"""Prescribed indices of vertices of a mesh: fixed quarter turns along their rings."""

from __future__ import annotations

import operator
from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import numpy as np

from ..errors import FormulationError
from ..instance.cycles import find_cycles
from ..instance.domain import Floats, Ints
from ..instance.instance import Instance
from ..instance.terms import quarter_turns

Indices = tuple[tuple[int, int], ...]
"""Vertices, ascending, and four times their indices."""


def as_indices(values: Iterable[Any]) -> Indices:
    """The pairs in order. Raises FormulationError for other values, and for a vertex that comes twice."""
    try:
        pairs = sorted((operator.index(vertex), operator.index(turns)) for vertex, turns in values)
    except (TypeError, ValueError) as error:
        raise FormulationError("indices are no pairs of a vertex and four times its index") from error
    if len(dict(pairs)) < len(pairs):
        raise FormulationError("indices list a vertex twice; give each vertex once")
    return tuple(pairs)


def with_rings(instance: Instance, indices: Indices) -> Instance:
    """The instance with a basis of cycles that has the rings of these vertices, if one exists.

    The rings of a closed part depend on each other, and its basis has all but one. Raises DomainError for
    an instance on pixels, and FormulationError for a vertex without a ring.
    """
    same = replace(instance)
    cycles = find_cycles(instance.domain, instance.stroke_index, _rings_of(instance, indices))
    object.__setattr__(same, "cycles", cycles)
    return same


def _rings_of(instance: Instance, indices: Indices) -> Ints:
    """The numbers of the rings of these vertices, (k,)."""
    vertices, known = np.array([vertex for vertex, _ in indices]), instance.mesh.ring_vertices
    missing = ~np.isin(vertices, known)
    if missing.any():
        raise FormulationError(
            f"vertex {vertices[missing][0]} has no index: it is on the boundary or in no face "
            f"({int(missing.sum())} such vertices); leave it out"
        )
    return np.searchsorted(known, vertices).astype(np.int32)


def fix_turns(instance: Instance, indices: Indices, k_min: Floats, k_max: Floats) -> tuple[Floats, Floats]:
    """The ranges (c,) of quarter turns along all cycles, fixed along the rings of prescribed vertices.

    instance: as `with_rings` returns it. Raises FormulationError for indices that no field has.
    """
    mesh, cycles, ring = instance.mesh, instance.cycles, _rings_of(instance, indices)
    flat = quarter_turns(mesh.rings, instance.pair_terms.offset(0))[ring]
    quarters = np.array([turns for _, turns in indices])
    cycle = np.minimum(np.searchsorted(cycles.rings, ring), len(cycles.rings) - 1)
    has_cycle = cycles.rings[cycle] == ring
    part = mesh.part_of_points[mesh.first[mesh.rings.pair[mesh.rings.start[ring]]]]
    for closed in part[~has_cycle].tolist():  # a closed part in which all vertices are prescribed
        least = int(flat[part == closed].sum())
        if (given := int(quarters[part == closed].sum())) != least:
            raise FormulationError(f"the indices of a closed part add up to {given}/4 instead of {least}/4")
    cycle, turns, lower, upper = cycle[has_cycle], flat - quarters, k_min.copy(), k_max.copy()
    wrong = np.nonzero((turns[has_cycle] < k_min[cycle]) | (turns[has_cycle] > k_max[cycle]))[0]
    if len(wrong):
        at = int(wrong[0])
        vertex, given = np.array(indices)[has_cycle][at]
        reach = [int(flat[has_cycle][at] - end[cycle[at]]) for end in (k_max, k_min)]
        raise FormulationError(
            f"vertex {vertex} cannot have the index {given}/4: with residuals of at most pi/4 it is "
            f"{reach[0]}/4 to {reach[1]}/4"
        )
    lower[cycle] = upper[cycle] = turns[has_cycle]
    return lower, upper
