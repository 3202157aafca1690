"""Evenly spaced streamlines of a cross field, traced on labels instead of nearest directions.

Between four pixel centres the angles alpha and beta are interpolated bilinearly after the jumps p have
brought the four crosses to one label, so the interpolant is continuous across cells and has exactly the
differences A and B that the energy measures. A line carries its label q with it (direction d_q of d_0..d_3 =
u, v, -u, -v) and passes it on from pixel to pixel by p: sign and family are continuous even where the two
lines almost coincide. Cells round which the jumps do not add up to zero are singular; lines end there, at the
border of the mask, and where the two lines are one.

Positions are complex numbers x + iy in pixel units, y up: pixel [row, column] has its centre at column - i
row and reaches half a unit to each side.

Placement follows Jobard and Lefer, Creating evenly-spaced streamlines of arbitrary density (1997): new lines
start at the separation distance from lines already there and end where they come closer than a fraction of
it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, fields
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ...models.errors import InputError
from ...models.field.field import DEGENERATE, CrossField
from ...models.instance.angles import double_angle
from ...models.instance.grid import Bools, Floats
from ...models.instance.instance import HALF, QUARTER
from .combing import combed, towards_u

Positions = NDArray[np.complex128]
Labels = NDArray[np.int64]
_Array = np.ndarray[Any, Any]

STEP: Final = 0.25
"""Length of a midpoint step of a single line in pixels."""

CLOSEST: Final = 0.55
"""Lines of one family end where they come closer than this part of the separation."""

_LONGEST: Final = 0.45  # step in pixels; below 1/2, so that it never leaves the cells that touch its pixel
_DENSEST: Final = 400  # separations across the grid, at most
_SHORTEST: Final = 1.2  # lines shorter than this many separations are not worth their ink
_FINENESS: Final = 6  # raster cells per separation, at least
_HALVINGS: Final = 8  # the end of a line is found to STEP / 2^8


@dataclass(frozen=True, eq=False)
class Streamline:
    """A line of a cross field.

    points: float (k, 2), x and y in pixel units, y up: pixel [row, column] has its centre at (column, -row).
    families: int (k,), 0 or 1 at each point: the label u or v that the line has in the combed field there. It
    changes only on the cuts that singularities force.
    closed: True where the last point is the first one again.
    """

    points: Floats
    families: Labels
    closed: bool


def streamlines(field: CrossField, separation: float) -> list[Streamline]:
    """Lines of both families that cover the mask, about `separation` pixels apart within a family.

    The result does not depend on the labels of the crosses, only on the lines and jumps they stand for.
    Raises InputError when separation is no number of at least 1/400 of the grid's longer side.
    """
    least = max(field.instance.mask.shape) / _DENSEST
    if not (np.isfinite(separation) and separation >= least):
        raise InputError(f"the separation is {separation} pixels; it must be a number of at least {least:g}")
    cells = _Cells(combed(field))
    cover = _Cover(cells, separation)
    step = min(0.4 * separation, _LONGEST)
    pace = _Pace(step, 4.0 * (cells.height + cells.width), CLOSEST * separation, cover.blocked)
    lines: list[Streamline] = []
    for seeds, families in cover.fronts():
        candidates = _through(cells, seeds, families, pace)
        for number in sorted(range(len(seeds)), key=lambda k: -round(candidates[k].length, 6)):
            if cover.covered(seeds[number], int(families[number])):
                continue
            line = candidates[number].until(cover.blocked).until_self(CLOSEST * separation)
            if line.length < _SHORTEST * separation:
                cover.give_up(seeds[number], int(families[number]))
                continue
            cover.add(line)
            lines.append(line.streamline())
    return lines


def trace(field: CrossField, seeds: Floats, labels: Labels, length: float) -> list[Floats]:
    """One half line from each seed, as points (k, 2); shape of seeds (m, 2), x and y in pixel units, y up.

    labels: int (m,), which direction to leave in: 0..3 = u, v, -u, -v of the pixel that holds the seed.
    length: greatest length in pixels. A seed off the mask or on a singular or degenerate place gives no
    points at all. Raises InputError when a seed is not finite.
    """
    start = np.asarray(seeds, dtype=np.float64).reshape(-1, 2)
    if not np.isfinite(start).all():
        raise InputError("a seed is not finite; give x and y in pixels")
    height, width = field.instance.mask.shape
    z = np.clip(start[:, 0], -1, width) + 1j * np.clip(start[:, 1], -height, 1)
    walks = _walk(_Cells(field), z, np.asarray(labels, dtype=np.int64), _Pace(STEP, length))
    return [_points(walk.z) for walk in walks]


def _points(z: Positions) -> Floats:
    return np.stack([z.real, z.imag], axis=1)


class _Cells:
    """The interpolant: one cell between each four pixel centres, incomplete ones at the border included.

    Corners are numbered 2 * bottom + right. steps[c, k] is the label step of corner k in the frame of cell c:
    lifted alpha = alpha - steps pi/2, lifted beta = (-1)^steps beta.
    """

    def __init__(self, field: CrossField) -> None:
        self.field = field
        self.height, self.width = field.instance.mask.shape
        self.inside: Bools = np.pad(field.instance.mask, 1).ravel()
        held = self._corners(field.instance.mask, fill=False)
        jump, linked = self._walks()
        total = jump.sum(axis=1)
        complete: Bools = np.all(linked, axis=1)
        self.singular = complete & (total != 0)
        # Diagonal neighbours without a common one have no jump between them: no interpolation, no way
        # through.
        self.loose: Bools = ~np.any(linked, axis=1)
        jump[~complete, np.argmin(linked, axis=1)[~complete]] = -total[~complete]
        around = np.concatenate([np.zeros_like(jump[:, :1]), np.cumsum(jump[:, :3], axis=1)], axis=1)
        self.steps = around[:, [3, 2, 0, 1]]  # walk order is bottom left, bottom right, top right, top left
        alpha = self._corners(field.image(field.alpha, 0.0), fill=0.0) - HALF * self.steps
        beta = self._corners(field.image(field.beta, 0.0), fill=0.0) * (1 - 2 * (self.steps & 1))
        self.table = np.where(held[..., None], np.stack([alpha, beta, held], axis=-1), 0.0)

    def _corners(self, picture: _Array, fill: float) -> _Array:
        padded = np.pad(picture, 1, constant_values=fill)
        corners = (padded[:-1, :-1], padded[:-1, 1:], padded[1:, :-1], padded[1:, 1:])
        return np.stack([corner.ravel() for corner in corners], axis=1)

    def _walks(self) -> tuple[_Array, Bools]:
        """Jumps (cells, 4) counter-clockwise from the bottom left corner, and which of them exist."""
        upper, right = (
            np.pad(table, 1, constant_values=-1) for table in self.field.instance.grid.pair_number
        )
        sides = (right[1:, :-1], upper[1:, 1:], right[:-1, :-1], upper[1:, :-1])
        pair = np.stack([side.ravel() for side in sides], axis=1)
        p = np.append(self.field.p, 0).astype(np.int64)  # pair -1 finds the zero at the end
        return p[pair] * np.array([1, 1, -1, -1]), pair >= 0

    def pixel(self, z: Positions) -> Positions:
        """Centre of the pixel that holds each position."""
        return np.rint(z.real) + 1j * np.rint(z.imag)

    def index(self, z: Positions) -> Labels:
        """Index of each pixel centre, on the grid or next to it, in a picture padded by one and flattened."""
        index: Labels = ((1 - z.imag) * (self.width + 2) + z.real + 1).astype(np.int64)
        return index

    def lift(self, z: Positions, pixel: Positions, q: Labels) -> tuple[_Array, _Array, Floats, Labels]:
        """Cell and top left corner of each position; (alpha, beta) and q there in the cell's frame."""
        top, left = np.floor(-z.imag), np.floor(z.real)
        cell = ((top + 1) * (self.width + 1) + left + 1).astype(np.int64)
        corner = (2 * (-pixel.imag - top) + pixel.real - left).astype(np.int64)
        down, across = -z.imag - top, z.real - left
        weight = np.stack(
            [(1 - down) * (1 - across), (1 - down) * across, down * (1 - across), down * across], axis=1
        )
        loose = self.loose[cell]
        if loose.any():
            weight[loose] = np.eye(4)[corner[loose]]
        sums = np.einsum("mc,mck->mk", weight, self.table[cell])
        return cell, left - 1j * top, sums[:, :2] / sums[:, 2:], q + self.steps[cell, corner]

    def heading(self, z: Positions, pixel: Positions, q: Labels) -> Positions:
        """Unit vectors of direction d_q of `pixel`, carried to positions z less than a unit away from it."""
        _, _, angles, turned = self.lift(z, pixel, q)
        return _direction(angles, turned)

    def arrive(self, z: Positions, pixel: Positions, q: Labels) -> tuple[Bools, Positions, Labels, Positions]:
        """Which lines may go to z, the pixel and label each then has, and its heading there."""
        new = self.pixel(z)
        cell, corner, angles, turned = self.lift(z, pixel, q)
        allowed = self.inside[self.index(new)] & ~self.singular[cell]
        allowed &= np.abs(angles[:, 1]) <= QUARTER - DEGENERATE
        allowed &= ~self.loose[cell] | (new == pixel)
        offset = new - corner
        label = turned - self.steps[cell, (offset.real - 2 * offset.imag).astype(np.int64)]
        return allowed, new, label, _direction(angles, turned)


