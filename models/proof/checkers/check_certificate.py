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
moving a cross by that much at every level changes F by less than `sliver_slack`, which is allowed for, too.
pi stands for the double next to it, as in the definition of the field.
"""

from __future__ import annotations

import copy
import functools
import io
import json
import math
import sys
import zipfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

FORMAT, VERSION = "crossfield-certificate", 4
CHECKERS = {FORMAT: "check_certificate.py", "crossfield-orthogonal-certificate": "check_orthogonal.py"}
HALF, QUARTER = math.pi / 2, math.pi / 4
OPTIMAL = 1e-8
SPARE = 1e-10  # taken off a bound that is reported, relative to 1 + it: other processors round otherwise
PRECISION = 2.0**-52
ROUNDING = 64.0
SLIVER = 2e-14
MOST_BYTES = 1 << 31  # of all arrays
_PIECE = 1 << 20  # bytes of a file that are read at once
ROOM, MORE_ROOM = 1 << 28, 128  # memory for a certificate: a number, and one for each byte of its file
MOST_LEVELS = 256
MOST_SIDE = 9999
MOST_CUTS = 1200  # numbers that describe the pieces of the boxes
MOST_PARTS = 8  # of a piece
MOST_COUNT = 4096  # labels of a pixel in alpha, and in beta
MOST_OF_LEVEL = 1 << 28  # of a level
FARTHEST_LABEL = 16.0  # radians
MOST_JUMP = 64
MOST_WEIGHT = 1e6
MOST_UNIT = 1.0  # of a share or a table
TILE = 40  # rows and columns of a large product that NumPy handles at once
TILE_NUMBERS = 1 << 16  # and numbers
FEW_TERMS = 1 << 19  # terms of a product up to which leaving some out costs more than it saves

PARTS = (
    "head", "instance_head", "instance_origin", "instance_mask", "instance_stroke_pixels", "instance_theta",
    "instance_w", "alpha", "beta", "p", "centre_alpha", "centre_beta", "cuts", "multipliers",
)  # fmt: skip
SLOPES = "slopes"  # also, unless the norm is 2
LEVEL_PARTS = ("h", "ranges", "allowed", "share_steps", "share_unit", "quads", "table_steps", "table_unit")

Array = Any


class NotProvenError(Exception):
    """A claim that does not follow; the message names the place."""


class UnreadableError(Exception):
    """A file that is not a certificate."""


# The archive -----------------------------------------------------------------------------------------------


def read_file(path: str) -> bytes:
    """Read the bytes of a certificate."""
    try:
        with open(path, "rb") as stream:  # noqa: PTH123 - only built-in functions
            # Piece by piece: to read so many bytes makes room for all of them.
            pieces = islice(iter(lambda: stream.read(_PIECE), b""), MOST_BYTES // _PIECE + 1)
            return b"".join(pieces)
    except (OSError, ValueError) as error:
        raise UnreadableError(f"cannot be read ({type(error).__name__})") from error


def unpack_arrays(data: bytes) -> dict[str, Array]:
    """Unpack the arrays of a certificate, and check their names and the memory for the check."""
    arrays = unpack_archive(data)
    check_sizes(arrays, len(data))
    return arrays


def unpack_archive(data: bytes) -> dict[str, Array]:
    """Unpack the arrays of a .npz, whose sizes are checked before anything is unpacked."""
    arrays: dict[str, Array] = {}
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            total = sum(member.file_size for member in archive.infolist())
            too_large = total > MOST_BYTES or 4 * total > ROOM + MORE_ROOM * len(data)
            check_format(not too_large, "has larger arrays than a file of its size may have")
            for member in archive.infolist():
                check_format(member.compress_type in (0, 8), "is packed in another way than NumPy packs")
                name, ending = member.filename[:-4], member.filename[-4:]
                check_format(ending == ".npy" and name not in arrays, f"has a wrong member {name[:40]!r}")
                arrays[name] = parse_array(archive.read(member), name)
    except (UnreadableError, MemoryError):
        raise
    except Exception as error:  # a damaged archive can raise anything
        raise UnreadableError(f"is no .npz that can be read ({type(error).__name__})") from error
    return arrays


def refuse_damage(work: Callable[..., Any]) -> Callable[..., Any]:
    """The function, which raises UnreadableError where damaged arrays let it fail."""

    @functools.wraps(work)
    def guarded(*arguments: Any, **named: Any) -> Any:
        try:
            return work(*arguments, **named)
        except (ArithmeticError, LookupError, RecursionError, TypeError, ValueError) as error:
            raise UnreadableError(f"is damaged ({type(error).__name__}: {str(error)[:80]})") from error

    return guarded


def parse_array(data: bytes, name: str) -> Array:
    """Return the array in the bytes of a .npy, whose header is checked before it is trusted; no pickles."""
    stream = io.BytesIO(data)
    version = np.lib.format.read_magic(stream)
    check_format(version == (1, 0), f"{name} is no array as certificates have it")
    shape, by_columns, kind = np.lib.format.read_array_header_1_0(stream)
    size = len(data) - stream.tell()
    fits = kind.kind in "biuf" and not by_columns and min(shape, default=0) >= 0
    check_format(fits and math.prod(shape) * kind.itemsize == size, f"{name} differs from its header")
    array = np.frombuffer(data, kind, offset=stream.tell()).reshape(shape)
    bits = kind.kind != "b" or array.view(np.uint8).max(initial=0) <= 1
    check_format(bits, f"{name} has bits that are neither 0 nor 1")
    return array


@refuse_damage
def check_sizes(arrays: dict[str, Array], size: int) -> None:
    """Raise UnreadableError for other arrays than a certificate of that many bytes may have."""
    check_names(arrays)
    check_memory(arrays, size)


def check_names(arrays: dict[str, Array]) -> None:
    """Raise UnreadableError unless the arrays are exactly those of a certificate with that many levels."""
    head = head_of(arrays)
    names = set(PARTS) | (set() if norm_of(head) == 2 else {SLOPES})
    compare_names(arrays, names, LEVEL_PARTS, level_count(head))


def compare_names(arrays: dict[str, Array], names: set[str], of_level: tuple[str, ...], levels: int) -> None:
    """Raise UnreadableError unless these are the names of all arrays, with those of so many levels."""
    names = names | {f"level_{number}_{part}" for number in range(levels) for part in of_level}
    for name in sorted(names - set(arrays)):
        raise UnreadableError(f"has no array {name}")
    for name in sorted(set(arrays) - names):
        raise UnreadableError(f"has an array {name[:40]} too many for a certificate with {levels} levels")


def check_memory(arrays: dict[str, Array], size: int) -> None:
    """Raise UnreadableError unless a file of that size may take the memory that the check would take."""
    mask, most = arrays["instance_mask"], 0
    for number in range(level_count(head_of(arrays))):
        at = f"level_{number}_"
        counts = take_array(arrays, f"{at}ranges", "<i4", None, 4)[:, 1::2]
        stored = (arrays[f"{at}{part}_steps"].size for part in ("share", "table"))
        most = max(most, level_memory(counts, *stored))
    most += 24 * mask.size + 1500 * int(mask.sum()) + sum(array.nbytes for array in arrays.values())
    check_room(most, memory_for(size))


def level_memory(counts: Array, shares: int, tables: int) -> int:
    """Bytes that the pass over a level takes at most; more than was measured.

    counts (n, 2): the numbers of alphas and betas of each pixel. shares, tables: how many numbers are stored.
    """
    counts = np.clip(counts, 0, MOST_COUNT).astype(np.int64)
    labels, side = counts.prod(axis=1), int(counts.max(initial=0))
    many = 16 * labels.sum() + 112 * labels.max(initial=0)
    return int(many) + 96 * shares + 64 * side * side + 32 * tables


def memory_for(size: int, each: int = MORE_ROOM) -> int:
    """Bytes of memory that the check of a file of that many bytes may take. each: for each of these."""
    return ROOM + each * size


def check_room(memory: int, most: int) -> None:
    """Raise UnreadableError unless a check takes at most so many bytes of memory."""
    few = f"more than the {most >> 20} MB that a file of its size may"
    check_format(memory <= most, f"takes {memory >> 20} MB of memory to check, {few}")


def head_of(arrays: dict[str, Array], known: str = FORMAT, version: int = VERSION) -> dict[str, Any]:
    """The text in the array `head` of a certificate of a known format."""
    head = json_of(arrays, "head")
    form = str(head.get("format"))
    same = form == known and type(head.get("version")) is int and head["version"] == version
    others = form in CHECKERS and form != known
    remedy = f"run {CHECKERS[form]}" if others else "make it again with crossfield prove"
    check_format(same, f"is no {known} of version {version}; {remedy}")
    return head


def norm_of(head: dict[str, Any]) -> Any:
    """The norm of the energy: 2, 1 or "mixed"."""
    norm = head.get("norm")
    check_format(type(norm) in (int, str) and norm in (1, 2, "mixed"), "is of an unknown norm")
    return norm


def level_count(head: dict[str, Any]) -> int:
    """The number of levels that a certificate has."""
    count = number_in(head, "levels", 1, MOST_LEVELS)
    require(count == int(count), "levels", "is no whole number")
    return int(count)


def json_of(arrays: dict[str, Array], name: str) -> dict[str, Any]:
    """The JSON object in an array of bytes."""
    text = json.loads(
        take_array(arrays, name, "|u1", None).tobytes().decode(), object_pairs_hook=_object_with_unique_keys
    )
    check_format(isinstance(text, dict), f"{name} is not a JSON object")
    return text  # type: ignore[no-any-return]


def _object_with_unique_keys(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """A JSON object without repeated keys, because programs differ on which of them counts."""
    check_format(len(dict(pairs)) == len(pairs), "has a text with a repeated key")
    return dict(pairs)


def number_in(head: dict[str, Any], name: str, least: float, most: float) -> float:
    """A number of a JSON object, within limits."""
    value: Any = head.get(name)
    finite = type(value) in (int, float) and math.isfinite(value)
    require(finite and least <= value <= most, name, f"is not in [{least:g}, {most:g}]")
    return float(value)


def take_array(arrays: dict[str, Array], name: str, kind: str, *shape: int | None) -> Array:
    """The array of that name, of that kind and, where sides are given, of that shape; finite."""
    check_format(name in arrays, f"has no array {name}")
    array = arrays[name]
    fits = array.ndim == len(shape) and all(side in (None, size) for side, size in zip(shape, array.shape))
    check_format(
        array.dtype == np.dtype(kind) and fits, f"{name} has another kind or shape than other arrays ask for"
    )
    if array.dtype.kind == "f":
        require(np.isfinite(array).all(), name, "holds something that is no number")
    return array


class NumberBlocks:
    """Blocks of numbers: whole multiples of a unit each, stored by their differences modulo 2^32."""

    def __init__(self, arrays: dict[str, Array], name: str, counts: Array) -> None:
        """counts: how many numbers each block has."""
        self.unit = take_array(arrays, f"{name}_unit", "<f8", len(counts))
        require((self.unit >= 0) & (self.unit <= MOST_UNIT), f"{name}_unit", "is not in [0, 1]")
        self.ends = np.concatenate([[0], np.cumsum(counts, dtype=np.int64)])
        self.steps = take_array(arrays, f"{name}_steps", "<i4", int(self.ends[-1]))

    def __getitem__(self, block: int) -> Array:
        """The numbers of a block, computed each time, because all of them together take much memory."""
        steps = self.steps[self.ends[block] : self.ends[block + 1]]
        return np.cumsum(steps, dtype=np.int32) * self.unit[block]


def check_format(holds: Any, otherwise: str) -> None:
    """Raise UnreadableError unless the condition holds."""
    if not holds:
        raise UnreadableError(otherwise)


def require(holds: Any, name: str, wrong: str) -> None:
    """Raise NotProvenError, with the first place that fails, unless all of the condition holds."""
    holds = np.asarray(holds)
    if not holds.all():
        place = f"[{int(np.argmin(holds))}]" if holds.ndim else ""
        raise NotProvenError(f"{name}{place} {wrong}")


# Section 1: the instance, the field, and the energy --------------------------------------------------------


@dataclass
class EnergyTerms:
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
        a, b = alpha[i] - alpha[j] + HALF * p, parity_sign(p) * beta[i] - beta[j]
        return [a, b, alpha + parity_sign(line) * beta - theta - HALF * line, beta]

    @property
    def weights(self) -> list[Array]:
        """The weights of these residuals in F."""
        two = np.full(len(self.first), 2.0)
        return [two, two, self.weight, np.full(len(self.weight), self.w_beta)]

    @property
    def squared(self) -> list[bool]:
        """Whether F has the squares of these residuals, and not their absolute values."""
        return [self.norm == 2, self.norm == 2, self.norm != 1, self.norm != 1]


def parity_sign(p: Array) -> Array:
    """The sign (-1)^p of each jump."""
    return 1.0 - 2.0 * (p & 1)


def terms_of(arrays: dict[str, Array]) -> tuple[EnergyTerms, Array]:
    """The instance, with directions moved into the gauge's own range, and its stroke pixels."""
    head = json_of(arrays, "instance_head")
    require(head.get("orthogonal", False) is False, "orthogonal", "crosses are another problem")
    take_array(arrays, "instance_origin", "<f8", 2)  # not part of the proof, but of the instance
    white, first, second, at = pixels_of(arrays)
    theta, w = strokes_of(arrays, head, at)
    gauge = head.get("gauge")
    require(gauge in ("strokes", "box"), "gauge", "is unknown")
    weight, direction, lower = np.zeros((3, len(white)))
    weight[at] = w
    if gauge == "strokes":
        direction[at], lower[at] = theta, theta - QUARTER
    else:
        direction[at] = np.where(theta >= 3 * QUARTER - 1e-9, np.maximum(theta - np.pi, -QUARTER), theta)
    strokes, w_beta = (
        (weight, direction, np.zeros(len(white)), lower),
        number_in(head, "w_beta", 0, MOST_WEIGHT),
    )
    return EnergyTerms(norm_of(head_of(arrays)), first, second, white, *strokes, w_beta), at


