"""Names of columns and rows (models/formulations/names.py) as pieces of records."""

from __future__ import annotations

from functools import cached_property
from typing import Any, Final

import numpy as np

from ...models.formulations.expressions import Symbol
from ...models.formulations.families import Block, PlacedFamily
from ...models.formulations.names import column_names, element_names, stack_names
from ...models.formulations.problem import Problem
from ...models.formulations.symbols import IndexSet
from .records import TaggedWords, Words

OBJECTIVE: Final = b"obj"
"""Name of the objective row."""


def problem_name(problem: Problem) -> str:
    """Name that solvers repeat in their solution files: instance and stamp, at most 52 word characters."""
    return f"{problem.instance.name}_{problem.stamp}"


class Names:
    """Names of columns and rows as pieces of records: a tag, and words for the positions of the elements.

    The words are the same for all blocks and families over an index set, so that there are few of them and
    each is made once.
    """

    def __init__(self, problem: Problem) -> None:
        self._problem = problem
        self._places: dict[IndexSet, Words] = {}
        self._reached: dict[tuple[Any, ...], Words] = {}

    def of(self, block: Block) -> TaggedWords:
        """Names of a block's columns in order."""
        return TaggedWords(block.name.encode(), self._of(block.over))

    def row(self, family: PlacedFamily) -> TaggedWords:
        """Names of the rows of a family in order."""
        words = self._of(family.family.over)
        return TaggedWords(
            family.family.tag.encode(), words if family.covers_index_set else words.at(family.elements)
        )

    def at(self, family: PlacedFamily, symbol: Symbol) -> TaggedWords:
        """Name of the symbol's column at each element of a family."""
        block, (_, way), declared = family.block(symbol), family.family.slots[symbol], family.family
        key = (declared.over, way, declared.only, declared.steps)
        if key not in self._reached:
            words, inside = self._of(block.over), family.inside(symbol)
            self._reached[key] = words if inside is None else words.at(inside)
        return TaggedWords(block.name.encode(), self._reached[key])

    def _of(self, over: IndexSet) -> Words:
        if over not in self._places:
            self._places[over] = Words(element_names(self._problem.instance, "", over), None)
        return self._places[over]

    @cached_property
    def places(self) -> tuple[Words, dict[IndexSet, int]]:
        """An empty word and all positions of rows, and where those of each index set begin."""
        sets = list(dict.fromkeys(family.family.over for family in self._problem.rows))
        tables = [np.zeros((1, 1), np.uint8), *(self._of(over).table for over in sets)]
        begins = np.cumsum([len(table) for table in tables]).tolist()
        return Words(stack_names(tables), None), dict(zip(sets, begins, strict=False))

    @cached_property
    def all(self) -> Words:
        """Names of all columns in order, padded to one length."""
        return Words(column_names(self._problem.instance, self._problem.blocks), None)
