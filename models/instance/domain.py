"""What formulations see of a domain: points, ordered pairs of neighbours, and rings of pairs.

A domain is a grid of pixels or a mesh of triangles. Whatever needs more than this module belongs to one of
the two, and asks the instance for its `grid` or its `mesh`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

Ints = NDArray[np.int32]
Bools = NDArray[np.bool_]
Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Walks:
    """Walks over pairs, one after the other.

    start: first step of each walk, and the number of all steps, shape (c + 1,). pair: pair of each step,
    shape (k,). sign: 1 where the step goes from the pair's first point to its second one, else -1, shape
    (k,).
    """

    start: Ints
    pair: Ints
    sign: Ints

    def sums(self, values: NDArray[Any]) -> Floats:
        """The sum of the values (m,) of the pairs along each walk, those of reversed pairs negative, (c,)."""
        if not len(self.pair):
            return np.zeros(len(self.start) - 1)
        return np.asarray(np.add.reduceat(self.sign * values[self.pair], self.start[:-1]), dtype=np.float64)


@dataclass(frozen=True, eq=False)
class Rings(Walks):
    """Closed counter-clockwise walks: around every inner corner of a domain, one after the other.

    defect: 2 pi less the angles around each corner, in radians, shape (r,); 0 where it is flat.
    """

    defect: Floats

    def select(self, number: Ints) -> Rings:
        """The rings whose pairs all have a new number, not -1, in `number` (m,), renumbered."""
        length = np.diff(self.start)
        known = np.bincount(np.repeat(np.arange(len(length)), length), number[self.pair] >= 0, len(length))
        kept = self.keep(known == length)
        return replace(kept, pair=number[kept.pair])

    def keep(self, kept: Bools) -> Rings:
        """Some of the rings, (r,)."""
        length = np.diff(self.start)
        steps = np.repeat(kept, length)
        start = np.append(0, np.cumsum(length[kept])).astype(np.int32)
        return Rings(start, self.pair[steps], self.sign[steps], self.defect[kept])


class Domain(ABC):
    """Points 0 to n - 1, ordered pairs (i, j) of neighbours, and the turns between their frames.

    kind: word for the points. side, reference: pixels of the longer side, and those at which a weight of an
    energy is its coefficient; both 1 where weights do not depend on the resolution.
    """

    kind: ClassVar[str]

    @property
    @abstractmethod
    def size(self) -> int:
        """Number of points n."""

    @property
    @abstractmethod
    def first(self) -> Ints:
        """Point i of each pair (i, j), shape (m,)."""

    @property
    @abstractmethod
    def second(self) -> Ints:
        """Point j of each pair, shape (m,)."""

    @property
    @abstractmethod
    def kappa(self) -> Floats | None:
        """Turn of a direction from the frame of i to that of j, (m,), in (-pi, pi]; None where all are 0."""

    @property
    @abstractmethod
    def rings(self) -> Rings:
        """The ring around each inner corner."""

    @property
    def fans(self) -> Walks:
        """Open walks along the boundary, each around one corner, where strokes may lie; here none."""
        return Walks(np.zeros(1, np.int32), np.zeros(0, np.int32), np.zeros(0, np.int32))

    @property
    @abstractmethod
    def ring_vertices(self) -> Ints:
        """The vertex inside each ring, as `mesh_of` numbers them, ascending, shape (r,)."""

    @property
    @abstractmethod
    def side(self) -> int:
        """Pixels of the longer side, 1 for a mesh."""

    @property
    @abstractmethod
    def reference(self) -> int:
        """Pixels of the longer side at which weights are coefficients, 1 for a mesh."""

    @property
    @abstractmethod
    def summary(self) -> str:
        """Its size in a few words."""

    @property
    @abstractmethod
    def facts(self) -> dict[str, Any]:
        """Its sizes by name, as reports list them."""

    @abstractmethod
    def check(self) -> None:
        """Raise InstanceError unless an instance can be on this domain."""

    def place(self, point: Any) -> str:
        """Words for a point, such as `pixel [3, 4]`."""
        return f"{self.kind} {self.places(np.array([point]))[0].tolist()}"

    @abstractmethod
    def content(self) -> tuple[list[int], list[float], list[NDArray[Any]]]:
        """Its sizes, other numbers and arrays: all about it, for a hash."""

    @abstractmethod
    def places(self, points: Ints) -> Ints:
        """Positions of points as files list them: row and column (k, 2), or number of the face (k,)."""

    @property
    def parts(self) -> int:
        """Number of connected parts."""
        return len(np.unique(self.part_of_points))

    @cached_property
    def part_of_points(self) -> NDArray[np.int64]:
        """The first point of the connected part of each point, (n,)."""
        least = np.arange(self.size)  # the first point known to belong to the same part, of each point
        while len(between := np.nonzero(least[self.first] != least[self.second])[0]):
            one, other = least[self.first[between]], least[self.second[between]]
            np.minimum.at(least, np.maximum(one, other), np.minimum(one, other))
            while (least[least] != least).any():
                least = least[least]
        return least
