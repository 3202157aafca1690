"""Check a certificate of a cross field with no code of its prover: `python check_certificate.py FILE`.

This file needs only Python 3.9 or newer and NumPy. It follows the page "Proven optima" of crossfield
(docs/proofs.md) from the top to the bottom. "Section" and "Lemma" refer to that page, which also has the
proofs. The page "Files" (docs/files.md, "Layout of a certificate") describes the arrays.

Everything is recomputed from the instance in float64: the energy U of the field; for every level of the
lattice the costs, a bound, the cells that it excludes, and that the next level covers the rest; and the least
energy in the boxes round the last cells. Exit code 0: the claim is proven. 1: it is not; a line names the
place. 2: the file is not a certificate. 3: there is too little memory to check it.

"Optimal" means: no field has an energy below U by more than the number printed, which is at most OPTIMAL
times the greater of 1 and U. "Gap" means: no field has an energy below the bound.

Rounding. Shares and tables may be any numbers, so errors in them do no harm. What counts is how much an
inequality may fail at a pixel, a pair or a quad. That is below a small multiple (ROUNDING) of the machine's
precision times the size of the numbers that enter, and the sum over all of them is taken off every bound.
Sums over pixels are made without rounding (math.fsum). Domains may fall short of the strip by SLIVER radians;
moving a cross by that much at every level changes F by less than `slack_of`, which is allowed for, too. pi
stands for the double next to it, as in the definition of the field.
"""

from __future__ import annotations

import io
import json
import math
import sys
import zipfile
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

FORMAT, VERSION = "crossfield-certificate", 4
HALF, QUARTER = math.pi / 2, math.pi / 4
OPTIMAL = 1e-8
SPARE = 1e-10  # taken off a bound that is reported, relative to 1 + it: other processors round otherwise
PRECISION = 2.0**-52
ROUNDING = 64.0
SLIVER = 2e-14
MOST_BYTES = 1 << 31  # of all arrays
ROOM, MORE_ROOM = 1 << 28, 128  # memory for a certificate: a number, and one for each byte of its file
MOST_LEVELS = 256
MOST_SIDE = 9999
MOST_PIECES = 400  # of the boxes
MOST_COUNT = 4096  # labels of a pixel in alpha, and in beta
MOST_LABELS = 1 << 28  # of a level
MOST_ANGLE = 16.0
MOST_JUMP = 64
MOST_WEIGHT = 1e6
MOST_UNIT = 1.0  # of a share or a table
ROWS, BLOCK = 32, 1 << 16  # rows of a product, and numbers, that NumPy handles at once

PARTS = (
    "head", "instance_head", "instance_origin", "instance_mask", "instance_stroke_pixels", "instance_theta",
    "instance_w", "alpha", "beta", "p", "centre_alpha", "centre_beta", "cuts", "multipliers",
)  # fmt: skip
SLOPES = "slopes"  # also, unless the norm is 2
LEVEL_PARTS = ("h", "ranges", "allowed", "share_steps", "share_unit", "quads", "table_steps", "table_unit")

Array = Any


class RefusedError(Exception):
    """A claim that does not follow; the message names the place."""


class UnreadableError(Exception):
    """A file that is not a certificate."""


# The archive -----------------------------------------------------------------------------------------------


def read(path: str) -> dict[str, Array]:
    """Read the arrays of a certificate."""
    try:
        with open(path, "rb") as stream:  # noqa: PTH123 - only built-in functions
            data = stream.read(MOST_BYTES + 1)
    except (OSError, ValueError) as error:
        raise UnreadableError(f"cannot be read ({type(error).__name__})") from error
    return unpack(data)


def unpack(data: bytes) -> dict[str, Array]:
    """Unpack the arrays of a certificate; names and sizes are checked before anything is unpacked."""
    arrays: dict[str, Array] = {}
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            total = sum(member.file_size for member in archive.infolist())
            too_large = total > MOST_BYTES or 4 * total > ROOM + MORE_ROOM * len(data)
            _need_format(not too_large, "has larger arrays than a file of its size may have")
            for member in archive.infolist():
                _need_format(member.compress_type in (0, 8), "is packed in another way than NumPy packs")
                name, ending = member.filename[:-4], member.filename[-4:]
                _need_format(ending == ".npy" and name not in arrays, f"has a wrong member {name[:40]!r}")
                arrays[name] = array_of(archive.read(member), name)
        need_names(arrays)
        need_room(arrays, len(data))
    except (UnreadableError, RefusedError, MemoryError):
        raise
    except Exception as error:  # a damaged archive can raise anything
        raise UnreadableError(f"is no .npz that can be read ({type(error).__name__})") from error
    return arrays


def array_of(data: bytes, name: str) -> Array:
    """Return the array in the bytes of a .npy, whose header is checked before it is trusted; no pickles."""
    stream = io.BytesIO(data)
    version = np.lib.format.read_magic(stream)
    _need_format(version == (1, 0), f"{name} is no array as certificates have it")
    shape, by_columns, kind = np.lib.format.read_array_header_1_0(stream)
    size = len(data) - stream.tell()
    fits = kind.kind in "biuf" and not by_columns and min(shape, default=0) >= 0
    _need_format(fits and math.prod(shape) * kind.itemsize == size, f"{name} differs from its header")
    array = np.frombuffer(data, kind, offset=stream.tell()).reshape(shape)
    bits = kind.kind != "b" or array.view(np.uint8).max(initial=0) <= 1
    _need_format(bits, f"{name} has bits that are neither 0 nor 1")
    return array


def need_names(arrays: dict[str, Array]) -> None:
    """Raise UnreadableError unless the arrays are exactly those of a certificate with that many levels."""
    head = head_of(arrays)
    levels, names = level_count(head), set(PARTS) | (set() if norm_of(head) == 2 else {SLOPES})
    names |= {f"level_{number}_{part}" for number in range(levels) for part in LEVEL_PARTS}
    for name in sorted(names - set(arrays)):
        raise UnreadableError(f"has no array {name}")
    for name in sorted(set(arrays) - names):
        raise UnreadableError(f"has an array {name[:40]} too many for a certificate with {levels} levels")


def need_room(arrays: dict[str, Array], size: int) -> None:
    """Raise UnreadableError unless a file of that size may take the memory that the check would take.

    The bytes for each number are more than what the check was measured to take.
    """
    mask, most = arrays["instance_mask"], 0
    for number in range(level_count(head_of(arrays))):
        at = f"level_{number}_"
        counts = np.clip(take(arrays, f"{at}ranges", "<i4", None, 4)[:, 1::2], 0, MOST_COUNT).astype(np.int64)
        labels, side = int(counts.prod(axis=1).sum()), int(counts.max(initial=0))
        shares = arrays[f"{at}share_steps"].size
        most = max(most, 8 * labels + 64 * shares + 96 * side * side + 32 * arrays[f"{at}table_steps"].size)
    most += 24 * mask.size + 1500 * int(mask.sum()) + sum(array.nbytes for array in arrays.values())
    enough = most <= ROOM + MORE_ROOM * size
    _need_format(enough, f"takes {most >> 20} MB of memory to check, more than a file of its size may")