def _direction(angles: Floats, q: Labels) -> Positions:
    return np.exp(1j * (angles[:, 0] + HALF * q + np.where(q & 1, -angles[:, 1], angles[:, 1])))


def _free(z: Positions, _q: Labels) -> Bools:
    return np.zeros(len(z), dtype=bool)


@dataclass(frozen=True)
class _Pace:
    """Limits and steps of tracing: step and greatest length in pixels, distance to their seed, limits."""

    step: float
    length: float
    return_distance: float = 0.0
    blocked: Callable[[Positions, Labels], Bools] = _free


@dataclass(eq=False)
class _Walk:
    """A traced line: positions, labels in the pixels that hold them, position number of the seed."""

    z: Positions
    q: Labels
    seed: int
    closed: bool

    @property
    def length(self) -> float:
        return float(np.abs(np.diff(self.z)).sum())

    def _part(self, first: int, stop: int) -> _Walk:
        if first == 0 and stop == len(self.z):
            return self
        return _Walk(self.z[first:stop], self.q[first:stop], self.seed - first, closed=False)

    def _without(self, bad: Bools) -> _Walk:
        """The run of points round the seed that holds no bad one."""
        before, after = np.flatnonzero(bad[: self.seed]), np.flatnonzero(bad[self.seed :])
        return self._part(
            before[-1] + 1 if len(before) else 0, self.seed + after[0] if len(after) else len(self.z)
        )

    def until(self, blocked: Callable[[Positions, Labels], Bools]) -> _Walk:
        return self._without(blocked(self.z, self.q))

    def until_self(self, distance: float) -> _Walk:
        """The part round the seed that keeps its distance from itself: spirals end before they crowd."""
        from scipy.spatial import cKDTree

        if self.closed:
            return self
        along = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(self.z)))])
        pairs = cKDTree(_points(self.z)).query_pairs(distance, output_type="ndarray")
        pairs = pairs[along[pairs[:, 1]] - along[pairs[:, 0]] > 3 * distance]
        age = np.abs(along - along[self.seed])
        late = np.where(age[pairs[:, 0]] > age[pairs[:, 1]], pairs[:, 0], pairs[:, 1])
        bad = np.zeros(len(self.z), dtype=bool)
        bad[late] = True
        return self._without(bad)

    def streamline(self) -> Streamline:
        return Streamline(_points(self.z), self.q & 1, self.closed)


