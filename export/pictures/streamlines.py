"""Evenly spaced streamlines of a cross field, after Jobard and Lefer (1997), and combing of its labels.

The direction of a line at a place is the weighted mean over the four pixels round it of the direction that is
nearest to the line's own. Lines end at the border of the mask, at singularities, where the two lines of a
cross coincide, and next to other lines of their family.

Positions are complex numbers x + iy in pixel units, y up: pixel [row, column] has its centre at column - i
row.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ...models.field.field import CrossField
from ...models.field.jumps import step_labels
from ...models.instance.angles import double_angle
from ...models.instance.domain import Bools, Floats
from ...models.instance.terms import parity_sign

Positions = NDArray[np.complex128]
Labels = NDArray[np.int64]
_Array = np.ndarray[Any, Any]

CLOSEST: Final = 0.55  # lines of one family end where they come closer than this part of the separation

_LONGEST: Final = 0.45  # step in pixels; below 1/2, so that it never leaves the cells that touch its pixel
_SHORTEST: Final = 1.2  # lines shorter than this many separations are not worth their ink
_FINENESS: Final = 6  # raster cells per separation, at least
_CORNERS: Final = np.array([[0, 0, 1, 1], [0, 1, 0, 1]])[..., None]  # of four pixels: below, to the right
_LEAST_STEP: Final = 1e-3  # pixels to which the end of a line is found
_SHIFT: Final = 1e-6  # keeps the signed Laplacian of a part without singularities regular
_ITERATIONS: Final = 12  # of the inverse iteration that places the cuts of the combing


@dataclass(frozen=True, eq=False)
class Streamline:
    """A line of a cross field.

    points: (k, 2), x and y in pixel units, y up; the last is the first again if the line is closed.
    families: (k,), 0 or 1 at each point: the line is nearer to u or to v there, once labels are aligned.
    """

    points: Floats
    families: Labels


def streamlines(field: CrossField, separation: float) -> list[Streamline]:
    """Lines of both families that cover the mask, about `separation` pixels apart within a family.

    The result does not depend on the labels of the crosses.
    """
    crosses = _Crosses(align_labels(field))
    cover = _Cover(crosses, separation)
    lines: list[Streamline] = []
    for seeds, families in cover.fronts():
        candidates = _trace_through(crosses, cover, seeds, families)
        for number in sorted(range(len(seeds)), key=lambda k: -round(candidates[k].length, 6)):
            seed, family = seeds[number], int(families[number])
            if cover.is_covered(seed, family):
                continue
            line = candidates[number]
            line = line.without(cover.is_blocked(line.z, line.family)).apart(CLOSEST * separation)
            if line.length < _SHORTEST * separation:
                cover.give_up(seed, family)
            else:
                cover.add(line)
                lines.append(Streamline(_as_points(line.z), line.family))
    return lines


def _as_points(z: Positions) -> Floats:
    return np.stack([z.real, z.imag], axis=1)


def align_labels(field: CrossField) -> CrossField:
    """The same crosses with labels that agree between neighbours: p is even but on cuts.

    Singularities and holes force cuts. In each 4-connected part the line that carries most stroke weight
    becomes u (without strokes: the more horizontal one). alpha may be outside the windows of a gauge.
    """
    from scipy import ndimage

    instance = field.instance
    part = ndimage.label(instance.mask)[0][instance.mask].astype(np.int64) - 1
    nearer = double_angle(field.u_angle) - double_angle(field.v_angle)  # positive product: nearer to u
    vector = _lowest_eigenvector(field, part, nearer[:, 0])
    at = instance.stroke_index
    carried = np.sign(vector[at]) * instance.w * np.sum(double_angle(instance.theta) * nearer[at], axis=1)
    strokes = np.round(np.bincount(part[at], carried, part.max() + 1), 9)
    lying = np.round(np.bincount(part, np.sign(vector) * nearer[:, 0]), 9)
    side = np.where(np.where(strokes != 0, strokes, lying) < 0, -1, 1)
    exchanged = (vector * side[part] < 0).astype(np.int64)
    return CrossField(instance, *step_labels(instance.grid, field.alpha, field.beta, field.p, exchanged))


def _lowest_eigenvector(field: CrossField, part: _Array, start: Floats) -> Floats:
    """The lowest eigenvector of the signed Laplacian with signs (-1)^p, by inverse iteration."""
    # Its signs say which labels are exchanged; its zero lines, the cuts, are short and smooth. A start that
    # changes its sign with the labels makes the result independent of them.
    from scipy.sparse import csr_array, diags_array

    from ...models.instance.sparse_systems import factor_matrix

    terms, size = field.instance.pair_terms, field.instance.grid.size
    signs = csr_array((parity_sign(field.p), (terms.first, terms.second)), shape=(size, size))
    solve = factor_matrix(diags_array(1.0 * terms.degree(size)) - signs - signs.T, pull=_SHIFT)
    # Weights keep a symmetric start from being orthogonal to the vector.
    vector: Floats = start * np.random.default_rng(0).random(size)
    for _ in range(_ITERATIONS):
        vector = solve(vector)
        vector /= np.sqrt(np.bincount(part, vector**2))[part]
    return vector


class _Crosses:
    """Directions of the crosses at any place.

    directions: complex (height + 2, width + 2, 4), u, v, -u, -v of each pixel, 0 outside of the mask.
    """

    def __init__(self, field: CrossField) -> None:
        mask, singular = field.instance.mask, field.singularities
        lines = np.exp(1j * np.stack([field.u_angle, field.v_angle], axis=1))
        leftwards = np.round(lines.real, 9) + 1e-12 * lines.imag < 0  # upright ones: downwards
        lines[leftwards] *= -1
        self.directions = np.zeros((*np.add(mask.shape, 2), 4), dtype=np.complex128)
        self.directions[1:-1, 1:-1][mask] = np.concatenate([lines, -lines], axis=1)
        self.inside: Bools = np.pad(mask, 1)
        self.open: Bools = np.pad(field.image(field.degenerate, 1.0) == 0, 1)
        self.singular = np.zeros(np.add(mask.shape, 1), dtype=bool)
        self.singular[singular.row + 1, singular.column + 1] = True

    def pixel(self, z: Positions) -> tuple[Labels, Labels]:
        """Row and column in padded tables of the pixels that hold the positions."""
        return 1 - np.rint(z.imag).astype(np.int64), 1 + np.rint(z.real).astype(np.int64)

    def nearest(self, place: tuple[Labels, Labels], heading: Positions) -> Labels:
        """Number 0..3 of the direction nearest to a heading at places of the table."""
        return np.asarray(np.argmax((self.directions[place] * heading.conj()[..., None]).real, axis=-1))

    def heading(self, z: Positions, before: Positions) -> Positions:
        """Unit vectors of the lines at z that continue the headings before."""
        top, left = np.floor(-z.imag).astype(np.int64) + 1, np.floor(z.real).astype(np.int64) + 1
        down, across = 1 - z.imag - top, 1 + z.real - left
        place = top + _CORNERS[0], left + _CORNERS[1]
        weight = np.where(_CORNERS[0], down, 1 - down) * np.where(_CORNERS[1], across, 1 - across)
        total = np.sum(weight * self.directions[(*place, self.nearest(place, before))], axis=0)
        return np.asarray(total / np.maximum(np.abs(total), 1e-12))

    def is_allowed(self, z: Positions, target: Positions) -> Bools:
        """Which lines may go from z to a target: not where pixels meet only in a corner."""
        (row, column), (new_row, new_column) = self.pixel(z), self.pixel(target)
        cell = np.floor(-target.imag).astype(np.int64) + 1, np.floor(target.real).astype(np.int64) + 1
        linked = self.inside[row, new_column] | self.inside[new_row, column]
        return self.open[new_row, new_column] & ~self.singular[cell] & linked


@dataclass(eq=False)
class _Walk:
    """A traced line: positions, families, and the number of the position of its seed."""

    z: Positions
    family: Labels
    seed: int
    closed: bool = False

    @property
    def length(self) -> float:
        return float(np.abs(np.diff(self.z)).sum())

    def without(self, bad: Bools) -> _Walk:
        """The run of points round the seed that holds no bad one."""
        if not bad.any():
            return self
        first = max(np.flatnonzero(bad[: self.seed + 1]).tolist(), default=-1) + 1
        stop = self.seed + min(np.flatnonzero(bad[self.seed :]).tolist(), default=len(bad) - self.seed)
        return _Walk(self.z[first:stop], self.family[first:stop], self.seed - first)

    def apart(self, distance: float) -> _Walk:
        """The part round the seed that keeps its distance from itself: spirals end before they crowd."""
        from scipy.spatial import cKDTree

        if self.closed or not len(self.z):
            return self
        along = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(self.z)))])
        pairs = cKDTree(_as_points(self.z)).query_pairs(distance, output_type="ndarray")
        pairs = pairs[along[pairs[:, 1]] - along[pairs[:, 0]] > 3 * distance]
        age = np.abs(along - along[self.seed])
        bad = np.zeros(len(self.z), dtype=bool)
        bad[np.where(age[pairs[:, 0]] > age[pairs[:, 1]], pairs[:, 0], pairs[:, 1])] = True
        return self.without(bad)


def _trace_through(crosses: _Crosses, cover: _Cover, seeds: Positions, families: Labels) -> list[_Walk]:
    """The lines through the seeds, traced to both sides."""
    halves = _trace_halves(crosses, cover, np.tile(seeds, 2), np.concatenate([families, families + 2]))
    lines = []
    for (ahead, headed, closed), (behind, left, _) in zip(
        halves[: len(seeds)], halves[len(seeds) :], strict=True
    ):
        back = slice(None, len(behind) if closed else 0, -1)
        z, heading = np.concatenate([behind[back], ahead]), np.concatenate([-left[back], headed])
        family = crosses.nearest(crosses.pixel(z), heading) % 2
        lines.append(_Walk(z, family, len(z) - len(ahead), closed))
    return lines


def _trace_halves(
    crosses: _Crosses, cover: _Cover, seeds: Positions, labels: Labels
) -> list[tuple[Positions, Positions, bool]]:
    """One half line from each seed by the midpoint rule, all at once: positions, headings, closed."""
    near = CLOSEST * cover.separation
    line = np.flatnonzero(crosses.is_allowed(seeds, seeds))
    z, step, way = seeds[line], np.full(len(line), min(0.5 * cover.separation, _LONGEST)), np.zeros(len(line))
    heading = crosses.heading(z, crosses.directions[*crosses.pixel(z), labels[line]])
    begun = np.zeros_like(seeds)
    begun[line] = heading
    closed = np.zeros(len(seeds), dtype=bool)
    record = [(line, z, heading)]
    while len(line):
        middle = crosses.heading(z + step / 2 * heading, heading)
        target = z + step * middle
        family = crosses.nearest(crosses.pixel(target), middle) % 2
        fine = crosses.is_allowed(z, target) & ~cover.is_blocked(target, family)
        z, way = np.where(fine, target, z), way + np.where(fine, step, 0.0)
        heading = np.where(fine, crosses.heading(z, middle), heading)
        record.append((line[fine], z[fine], heading[fine]))
        home = seeds[line] - z
        back = (np.abs(home) < near) & (way > 3 * near) & ((heading * begun[line].conj()).real > 0.5)
        met = back & (np.abs((home * heading.conj()).imag) < 0.5 * step)
        closed[line[met]] = True
        record.append((line[met], seeds[line[met]], begun[line[met]]))
        step = np.where(fine, step, step / 2)
        on = ~back & (step > _LEAST_STEP) & (way < cover.longest)
        line, z, heading, step, way = line[on], z[on], heading[on], step[on], way[on]
    owner, z, heading = (np.concatenate(arrays) for arrays in zip(*record, strict=True))
    order = np.argsort(owner, kind="stable")
    limits = np.cumsum(np.bincount(owner, minlength=len(seeds)))[:-1]
    parts = zip(np.split(z[order], limits), np.split(heading[order], limits), closed.tolist(), strict=True)
    return list(parts)


class _Cover:
    """A raster, finer than the separation, of what the lines of each family already cover.

    near: closer than CLOSEST separations to a line: lines end here. wide: closer than the separation: no
    seeds here. shut: no seeds either, because the mask or the crosses end here or because lines from here are
    too short. A line marks in each pixel the family that is nearest to its own direction.
    """

    def __init__(self, crosses: _Crosses, separation: float) -> None:
        self.crosses, self.separation = crosses, separation
        self.fine = int(np.ceil(_FINENESS / separation))
        free = np.kron(crosses.open[1:-1, 1:-1], np.ones((self.fine, self.fine))) > 0
        self.shape = free.shape
        self.longest = 4.0 * sum(crosses.open.shape)
        self.near = np.zeros((2, *self.shape), dtype=bool)
        self.wide = self.near.copy()
        self.shut = np.stack([~free, ~free])

    def _raster(self, z: Positions) -> tuple[_Array, _Array]:
        places = np.stack([0.5 - z.imag, 0.5 + z.real]) * self.fine
        row, column = np.floor(places).astype(np.int64)
        last_row, last_column = self.shape[0] - 1, self.shape[1] - 1
        return np.minimum(np.maximum(row, 0), last_row), np.minimum(np.maximum(column, 0), last_column)

    def is_blocked(self, z: Positions, family: Labels) -> Bools:
        """True where a line of a family at z would be too near to another one."""
        return np.asarray(self.near[family, *self._raster(z)])

    def is_covered(self, z: complex, family: int) -> bool:
        """True where a line may no longer start at z."""
        row, column = self._raster(np.array(z))
        return bool(self.wide[family, row, column] or self.shut[family, row, column])

    def give_up(self, z: complex, family: int) -> None:
        """Start no line close to z again."""
        row, column = (int(index) for index in self._raster(np.array(z)))
        size = int(0.4 * self.separation * self.fine)
        area = np.s_[max(row - size, 0) : row + size + 1, max(column - size, 0) : column + size + 1]
        self.shut[family][area] = True

    def add(self, line: _Walk) -> None:
        """Mark what a new line covers."""
        along = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(line.z)))])
        z = np.interp(np.append(np.arange(0.0, along[-1], 1.0 / self.fine), along[-1]), along, line.z)
        self._mark(z)
        for raster in (self.near, self.wide):  # its own way for certain, where crosses jump too
            raster[line.family, *self._raster(line.z)] = True

    def _mark(self, z: Positions) -> None:
        # Half the diagonal of a raster cell more, so that no point of a free cell is nearer than asked.
        near, wide = CLOSEST * self.separation * self.fine + np.sqrt(0.5), self.separation * self.fine
        reach = np.arange(-int(wide) - 1, int(wide) + 2)
        down, across = (offset.ravel() for offset in np.meshgrid(reach, reach, indexing="ij"))
        row, column = (index[:, None] for index in self._raster(z))
        row, column = row + down, column + across
        away = (row + 0.5 - (0.5 - z.imag[:, None]) * self.fine) ** 2
        away += (column + 0.5 - (0.5 + z.real[:, None]) * self.fine) ** 2
        held = (row >= 0) & (column >= 0) & (row < self.shape[0]) & (column < self.shape[1])
        kept = np.nonzero(held & (away <= wide**2))
        row, column, away = row[kept], column[kept], away[kept]
        place = row // self.fine + 1, column // self.fine + 1
        cell = self.crosses.nearest(place, np.gradient(z)[kept[0]]) % 2, row, column
        self.wide[cell] = True
        self.near[tuple(index[away <= near**2] for index in cell)] = True

    def fronts(self) -> Iterator[tuple[Positions, Labels]]:
        """Seeds and families of the next candidates, just outside what is covered, until everything is."""
        while not (self.wide | self.shut).all():
            seeds = [self._seeds(family) for family in (0, 1)]
            yield np.concatenate(seeds), np.repeat([0, 1], [len(seed) for seed in seeds])

    def _seeds(self, family: int) -> Positions:
        from scipy import ndimage

        free = ~(self.wide[family] | self.shut[family])
        front = free & ndimage.binary_dilation(self.wide[family])
        if not front.any():
            depth = ndimage.distance_transform_edt(np.pad(free, 1))[1:-1, 1:-1]
            front = free & (depth == depth.max())
        row, column = np.argwhere(front).T
        size = 2 * self.separation * self.fine
        key = np.floor(row / size) * (self.shape[1] + 1) + np.floor(column / size)
        chosen = np.unique(key, return_index=True)[1]
        return (column[chosen] + 0.5) / self.fine - 0.5 - 1j * ((row[chosen] + 0.5) / self.fine - 0.5)
