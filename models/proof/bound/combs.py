"""Min-marginals on trees of the grid, combs, which exclude more labels than those of a pass.

After a forward pass, the cost of any labels exceeds the bound by at least their excesses, the reparametrised
costs: D + shares less the least of each pixel, and c - shares of each pair. On a tree, the least sum of these
with one label fixed follows from messages along its pairs. A comb is such a tree: a row of pixels is its
spine, and the columns that cross it are its teeth; or a column is its spine, and rows are its teeth. Only
labels at the corners of cells that other tests leave take part.

Lemma 3a of docs/proofs.md proves that cells are excluded rightly.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from ...instance.domain import Floats
from ...processes.compilation import Crew
from .passes import COMB, fill_reparametrised, work_on
from .state import State

_COLUMN: Final = (0, 2)  # of `State.around`: the neighbours before and after a pixel in its column
_ROW: Final = (1, 3)


def single_excesses(state: State, crew: Crew) -> Floats:
    """The excess of each label at its pixel alone, flat. Before: a forward pass."""
    single = reparametrised_costs(state, crew)
    single -= np.repeat(np.minimum.reduceat(single, state.start[:-1]), np.diff(state.start))
    return single


def comb_excesses(state: State, single: Floats, crew: Crew, *, columns: bool) -> Floats:
    """The least excess of each label on its comb, flat, with columns or rows as teeth.

    single: as of `single_excesses`. Numbers at labels that are not allowed have no meaning.
    """
    teeth, spine = (_COLUMN, _ROW) if columns else (_ROW, _COLUMN)
    return _along(spine, _along(teeth, single, state, crew), state, crew)


def reparametrised_costs(state: State, crew: Crew) -> Floats:
    """The cost of each label plus the shares of all pairs there, flat."""
    theta = np.empty(len(state.unary))
    crew.run(
        lambda part: fill_reparametrised(part.start, part.stop, state, theta),
        crew.equal_parts(len(state.least)),
    )
    return theta


def _along(line: tuple[int, int], single: Floats, state: State, crew: Crew) -> Floats:
    """The excesses with the least ones of the pixels before and after each pixel in its column or row."""
    sums = single.copy()
    for before, after in (line, line[::-1]):
        first = np.flatnonzero(state.around[:, before] < 0)
        crew.run(
            lambda pixel: work_on(COMB, pixel, after, state, single, sums),  # noqa: B023
            np.split(first, len(first)),
        )
    return sums