def _through(cells: _Cells, seeds: Positions, families: Labels, pace: _Pace) -> list[_Walk]:
    """The lines through the seeds, traced to both sides."""
    halves = _walk(cells, np.tile(seeds, 2), np.concatenate([families, families + 2]), pace)
    return [
        _joined(ahead, behind)
        for ahead, behind in zip(halves[: len(seeds)], halves[len(seeds) :], strict=True)
    ]


def _joined(ahead: _Walk, behind: _Walk) -> _Walk:
    if ahead.closed or len(behind.z) < 2:
        return ahead
    back = slice(None, 0, -1)
    z, q = np.concatenate([behind.z[back], ahead.z]), np.concatenate([behind.q[back] + 2, ahead.q])
    return _Walk(z, q, len(behind.z) - 1, closed=False)


@dataclass(eq=False)
class _Heads:
    """Current ends of lines: line, position, pixel's centre, label in it, heading; shapes (m,)."""

    line: Labels
    z: Positions
    pixel: Positions
    q: Labels
    heading: Positions

    def where(self, chosen: Bools) -> _Heads:
        return _Heads(
            self.line[chosen], self.z[chosen], self.pixel[chosen], self.q[chosen], self.heading[chosen]
        )

    def at(self, cells: _Cells, z: Positions, pace: _Pace) -> tuple[Bools, _Heads]:
        """Which lines may go on to z, and their heads there."""
        allowed, pixel, q, heading = cells.arrive(z, self.pixel, self.q)
        return allowed & ~pace.blocked(z, q), _Heads(self.line, z, pixel, q, heading)