def pixels_of(arrays: dict[str, Array]) -> tuple[Array, Array, Array, Array]:
    """The checkerboard of the pixels, pairs with their upper, then right neighbours, and stroke pixels."""
    mask = take_array(arrays, "instance_mask", "|b1", None, None)
    place = take_array(arrays, "instance_stroke_pixels", "<i4", None, 2).astype(np.int64)
    require(max(mask.shape) <= MOST_SIDE, "instance_mask", "has too long a side")
    rows, columns = np.nonzero(mask)
    require(len(rows) > 0, "instance_mask", "has no pixel")
    number = np.full((mask.shape[0] + 1, mask.shape[1] + 1), -1)
    number[1:, :-1][mask] = np.arange(len(rows))
    neighbours = np.stack([number[rows, columns], number[rows + 1, columns + 1]], axis=1)
    first, side = np.nonzero(neighbours >= 0)
    require(((place >= 0) & (place < mask.shape)).all(axis=1), "instance_stroke_pixels", "is no pixel")
    at = number[1:, :-1][tuple(place.T)]
    require(at >= 0, "instance_stroke_pixels", "is outside the mask")
    return (rows + columns) % 2 == 1, first, neighbours[first, side], at


def strokes_of(arrays: dict[str, Array], head: dict[str, Any], at: Array) -> tuple[Array, Array]:
    """The directions and weights W of the strokes at points that ascend."""
    theta, w = (take_array(arrays, f"instance_{name}", "<f8", len(at)) for name in ("theta", "w"))
    require((theta >= 0) & (theta < np.pi), "instance_theta", "is not in [0, pi)")
    require((w > 0) & (w <= 1), "instance_w", "is not in (0, 1]")
    require(np.diff(at) > 0, "strokes", "are out of order")
    return theta, number_in(head, "w_strokes", 0, MOST_WEIGHT) * w


