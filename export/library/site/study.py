"""Content of an entry's page beyond its sidecar: mathematics and structure.

The structure is the sparsity of the matrix and of the Hessian of the Lagrangian, as in MINLPLib.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations, combinations_with_replacement
from pathlib import Path
from typing import Any, Final

import numpy as np
import sympy as sp
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from ....models.formulations.families import PlacedFamily
from ....models.formulations.latex import latex
from ....models.formulations.problem import Problem
from ....models.storage import write_bytes
from ...pictures.sparsity import MatrixParts, Places, SparsityPattern, sparsity_picture
from ..documents.documents import Library, problem_of
from .formulas import lines_of

_HIGHEST: Final = 4  # the greatest degree of a polynomial in any formulation


@dataclass(frozen=True)
class EntryStudy:
    """Results computed from an entry.

    latex: its formulation; lines: the same line by line; matrix, hessian: None if empty; blocks: number and
    sizes of the sets of columns that no entry of the Hessian joins.
    """

    latex: str
    lines: tuple[dict[str, str], ...]
    matrix: SparsityPattern | None
    hessian: SparsityPattern | None
    blocks: dict[str, float] | None


def study_entry(library: Library, entry: dict[str, Any], pictures: Path) -> EntryStudy:
    """Compute the content of an entry's page and write its pictures. Raises as `problem_of`; OutputError."""
    problem = problem_of(library, entry)
    patterns = {
        kind: pattern
        for kind, pattern in (("matrix", jacobian_pattern(problem)), ("hessian", hessian_pattern(problem)))
        if pattern.entries
    }
    for kind, pattern in patterns.items():
        write_bytes(pictures / f"{entry['name']}.{kind}.svg", sparsity_picture(pattern))
    source = latex(problem.formulation)
    return EntryStudy(
        source,
        lines_of(source),
        patterns.get("matrix"),
        patterns.get("hessian"),
        hessian_blocks(patterns["hessian"]) if "hessian" in patterns else None,
    )


def jacobian_pattern(problem: Problem) -> SparsityPattern:
    """Return the entries of the Jacobian of the rows by family, with nonlinear ones marked."""
    rows: list[Places] = [np.zeros(0, np.int64)]
    columns: list[Places] = [np.zeros(0, np.int64)]
    curved, offset = [np.zeros(0, bool)], 0
    for family in problem.rows:
        nonlinear = _nonlinear(family)
        for symbol in family.variables:
            rows.append(np.arange(family.count, dtype=np.int64) + offset)
            columns.append(family.column_of(symbol).astype(np.int64))
            curved.append(np.full(family.count, symbol in nonlinear))
        offset += family.count
    families = [(family.family.tag, family.count) for family in problem.rows]
    down = MatrixParts(tuple(tag for tag, _ in families), tuple(count for _, count in families))
    return SparsityPattern(down, _columns(problem), *map(np.concatenate, (rows, columns, curved)))


def hessian_pattern(problem: Problem) -> SparsityPattern:
    """Return the entries of the Hessian of the Lagrangian, both triangles."""
    pairs = np.concatenate([np.zeros((0, 2), np.int64), *_pairs(problem)])
    both = np.concatenate([pairs, pairs[:, ::-1]])
    keys = np.unique(both[:, 0] * problem.n_columns + both[:, 1])
    parts = _columns(problem)
    return SparsityPattern(
        parts, parts, keys // problem.n_columns, keys % problem.n_columns, np.ones(len(keys), bool)
    )


def hessian_blocks(pattern: SparsityPattern) -> dict[str, float]:
    """Return number and sizes of the blocks of a Hessian among the columns of nonlinear terms."""
    used, place = np.unique(np.concatenate([pattern.rows, pattern.columns]), return_inverse=True)
    ends = place[: pattern.entries], place[pattern.entries :]
    graph = coo_array((np.ones(pattern.entries, bool), ends), shape=(len(used), len(used)))
    count, labels = connected_components(graph, directed=False)
    sizes = np.bincount(labels)
    least, greatest = int(sizes.min()), int(sizes.max())
    return {"count": int(count), "least": least, "greatest": greatest, "average": len(used) / int(count)}


def _columns(problem: Problem) -> MatrixParts:
    shown = [block for block in problem.blocks.values() if block.count]
    return MatrixParts(tuple(block.name for block in shown), tuple(block.count for block in shown))


def _nonlinear(family: PlacedFamily) -> set[sp.Symbol]:
    """The symbols that stand in nonlinear terms of a family."""
    if family.terms is None:
        return set(family.variables)
    return {symbol for term in family.terms if term.degree > 1 for symbol in term.symbols}


def _pairs(problem: Problem) -> Iterator[Places]:
    """Columns whose mixed second derivative is not zero everywhere, arrays (k, 2).

    Terms of the objective that cancel are omitted.
    """
    for degree in range(2, _HIGHEST + 1):
        index, _ = problem.merged_objective(degree)
        yield from (index[:, ends].astype(np.int64) for ends in map(list, combinations(range(degree), 2)))
    for family in problem.objective:
        if family.terms is None:
            yield from _general(family)
    for family in problem.rows:
        if family.terms is None:
            yield from _general(family)
        for term in family.terms or ():
            yield from (np.stack(both, axis=1).astype(np.int64) for both in combinations(term.factors, 2))


def _general(family: PlacedFamily) -> Iterator[Places]:
    """Pairs of columns whose second derivative is not zero, for other families than polynomials."""
    for one, other in combinations_with_replacement(family.variables, 2):
        if sp.diff(family.family.body, one, other) != 0:
            yield np.stack([family.column_of(one), family.column_of(other)], axis=1).astype(np.int64)