def _walk(cells: _Cells, seeds: Positions, labels: Labels, pace: _Pace) -> list[_Walk]:
    """One half line from each seed by the midpoint rule, all at once."""
    heads = _heads(cells, seeds, labels, pace)
    begun = np.zeros(len(seeds), dtype=np.complex128)
    begun[heads.line] = heads.heading
    closed = np.zeros(len(seeds), dtype=bool)
    record, refused, targets = [(heads.line, heads.z, heads.q)], [], []
    for count in range(1, int(np.ceil(pace.length / pace.step)) + 1):
        if not len(heads.line):
            break
        middle = heads.z + pace.step / 2 * heads.heading
        target = heads.z + pace.step * cells.heading(middle, heads.pixel, heads.q)
        fine, moved = heads.at(cells, target, pace)
        if not fine.all():
            refused.append(heads.where(~fine))
            targets.append(target[~fine])
        back, home = _returned(
            target - seeds[heads.line], moved.heading * begun[heads.line].conj(), count, pace
        )
        ended = moved.where(fine & home)
        closed[ended.line] = True
        record.append((ended.line, seeds[ended.line], ended.q))
        heads = moved.where(fine & ~back)
        record.append((heads.line, heads.z, heads.q))
    if refused:
        record.append(_last_points(cells, _together(refused), np.concatenate(targets), pace))
    return _walks_of(record, closed)


def _heads(cells: _Cells, seeds: Positions, labels: Labels, pace: _Pace) -> _Heads:
    """The heads of the lines that may start at all."""
    line = np.flatnonzero(cells.inside[cells.index(cells.pixel(seeds))])
    z = seeds[line]
    allowed, heads = _Heads(line, z, cells.pixel(z), labels[line], np.zeros_like(z)).at(cells, z, pace)
    return heads.where(allowed)


def _together(heads: list[_Heads]) -> _Heads:
    return _Heads(*(np.concatenate([getattr(some, part.name) for some in heads]) for part in fields(_Heads)))


def _returned(way: Positions, turn: Positions, count: int, pace: _Pace) -> tuple[Bools, Bools]:
    """Which lines are back beside their seed in the direction they left it, and which of them have met it."""
    distance, travelled = np.abs(way), count * pace.step
    same = turn.real > 0.5
    home = same & (distance < 0.7 * pace.step) & (count > 8)
    beside = same & (distance < pace.return_distance) & (travelled > 3 * pace.return_distance)
    return home | beside, home


def _last_points(
    cells: _Cells, heads: _Heads, target: Positions, pace: _Pace
) -> tuple[Labels, Positions, Labels]:
    """Line, position and label of the farthest point of each refused last step, by bisection."""
    way, reach, size = target - heads.z, np.zeros(len(target)), 0.5
    for _ in range(_HALVINGS):
        allowed, _ = heads.at(cells, heads.z + (reach + size) * way, pace)
        reach += np.where(allowed, size, 0.0)
        size /= 2
    z = heads.z + reach * way
    return heads.line, z, heads.at(cells, z, pace)[1].q


def _walks_of(record: list[tuple[Labels, Positions, Labels]], closed: Bools) -> list[_Walk]:
    owner, z, q = (np.concatenate(arrays) for arrays in zip(*record, strict=True))
    order = np.argsort(owner, kind="stable")
    limits = np.cumsum(np.bincount(owner, minlength=len(closed)))[:-1]
    parts = zip(np.split(z[order], limits), np.split(q[order], limits), closed, strict=True)
    return [_Walk(points, labels, 0, closed=bool(loop)) for points, labels, loop in parts]