def head_of(arrays: dict[str, Array]) -> dict[str, Any]:
    """The text in the array `head`."""
    head = text_of(arrays, "head")
    version = head.get("version")
    known = head.get("format") == FORMAT and type(version) is int and version == VERSION
    _need_format(known, f"is no {FORMAT} of version {VERSION}; make it again with crossfield prove")
    return head


def norm_of(head: dict[str, Any]) -> Any:
    """The norm of the energy: 2, 1 or "mixed"."""
    norm = head.get("norm")
    _need_format(type(norm) in (int, str) and norm in (1, 2, "mixed"), "is of an unknown norm")
    return norm


def level_count(head: dict[str, Any]) -> int:
    """The number of levels that a certificate has."""
    count = number_in(head, "levels", 1, MOST_LEVELS)
    _need(count == int(count), "levels", "is no whole number")
    return int(count)


def text_of(arrays: dict[str, Array], name: str) -> dict[str, Any]:
    """The JSON object in an array of bytes."""
    text = json.loads(take(arrays, name, "|u1", None).tobytes().decode(), object_pairs_hook=_unique)
    _need_format(isinstance(text, dict), f"{name} is not a JSON object")
    return text  # type: ignore[no-any-return]


def _unique(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """A JSON object without repeated keys, because programs differ on which of them counts."""
    _need_format(len(dict(pairs)) == len(pairs), "has a text with a repeated key")
    return dict(pairs)


def number_in(head: dict[str, Any], name: str, least: float, most: float) -> float:
    """A number of a JSON object, within limits."""
    value: Any = head.get(name)
    _need(type(value) in (int, float) and least <= value <= most, name, f"is not in [{least:g}, {most:g}]")
    return float(value)


def take(arrays: dict[str, Array], name: str, kind: str, *shape: int | None) -> Array:
    """The array of that name, of that kind and, where sides are given, of that shape; finite."""
    _need_format(name in arrays, f"has no array {name}")
    array = arrays[name]
    fits = array.ndim == len(shape) and all(side in (None, size) for side, size in zip(shape, array.shape))
    _need_format(
        array.dtype == np.dtype(kind) and fits, f"{name} has another kind or shape than other arrays ask for"
    )
    if array.dtype.kind == "f":
        _need(np.isfinite(array).all(), name, "holds something that is no number")
    return array


class Blocks:
    """Blocks of numbers: whole multiples of a unit each, stored by their differences modulo 2^32."""

    def __init__(self, arrays: dict[str, Array], name: str, counts: Array) -> None:
        """counts: how many numbers each block has."""
        self.unit = take(arrays, f"{name}_unit", "<f8", len(counts))
        _need((self.unit >= 0) & (self.unit <= MOST_UNIT), f"{name}_unit", "is not in [0, 1]")
        self.ends = np.concatenate([[0], np.cumsum(counts, dtype=np.int64)])
        self.steps = take(arrays, f"{name}_steps", "<i4", int(self.ends[-1]))

    def __getitem__(self, block: int) -> Array:
        """The numbers of a block, computed each time, because all of them together take much memory."""
        steps = self.steps[self.ends[block] : self.ends[block + 1]]
        return np.cumsum(steps, dtype=np.int32) * self.unit[block]


def _need_format(holds: Any, otherwise: str) -> None:
    """Raise UnreadableError unless the condition holds."""
    if not holds:
        raise UnreadableError(otherwise)


def _need(holds: Any, name: str, wrong: str) -> None:
    """Raise RefusedError, with the first place that fails, unless all of the condition holds."""
    holds = np.asarray(holds)
    if not holds.all():
        place = f"[{int(np.argmin(holds))}]" if holds.ndim else ""
        raise RefusedError(f"{name}{place} {wrong}")


# Section 1: the instance, the field, and the energy --------------------------------------------------------


@dataclass
class Sketch:
    """The terms of F: pixels in their order, pairs of neighbours, strokes.

    first, second (m,): the pixels i and j of each pair. white (n,): on the checkerboard. weight, theta (n,):
    W and the direction of the stroke, 0 where there is none. slope (n,): l of section 9. lower (n,): least
    alpha of the gauge. norm: 1, 2 or "mixed".
    """

    norm: Any
    first: Array
    second: Array
    white: Array
    weight: Array
    theta: Array
    slope: Array
    lower: Array
    w_beta: float
    later: list[list[int]] = field(init=False)  # of each pixel, its pairs with later pixels
    earlier: list[list[int]] = field(init=False)

    def __post_init__(self) -> None:
        self.later, self.earlier = [[] for _ in self.white], [[] for _ in self.white]
        for e, (i, j) in enumerate(zip(self.first.tolist(), self.second.tolist())):
            self.later[min(i, j)].append(e)
            self.earlier[max(i, j)].append(e)

    def residuals(self, alpha: Array, beta: Array, p: Array, line: Array, theta: Array) -> list[Array]:
        """A and B of all pairs, R of all pixels, and beta.

        line (n,): 0 where u carries the stroke; 1 and -1 where v does, above and below the window of u.
        """
        i, j = self.first, self.second
        a, b = alpha[i] - alpha[j] + HALF * p, sign(p) * beta[i] - beta[j]
        return [a, b, alpha + sign(line) * beta - theta - HALF * line, beta]

    @property
    def weights(self) -> list[Array]:
        """The weights of these residuals in F."""
        two = np.full(len(self.first), 2.0)
        return [two, two, self.weight, np.full(len(self.weight), self.w_beta)]

    @property
    def squared(self) -> list[bool]:
        """Whether F has the squares of these residuals, and not their absolute values."""
        return [self.norm == 2, self.norm == 2, self.norm != 1, self.norm != 1]


def sign(p: Array) -> Array:
    """The sign (-1)^p of each jump."""
    return 1.0 - 2.0 * (p & 1)


def sketch_of(arrays: dict[str, Array]) -> tuple[Sketch, Array]:
    """The instance, with directions moved into the gauge's own range, and its stroke pixels."""
    head = text_of(arrays, "instance_head")
    _need("instance_crossings" not in arrays, "instance_crossings", "is not covered by certificates")
    mask = take(arrays, "instance_mask", "|b1", None, None)
    take(arrays, "instance_origin", "<f8", 2)  # not part of the proof, but of the instance
    _need(max(mask.shape) <= MOST_SIDE, "instance_mask", "has too long a side")
    rows, columns = np.nonzero(mask)
    n = len(rows)
    _need(n > 0, "instance_mask", "has no pixel")
    number = np.full((mask.shape[0] + 1, mask.shape[1] + 1), -1)
    number[1:, :-1][mask] = np.arange(n)
    neighbours = np.stack([number[rows, columns], number[rows + 1, columns + 1]], axis=1)  # upper, right
    first, side = np.nonzero(neighbours >= 0)

    theta = take(arrays, "instance_theta", "<f8", None)
    w = take(arrays, "instance_w", "<f8", len(theta))
    places = take(arrays, "instance_stroke_pixels", "<i4", len(theta), 2).astype(np.int64)
    gauge = head.get("gauge")
    _need(gauge in ("strokes", "box"), "gauge", "is unknown")
    _need((theta >= 0) & (theta < np.pi), "instance_theta", "is not in [0, pi)")
    _need((w > 0) & (w <= 1), "instance_w", "is not in (0, 1]")
    _need(((places >= 0) & (places < mask.shape)).all(axis=1), "instance_stroke_pixels", "is no pixel")
    at = number[1:, :-1][tuple(places.T)]
    _need(at >= 0, "instance_stroke_pixels", "is outside the mask")
    _need(np.diff(at) > 0, "instance_stroke_pixels", "is out of order")
    weight, direction, lower = np.zeros((3, n))
    weight[at] = number_in(head, "w_strokes", 0.0, MOST_WEIGHT) * w
    if gauge == "strokes":
        direction[at], lower[at] = theta, theta - QUARTER
    else:
        direction[at] = np.where(theta >= 3 * QUARTER - 1e-9, np.maximum(theta - np.pi, -QUARTER), theta)
    white, w_beta = (rows + columns) % 2 == 1, number_in(head, "w_beta", 0.0, MOST_WEIGHT)
    terms = first, neighbours[first, side], white, weight, direction, np.zeros(n), lower, w_beta
    return Sketch(norm_of(head_of(arrays)), *terms), at


def field_of(arrays: dict[str, Array], sketch: Sketch) -> tuple[Array, Array, Array]:
    """The angles alpha, beta (n,) and jumps p (m,) of the field, which must lie in the windows."""
    n, m = len(sketch.white), len(sketch.first)
    alpha, beta, p = (
        take(arrays, *each) for each in (("alpha", "<f8", n), ("beta", "<f8", n), ("p", "<i4", m))
    )
    inside = (alpha >= sketch.lower - SLIVER) & (alpha <= sketch.lower + HALF + SLIVER)
    _need(inside, "alpha", "is outside the window of the gauge")
    _need(np.abs(beta) <= QUARTER + SLIVER, "beta", "is beyond pi/4")
    _need(np.abs(p.astype(np.int64)) <= MOST_JUMP, "p", "is no jump")
    return alpha, beta, p.astype(np.int64)


def energy_of(sketch: Sketch, alpha: Array, beta: Array, p: Array) -> tuple[float, float]:
    """The energy U of a field by its definition, and the greatest error of the number."""
    u = np.zeros(len(alpha), np.int64)
    residuals = sketch.residuals(alpha, beta, p, u, sketch.theta)
    sizes = [x * x if squared else np.abs(x) for x, squared in zip(residuals, sketch.squared)]
    total = math.fsum(np.concatenate([k * size for k, size in zip(sketch.weights, sizes)]))
    slope_a, slope_b, slope_r, _ = (
        2 * np.abs(x) if squared else np.ones_like(x) for x, squared in zip(residuals, sketch.squared)
    )
    size = np.abs(alpha[sketch.first]) + np.abs(alpha[sketch.second]) + HALF * np.abs(p) + 1
    error = np.sum(4 * size * (slope_a + slope_b)) + np.sum(sketch.weight * 8 * slope_r)
    return total, PRECISION * (float(error) + 8 * total)


def with_strokes(arrays: dict[str, Array], sketch: Sketch, at: Array) -> tuple[Sketch, Array, Array]:
    """Lemma 0: the terms in the parts of the mask that have a stroke, and the numbers of pixels and pairs.

    at: the stroke pixels. All levels are about these pixels alone, numbered anew.
    """
    held = np.zeros(len(sketch.white), bool)
    held[at] = True
    count = -1
    while count != int(held.sum()):
        count = int(held.sum())
        joined = held[sketch.first] | held[sketch.second]
        held[sketch.first[joined]] = held[sketch.second[joined]] = True
    pixels, pairs, anew = np.flatnonzero(held), np.flatnonzero(held[sketch.first]), np.cumsum(held) - 1
    slope = np.zeros(len(pixels))
    if sketch.norm != 2:
        slope = take(arrays, SLOPES, "<f8", len(pixels))
        _need(np.abs(slope) <= (1.0 if sketch.norm == 1 else HALF), SLOPES, "is too steep")
    ends = anew[sketch.first[pairs]], anew[sketch.second[pairs]]
    strokes = sketch.weight[pixels], sketch.theta[pixels], slope, sketch.lower[pixels]
    return Sketch(sketch.norm, *ends, sketch.white[pixels], *strokes, sketch.w_beta), pixels, pairs


def slack_of(weight: Array, w_beta: float, levels: int) -> float:
    """Greatest change of F when every angle moves by SLIVER at each level.

    At most four pairs with slopes of 4 |A| and 4 |B|, both at most pi / 2 at the best jumps, 2 W pi/2 and
    2 w_beta pi/4. Those of absolute values are less.
    """
    slopes = 64.0 + 8.0 * weight + 4.0 * w_beta
    return 2 * (levels + 1) * SLIVER * float(np.sum(slopes))


# Section 2: a lattice of labels ----------------------------------------------------------------------------


@dataclass
class Quad:
    """The four pixels a (lower left), b, c, d counter-clockwise, and the tables of their pairs.

    pairs, tables: of (a, b), (b, c), (d, c) and (a, d), by the alphas of these.
    """

    pixels: list[int]
    pairs: list[int]
    tables: list[Array]


@dataclass
class Level:
    """The labels of a level, its shares and its tables.

    alpha, beta (n,): the centres. least (n, 2): the least k and l of each pixel. allowed: of each pixel, by k
    and l. offset (n,): o. shares: what each pair gives to the allowed labels of its earlier pixel, row by
    row. rows, columns: the numbers of the alphas and betas of each pixel that have an allowed label.
    """

    h: float
    alpha: Array
    beta: Array
    offset: Array
    least: Array
    allowed: list[Array]
    shares: Any
    quads: list[Quad]
    tables: dict[int, Array] = field(init=False)  # the sum at each pair that has some
    rows: list[Array] = field(init=False)
    columns: list[Array] = field(init=False)

    def __post_init__(self) -> None:
        self.rows, self.columns = (
            [np.flatnonzero(allowed.any(axis=axis)) for allowed in self.allowed] for axis in (1, 0)
        )
        self.tables = {}
        for quad in self.quads:
            for e, table in zip(quad.pairs, quad.tables):
                self.tables[e] = self.tables[e] + table if e in self.tables else table

    def places(self, i: int) -> tuple[Array, Array]:
        """Alpha of every k and beta of every l of pixel i."""
        k, l = (np.arange(size) + least for size, least in zip(self.allowed[i].shape, self.least[i]))  # noqa: E741
        o = self.offset[i]
        return self.alpha[i] + self.h * (k + o), self.beta[i] + self.h * (l + o)


def level_of(arrays: dict[str, Array], number: int, sketch: Sketch) -> Level:
    """Level `number` of the certificate."""
    n, at = len(sketch.white), f"level_{number}_"
    h = float(take(arrays, f"{at}h", "<f8", 1)[0])
    _need(1e-5 <= h <= QUARTER + SLIVER, f"{at}h", "is no spacing")
    alpha, beta = (take(arrays, f"centre_{name}", "<f8", n) for name in ("alpha", "beta"))
    _need(np.abs(alpha) <= MOST_ANGLE, "centre_alpha", "is too large")
    _need(np.abs(beta) <= MOST_ANGLE, "centre_beta", "is too large")
    if sketch.norm != 2:  # section 9: one lattice for all pixels
        _need(h * round(HALF / h) == HALF, f"{at}h", "does not divide pi/2")
        _need(sketch.norm == 1 or h <= HALF / 8, f"{at}h", "is too wide")
        _need(alpha == h * np.round(alpha / h), "centre_alpha", "is no multiple of the spacing")
        _need(beta == 0, "centre_beta", "is not 0")
    ranges = take(arrays, f"{at}ranges", "<i4", n, 4).astype(np.int64)
    least, shapes = ranges[:, ::2], ranges[:, 1::2]
    _need(((shapes >= 2) & (shapes <= MOST_COUNT)).all(axis=1), f"{at}ranges", "has no cell, or too many")
    _need((h * (np.abs(least) + shapes) <= MOST_ANGLE).all(axis=1), f"{at}ranges", "leads too far away")
    counts = shapes.prod(axis=1)
    labels = int(counts.sum())
    _need(labels <= MOST_LABELS, f"{at}ranges", "has too many labels in all")
    bits = np.unpackbits(take(arrays, f"{at}allowed", "|u1", (labels + 7) // 8), count=labels).astype(bool)
    blocks = np.split(bits, np.cumsum(counts)[:-1])
    allowed = [block.reshape(shape) for block, shape in zip(blocks, shapes)]
    _need([at_corners(np.logical_and, x).any() for x in allowed], f"{at}allowed of pixel", "has no cell")
    sizes = np.array([np.count_nonzero(x) for x in allowed], np.int64)
    shares = Blocks(arrays, f"{at}share", sizes[np.minimum(sketch.first, sketch.second)])
    offset = 0.5 * (sketch.white & (sketch.norm == 2))
    return Level(h, alpha, beta, offset, least, allowed, shares, quads_of(arrays, at, sketch, shapes[:, 0]))


def quads_of(arrays: dict[str, Array], at: str, sketch: Sketch, sides: Array) -> list[Quad]:
    """The quads of a level that have tables. sides (n,): the number of alphas of each pixel."""
    lower_left = take(arrays, f"{at}quads", "<i4", None)
    _need((lower_left >= 0) & (lower_left < len(sides)), f"{at}quads", "is no pixel")
    _need(np.diff(lower_left) > 0, f"{at}quads", "is out of order")
    pair_of = {ends: e for e, ends in enumerate(zip(sketch.first.tolist(), sketch.second.tolist()))}
    upper = {i: j for i, j in pair_of if j < i}
    right = {i: j for i, j in pair_of if j > i}
    quads: list[Quad] = []
    counts: list[Array] = []
    for a in lower_left.tolist():
        b, d = right.get(a, -1), upper.get(a, -1)
        c = right.get(d, -1)
        _need(c >= 0 and upper.get(b, -1) == c, f"{at}quads", f"has no quad at pixel {a}")
        ends = ((a, b), (b, c), (d, c), (a, d))
        quads.append(Quad([a, b, c, d], [pair_of[pair] for pair in ends], []))
        counts += [sides[[*pair]] for pair in ends]
    shapes = np.array(counts, np.int64).reshape(-1, 2)
    tables = Blocks(arrays, f"{at}table", shapes.prod(axis=1))
    for number, shape in enumerate(shapes):
        quads[number // 4].tables.append(tables[number].reshape(shape))
    return quads


def at_corners(both: Any, labels: Array) -> Array:
    """Combine the values at the four corners of each cell with `both`."""
    return both(both(labels[:-1, :-1], labels[1:, :-1]), both(labels[:-1, 1:], labels[1:, 1:]))


def need_whole_strip(level: Level) -> None:
    """Raise RefusedError unless the domain of each pixel holds every cross."""
    for i, allowed in enumerate(level.allowed):
        alpha, beta = level.places(i)
        _need(allowed.all(), f"level_0_allowed of pixel {i}", "leaves out labels")
        _need(alpha[-1] - alpha[0] >= HALF - SLIVER, f"level_0_ranges[{i}]", "is less than pi/2 of alpha")
        full = beta[0] <= -QUARTER + SLIVER and beta[-1] >= QUARTER - SLIVER
        _need(full, f"level_0_ranges[{i}]", "is less than all of beta")


# Section 3, Lemma 1: discrete costs ------------------------------------------------------------------------


def pixel_costs(level: Level, sketch: Sketch, i: int) -> tuple[Array, float]:
    """The cost D of each allowed label of pixel i, and the size of its terms."""
    alpha, beta = level.places(i)
    k, l = np.nonzero(level.allowed[i])  # noqa: E741 - the letters of the page
    skew = np.abs(beta) if sketch.norm == 1 else beta * beta - level.h * level.h / 4
    cost = (sketch.w_beta * skew)[l]
    if sketch.weight[i] > 0:
        s = level.least[i].sum() + k + l + int(2 * level.offset[i])
        cost = cost + sketch.weight[i] * stroke_costs(level, sketch, i, (alpha[k], beta[l], s))
    size = 2.0 + float(np.abs(alpha).max() + np.abs(beta).max())
    return cost, (float(sketch.weight[i]) + sketch.w_beta) * size * size


def stroke_costs(level: Level, sketch: Sketch, i: int, labels: tuple[Array, Array, Array]) -> Array:
    """The least over lines and turns of R^2 less its deduction (section 3), or of d (section 9).

    labels: alpha, beta and s of each.
    """
    (alpha, beta, s), square, theta = labels, level.h * level.h, sketch.theta[i]
    u, v = alpha + beta - theta, alpha + HALF - beta - theta
    v = v - math.pi * np.round(v / math.pi)
    if sketch.norm == 2:
        turn = round(float(level.alpha[i] + level.beta[i] - theta) / math.pi)  # of u at the centre
        others = np.abs(u - math.pi * np.round(u / math.pi))
        others = np.where(np.round(u / math.pi) == turn, math.pi - others, others)
        deduction = np.where(np.abs(s) <= 1, np.abs(s), 0.5) * square
        nearest = np.minimum(others, np.abs(v))
        return np.minimum((u - math.pi * turn) ** 2 - deduction, nearest**2 - square / 2)
    u, slope = u - math.pi * np.round(u / math.pi), sketch.slope[i]
    near = 2 * level.h * (1 + 1e-12) + 1e-12  # where rounding could go either way: d is less if near
    if sketch.norm == 1:
        of_u = np.where(np.abs(u) < near, slope * u, np.abs(u))
        return np.minimum(of_u, np.where(np.abs(v) < near, 0.0, np.abs(v)))
    away = np.abs(u - slope / 2)
    return np.minimum(u * u - np.where(away < near, away * away, square / 2), v * v - square / 2)


class PairCost:
    """The cost c' of a pair: for jumps of each parity a matrix in alpha plus one in beta.

    c' is the lesser of the two. With d = alpha_i - alpha_j, the best jump of a parity has |A| <= pi/2, so it
    is among ceil(-2 d/pi - 1) .. floor(-2 d/pi + 1). For all labels of two pixels at once these are the jumps
    from the least to the greatest of them, with a margin for rounding. Alphas and betas without an allowed
    label are left out, because no minimum needs them. parts: for each parity, the matrix in alpha and that in
    beta, by the labels of the earlier and of the later pixel. size: of the terms.
    """

    def __init__(self, level: Level, sketch: Sketch, e: int) -> None:
        i, j = int(sketch.first[e]), int(sketch.second[e])
        (alpha_i, beta_i), (alpha_j, beta_j) = (
            (alpha[level.rows[x]], beta[level.columns[x]])
            for x in (i, j)
            for alpha, beta in [level.places(x)]
        )
        lowest = math.ceil(-2 * float(alpha_i[-1] - alpha_j[0]) / math.pi - 1 - 1e-6)
        highest = math.floor(-2 * float(alpha_i[0] - alpha_j[-1]) / math.pi + 1 + 1e-6)
        table: Any = level.tables[e][np.ix_(level.rows[i], level.rows[j])] if e in level.tables else 0.0
        reach = sum(float(np.abs(x).max()) for x in (alpha_i, beta_i, alpha_j, beta_j))
        self.size = (1.0 + reach + HALF * max(-lowest, highest, 0)) ** 2 + float(np.abs(table).max())
        self.allowed = [level.allowed[x][np.ix_(level.rows[x], level.columns[x])] for x in sorted((i, j))]
        parts = []
        for parity in (0, 1):
            jumps = [p for p in range(lowest, highest + 1) if p % 2 == parity]
            if not jumps:
                continue
            a = np.abs(alpha_i[:, None] - alpha_j + HALF * jumps[0])
            for p in jumps[1:]:
                a = np.minimum(a, np.abs(alpha_i[:, None] - alpha_j + HALF * p))
            b = np.abs((1 - 2 * parity) * beta_i[:, None] - beta_j)
            if sketch.norm == 2:
                a, b = a * a - level.h * level.h / 2, b * b
            a, b = 2 * a + table, 2 * b
            parts.append((a, b) if i < j else (a.T, b.T))
        most = min(float(a.max() + b.max()) for a, b in parts)
        self.parts = [(a, b) for a, b in parts if a.min() + b.min() <= most]  # others are nowhere less

    def least(self, at_labels: Array, *, back: bool = False) -> Array:
        """The least at_labels(x) + c'(x, y) over x of the earlier pixel, for each label y of the later one.

        at_labels and the result have one number for each allowed label. back: with the pixels exchanged.
        """
        here, there = self.allowed[:: -1 if back else 1]
        spread = np.full(here.shape, np.inf)
        spread[here] = at_labels
        ends = [
            min_plus(a, min_plus(spread, b.T)) if back else min_plus(a.T, min_plus(spread, b))
            for a, b in self.parts
        ]
        least: Array = np.minimum.reduce(ends)[there]
        return least


def min_plus(left: Array, right: Array) -> Array:
    """The matrix of min over k of left[x, k] + right[k, y]; left may be inf, but no row of it.

    Some rows are computed at a time, without the terms k that are nowhere less than the best one of its row.
    """
    product = np.empty((len(left), right.shape[1]))
    least, most = right.min(axis=1), right.max(axis=1)
    for begin in range(0, len(left), ROWS):
        rows = left[begin : begin + ROWS]
        best = (rows + least).argmin(axis=1)
        enough = rows[np.arange(len(rows)), best] + most[best]
        some = (rows + least <= enough[:, None]).any(axis=0)
        product[begin : begin + ROWS] = _least_sums(rows[:, some], right[some])
    return product


def _least_sums(left: Array, right: Array) -> Array:
    """The matrix of `min_plus` with all terms; NumPy is quicker along the longer side, and with few calls."""
    if left.shape[0] > right.shape[1]:
        turned: Array = _least_sums(right.T, left.T).T
        return turned
    columns, right = np.ascontiguousarray(left.T)[:, :, None], np.ascontiguousarray(right)[:, None, :]
    least, many = (
        np.full((left.shape[0], right.shape[2]), np.inf),
        max(1, BLOCK // (len(left) * right.shape[2])),
    )
    for k in range(0, len(right), many):
        np.minimum(least, (columns[k : k + many] + right[k : k + many]).min(axis=0), out=least)
    return least


# Sections 4 and 5: the bound, and the cells that are left --------------------------------------------------


@dataclass
class Test:
    """The left side of Lemma 3 or 3a at each allowed label of each pixel, and the greatest error of these."""

    bounds: list[Array]
    error: float


class ForwardPass:
    """A forward pass over a level: the bound L of Lemma 2, and the tests of Lemmas 3 and 3a.

    The pass starts from the greatest shares of the later pixels, so that the last sum of Lemma 2 is zero.
    """

    def __init__(self, level: Level, sketch: Sketch, most: float) -> None:
        """most: greatest energy of interest. Where the bound exceeds it, Lemma 3 alone leaves no cell."""
        self.level, self.sketch = level, sketch
        self.before: dict[int, Array] = {}  # the shares of later pixels before the pass
        self.shares: dict[int, tuple[Array, Array]] = {}  # those of earlier and of later pixels after it
        self.errors: list[float] = []
        visits = [self._visit(i) for i in range(len(level.allowed))]
        excess, least, before = ([visit[k] for visit in visits] for k in range(3))
        quads = [self._quad_term(quad) for quad in level.quads]
        error = 2 * math.fsum(self.errors)
        bound = math.fsum([*quads, *least])
        partial = [math.fsum([*quads, *least[: i + 1], *before[i + 1 :]]) for i in range(len(least))]
        self.bound = bound - error
        self.tests = [Test([t + lower for t, lower in zip(excess, partial)], error)]
        if bound - error <= most + error:
            for comb, wrong in self._combs(excess):
                self.tests.append(Test([bound + excess for excess in comb], error + wrong))

    def _visit(self, i: int) -> tuple[Array, float, float]:
        """Visit pixel i: t_i at its labels, min theta_i, and the same minimum before the pass."""
        sketch, earlier, later = self.sketch, self.sketch.earlier[i], self.sketch.later[i]
        cost, size = pixel_costs(self.level, sketch, i)
        held = [self.level.shares[e] for e in later]
        before = [*held, *(self.before.pop(e) for e in earlier)]
        theta = self._sum(cost, size, [*held, *(self.shares[e][1] for e in earlier)])
        excess = theta - theta.min()
        for e, share in zip(later, held):
            self._send(e, share, share - excess / max(1, len(earlier), len(later)))
        return excess, float(theta.min()), float(self._sum(cost, size, before).min())

    def _sum(self, cost: Array, size: float, shares: list[Array]) -> Array:
        """The sum of the cost of a pixel's labels, with terms of that size, and of the shares."""
        self._account(size + sum(greatest(share) for share in shares))
        total: Array = np.sum([cost, *shares], axis=0)
        return total

    def _send(self, e: int, held: Array, share: Array) -> None:
        """Steps 1 and 2 of a visit at pair e. held, share: of its earlier pixel before and after."""
        pair = PairCost(self.level, self.sketch, e)
        self.before[e], sent = pair.least(-held), pair.least(-share)
        self.shares[e] = share, sent
        self._account(pair.size + greatest(held) + greatest(share) + greatest(sent))

    def _quad_term(self, quad: Quad) -> float:
        """Section 4: the term Q of a quad, over the alphas that have an allowed label."""
        a, b, c, d = (self.level.rows[i] for i in quad.pixels)
        ab, bc, dc, ad = (-table for table in quad.tables)
        self._account(sum(greatest(table) for table in quad.tables))
        diagonal = min_plus(ab[np.ix_(a, b)], bc[np.ix_(b, c)])
        return float((min_plus(ad[np.ix_(a, d)].T, diagonal) + dc[np.ix_(d, c)]).min())

    def _combs(self, excess: list[Array]) -> Iterator[tuple[list[Array], float]]:
        """Lemma 3a: m_i of each label for both kinds of trees, and the greatest error of these numbers."""
        sketch = self.sketch
        rest = [
            t * (1 - len(later) / max(1, len(earlier), len(later)))
            for t, earlier, later in zip(excess, sketch.earlier, sketch.later)
        ]
        columns, rows = (runs_of(sketch, upper=upper) for upper in (True, False))
        for teeth, spines in ((columns, rows), (rows, columns)):
            self.errors = []
            yield self._along(spines, self._along(teeth, rest)), 2 * math.fsum(self.errors)

    def _along(self, runs: list[tuple[list[int], list[int]]], terms: list[Array]) -> list[Array]:
        """The least sums over the pixels and pairs of each run, by the labels of each of its pixels.

        terms: of each pixel alone.
        """
        sums = list(terms)
        for pixels, pairs in runs:
            costs = [PairCost(self.level, self.sketch, e) for e in pairs]
            for way in (1, -1):
                carried = terms[pixels[::way][0]]
                for e, cost, j in zip(pairs[::way], costs[::way], pixels[::way][1:]):
                    here, there = self.shares[e][::way]
                    message = cost.least(carried - here, back=way < 0) - there
                    shares = greatest(here) + greatest(there)
                    self._account(cost.size + shares + greatest(carried) + greatest(message))
                    sums[j], carried = sums[j] + message, terms[j] + message
        return sums

    def _account(self, size: float) -> None:
        """Note how much an inequality with numbers of that size may fail."""
        self.errors.append(ROUNDING * PRECISION * size)

    def remaining_cells(self, most: float) -> list[Array]:
        """Lemmas 3 and 3a: the cells in which a field of energy up to `most` may have its crosses."""
        remaining = []
        for i, allowed in enumerate(self.level.allowed):
            cells = at_corners(np.logical_and, allowed)
            for test in self.tests:
                alive = np.zeros_like(allowed)
                alive[allowed] = test.bounds[i] <= most + test.error
                cells &= at_corners(np.logical_or, alive)
            remaining.append(cells)
        return remaining


def runs_of(sketch: Sketch, *, upper: bool) -> list[tuple[list[int], list[int]]]:
    """The columns (upper) or rows of the mask without gaps: their pixels, earlier ones first, and pairs."""
    chosen = np.flatnonzero((sketch.first > sketch.second) == upper)
    ends = np.sort([sketch.first[chosen], sketch.second[chosen]], axis=0).T.tolist()
    next_of = {i: (e, j) for e, (i, j) in zip(chosen.tolist(), ends)}
    runs = []
    for begin in sorted(set(range(len(sketch.white))) - {j for _, j in next_of.values()}):
        pixels, pairs = [begin], list[int]()
        while pixels[-1] in next_of:
            e, j = next_of[pixels[-1]]
            pixels.append(j)
            pairs.append(e)
        runs.append((pixels, pairs))
    return runs


def greatest(numbers: Array) -> float:
    """The greatest absolute value."""
    return max(float(numbers.max()), -float(numbers.min()))


def need_covered(coarse: Level, cells: list[Array], fine: Level, number: int) -> None:
    """Raise RefusedError unless the cells left of a level lie in the domain of the next one.

    With half the spacing, cell (k, l) begins at the steps (2 k + o, 2 l + o) of the next level: at a label on
    black pixels, and in the middle of a cell on white ones. Cells beyond |beta| = pi/4 contain no cross.
    number: of the next level.
    """
    times = 2 if fine.h == coarse.h / 2 else 1
    halves = times == 2 or fine.h == coarse.h
    _need(halves, f"level_{number}_h", "is neither that of the level before nor half")
    for i, left in enumerate(cells):
        cell = np.stack(np.nonzero(left), axis=1) + coarse.least[i]
        extra = np.arange(1 if times == 1 else 2 + int(2 * fine.offset[i]))
        rows, columns = ((times * cell[:, axis, None] + extra) - fine.least[i, axis] for axis in (0, 1))
        domain = at_corners(np.logical_and, fine.allowed[i])
        there = [(steps >= 0) & (steps < side) for steps, side in zip((rows, columns), domain.shape)]
        held = domain[np.where(there[0], rows, 0)[:, :, None], np.where(there[1], columns, 0)[:, None]]
        held = held & there[0][:, :, None] & there[1][:, None]
        beta = fine.beta[i] + fine.h * (columns + fine.least[i, 1] + fine.offset[i])
        inside = (beta < QUARTER - SLIVER) & (beta + fine.h > -QUARTER + SLIVER)
        covered = (held | ~inside[:, None]).all(axis=(1, 2))
        _need(covered, f"level {number}, pixel {i}, cell", "of the level before is not covered")


# Sections 6 and 9: the last step ---------------------------------------------------------------------------


def boxes_of(level: Level, cells: list[Array], margin: float) -> Array:
    """The boxes round the cells of each pixel within |beta| <= pi/4, wider by a margin; shape (n, 4).

    Columns: alpha from, to, beta from, to.
    """
    boxes = np.zeros((len(cells), 4))
    for i, left in enumerate(cells):
        (alpha, beta), (k, l) = level.places(i), np.nonzero(left)  # noqa: E741
        boxes[i] = alpha[k.min()], alpha[k.max() + 1], beta[l.min()], beta[l.max() + 1]
    boxes += np.array([-margin, margin, -margin, margin])
    boxes[:, 2:] = np.clip(boxes[:, 2:], -QUARTER, QUARTER)
    return boxes


@dataclass
class LastStep:
    """The boxes (n, 4) of a last step, the jumps p (m,), and a direction theta (n,) of each stroke.

    All have the labels and the turn that are nearest to the middle of the box.
    """

    boxes: Array
    p: Array
    theta: Array

    @property
    def whole(self) -> Piece:
        """The boxes as one piece: v carries a stroke where a whole box is beyond the window of u."""
        above, below = beyond_windows(self.theta, self.boxes[:, [1, 0, 2, 3]]) > 1e-12
        return Piece(self.boxes, above.astype(np.int64) - below)


@dataclass
class Piece:
    """A part of the boxes (n, 4), and the lines that carry the strokes there, as in `Sketch.residuals`."""

    boxes: Array
    line: Array

    def cut(self, at: int, theta: Array) -> list[Piece]:
        """The parts below, in and above the window of the stroke of pixel `at`; some may be empty."""
        ends = (-math.inf, theta[at] - QUARTER, theta[at] + QUARTER, math.inf)
        parts = []
        for side in (-1, 0, 1):
            boxes, line = self.boxes.copy(), self.line.copy()
            boxes[at, 0], boxes[at, 1] = max(boxes[at, 0], ends[side + 1]), min(boxes[at, 1], ends[side + 2])
            line[at] = side
            parts.append(Piece(boxes, line))
        return parts


def last_step(sketch: Sketch, boxes: Array, alpha: Array, p: Array) -> LastStep:
    """The last step in some boxes. alpha, p: of the field."""
    middle = (boxes[:, 0] + boxes[:, 1]) / 2
    turns = np.round((middle - alpha) / HALF).astype(np.int64)
    theta = sketch.theta + math.pi * np.round((middle - sketch.theta) / math.pi)
    return LastStep(boxes, p - turns[sketch.first] + turns[sketch.second], theta)


def is_convex(sketch: Sketch, step: LastStep) -> bool:
    """Whether Lemmas 4 and 5 apply everywhere in the boxes."""
    reach = QUARTER if sketch.norm == 1 else HALF
    far = (beyond_windows(step.theta, step.boxes) > reach - 1e-9) & (sketch.weight > 0)
    return bool(forced(sketch, step.p, step.boxes).all() and not far.any())


def forced(sketch: Sketch, p: Array, boxes: Array) -> Array:
    """Lemma 4, or "Jumps" of section 9: where p is a best jump everywhere in the boxes; shape (m,)."""
    i, j = boxes[sketch.first], boxes[sketch.second]
    a = np.maximum(np.abs(i[:, 0] - j[:, 1] + HALF * p), np.abs(i[:, 1] - j[:, 0] + HALF * p)) + 1e-12
    s = sign(p)
    if sketch.norm == 2:
        least = np.min([s * i[:, x] * j[:, y] for x in (2, 3) for y in (2, 3)], axis=0)
        best: Array = (a <= HALF) & (math.pi * a - math.pi**2 / 4 <= 4 * least - 1e-12)
        return best
    (above, below), (same, other) = (
        (np.maximum(beta.max(axis=1), 0.0), np.maximum(-beta.min(axis=1), 0.0))
        for beta in (i[:, 2:], s[:, None] * j[:, 2:])
    )
    unlike = np.maximum(np.minimum(above, other), np.minimum(below, same))
    alike = [np.where(box[:, 2] * box[:, 3] > 0, np.abs(box[:, 2:]).min(axis=1), 0.0) for box in (i, j)]
    g = np.where(unlike > 0, unlike, -np.minimum(*alike))
    best = (a <= HALF) & (a + g <= QUARTER)
    return np.asarray(best)


def beyond_windows(theta: Array, boxes: Array) -> Array:
    """Distances by which the boxes exceed the windows of the strokes, above and below; shape (2, n)."""
    beyond: Array = np.stack([boxes[:, 1] - theta, theta - boxes[:, 0]]) - QUARTER
    return beyond


def linear_bound(sketch: Sketch, step: LastStep, piece: Piece, multipliers: Array) -> float:
    """Lemma 5: a lower bound of F in a piece, from any multipliers l of all residuals (2m + 2n,).

    With phi(r) >= l r - l^2/4 for squares, and >= l r for absolute values and |l| <= 1, the bound is linear
    in the angles. So is the deduction of Lemma 5 where u carries a stroke beyond its window.
    """
    m, n, (low, high) = len(step.p), len(step.theta), (piece.boxes[:, ::2].T, piece.boxes[:, 1::2].T)
    forces, constants = [], []
    for l, k, squared in zip(np.split(multipliers, [m, 2 * m, 2 * m + n]), sketch.weights, sketch.squared):  # noqa: E741
        l = l if squared else np.clip(l, -1.0, 1.0)  # noqa: E741, PLW2901
        forces.append(k * l)
        constants.append(-k * l * l / 4 if squared else 0 * l)
    above, below = (
        np.maximum(beyond_windows(step.theta, piece.boxes), 0.0) * sketch.weight * (piece.line == 0)
    )
    if sketch.norm == 1:
        deduction, tilt = 2 * (above + below), np.zeros(n)
    else:
        deduction, tilt = math.pi * (above + below), 4 * (above - below)
    of_a, of_b, of_r, of_beta = forces
    i, j, upright = sketch.first, sketch.second, of_beta - tilt
    of_alpha = np.bincount(i, of_a, n) - np.bincount(j, of_a, n)
    of_skew = np.bincount(i, sign(step.p) * of_b, n) - np.bincount(j, of_b, n)
    slope = np.stack([of_alpha + of_r, of_skew + sign(piece.line) * of_r + upright])
    zero = np.zeros(n)
    still = sketch.residuals(zero, zero, step.p, piece.line, step.theta)
    terms = [force * x for force, x in zip(forces, still)]
    terms += [*constants, -deduction, *np.minimum(slope * low, slope * high)]
    # What may fail is below 16 roundings of every product that enters.
    far, turn = np.maximum(np.abs(low), np.abs(high)).max(axis=0), np.abs(still[2])
    size = np.sum(np.abs(of_a) * (2 * far[i] + 2 * far[j] + HALF * np.abs(step.p))) + 4.0 * m
    size += np.sum(np.abs(of_b) * 2) + np.sum(np.abs(of_r) * (far + 1 + turn) + np.abs(upright) + deduction)
    size += sum(np.abs(x).sum() for x in constants)
    return math.fsum(np.concatenate(terms)) - 16 * PRECISION * float(size)


def pieces_bound(sketch: Sketch, step: LastStep, arrays: dict[str, Array]) -> float:
    """A lower bound of F in the boxes of the last step: the least of all pieces; -inf without any.

    A cut is the pixel at whose window a piece is cut into three, or -1 for a piece that stays whole, which
    has multipliers. Each piece comes before its parts.
    """
    size, cuts = 2 * (len(sketch.first) + len(sketch.white)), take(arrays, "cuts", "<i4", None)
    _need(len(cuts) <= MOST_PIECES, "cuts", "has too many pieces")
    _need((cuts >= -1) & (cuts < len(sketch.white)), "cuts", "is no pixel")
    multipliers = take(arrays, "multipliers", "<f8", int((cuts < 0).sum()), size)
    _need((np.abs(multipliers) <= MOST_WEIGHT).all(axis=1), "multipliers", "is too large")
    waiting, bounds = [step.whole] if len(cuts) else [], list[float]()
    for at in cuts.tolist():
        _need(waiting, "cuts", "has a piece too many")
        piece = waiting.pop()
        if at >= 0:
            waiting += reversed(piece.cut(at, step.theta))
        else:
            least = linear_bound(sketch, step, piece, multipliers[len(bounds)])
            bounds.append(math.inf if (piece.boxes[:, 0] > piece.boxes[:, 1]).any() else least)
    _need(not waiting, "cuts", "leaves a piece without multipliers")
    return min(bounds, default=-math.inf)


# Section 7: the theorem ------------------------------------------------------------------------------------


@dataclass
class PassedLevels:
    """All levels after their passes, with what follows.

    whole: the instance; sketch, pixels, pairs: its parts with strokes. error: of the energy. slack: of
    `slack_of`. bounds: of the levels. last: the last step; None if the last level leaves a pixel no cell.
    """

    whole: Sketch
    sketch: Sketch
    pixels: Array
    pairs: Array
    energy: float
    error: float
    slack: float
    bounds: list[float]
    last: LastStep | None


@dataclass
class Verdict:
    """Findings of the checker: the proven claim.

    bound: what a certificate may claim everywhere; it is less than what is proven here by a margin for other
    processors. status: as `status_of` has it. boxes (n, 4): ranges of alpha and beta that hold the crosses of
    every better field, by some of their labels. forced_pairs (m,): where its jumps are forced. levels: their
    bounds.
    """

    status: str
    norm: Any
    energy: float
    bound: float
    boxes: Array
    forced_pairs: Array
    levels: list[float]

    @property
    def forced(self) -> int:
        """The number of forced jumps."""
        return int(self.forced_pairs.sum())


def status_of(energy: float, bound: float) -> str:
    """Status of a field with that energy, if no field has less than the bound: `optimal` or `gap`."""
    return "optimal" if energy - bound <= OPTIMAL * max(1.0, energy) else "gap"


def gap_of(energy: float, bound: float) -> float:
    """The relative gap, (energy - bound) / energy; 0 with the status `optimal`."""
    return 0.0 if status_of(energy, bound) == "optimal" else (energy - bound) / energy


def check(arrays: dict[str, Array]) -> Verdict:
    """Check the arrays of a certificate and return what they prove.

    Raises RefusedError when a level does not follow from the one before, or when less is proven than claimed,
    and UnreadableError for arrays that are not a certificate.
    """
    try:
        return conclude(arrays, pass_levels(arrays))
    except (ValueError, TypeError, KeyError, IndexError, OverflowError, RecursionError) as error:
        raise UnreadableError(f"is damaged ({type(error).__name__}: {str(error)[:80]})") from error


def pass_levels(arrays: dict[str, Array]) -> PassedLevels:
    """Do the passes over all levels; check that the first is the whole strip and each covers what is left."""
    whole, at = sketch_of(arrays)
    alpha, beta, p = field_of(arrays, whole)
    energy, error = energy_of(whole, alpha, beta, p)
    sketch, pixels, pairs = with_strokes(arrays, whole, at)
    count = level_count(head_of(arrays))
    slack = slack_of(sketch.weight, sketch.w_beta, count)
    most = energy + error + slack
    bounds: list[float] = []
    level, cells = level_of(arrays, 0, sketch), list[Array]()
    need_whole_strip(level)
    for number in range(count):
        if number:
            before, level = level, level_of(arrays, number, sketch)
            need_covered(before, cells, level, number)
        passed = ForwardPass(level, sketch, most)
        bounds.append(passed.bound)
        cells = passed.remaining_cells(most)
    last = None
    if all(left.any() for left in cells):
        boxes = boxes_of(level, cells, 2 * (count + 1) * SLIVER)
        last = last_step(sketch, boxes, alpha[pixels], p[pairs])
    return PassedLevels(whole, sketch, pixels, pairs, energy, error, slack, bounds, last)


def conclude(arrays: dict[str, Array], passed: PassedLevels) -> Verdict:
    """Do the last step, and compare what is proven with what the certificate claims."""
    sketch, energy, last = passed.sketch, passed.energy, passed.last
    _need(last is not None, "the last level", "leaves nothing, not even the field")
    assert last is not None
    least = pieces_bound(sketch, last, arrays) if is_convex(sketch, last) else -math.inf
    proven = max(0.0, min(max(max(passed.bounds) - passed.slack, least), energy - passed.error))
    bound = max(0.0, proven - SPARE * (1 + proven))
    n, m = len(passed.whole.white), len(passed.whole.first)
    boxes, pairs = np.zeros((n, 4)), np.zeros(m, bool)
    lower = passed.whole.lower  # in parts without strokes, anything is possible
    boxes[:, 0], boxes[:, 1], boxes[:, 2], boxes[:, 3] = lower, lower + HALF, -QUARTER, QUARTER
    boxes[passed.pixels], pairs[passed.pairs] = last.boxes, forced(sketch, last.p, last.boxes)
    verdict = Verdict(status_of(energy, bound), sketch.norm, energy, bound, boxes, pairs, passed.bounds)
    compare(head_of(arrays), verdict, proven, passed.error)
    return verdict


def compare(head: dict[str, Any], verdict: Verdict, most: float, error: float) -> None:
    """Raise RefusedError unless the claim is proven. most: the greatest bound that is."""
    energy, bound = number_in(head, "energy", 0.0, math.inf), number_in(head, "bound", -math.inf, math.inf)
    close = abs(energy - verdict.energy) <= error + 1e-12 * max(1.0, verdict.energy)
    _need(close, "energy", f"is claimed as {energy!r}, but the field has {verdict.energy!r}")
    _need(head.get("status") in ("optimal", "gap"), "status", "is neither 'optimal' nor 'gap'")
    proven = f"only {most!r} is proven, for an energy of {verdict.energy!r}"
    _need(bound <= most, "bound", f"is claimed as {bound!r}, but {proven}")
    if head["status"] == "optimal":
        _need(verdict.status == "optimal", "status", f"is claimed as optimal, but {proven}")
        _need(status_of(energy, bound) == "optimal", "status", "is claimed as optimal, but not by the bound")


def main(arguments: list[str]) -> int:
    """Print the verdict and return the exit code."""
    if len(arguments) != 1 or arguments[0].startswith("-"):
        print("usage: python check_certificate.py FILE")
        return 2
    path = arguments[0]
    try:
        verdict = check(read(path))
    except RefusedError as error:
        print(f"refused: {error}")
        return 1
    except UnreadableError as error:
        print(f"unreadable: {path} {error}")
        return 2
    except MemoryError:
        print(f"unchecked: {path} takes more memory than there is")
        return 3
    for number, bound in enumerate(verdict.levels):
        print(f"level {number}: bound {bound:.9f}")
    print(f"energy {verdict.energy!r}")
    print(f"bound  {verdict.bound!r}")
    if verdict.status == "optimal":
        print(f"optimal: no field has less by more than {verdict.energy - verdict.bound:.3g}")
    else:
        print(f"gap: {verdict.energy - verdict.bound:.6g}; {verdict.forced} jumps are forced")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