def field_of(arrays: dict[str, Array], terms: EnergyTerms) -> tuple[Array, Array, Array]:
    """The angles alpha, beta (n,) and jumps p (m,) of the field, which must lie in the windows."""
    n, m = len(terms.white), len(terms.first)
    alpha, beta, p = (
        take_array(arrays, *each) for each in (("alpha", "<f8", n), ("beta", "<f8", n), ("p", "<i4", m))
    )
    inside = (alpha >= terms.lower - SLIVER) & (alpha <= terms.lower + HALF + SLIVER)
    require(inside, "alpha", "is outside the window of the gauge")
    require(np.abs(beta) <= QUARTER + SLIVER, "beta", "is beyond pi/4")
    require(np.abs(p.astype(np.int64)) <= MOST_JUMP, "p", "is no jump")
    return alpha, beta, p.astype(np.int64)


def energy_of(terms: EnergyTerms, alpha: Array, beta: Array, p: Array) -> tuple[float, float]:
    """The energy U of a field by its definition, and the greatest error of the number."""
    u = np.zeros(len(alpha), np.int64)
    residuals = terms.residuals(alpha, beta, p, u, terms.theta)
    sizes = [x * x if squared else np.abs(x) for x, squared in zip(residuals, terms.squared)]
    total = math.fsum(np.concatenate([k * size for k, size in zip(terms.weights, sizes)]))
    slope_a, slope_b, slope_r, _ = (
        2 * np.abs(x) if squared else np.ones_like(x) for x, squared in zip(residuals, terms.squared)
    )
    size = np.abs(alpha[terms.first]) + np.abs(alpha[terms.second]) + HALF * np.abs(p) + 1
    error = np.sum(4 * size * (slope_a + slope_b)) + np.sum(terms.weight * 8 * slope_r)
    return total, PRECISION * (float(error) + 8 * total)


def terms_with_strokes(
    arrays: dict[str, Array], terms: EnergyTerms, at: Array
) -> tuple[EnergyTerms, Array, Array]:
    """Lemma 0: the terms in the parts of the mask that have a stroke, and the numbers of pixels and pairs.

    at: the stroke pixels. All levels are about these pixels alone, numbered anew.
    """
    part = parts_of(len(terms.white), terms.first, terms.second)
    held = np.isin(part, part[at])
    pixels, pairs, anew = np.flatnonzero(held), np.flatnonzero(held[terms.first]), np.cumsum(held) - 1
    slope = np.zeros(len(pixels))
    if terms.norm != 2:
        slope = take_array(arrays, SLOPES, "<f8", len(pixels))
        require(np.abs(slope) <= (1.0 if terms.norm == 1 else HALF), SLOPES, "is too steep")
    ends = anew[terms.first[pairs]], anew[terms.second[pairs]]
    strokes = terms.weight[pixels], terms.theta[pixels], slope, terms.lower[pixels]
    return EnergyTerms(terms.norm, *ends, terms.white[pixels], *strokes, terms.w_beta), pixels, pairs


def parts_of(count: int, first: Array, second: Array) -> Array:
    """The least point of the connected part of each of so many points. first, second (m,): ends of pairs."""
    part, before = np.arange(count), np.full(count, -1)
    while (part != before).any():
        before = part.copy()
        least = np.minimum(before[first], before[second])
        np.minimum.at(part, before[first], least)
        np.minimum.at(part, before[second], least)
        part = part[part]  # few rounds, because whole parts are joined
    return part


def sliver_slack(weight: Array, w_beta: float, levels: int) -> float:
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
    row. rows, columns: the numbers of the alphas and betas of each pixel that have an allowed label. sides,
    used: these alphas and betas, and which of their labels are allowed.
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
    sides: list[tuple[Array, Array]] = field(init=False)
    used: list[Array] = field(init=False)

    def __post_init__(self) -> None:
        self.rows, self.columns = (
            [np.flatnonzero(allowed.any(axis=axis)) for allowed in self.allowed] for axis in (1, 0)
        )
        self.sides, self.used = [], []
        for i, (rows, columns) in enumerate(zip(self.rows, self.columns)):
            alpha, beta = self.angles(i)
            self.sides.append((alpha[rows], beta[columns]))
            self.used.append(self.allowed[i][np.ix_(rows, columns)])
        self.tables = {}
        for quad in self.quads:
            for e, table in zip(quad.pairs, quad.tables):
                self.tables[e] = self.tables[e] + table if e in self.tables else table

    def angles(self, i: int) -> tuple[Array, Array]:
        """Alpha of every k and beta of every l of pixel i."""
        k, l = (np.arange(size) + least for size, least in zip(self.allowed[i].shape, self.least[i]))  # noqa: E741
        o = self.offset[i]
        return self.alpha[i] + self.h * (k + o), self.beta[i] + self.h * (l + o)