class _Cover:
    """A raster, finer than the separation, of what the lines of each family already cover.

    near: closer than CLOSEST separations to a line: lines end here. wide: closer than the separation: no
    seeds here.
    shut: no seeds either, because the mask or the crosses end here or because lines from here are too short.
    Families are those of the pixel that holds the raster cell; a line marks the family whose direction is
    nearest to its own, so cuts of the combing do not matter.
    """

    def __init__(self, cells: _Cells, separation: float) -> None:
        field = cells.field
        self.separation = separation
        self.fine = int(np.ceil(_FINENESS / separation))
        degenerate = field.image(field.degenerate, 1.0) > 0
        self.open = np.kron(~degenerate, np.ones((self.fine, self.fine))) > 0
        self.near = np.zeros((2, *self.open.shape), dtype=bool)
        self.wide = self.near.copy()
        self.shut = np.stack([~self.open, ~self.open])
        self.number = field.instance.grid.number
        self.towards_u = towards_u(field)
        self.field = field

    def _raster(self, z: Positions) -> tuple[_Array, _Array]:
        row = np.floor((0.5 - z.imag) * self.fine).astype(np.int64)
        column = np.floor((0.5 + z.real) * self.fine).astype(np.int64)
        height, width = self.open.shape
        return np.maximum(np.minimum(row, height - 1), 0), np.maximum(np.minimum(column, width - 1), 0)

    def blocked(self, z: Positions, q: Labels) -> Bools:
        """True where a line of label q at z would be too near to another one."""
        near: Bools = self.near[q & 1, *self._raster(z)]
        return near

    def covered(self, z: complex, family: int) -> bool:
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
        at = np.arange(0.0, along[-1], 1.0 / self.fine)
        z = np.append(np.interp(at, along, line.z), line.z[-1])
        tangent = np.append(np.interp(at, along, np.gradient(line.z)), line.z[-1] - line.z[-2])
        angle = double_angle(np.angle(tangent))
        # Half the diagonal of a raster cell more, so that no point of a free cell is nearer than asked.
        self._mark(self.near, z, angle, CLOSEST * self.separation * self.fine + np.sqrt(0.5))
        self._mark(self.wide, z, angle, self.separation * self.fine)
        for raster in (self.near, self.wide):  # its own way for certain, where crosses jump too
            raster[line.q & 1, *self._raster(line.z)] = True

    def _mark(self, raster: Bools, z: Positions, angle: Floats, radius: float) -> None:
        reach = np.arange(-int(radius) - 1, int(radius) + 2)
        down, across = (offset.ravel() for offset in np.meshgrid(reach, reach, indexing="ij"))
        disc = np.hypot(down, across) < radius + np.sqrt(0.5)
        down, across = down[disc], across[disc]
        row, column = self._raster(z)
        below, beyond = row + 0.5 - (0.5 - z.imag) * self.fine, column + 0.5 - (0.5 + z.real) * self.fine
        close = (below[:, None] + down) ** 2 + (beyond[:, None] + across) ** 2 <= radius**2
        point, offset = np.nonzero(close)
        row, column = row[point] + down[offset], column[point] + across[offset]
        held = (row >= 0) & (column >= 0) & (row < self.open.shape[0]) & (column < self.open.shape[1])
        row, column, point = row[held], column[held], point[held]
        pixel = self.number[row // self.fine, column // self.fine]
        family = (np.sum(angle[point] * self.towards_u[pixel], axis=1) < 0).astype(np.int64)
        raster[family, row, column] = True

    def fronts(self) -> Iterator[tuple[Positions, Labels]]:
        """Seeds and families of the next candidates, until everything is covered or given up.

        Seeds lie just outside what is covered; where nothing is, one seed far from all borders.
        """
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
        row, column = np.nonzero(front)
        size = 2 * self.separation * self.fine
        key = np.floor(row / size) * (self.open.shape[1] + 1) + np.floor(column / size)
        chosen = np.unique(key, return_index=True)[1]
        return (column[chosen] + 0.5) / self.fine - 0.5 - 1j * ((row[chosen] + 0.5) / self.fine - 0.5)