def level_of(arrays: dict[str, Array], number: int, terms: EnergyTerms) -> Level:
    """Level `number` of the certificate."""
    n, at = len(terms.white), f"level_{number}_"
    h = float(take_array(arrays, f"{at}h", "<f8", 1)[0])
    require(1e-5 <= h <= QUARTER + SLIVER, f"{at}h", "is no spacing")
    alpha, beta = (take_array(arrays, f"centre_{name}", "<f8", n) for name in ("alpha", "beta"))
    require(np.abs(alpha) <= FARTHEST_LABEL, "centre_alpha", "is too large")
    require(np.abs(beta) <= FARTHEST_LABEL, "centre_beta", "is too large")
    if terms.norm != 2:  # section 9: one lattice for all pixels
        require(h * round(HALF / h) == HALF, f"{at}h", "does not divide pi/2")
        require(terms.norm == 1 or h <= HALF / 8, f"{at}h", "is too wide")
        require(alpha == h * np.round(alpha / h), "centre_alpha", "is no multiple of the spacing")
        require(beta == 0, "centre_beta", "is not 0")
    ranges = take_array(arrays, f"{at}ranges", "<i4", n, 4).astype(np.int64)
    least, shapes = ranges[:, ::2], ranges[:, 1::2]
    require(((shapes >= 2) & (shapes <= MOST_COUNT)).all(axis=1), f"{at}ranges", "has no cell, or too many")
    require((h * (np.abs(least) + shapes) <= FARTHEST_LABEL).all(axis=1), f"{at}ranges", "leads too far away")
    counts = shapes.prod(axis=1)
    labels = int(counts.sum())
    require(labels <= MOST_OF_LEVEL, f"{at}ranges", "has too many labels in all")
    bits = np.unpackbits(take_array(arrays, f"{at}allowed", "|u1", (labels + 7) // 8), count=labels).astype(
        bool
    )
    blocks = np.split(bits, np.cumsum(counts)[:-1])
    allowed = [block.reshape(shape) for block, shape in zip(blocks, shapes)]
    require(
        [combine_corners(np.logical_and, x).any() for x in allowed], f"{at}allowed of pixel", "has no cell"
    )
    sizes = np.array([np.count_nonzero(x) for x in allowed], np.int64)
    shares = NumberBlocks(arrays, f"{at}share", sizes[np.minimum(terms.first, terms.second)])
    offset = 0.5 * (terms.white & (terms.norm == 2))
    return Level(h, alpha, beta, offset, least, allowed, shares, quads_of(arrays, at, terms, shapes[:, 0]))


def quads_of(arrays: dict[str, Array], at: str, terms: EnergyTerms, sides: Array) -> list[Quad]:
    """The quads of a level that have tables. sides (n,): the number of alphas of each pixel."""
    lower_left = take_array(arrays, f"{at}quads", "<i4", None)
    require((lower_left >= 0) & (lower_left < len(sides)), f"{at}quads", "is no pixel")
    require(np.diff(lower_left) > 0, f"{at}quads", "is out of order")
    require(terms.norm == 2 or not len(lower_left), f"{at}quads", "needs the norm 2")
    pair_of = {ends: e for e, ends in enumerate(zip(terms.first.tolist(), terms.second.tolist()))}
    upper = {i: j for i, j in pair_of if j < i}
    right = {i: j for i, j in pair_of if j > i}
    quads: list[Quad] = []
    counts: list[Array] = []
    for a in lower_left.tolist():
        b, d = right.get(a, -1), upper.get(a, -1)
        c = right.get(d, -1)
        require(c >= 0 and upper.get(b, -1) == c, f"{at}quads", f"has no quad at pixel {a}")
        ends = ((a, b), (b, c), (d, c), (a, d))
        quads.append(Quad([a, b, c, d], [pair_of[pair] for pair in ends], []))
        counts += [sides[[*pair]] for pair in ends]
    shapes = np.array(counts, np.int64).reshape(-1, 2)
    tables = NumberBlocks(arrays, f"{at}table", shapes.prod(axis=1))
    for number, shape in enumerate(shapes):
        quads[number // 4].tables.append(tables[number].reshape(shape))
    return quads


def combine_corners(both: Any, labels: Array) -> Array:
    """Combine the values at the four corners of each cell with `both`."""
    return both(both(labels[:-1, :-1], labels[1:, :-1]), both(labels[:-1, 1:], labels[1:, 1:]))


def check_whole_strip(level: Level) -> None:
    """Raise NotProvenError unless the domain of each pixel holds every cross."""
    for i, allowed in enumerate(level.allowed):
        alpha, beta = level.angles(i)
        require(allowed.all(), f"level_0_allowed of pixel {i}", "leaves out labels")
        require(alpha[-1] - alpha[0] >= HALF - SLIVER, f"level_0_ranges[{i}]", "is less than pi/2 of alpha")
        full = beta[0] <= -QUARTER + SLIVER and beta[-1] >= QUARTER - SLIVER
        require(full, f"level_0_ranges[{i}]", "is less than all of beta")


# Section 3, Lemma 1: discrete costs ------------------------------------------------------------------------


def pixel_costs(level: Level, terms: EnergyTerms, i: int) -> tuple[Array, float]:
    """The cost D of each allowed label of pixel i, and the size of its terms."""
    alpha, beta = level.angles(i)
    k, l = np.nonzero(level.allowed[i])  # noqa: E741 - the letters of the page
    skew = np.abs(beta) if terms.norm == 1 else beta * beta - level.h * level.h / 4
    cost = (terms.w_beta * skew)[l]
    if terms.weight[i] > 0:
        s = level.least[i].sum() + k + l + int(2 * level.offset[i])
        cost = cost + terms.weight[i] * stroke_costs(level, terms, i, (alpha[k], beta[l], s))
    size = 2.0 + float(np.abs(alpha).max() + np.abs(beta).max())
    return cost, (float(terms.weight[i]) + terms.w_beta) * size * size


def stroke_costs(level: Level, terms: EnergyTerms, i: int, labels: tuple[Array, Array, Array]) -> Array:
    """The least over lines and turns of R^2 less its deduction (section 3), or of d (section 9).

    labels: alpha, beta and s of each.

    A cross at the fractions f, g of a cell has R at the variance f (1 - f) + g (1 - g), in units of h^2. In
    the 2-norm, the mean deduction exceeds it by f^2 + g^2 - 3/2 f g >= 0 in a cell whose lower corner has
    s = 0, by (1 - f - g)^2 for s = -1, by f^2 + g^2 + 1/2 f g - 3/2 (f + g) + 1 >= 1/10 for s = 1, and
    likewise for s = -2 and -3. Other cells have 1/2.

    In other norms, R goes to three values h apart, with mean r. If all are near, d is linear on them, so its
    mean is l r or l r - l^2/4. Otherwise no two signs differ in the 1-norm, so |R| is linear, and d <= |R|.
    In the mixed norm, (R - l/2)/h has the values y, y + 1, y + 2 with y >= 0, or minus these. For y >= 1,
    each loses at least 1/2, and for y < 1 at least 0, 1 and 1/2, as with s = 0.
    """
    (alpha, beta, s), square, theta = labels, level.h * level.h, terms.theta[i]
    u, v = alpha + beta - theta, alpha + HALF - beta - theta
    v = v - math.pi * np.round(v / math.pi)
    if terms.norm == 2:
        turn = round(float(level.alpha[i] + level.beta[i] - theta) / math.pi)  # of u at the centre
        others = np.abs(u - math.pi * np.round(u / math.pi))
        others = np.where(np.round(u / math.pi) == turn, math.pi - others, others)
        deduction = np.where(np.abs(s) <= 1, np.abs(s), 0.5) * square
        nearest = np.minimum(others, np.abs(v))
        return np.minimum((u - math.pi * turn) ** 2 - deduction, nearest**2 - square / 2)
    u, slope = u - math.pi * np.round(u / math.pi), terms.slope[i]
    near = 2 * level.h * (1 + 1e-12) + 1e-12  # where rounding could go either way: d is less if near
    if terms.norm == 1:
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

    def __init__(self, level: Level, terms: EnergyTerms, e: int) -> None:
        i, j = int(terms.first[e]), int(terms.second[e])
        (alpha_i, beta_i), (alpha_j, beta_j) = level.sides[i], level.sides[j]
        lowest = math.ceil(-2 * float(alpha_i[-1] - alpha_j[0]) / math.pi - 1 - 1e-6)
        highest = math.floor(-2 * float(alpha_i[0] - alpha_j[-1]) / math.pi + 1 + 1e-6)
        table: Any = level.tables[e][np.ix_(level.rows[i], level.rows[j])] if e in level.tables else 0.0
        reach = sum(max(abs(float(x[0])), abs(float(x[-1]))) for x in (*level.sides[i], *level.sides[j]))
        self.size = (1.0 + reach + HALF * max(-lowest, highest, 0)) ** 2 + float(np.abs(table).max())
        self.allowed = [level.used[x] for x in sorted((i, j))]
        parts = []
        for jumps in (range(lowest, highest + 1, 2), range(lowest + 1, highest + 1, 2)):
            a = functools.reduce(np.minimum, (np.abs(alpha_i[:, None] - alpha_j + HALF * p) for p in jumps))
            b = np.abs((1 - 2 * (jumps[0] % 2)) * beta_i[:, None] - beta_j)
            if terms.norm == 2:
                a, b = a * a - level.h * level.h / 2, b * b
            a, b = 2 * a + table, 2 * b
            parts.append((a, b) if i < j else (a.T, b.T))
        ranges = [(a.min() + b.min(), a.max() + b.max()) for a, b in parts]
        most = min(greatest for _, greatest in ranges)
        self.parts = [part for part, (least, _) in zip(parts, ranges) if least <= most]  # others nowhere less

    def least_sums(self, at_labels: Array, *, back: bool = False) -> Array:
        """The least at_labels(x) + c'(x, y) over x of the earlier pixel, for each label y of the later one.

        at_labels and the result have one number for each allowed label. back: with the pixels exchanged.
        """
        here, there = self.allowed[:: -1 if back else 1]
        spread = np.full(here.shape, np.inf)
        spread[here] = at_labels
        ends = [
            min_plus_product(a, min_plus_product(spread, b.T))
            if back
            else min_plus_product(a.T, min_plus_product(spread, b))
            for a, b in self.parts
        ]
        least: Array = np.minimum.reduce(ends)[there]
        return least


def min_plus_product(left: Array, right: Array) -> Array:
    """The matrix of min over k of left[x, k] + right[k, y]; both may be inf.

    Of a large product, some rows and columns are computed at a time, without the terms k that are nowhere
    there less than the best one of its row.
    """
    if left.size * right.shape[1] <= FEW_TERMS:
        return _min_plus_block(left, right)
    product, begins = np.empty((len(left), right.shape[1])), np.arange(0, right.shape[1], TILE)
    all_least, all_most = (end.reduceat(right, begins, axis=1).T for end in (np.minimum, np.maximum))
    for low in range(0, len(left), TILE):
        rows = left[low : low + TILE]
        for begin, least, most in zip(begins.tolist(), all_least, all_most):
            best = (rows + least).argmin(axis=1)
            enough = rows[np.arange(len(rows)), best] + most[best]
            some = (rows + least <= enough[:, None]).any(axis=0)
            part = right[some, begin : begin + TILE]
            product[low : low + TILE, begin : begin + TILE] = _min_plus_block(rows[:, some], part)
    return product


def _min_plus_block(left: Array, right: Array) -> Array:
    """The product with all terms; NumPy is quicker along the longer side, and with few calls."""
    if left.shape[0] > right.shape[1]:
        turned: Array = _min_plus_block(right.T, left.T).T
        return turned
    columns, right = np.ascontiguousarray(left.T)[:, :, None], np.ascontiguousarray(right)[:, None, :]
    least, many = (
        np.full((left.shape[0], right.shape[2]), np.inf),
        max(1, TILE_NUMBERS // (len(left) * right.shape[2])),
    )
    for k in range(0, len(right), many):
        np.minimum(least, (columns[k : k + many] + right[k : k + many]).min(axis=0), out=least)
    return least


# Sections 4 and 5: the bound, and the cells that are left --------------------------------------------------


class ForwardPass:
    """A forward pass over a level: the bound L of Lemma 2, and the tests of Lemmas 3 and 3a.

    excess, partial: of each pixel, t at its allowed labels, and what Lemma 3 adds to it. error: the greatest
    error of L and of these. The shares of later pixels are always the greatest that those of the earlier ones
    allow.
    """

    def __init__(self, level: Level, terms: EnergyTerms) -> None:
        self.level, self.terms = level, terms
        self.before: dict[int, Array] = {}  # the shares of later pixels before the pass
        self.shares: dict[int, tuple[Array, Array]] = {}  # those of earlier and of later pixels after it
        self.errors: list[float] = []
        visits = [self._visit(i) for i in range(len(level.allowed))]
        self.excess: list[Array] = [visit[0] for visit in visits]
        least, before = ([visit[k] for visit in visits] for k in (1, 2))
        quads = [self._quad_term(quad) for quad in level.quads]
        self.error = 2 * math.fsum(self.errors)
        self.partial = [math.fsum([*quads, *least[: i + 1], *before[i + 1 :]]) for i in range(len(least))]
        self.bound = math.fsum([*quads, *least]) - self.error

    def _visit(self, i: int) -> tuple[Array, float, float]:
        """Visit pixel i: t_i at its labels, min theta_i, and the same minimum before the pass."""
        terms, earlier, later = self.terms, self.terms.earlier[i], self.terms.later[i]
        cost, size = pixel_costs(self.level, terms, i)
        held = [self.level.shares[e] for e in later]
        before = [*held, *(self.before.pop(e) for e in earlier)]
        theta = self._theta(cost, size, [*held, *(self.shares[e][1] for e in earlier)])
        excess = theta - theta.min()
        for e, share in zip(later, held):
            self._update_shares(e, share, share - excess / max(1, len(earlier), len(later)))
        return excess, float(theta.min()), float(self._theta(cost, size, before).min())

    def _theta(self, cost: Array, size: float, shares: list[Array]) -> Array:
        """The sum of the cost of a pixel's labels, with terms of that size, and of the shares."""
        self._add_error(size + sum(greatest_size(share) for share in shares))
        total: Array = np.sum([cost, *shares], axis=0)
        return total

    def _update_shares(self, e: int, held: Array, share: Array) -> None:
        """Steps 1 and 2 of a visit at pair e. held, share: of its earlier pixel before and after."""
        pair = PairCost(self.level, self.terms, e)
        self.before[e], sent = pair.least_sums(-held), pair.least_sums(-share)
        self.shares[e] = share, sent
        self._add_error(pair.size + greatest_size(held) + greatest_size(share) + greatest_size(sent))

    def _quad_term(self, quad: Quad) -> float:
        """Section 4: the term Q of a quad, over the alphas that have an allowed label."""
        a, b, c, d = (self.level.rows[i] for i in quad.pixels)
        ab, bc, dc, ad = (-table for table in quad.tables)
        self._add_error(sum(greatest_size(table) for table in quad.tables))
        diagonal = min_plus_product(ab[np.ix_(a, b)], bc[np.ix_(b, c)])
        return float((min_plus_product(ad[np.ix_(a, d)].T, diagonal) + dc[np.ix_(d, c)]).min())

    def remaining_cells(self, most: float, *, combs: bool = True) -> list[Array]:
        """The cells that Lemma 3 and, with combs, Lemma 3a leave to fields of energy up to `most`."""
        cells = [combine_corners(np.logical_and, allowed) for allowed in self.level.allowed]
        cells = surviving_cells(self.level, cells, self.bounds_of_pass(), most)
        passed = self
        for upper in (True, False) if combs else ():
            if all(left.any() for left in cells):
                passed = passed._at_corners(cells)
                cells = surviving_cells(passed.level, cells, passed.bounds_of_combs(upper=upper), most)
        return cells

    def bounds_of_pass(self) -> list[Array]:
        """The left side of Lemma 3 at the allowed labels of each pixel, less its error."""
        return [t + (partial - self.error) for t, partial in zip(self.excess, self.partial)]

    def bounds_of_combs(self, *, upper: bool) -> list[Array]:
        """The left side of Lemma 3a, less its error, for the trees with columns (upper) or rows as teeth."""
        teeth, spines = (runs_of(self.terms, upper=of_teeth) for of_teeth in (upper, not upper))
        counts = zip(self.excess, self.terms.earlier, self.terms.later)
        rest = [t * (1 - len(later) / max(1, len(earlier), len(later))) for t, earlier, later in counts]
        self.errors = []
        sums = self._sums_along(spines, self._sums_along(teeth, rest))
        least = self.bound - 2 * math.fsum(self.errors)
        return [m + least for m in sums]

    def _at_corners(self, cells: list[Array]) -> ForwardPass:
        """The pass over the labels at the corners of some cells alone, where crosses of interest are."""
        allowed = [np.zeros_like(labels) for labels in self.level.allowed]
        for corners, left in zip(allowed, cells):
            for rows in (slice(None, -1), slice(1, None)):
                for columns in (slice(None, -1), slice(1, None)):
                    corners[rows, columns] |= left
        keep = [corners[labels] for corners, labels in zip(allowed, self.level.allowed)]
        passed, ends = copy.copy(self), np.sort([self.terms.first, self.terms.second], axis=0)
        passed.level = replace(self.level, allowed=allowed)
        passed.excess = [t[at] for t, at in zip(self.excess, keep)]
        passed.shares = {
            e: (here[keep[ends[0, e]]], there[keep[ends[1, e]]]) for e, (here, there) in self.shares.items()
        }
        return passed

    def _sums_along(self, runs: list[tuple[list[int], list[int]]], at_points: list[Array]) -> list[Array]:
        """The least sums over the pixels and pairs of each run, by the labels of each of its pixels.

        at_points: the terms of each pixel alone.
        """
        sums = list(at_points)
        for pixels, pairs in runs:
            costs = [PairCost(self.level, self.terms, e) for e in pairs]
            for way in (1, -1):
                carried = at_points[pixels[::way][0]]
                for e, cost, j in zip(pairs[::way], costs[::way], pixels[::way][1:]):
                    here, there = self.shares[e][::way]
                    message = cost.least_sums(carried - here, back=way < 0) - there
                    shares = greatest_size(here) + greatest_size(there)
                    self._add_error(cost.size + shares + greatest_size(carried) + greatest_size(message))
                    sums[j], carried = sums[j] + message, at_points[j] + message
        return sums

    def _add_error(self, size: float) -> None:
        """Note how much an inequality with numbers of that size may fail."""
        self.errors.append(ROUNDING * PRECISION * size)


def surviving_cells(level: Level, cells: list[Array], bounds: list[Array], most: float) -> list[Array]:
    """The cells with a corner whose bound is at most `most`. bounds: of each pixel, at its allowed labels."""
    remaining = []
    for allowed, left, at_labels in zip(level.allowed, cells, bounds):
        alive = np.zeros_like(allowed)
        alive[allowed] = at_labels <= most
        remaining.append(left & combine_corners(np.logical_or, alive))
    return remaining


def runs_of(terms: EnergyTerms, *, upper: bool) -> list[tuple[list[int], list[int]]]:
    """The columns (upper) or rows of the mask without gaps: their pixels, earlier ones first, and pairs."""
    chosen = np.flatnonzero((terms.first > terms.second) == upper)
    ends = np.sort([terms.first[chosen], terms.second[chosen]], axis=0).T.tolist()
    next_of = {i: (e, j) for e, (i, j) in zip(chosen.tolist(), ends)}
    runs = []
    for begin in sorted(set(range(len(terms.white))) - {j for _, j in next_of.values()}):
        pixels, pairs = [begin], list[int]()
        while pixels[-1] in next_of:
            e, j = next_of[pixels[-1]]
            pixels.append(j)
            pairs.append(e)
        runs.append((pixels, pairs))
    return runs


def greatest_size(numbers: Array) -> float:
    """The greatest absolute value."""
    return max(float(numbers.max()), -float(numbers.min()))


def check_covered(coarse: Level, cells: list[Array], fine: Level, number: int) -> None:
    """Raise NotProvenError unless the cells left of a level lie in the domain of the next one.

    With half the spacing, cell (k, l) begins at the steps (2 k + o, 2 l + o) of the next level: at a label on
    black pixels, and in the middle of a cell on white ones. Cells beyond |beta| = pi/4 contain no cross.
    number: of the next level.
    """
    times = 2 if fine.h == coarse.h / 2 else 1
    halves = times == 2 or fine.h == coarse.h
    require(halves, f"level_{number}_h", "is neither that of the level before nor half")
    for i, left in enumerate(cells):
        cell = np.stack(np.nonzero(left), axis=1) + coarse.least[i]
        extra = np.arange(1 if times == 1 else 2 + int(2 * fine.offset[i]))
        rows, columns = ((times * cell[:, axis, None] + extra) - fine.least[i, axis] for axis in (0, 1))
        domain = combine_corners(np.logical_and, fine.allowed[i])
        there = [(steps >= 0) & (steps < side) for steps, side in zip((rows, columns), domain.shape)]
        held = domain[np.where(there[0], rows, 0)[:, :, None], np.where(there[1], columns, 0)[:, None]]
        held = held & there[0][:, :, None] & there[1][:, None]
        beta = fine.beta[i] + fine.h * (columns + fine.least[i, 1] + fine.offset[i])
        inside = (beta < QUARTER - SLIVER) & (beta + fine.h > -QUARTER + SLIVER)
        covered = (held | ~inside[:, None]).all(axis=(1, 2))
        require(covered, f"level {number}, pixel {i}, cell", "of the level before is not covered")


# Sections 6 and 9: the last step ---------------------------------------------------------------------------


def boxes_of(level: Level, cells: list[Array], margin: float) -> Array:
    """The boxes round the cells of each pixel within |beta| <= pi/4, wider by a margin; shape (n, 4).

    Columns: alpha from, to, beta from, to.
    """
    boxes = np.zeros((len(cells), 4))
    for i, left in enumerate(cells):
        (alpha, beta), (k, l) = level.angles(i), np.nonzero(left)  # noqa: E741
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
    def whole_piece(self) -> BoxPiece:
        """The boxes as one piece: v carries a stroke where a whole box is beyond the window of u."""
        above, below = excess_over_windows(self.theta, self.boxes[:, [1, 0, 2, 3]]) > 1e-12
        return BoxPiece(self.boxes, above.astype(np.int64) - below, self.p, np.zeros(len(self.p), bool))


@dataclass
class BoxPiece:
    """Some of the fields in the boxes of a last step.

    boxes (n, 4): a part of the boxes. line (n,): the lines that carry the strokes (`EnergyTerms.residuals`).
    p (m,): jumps. chosen (m,): whether the best jump of a pair is p, because other pieces have the others.
    """

    boxes: Array
    line: Array
    p: Array
    chosen: Array

    def beside_window(self, at: int, side: int, theta: Array) -> BoxPiece:
        """The part below (-1), in (0) or above (1) the window of the stroke of pixel `at`; may be empty."""
        ends = (-math.inf, theta[at] - QUARTER, theta[at] + QUARTER, math.inf)
        boxes, line = self.boxes.copy(), self.line.copy()
        boxes[at, 0], boxes[at, 1] = max(boxes[at, 0], ends[side + 1]), min(boxes[at, 1], ends[side + 2])
        line[at] = side
        return BoxPiece(boxes, line, self.p, self.chosen)

    def with_jump(self, e: int, p: int, terms: EnergyTerms) -> BoxPiece:
        """The part with that best jump of pair e, which may be empty."""
        boxes, jumps, chosen = self.boxes.copy(), self.p.copy(), self.chosen.copy()
        i, j, way = boxes[terms.first[e]], boxes[terms.second[e]], HALF * p
        reach = greatest_a(terms, boxes, e, p)
        i[0], i[1] = max(i[0], j[0] - way - reach), min(i[1], j[1] - way + reach)
        j[0], j[1] = max(j[0], i[0] + way - reach), min(j[1], i[1] + way + reach)
        jumps[e], chosen[e] = p, True
        middle = boxes[:, :2].mean(axis=1)
        a = middle[terms.first] - middle[terms.second] + HALF * jumps
        jumps = jumps - np.where(chosen, 0, np.round(a / HALF)).astype(np.int64)
        return BoxPiece(boxes, self.line, jumps, chosen)

    def possible_jumps(self, e: int, terms: EnergyTerms) -> list[int]:
        """Lemma 4a: all jumps that can be a best one of pair e in the piece."""
        i, j = self.boxes[terms.first[e]], self.boxes[terms.second[e]]
        low, high = (i[0] - j[1]) / HALF, (i[1] - j[0]) / HALF
        nearby = range(math.ceil(-1 - high - 1e-9), math.floor(1 - low + 1e-9) + 1)
        reaches = [greatest_a(terms, self.boxes, e, p) / HALF for p in nearby]
        return [p for p, reach in zip(nearby, reaches) if low + p <= reach and high + p >= -reach]

    @property
    def is_empty(self) -> bool:
        """Whether no field is in it."""
        return bool((self.boxes[:, 0] > self.boxes[:, 1]).any())

    def has_known_jump(self, terms: EnergyTerms) -> Array:
        """Where p is a best jump of all its fields; shape (m,)."""
        known: Array = self.chosen | has_forced_jump(terms, self.p, self.boxes)
        return known

    def weights(self, terms: EnergyTerms, theta: Array) -> list[Array]:
        """The weights of all residuals with which F in the piece is bounded (sections 6 and 9)."""
        known, reach = self.has_known_jump(terms), QUARTER if terms.norm == 1 else HALF
        far = (excess_over_windows(theta, self.boxes) > reach - 1e-9).any(axis=0)
        of_a, of_b, of_r, of_beta = terms.weights
        return [of_a * known, of_b * known, of_r * ~far, of_beta]


def greatest_a(terms: EnergyTerms, boxes: Array, e: int, p: int) -> float:
    """Lemma 4a: the greatest |A| of pair e in the boxes where p is a best jump, and a little more."""
    i, j = boxes[terms.first[e]], boxes[terms.second[e]]
    most = max((1 - 2 * (p % 2)) * i[x] * j[y] for x in (2, 3) for y in (2, 3))
    return 1e-9 + (min(HALF, QUARTER + 4 / math.pi * most) if terms.norm == 2 else HALF)


def last_step(terms: EnergyTerms, boxes: Array, alpha: Array, p: Array) -> LastStep:
    """The last step in some boxes. alpha, p: of the field."""
    middle = (boxes[:, 0] + boxes[:, 1]) / 2
    turns = np.round((middle - alpha) / HALF).astype(np.int64)
    theta = terms.theta + math.pi * np.round((middle - terms.theta) / math.pi)
    return LastStep(boxes, p - turns[terms.first] + turns[terms.second], theta)


def has_forced_jump(terms: EnergyTerms, p: Array, boxes: Array) -> Array:
    """Lemma 4, or "Jumps" of section 9: where p is a best jump everywhere in the boxes; shape (m,)."""
    i, j = boxes[terms.first], boxes[terms.second]
    a = np.maximum(np.abs(i[:, 0] - j[:, 1] + HALF * p), np.abs(i[:, 1] - j[:, 0] + HALF * p)) + 1e-12
    s = parity_sign(p)
    if terms.norm == 2:
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


def excess_over_windows(theta: Array, boxes: Array) -> Array:
    """Distances by which the boxes exceed the windows of the strokes, above and below; shape (2, n)."""
    beyond: Array = np.stack([boxes[:, 1] - theta, theta - boxes[:, 0]]) - QUARTER
    return beyond


def linear_bound(terms: EnergyTerms, step: LastStep, piece: BoxPiece, multipliers: Array) -> float:
    """Lemma 6: a lower bound of F in a piece, from any multipliers l of all residuals (2m + 2n,).

    With phi(r) >= l r - l^2/4 for squares, and >= l r for absolute values and |l| <= 1, the bound is linear
    in the angles. So is the deduction of Lemma 5 where u carries a stroke beyond its window; a stroke with
    l = 0 needs none. Infinite for an empty piece.
    """
    if piece.is_empty:
        return math.inf
    m, n, (low, high) = len(step.p), len(step.theta), (piece.boxes[:, ::2].T, piece.boxes[:, 1::2].T)
    forces, constants, weights = [], [], piece.weights(terms, step.theta)
    for l, k, squared in zip(np.split(multipliers, [m, 2 * m, 2 * m + n]), weights, terms.squared):  # noqa: E741
        l = l if squared else np.clip(l, -1.0, 1.0)  # noqa: E741, PLW2901
        forces.append(k * l)
        constants.append(-k * l * l / 4 if squared else 0 * l)
    above, below = (
        np.maximum(excess_over_windows(step.theta, piece.boxes), 0.0)
        * ((piece.line == 0) & (forces[2] != 0))
        * weights[2]
    )
    if terms.norm == 1:
        deduction, tilt = 2 * (above + below), np.zeros(n)
    else:
        deduction, tilt = math.pi * (above + below), 4 * (above - below)
    of_a, of_b, of_r, of_beta = forces
    i, j, upright = terms.first, terms.second, of_beta - tilt
    of_alpha = np.bincount(i, of_a, n) - np.bincount(j, of_a, n)
    of_skew = np.bincount(i, parity_sign(piece.p) * of_b, n) - np.bincount(j, of_b, n)
    slope = np.stack([of_alpha + of_r, of_skew + parity_sign(piece.line) * of_r + upright])
    zero = np.zeros(n)
    still = terms.residuals(zero, zero, piece.p, piece.line, step.theta)
    parts = [force * x for force, x in zip(forces, still)]
    parts += [*constants, -deduction, *np.minimum(slope * low, slope * high)]
    # What may fail is below 16 roundings of every product that enters.
    far, turn = np.maximum(np.abs(low), np.abs(high)).max(axis=0), np.abs(still[2])
    size = np.sum(np.abs(of_a) * (2 * far[i] + 2 * far[j] + HALF * np.abs(piece.p))) + 4.0 * m
    size += np.sum(np.abs(of_b) * 2) + np.sum(np.abs(of_r) * (far + 1 + turn) + np.abs(upright) + deduction)
    size += sum(np.abs(x).sum() for x in constants)
    return math.fsum(np.concatenate(parts)) - 16 * PRECISION * float(size)


def pieces_of(terms: EnergyTerms, step: LastStep, cuts: list[int]) -> Iterator[BoxPiece]:
    """The pieces of the boxes that stay whole.

    cuts: describes all pieces, each before its parts: by the pixel at whose window it is cut; by n + e for
    pair e, then the least and the greatest jump, of which each has a part; or by -1 if it stays whole.
    """
    numbers, n = iter(cuts), len(terms.white)
    waiting: list[Callable[[], BoxPiece]] = [lambda: step.whole_piece] if cuts else []  # made when needed
    for at in numbers:
        require(bool(waiting), "cuts", "has a piece too many")
        require(-1 <= at < n + len(terms.first), "cuts", "is no pixel and no pair")
        piece = waiting.pop()()
        if at >= n:
            first, last = next(numbers, 1), next(numbers, 0)
            possible = piece.possible_jumps(at - n, terms)
            covered = 0 <= last - first < MOST_PARTS and all(first <= p <= last for p in possible)
            require(covered, "cuts", f"leaves out jumps of pair {at - n}")
            jumps = range(last, first - 1, -1)
            waiting += [functools.partial(piece.with_jump, at - n, p, terms) for p in jumps]
        elif at >= 0:
            waiting += [functools.partial(piece.beside_window, at, side, step.theta) for side in (1, 0, -1)]
        else:
            yield piece
    require(not waiting, "cuts", "leaves pieces out")


def bound_pieces(
    terms: EnergyTerms, step: LastStep, arrays: dict[str, Array]
) -> list[tuple[BoxPiece, float]]:
    """The pieces of the boxes of the last step, each with a lower bound of F in it."""
    size, cuts = 2 * (len(terms.first) + len(terms.white)), take_array(arrays, "cuts", "<i4", None)
    require(len(cuts) <= MOST_CUTS, "cuts", "has too many pieces")
    multipliers = take_array(arrays, "multipliers", "<f8", None, size)
    require((np.abs(multipliers) <= MOST_WEIGHT).all(axis=1), "multipliers", "is too large")
    bounded = []
    for number, piece in enumerate(pieces_of(terms, step, cuts.tolist())):
        require(number < len(multipliers), "multipliers", "has too few pieces")
        bounded.append((piece, linear_bound(terms, step, piece, multipliers[number])))
    require(len(bounded) == len(multipliers), "multipliers", "has too many pieces")
    return bounded


# Section 7: the theorem ------------------------------------------------------------------------------------


@dataclass
class PassedLevels:
    """All levels after their passes, with what follows.

    whole: the instance; terms, pixels, pairs: its parts with strokes. error: of the energy. slack: of
    `sliver_slack`. bounds: of the levels. last: the last step; None if the last level leaves a pixel no cell.
    """

    whole: EnergyTerms
    terms: EnergyTerms
    pixels: Array
    pairs: Array
    energy: float
    error: float
    slack: float
    bounds: list[float]
    last: LastStep | None


@dataclass
class Findings:
    """Findings of the checker: what the certificate proves.

    bound: what a certificate may claim everywhere; it is less than what is proven here by a margin for other
    processors. status: as `status_of` has it. forced_pairs (m,): where the jumps of every better field are
    forced. levels: their bounds. boxes (n, 4): ranges of alpha and beta that hold some label of each cross of
    every better field; None for orthogonal crosses.
    """

    status: str
    norm: Any
    energy: float
    bound: float
    forced_pairs: Array
    levels: list[float]
    boxes: Array = None

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


@refuse_damage
def check_arrays(arrays: dict[str, Array], do_all: Callable[..., Any] = map) -> Findings:
    """Check the arrays of a certificate and return what they prove.

    do_all: as of `pass_levels`. Raises NotProvenError when a level does not follow from the one before, or
    when less is proven than claimed, and UnreadableError for arrays that are not a certificate.
    """
    check_names(arrays)
    has_pieces = len(take_array(arrays, "cuts", "<i4", None)) > 0
    return check_last_step(arrays, pass_levels(arrays, do_all, has_pieces=has_pieces))


def arrays_for(arrays: dict[str, Array], number: int) -> dict[str, Array]:
    """The arrays without those of other levels than one."""
    wanted = f"level_{number}_"
    return {
        name: array
        for name, array in arrays.items()
        if name.startswith(wanted) or not name.startswith("level_")
    }


def pass_level(task: tuple[dict[str, Array], int, float, bool]) -> tuple[float, list[Array]]:
    """Do the pass over one level; return its bound, and the cells that it leaves at each pixel.

    task: the arrays of the certificate without those of other levels, the number of the level, the greatest
    energy of interest, and whether to use combs.
    """
    arrays, number, most, combs = task
    terms, _, _ = terms_with_strokes(arrays, *terms_of(arrays))
    passed = ForwardPass(level_of(arrays, number, terms), terms)
    return passed.bound, passed.remaining_cells(most, combs=combs)


def pass_levels(
    arrays: dict[str, Array], do_all: Callable[..., Any] = map, *, has_pieces: bool
) -> PassedLevels:
    """Do the passes over all levels; check that the first is the whole strip and each covers what is left.

    do_all: does `pass_level` on a list of tasks, here or in other processes. has_pieces: whether a last step
    follows; only then the last level has combs, which take more than half of its time.
    """
    whole, at = terms_of(arrays)
    alpha, beta, p = field_of(arrays, whole)
    energy, error = energy_of(whole, alpha, beta, p)
    terms, pixels, pairs = terms_with_strokes(arrays, whole, at)
    count = level_count(head_of(arrays))
    slack = sliver_slack(terms.weight, terms.w_beta, count)
    most = energy + error + slack
    combs = [True] * (count - 1) + [has_pieces]
    tasks = [(arrays_for(arrays, number), number, most, combs[number]) for number in range(count)]
    bounds, cells, passes = list[float](), list[Array](), iter(do_all(pass_level, tasks))
    level = finer = level_of(arrays, 0, terms)
    check_whole_strip(level)
    for number in range(count):
        if number:  # before the pass, which may take long
            finer = level_of(arrays, number, terms)
            check_covered(level, cells, finer, number)
        passed = next(passes, None)
        if passed is None:  # interrupted
            break
        level, (bound, cells) = finer, passed
        bounds.append(bound)
    last = None
    if all(left.any() for left in cells):
        boxes = boxes_of(level, cells, 2 * (count + 1) * SLIVER)
        last = last_step(terms, boxes, alpha[pixels], p[pairs])
    return PassedLevels(whole, terms, pixels, pairs, energy, error, slack, bounds, last)


def check_last_step(arrays: dict[str, Array], passed: PassedLevels) -> Findings:
    """Do the last step, and compare what is proven with what the certificate claims."""
    terms, energy, last = passed.terms, passed.energy, passed.last
    require(last is not None, "the last level", "leaves nothing, not even the field")
    assert last is not None
    bounded = bound_pieces(terms, last, arrays)
    least = min((bound for _, bound in bounded), default=-math.inf)
    proven = max(0.0, min(max(max(passed.bounds) - passed.slack, least), energy - passed.error))
    bound = max(0.0, proven - SPARE * (1 + proven))
    n, m = len(passed.whole.white), len(passed.whole.first)
    boxes, pairs = np.zeros((n, 4)), np.zeros(m, bool)
    boxes[:, 0] = passed.whole.lower  # in parts without strokes, anything is possible
    boxes[:, 1], boxes[:, 2], boxes[:, 3] = boxes[:, 0] + HALF, -QUARTER, QUARTER
    most = energy + passed.error + SPARE * (1 + energy)
    left = [piece for piece, lower in bounded if lower <= most] or [last.whole_piece]
    boxes[passed.pixels] = widest_box([piece.boxes for piece in left])
    alpha, _, p = field_of(arrays, passed.whole)  # all pieces may agree on a jump that is not the field's
    here = last_step(terms, boxes[passed.pixels], alpha[passed.pixels], p[passed.pairs])
    same = np.all([piece.p == here.p for piece in left], axis=0)
    pairs[passed.pairs] = np.all([piece.has_known_jump(terms) for piece in left], axis=0) & same
    claim = Findings(status_of(energy, bound), terms.norm, energy, bound, pairs, passed.bounds, boxes)
    check_claim(head_of(arrays), claim, proven, passed.error)
    return claim


def widest_box(boxes: list[Array]) -> Array:
    """The least boxes (n, 4) round all of these."""
    upper = np.arange(4) % 2 == 1
    widest: Array = np.where(upper, np.max(boxes, axis=0), np.min(boxes, axis=0))
    return widest


def check_claim(head: dict[str, Any], claim: Findings, most: float, error: float) -> None:
    """Raise NotProvenError unless the claim is proven. most: the greatest bound that is."""
    energy, bound = number_in(head, "energy", 0.0, math.inf), number_in(head, "bound", -math.inf, math.inf)
    close = abs(energy - claim.energy) <= error + 1e-12 * max(1.0, claim.energy)
    require(close, "energy", f"is claimed as {energy!r}, but the field has {claim.energy!r}")
    require(head.get("status") in ("optimal", "gap"), "status", "is neither 'optimal' nor 'gap'")
    proven = f"only {most!r} is proven, for an energy of {claim.energy!r}"
    require(bound <= most, "bound", f"is claimed as {bound!r}, but {proven}")
    if head["status"] == "optimal":
        require(claim.status == "optimal", "status", f"is claimed as optimal, but {proven}")
        require(
            status_of(energy, bound) == "optimal", "status", "is claimed as optimal, but not by the bound"
        )


def check_bytes(data: bytes) -> Findings:
    """Check the bytes of a certificate. Raises as `check_arrays`."""
    return check_arrays(unpack_arrays(data))  # type: ignore[no-any-return]


def main(arguments: list[str], check: Callable[[bytes], Findings] = check_bytes) -> int:
    """Print the verdict and return the exit code."""
    if len(arguments) != 1 or arguments[0].startswith("-"):
        print(f"usage: python {Path(sys.argv[0]).name} FILE")
        return 2
    path = arguments[0]
    try:
        claim = check(read_file(path))
    except NotProvenError as error:
        print(f"refused: {error}")
        return 1
    except UnreadableError as error:
        print(f"unreadable: {path} {error}")
        return 2
    except MemoryError:
        print(f"unchecked: {path} takes more memory than there is")
        return 3
    for number, bound in enumerate(claim.levels):
        print(f"level {number}: bound {bound:.9f}")
    print(f"energy {claim.energy!r}")
    print(f"bound  {claim.bound!r}")
    if claim.status == "optimal":
        print(f"optimal: no field has less by more than {claim.energy - claim.bound:.3g}")
    else:
        print(f"gap: {claim.energy - claim.bound:.6g}; {claim.forced} jumps are forced")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
