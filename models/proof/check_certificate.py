"""Check a certificate of a cross field with no code of its prover: `python check_certificate.py FILE`.

This file needs only Python 3.9 or newer and NumPy. It checks the levels of a large certificate in one process
for each processor, and by compiled loops where Numba is installed. With --plain it does without both; the
numbers are the same.

It recomputes everything from the instance in float64: the energy U of the field, and at every level of the
lattice the costs, a bound, the cells that it excludes, and that the next level covers the rest. Exit code 0:
the claim is proven. 1: it is not; a line names the place. 2: the file is not a certificate. 3: there is too
little memory to check it.

"Optimal" means: no field has an energy below U by more than the number printed, which is at most OPTIMAL
times the greater of 1 and U. "Gap" means: no field has an energy below the bound.

1. The problem. Crosses lie on a strip: (alpha, beta) and (alpha + pi/2, -beta) are the same lines, and
   |beta| <= pi/4. With the best jumps, and at every stroke its nearer line, crosses have the energy

       F = sum over pairs  min over p of 2 (A^2 + B^2)  +  sum W min over lines and turns of R^2
           + w_beta sum beta^2,     A = alpha_i - alpha_j + p pi/2,   B = (-1)^p beta_i - beta_j.

   A field's energy, in any gauge, is at least F of its crosses: a lower bound of F is one of all fields.
   No pair joins two parts of the mask, and no term is negative. So F is at least the sum of its terms in
   those parts that have a stroke. All that follows is about these terms and pixels alone, numbered anew; U
   is the energy of the whole field.

2. A level. Label (k, l) of pixel i stands at (alpha_i + h (k + o), beta_i + h (l + o)), where o is 0 on
   black and 1/2 on white pixels. The domain of a pixel is the union of the cells whose four vertices are
   allowed. Round all crosses of the domain to vertices by two thresholds, uniform and independent, one for
   all alphas and one for all betas; a pair with an odd best jump takes 1 - t for its second beta. At a pair
   each of A and B falls on one of two neighbouring values with the right mean: variance at most h^2/4. A line
   of a stroke is a sum of two independent roundings: at most h^2/2. So the expectations of

       c = min over p of 2 (A^2 + B^2) - h^2     W (min of R^2 - h^2/2)     w_beta (beta^2 - h^2/4)

   are at most the terms of F. (Let s = k + l + 2 o. The line u at the turn it has at the centre may lose 0
   where s = 0 and h^2 where |s| = 1 in place of h^2/2. With fractions f and g of the step the variance is
   h^2 (f (1 - f) + g (1 - g)). For a lower corner with s = 0, (1 - f)(1 - g) 0 + (f + g - 2 f g) + f g/2
   exceeds it, over h^2, by f^2 + g^2 - 3 f g/2; with s = -1 by (1 - f - g)^2; with s = 1 by
   f^2 + g^2 + f g/2 - 3 (f + g)/2 + 1, which is at least 1/10; with s = -2 and -3 by symmetry; elsewhere
   h^2/2 is enough.) The distribution of a pixel's vertex is the same at all its pairs. Hence a sum of
   functions of single vertices and of pairs that is below the discrete costs everywhere is, in the mean,
   below F.

   Tables move costs between pairs and quads (the pixels of 2 x 2). Let lambda_e be any numbers for the labels
   of alpha at the four pairs e of a quad. A pair then costs c + the sum of its lambda_e, and the quad costs
   minus the sum of its four lambda_e: the sum of all costs is the same for all labels. One threshold rounds
   all alphas, whatever the jumps. So the alphas of a quad have a joint distribution, whose parts at two
   pixels are those of their pair. Hence the mean of a quad's cost is at least its minimum over the alphas
   that have an allowed label, and these minima are added to every bound in 3. (Betas have no joint
   distribution: a pair with an odd jump takes 1 - t for one of them.)

   The minimum over p is one over all integers: with d = alpha_i - alpha_j, the best jump of a given parity
   has |A| <= pi/2, so that it is among ceil(-2 d/pi - 1) .. floor(-2 d/pi + 1). For all labels of two pixels
   at once these are the jumps from the least to the greatest of them; see `jumps`.

3. A pass. M_e(x) is a number for each label of the earlier pixel of pair e, taken from the certificate; any
   numbers will do. The largest share that remains for its later pixel is S_e(y) = min over x of c_e(x, y) -
   M_e(x), so that c_e(x, y) >= M_e(x) + S_e(y). Go through the pixels in their order. At pixel i, theta_i is
   D_i + the sum of M over its pairs to later pixels + the sum of shares received from earlier ones, mu_i =
   min theta_i, t_i = theta_i - mu_i >= 0. It hands gamma t_i on, gamma = 1 / max(1, earlier pairs, later
   pairs): later pixels get

       N_e(y) = min over x of (c_e(x, y) - M_e(x) + gamma t_i(x)),
       c_e(x, y) >= M_e(x) - gamma t_i(x) + N_e(y).

   For any i take the second inequality at the pairs whose later pixel is at most i, the first one at the
   others. In the sum of all D and c, labels of j < i have at least mu_j + t_j - (number of later pairs) gamma
   t_j >= mu_j, those of j > i at least mu*_j = min (D_j + sum of M + sum of S), and those of i have mu_i +
   t_i(x). So

       F >= sum over j <= i of mu_j  +  sum over j > i of mu*_j  +  E[t_i(x)]

   for crosses in the domain. Where the right side, with t_i in the place of E[t_i], exceeds U at all four
   vertices of a cell, no field of energy U or less has its cross in that cell. The cells that are left must
   lie in the domain of the next level; the first domain must be all of the strip. With i the last pixel, the
   bound is the sum of mu. With tables, c is a pair's cost with them, and the minima of the quads are added to
   every right side.

   After the pass, trees exclude more cells. The whole pass gives

       F >= sum of mu  +  sum over pixels of E[r_i(x)]  +  sum over pairs of E[s_e(x, y)],
       r_i = (1 - gamma times the number of later pairs) t_i,   s_e = c_e - (M_e - gamma t_i) - N_e,

   where no r and no s is negative. On a tree of pairs, the distributions of its pairs belong to one joint
   distribution of all its pixels. So the sum of the means over the tree is at least E[m_i(x_i)], with m_i(x)
   the least sum over the tree with label x at pixel i. Where the sum of mu + m_i exceeds U at all four
   vertices of a cell, the cell is excluded, too. m_i follows from messages along the tree. There are two
   trees for each pixel: its row, without gaps of the mask, with the columns that cross it; and its column,
   with the rows that cross it.

   What a level leaves may be cut in two, between two steps of alpha or of beta at one pixel. Each cell of
   that pixel is on one side. So a field of energy U or less has all its crosses in one of the two parts, and
   each part may have levels of its own. F is then at least the lesser of their bounds, or U.

4. Optimality. The last cells, of each part, span a box for each pixel. Cells above a gap in alpha may have
   their other label there, (alpha - pi/2, -beta), if that makes the box narrower. There p is a best jump
   everywhere if max |A| <= pi/2 and pi max |A| - pi^2/4 <= 4 min (-1)^p beta_i beta_j: against p +- 1, A'^2
   - A^2 >= pi^2/4 - pi |A| and B^2 - B'^2 = -4 (-1)^p beta_i beta_j; against others |A| <= pi/2 is enough.
   Let a = alpha - theta, |a| <= 3 pi/4. Where |a| <= pi/4 the nearest line is u at this turn. At a = pi/4 +
   e it is v, with 4 e (pi/4 + beta) less in its square, at a = -pi/4 - e with 4 e (pi/4 - beta) less: the
   squares differ by (u - v)(u + v), with v = a - pi/2 - beta and v = a + pi/2 - beta. With the greatest e of
   the box these are linear in beta; or the box is cut at the edge, and v carries the stroke beyond. So F is
   at least a convex quadratic G on each piece, and G(y) >= G(x) + grad G(x) (y - x), whose least value over
   the y in a box is a sum of single terms.

5. Absolute values. In the norm 1 the terms of F are 2 (|A| + |B|), W |R| and w_beta |beta|. In the norm
   "mixed" only those of pairs are; the others stay squares. The differences from 2 and 4 are these. There is
   one lattice for all pixels: every alpha and beta of a label is a multiple of h, and so is pi/2. So A and B
   of two labels are multiples of h at every jump, and |.| is linear between them: the expectation of

       c = min over p of 2 (|A| + |B|)         w_beta |beta|    (mixed: w_beta (beta^2 - h^2/4))

   is at most the term of F. A line's R takes the values x, x + h, x + 2 h, with the right mean r. For line u
   and any slope l of the stroke (|l| <= 1 in the norm 1, |l| <= pi/2 and h <= pi/16 in the norm mixed) let

       norm 1   d(R) = |R| where |R| >= 2 h,  else l R
       mixed    d(R) = R^2 - h^2/2 where |R - l/2| >= 2 h,  else R^2 - (R - l/2)^2 = l R - l^2/4.

   The mean of d is at most |r| or r^2. Where all three values are near, d is linear and nowhere above. In
   the norm 1, if one is far, none has another sign, |.| is linear on them, and d <= |.|. In the norm
   mixed, if one is far, the three values of (R - l/2)/h are y, y + 1, y + 2 with y >= 0, or the reverse.
   For y >= 1 each loses h^2/2 or more, which is at least the variance. For y < 1 they lose at least 0,
   h^2 and h^2/2, as with s = 0 in 2. For line v, l = 0 in the norm 1, and all lose h^2/2 in the norm
   mixed. The least over lines and turns is nowhere above any of them; as |l/2| + 2 h < pi/2, the nearest
   turn of a line has it.

   Jumps: let g = min(|beta_i|, |beta_j|), negative where (-1)^p beta_i beta_j >= 0. With the other parity
   |B| grows by -2 g, and one step further |A| is at least pi/2 - |A|. So p is a best jump where |A| <=
   pi/2 and |A| + g <= pi/4. Strokes in the norm 1: at a = pi/4 + e and at -pi/4 - e, 0 <= e <= pi/4, the
   nearest line is nearer than u by at most 2 e. Or the box is cut at the edge, and v carries the stroke
   beyond. The rest is linear: for any multiplier l, |r| >= l r if |l| <= 1, and r^2 >= l r - l^2/4. The sum
   over all terms is linear in the angles, and its least value in a piece of the boxes is a sum of single
   terms. The certificate holds the cuts, and the multipliers of A, B, R and beta on each piece.

6. Rounding. Messages may be anything, so errors in them do no harm. What counts is how much an inequality
   of 3. may fail at a pixel or a pair. That is below a small multiple (ROUNDING) of the machine's precision
   times the size of the numbers that enter; the sum over all of them is taken off every bound. Sums over
   pixels are made without rounding (math.fsum). Domains may fall short of what they should cover by SLIVER
   radians, as sides are rounded; moving a cross by that much at every level changes F by less than `slack`,
   which is allowed for too. pi stands for the double next to it, as in the definition of the field.
"""

from __future__ import annotations

import argparse
import json
import math
import multiprocessing
import os
import re
import signal
import struct
import sys
import zlib
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

FORMAT, VERSION = "crossfield-certificate", 3
HALF, QUARTER = math.pi / 2, math.pi / 4
OPTIMAL = 1e-8
SPARE = 1e-10  # taken off a bound that is reported, relative to 1 + it: other processors round otherwise
PRECISION = 2.0**-52
ROUNDING = 64.0
SLIVER = 2e-14
MOST_BYTES = 1 << 31  # of a file, and of all its arrays
ROOM, MORE_ROOM = 1 << 28, 128  # memory for a certificate: a number, and one for each byte of its file
MOST_LEVELS = 256
MOST_SIDE = 9999
MOST_PIECES = 200  # of the boxes
MOST_COUNT = 4096  # labels of a pixel in alpha, and in beta
MOST_LABELS = 1 << 28  # of a level
MOST_ANGLE = 16.0
MOST_JUMP = 64
MOST_WEIGHT = 1e6
MOST_WHOLE = 2.0**53  # of a message
MOST_SCALE = 1.0  # of a message or a table
BLOCK = 1 << 16  # numbers of a product that NumPy handles at once
KEPT = 1 << 23  # numbers of costs that a pass keeps for its combs
ROWS = 32  # of a product, from which NumPy leaves out terms together
ANY_ORDER = {"reassoc", "nnan", "nsz"}  # minima do not depend on the order of their terms
LARGE = 3_000_000  # numbers in a certificate from which compiling, some 2 s, saves time

INSTANCE_PARTS = ("head", "origin", "mask", "stroke_pixels", "theta", "w")
PARTS = ("head", "alpha", "beta", "p", *(f"instance_{part}" for part in INSTANCE_PARTS))
LEVEL_PARTS = ("h", "alpha", "beta", "ranges", "allowed", "scale", "wide")
STEP_PARTS = {2: ("steps_16", "steps_32"), 1: ("steps_32", "steps_64"), "mixed": ("steps_32", "steps_64")}
ABSOLUTE_PARTS = ("slopes", "multipliers")  # unless the norm is 2
CUTS = "cuts"  # also, if boxes are cut
BRANCHES = "branches"  # if the levels are no chain
CLUSTER_PARTS = ("quads", "table_scale", "table_steps")  # of a level
NAME = re.compile(rb"[a-z0-9_]+\.npy")
HEAD = re.compile(
    rb"\x93NUMPY\x01\x00\x76\x00\{'descr': '(\|[bu]1|<i[248]|<f8)', 'fortran_order': False, "
    rb"'shape': \(((?:[0-9]{1,10},)|(?:[0-9]{1,10}, [0-9]{1,10}))\), \} *\n"
)  # of an array, as NumPy writes it: 128 bytes

Array = Any
Field = tuple[Array, Array, Array]
Over = Callable[[], bool]
Spans = tuple[Array, Array]
Run = tuple[list[int], list[int]]  # pixels, the earlier ones first, and the pairs between them
Product = Callable[[Array, Array, Spans], Array]


class RefusedError(Exception):
    """A claim that does not follow; the message names the place."""


class UnreadableError(Exception):
    """A file that is not a certificate."""


class StoppedError(Exception):
    """Time was over before anything was proven."""


@dataclass
class Sketch:
    """The instance: pixels in order, pairs (upper or right neighbours), strokes, windows.

    pixels (n,), pairs (m,): numbers in the whole mask. norm: 1, 2 or "mixed". offset (n,): o. weight, target
    (n,): W and theta, 0 where there is no stroke. slope (n,): l of 5. lower (n,): least alpha of the gauge.
    earlier, later: numbers of the pairs of each pixel to later, to earlier pixels. runs: columns and rows of
    pixels without gaps.
    """

    norm: Any
    pixels: Array
    pairs: Array
    offset: Array
    slope: Array
    first: Array
    second: Array
    weight: Array
    target: Array
    lower: Array
    w_beta: float
    later: list[list[int]]
    earlier: list[list[int]]
    runs: tuple[list[Run], list[Run]]


@dataclass
class Cluster:
    """Four tables on a quad, which has the pixels a (lower left), b, c, d counter-clockwise.

    tables: of the pairs (a, b), (b, c), (d, c) and (a, d), by the alphas of these.
    """

    pixels: list[int]
    pairs: list[int]
    tables: list[Array]


@dataclass
class Level:
    """A lattice, its allowed labels, and the messages of the pairs.

    ranges (n, 4): steps, as first and count of alpha, first and count of beta; allowed (a, b) of each pixel;
    the message of each pair is to its earlier pixel: `Messages`, or arrays. clusters: the tables of quads;
    tables: their sum at each pair that has some, by alphas of its first and of its second pixel.
    rows, columns: numbers of the alphas and betas of each pixel that have an allowed label. used: `allowed`
    at these alone; spans: for each of those rows, the first allowed column and the one after the last.

    Messages have one number for each allowed label, row by row.
    """

    h: float
    alpha: Array
    beta: Array
    ranges: Array
    allowed: list[Array]
    messages: Sequence[Array]
    clusters: list[Cluster]
    tables: dict[int, Array]

    def __post_init__(self) -> None:
        self.rows, self.columns = (
            [np.flatnonzero(allowed.any(axis=axis)) for allowed in self.allowed] for axis in (1, 0)
        )
        some = zip(self.allowed, self.rows, self.columns)
        self.used = [allowed[np.ix_(rows, columns)] for allowed, rows, columns in some]
        self.spans = [
            np.stack([used.argmax(axis=1), used.shape[1] - used[:, ::-1].argmax(axis=1)], axis=1)
            for used in self.used
        ]


@dataclass
class Test:
    """A right side of 3. at each allowed label of each pixel, and the greatest error of these numbers."""

    least: list[Array]
    error: float


@dataclass
class Passed:
    """Result of a pass over a level: a bound of F on its domain, and the tests that exclude cells."""

    bound: float
    tests: list[Test]


@dataclass
class Region:
    """A level after its pass: its bound, and the boxes of `boxes_of`, None if it leaves a pixel no cell.

    parts: the levels that together cover what it leaves; empty without such ones.
    """

    level: Level
    bound: float
    boxes: tuple[Array, Array] | None
    parts: Sequence[int] = ()


@dataclass
class Verdict:
    """Findings of the checker: the proven claim.

    bound: what a certificate may claim everywhere; it is less than what is proven here by a margin for other
    processors. status: as `status_of` has it. boxes (n, 4): ranges of alpha and beta that hold the crosses of
    every better field, by labels around `centres` (n, 2). forced_pairs (m,): where its jumps are forced.
    levels: their bounds.
    """

    status: str
    norm: Any
    energy: float
    bound: float
    boxes: Array
    centres: Array
    forced_pairs: Array
    levels: list[float]

    @property
    def forced(self) -> int:
        """The number of forced jumps."""
        return int(self.forced_pairs.sum())


# Reading ---------------------------------------------------------------------------------------------------


# This file parses the archive itself, and strictly: programs read different arrays from unusual archives.


def read(path: str) -> dict[str, Array]:
    """The arrays of the certificate in a file."""
    try:
        with open(path, "rb") as stream:  # noqa: PTH123 - only built-in functions
            data = stream.read(MOST_BYTES + 1)
    except (OSError, ValueError) as error:
        raise UnreadableError(f"cannot be read ({type(error).__name__})") from error
    return unpacked(data)


def unpacked(data: bytes) -> dict[str, Array]:
    """The arrays of an .npz, which holds a certificate's arrays and nothing else.

    It consists of the members, stored or deflated, the directory and its end record, without other bytes
    before, between or after them, and without a comment. The header of each member repeats its directory
    entry. Each name appears once. Sizes are checked before anything is unpacked; no pickles. What it takes to
    check the arrays is limited by the size of the file.
    """
    try:
        arrays = _members(data)
        _need_names(arrays)
        _need_room(arrays, len(data))
    except (UnreadableError, RefusedError, MemoryError):
        raise
    except Exception as error:  # a damaged archive can raise anything
        raise UnreadableError(f"is no .npz that can be read ({type(error).__name__})") from error
    return arrays


def _require(holds: Any, otherwise: str) -> None:
    """Raise UnreadableError unless the condition holds."""
    if not holds:
        raise UnreadableError(otherwise)


def _members(data: bytes) -> dict[str, Array]:
    """All arrays of an archive, by name."""
    _require(len(data) <= MOST_BYTES, "holds more than 2 GiB")
    end = len(data) - 22
    _require(end >= 0, "is no .npz, or cut off")
    mark, disk, first, here, count, size, start, comment = struct.unpack("<4s4H2LH", data[end:])
    whole = (mark, disk, first, here, comment, start + size) == (b"PK\5\6", 0, 0, count, 0, end)
    _require(whole, "is no .npz, or has more or less than its members")
    arrays: dict[str, Array] = {}
    at, place, total = start, 0, 0
    for _ in range(count):
        mark, _, *facts = struct.unpack_from("<4s6H3L5H2L", data, at)
        name = data[at + 46 : at + 46 + facts[8]]
        _require(mark == b"PK\1\2" and NAME.fullmatch(name), f"has a member {name[:40]!r}")
        key = name[: -len(b".npy")].decode()
        _require(key not in arrays, f"has {key} twice")
        total += facts[7]
        _require(total <= MOST_BYTES, "holds more than 2 GiB")
        _require(
            4 * total <= ROOM + MORE_ROOM * len(data), "has larger arrays than a file of its size may have"
        )
        begin = _content(data, place, key, facts)
        place = begin + facts[6]
        arrays[key] = _array(key, data[begin:place], facts)
        at += 46 + len(name)
    _require((at, place) == (end, start), "has more or less than its members")
    return arrays


def _content(data: bytes, place: int, key: str, facts: list[int]) -> int:
    """Start of the content of a member, whose header at a place must repeat the directory entry."""
    _, flags, method, _, _, _, packed, length, _, extra, comment, disk, _, _, offset = facts
    local = [*struct.unpack_from("<4s5H3L2H", data, place)]
    name = key.encode() + b".npy"
    begin: int = place + 30 + len(name) + local[10]
    if local[10] == 20:  # NumPy repeats the sizes in 64 bits
        wide = struct.pack("<2H2Q", 1, 16, length, packed)
        _require(data[begin - 20 : begin] == wide, f"{key} has two sizes")
        local[7:9] = [packed, length] if local[7:9] == [0xFFFFFFFF] * 2 else local[7:9]
        local[10] = 0
    same = local == [b"PK\3\4", *facts[:8], len(name), 0] and data.startswith(name, place + 30)
    _require(same and offset == place, f"{key} has a header that differs from its directory entry")
    plain = not (flags or extra or comment or disk) and (method == 8 or (method == 0 and packed == length))
    _require(plain and begin + packed <= len(data), f"{key} is packed in another way, or cut off")
    return begin


def _array(name: str, packed: bytes, facts: list[int]) -> Array:
    """The array in the content of a member, in the kinds and the form of certificates."""
    deflated, checksum, length = facts[2] == 8, facts[5], facts[7]
    unpacker = zlib.decompressobj(-15)
    head = unpacker.decompress(packed, 128) if deflated else packed[:128]
    found = HEAD.fullmatch(head)
    if found is None:
        raise UnreadableError(f"{name} is no array as certificates have it")
    kind, shape = np.dtype(found[1].decode()), tuple(int(side) for side in found[2].split(b",") if side)
    size = math.prod(shape) * kind.itemsize
    _require(128 + size == length, f"{name} differs from its header")
    rest = unpacker.decompress(unpacker.unconsumed_tail, size + 1) if deflated else packed[128:]
    ended = not deflated or (unpacker.eof and not unpacker.unused_data)
    whole = ended and len(rest) == size and zlib.crc32(rest, zlib.crc32(head)) == checksum
    _require(whole, f"{name} is damaged")
    _require(kind.kind != "b" or not rest.strip(b"\0\1"), f"{name} has bits that are neither 0 nor 1")
    return np.frombuffer(rest, kind).reshape(shape)


def _need_names(arrays: dict[str, Array]) -> None:
    """Raise an error unless the arrays are exactly those of a certificate with that many levels."""
    head = head_of(arrays)
    norm = norm_of(head)
    parts = LEVEL_PARTS + STEP_PARTS[norm] + CLUSTER_PARTS
    levels, whole = _levels(head), PARTS + (() if norm == 2 else ABSOLUTE_PARTS)
    names = set(whole) | {f"level_{number}_{part}" for number in range(levels) for part in parts}
    names |= {BRANCHES if norm == 2 else CUTS} & set(arrays)
    for name in sorted(names - set(arrays)):
        raise UnreadableError(f"has no array {name}")
    for name in sorted(set(arrays) - names):
        raise UnreadableError(f"has an array {name[:40]} too many for a certificate with {levels} levels")


def _need_room(arrays: dict[str, Array], size: int) -> None:
    """Raise UnreadableError unless a file of that size may take the memory that the check would take.

    The bytes for each number are more than what the check was measured to take.
    """
    bits = np.array([bin(byte).count("1") for byte in range(256)], np.uint8)
    mask, most = arrays["instance_mask"], 0
    for number in range(_levels(head_of(arrays))):
        at = f"level_{number}_"
        counts = np.clip(_given(arrays, f"{at}ranges", "<i4", None, 4)[:, 1::2], 0, MOST_COUNT).astype(
            np.int64
        )
        allowed = int(bits[_given(arrays, f"{at}allowed", "|u1", None)].sum(dtype=np.int64))
        side = int(counts.max(initial=0))
        need = 160 * allowed + 4 * int(counts.prod(axis=1).sum()) + 56 * side * side
        most = max(most, need + 32 * arrays[f"{at}table_steps"].size)
    most += 24 * mask.size + 1500 * int(mask.sum()) + sum(array.nbytes for array in arrays.values())
    enough = most <= ROOM + MORE_ROOM * size
    _require(enough, f"takes {most >> 20} MB of memory to check, more than a file of its size may")


def head_of(arrays: dict[str, Array]) -> dict[str, Any]:
    """The text in the array `head`."""
    head = _text(arrays, "head")
    version = head.get("version")
    if head.get("format") != FORMAT or type(version) is not int or version != VERSION:
        raise UnreadableError(f"is no {FORMAT} of version {VERSION}; make it again with crossfield prove")
    return head


def norm_of(head: dict[str, Any]) -> Any:
    """The norm of the energy."""
    norm = head.get("norm")
    known = type(norm) in (int, str) and norm in STEP_PARTS
    _require(known, "is of an unknown norm")
    return norm


def _text(arrays: dict[str, Array], name: str) -> dict[str, Any]:
    text = _given(arrays, name, "|u1", None).tobytes().decode()
    found = json.loads(text, object_pairs_hook=_object)
    if not isinstance(found, dict):
        raise UnreadableError(f"{name} is not a JSON object")
    return found


def _object(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """A JSON object without repeated keys, because programs differ on which of them counts."""
    found = dict(pairs)
    _require(len(found) == len(pairs), "has a text with a repeated key")
    return found


def _given(arrays: dict[str, Array], name: str, kind: str, *shape: int | None) -> Array:
    """An array of that kind and, if numbers are given, of that shape; finite."""
    if name not in arrays:
        raise UnreadableError(f"has no array {name}")
    array = arrays[name]
    fits = len(array.shape) == len(shape) and all(
        size is None or size == found for size, found in zip(shape, array.shape)
    )
    if array.dtype != np.dtype(kind) or not fits:
        raise UnreadableError(f"{name} has another kind or shape than other arrays ask for")
    if array.dtype.kind == "f" and not np.isfinite(array).all():
        raise RefusedError(f"{name} holds something that is no number")
    return array


def _need(holds: Any, name: str, wrong: str) -> None:
    """Raise RefusedError, with the first place that fails, unless all of the condition holds."""
    holds = np.asarray(holds)
    if not holds.all():
        place = f"[{int(np.argmin(holds))}]" if holds.ndim else ""
        raise RefusedError(f"{name}{place} {wrong}")


def _number(head: dict[str, Any], name: str, least: float, most: float) -> float:
    value: Any = head.get(name)
    _need(type(value) in (int, float) and least <= value <= most, name, f"is not in [{least:g}, {most:g}]")
    return float(value)


def _levels(head: dict[str, Any]) -> int:
    """The number of levels that a certificate has."""
    count = _number(head, "levels", 1, MOST_LEVELS)
    _need(count == int(count), "levels", "is no whole number")
    return int(count)


# The instance and the field --------------------------------------------------------------------------------


def sketch_of(arrays: dict[str, Array], *, whole: bool = False) -> Sketch:
    """The instance in the certificate, with stroke directions moved into the gauge's own range.

    whole: with the parts of the mask that have no stroke, of which no level says anything.
    """
    head = _text(arrays, "instance_head")
    _need("instance_crossings" not in arrays, "instance_crossings", "is not covered by certificates")
    mask = _given(arrays, "instance_mask", "|b1", None, None)
    _given(arrays, "instance_origin", "<f8", 2)  # not part of the proof, but of the instance
    rows, columns = np.nonzero(mask)
    n = len(rows)
    _need(n > 0, "instance_mask", "has no pixel")
    _need(max(mask.shape) <= MOST_SIDE, "instance_mask", "has too long a side")
    number = np.full((mask.shape[0] + 1, mask.shape[1] + 1), -1)
    number[1:, :-1][mask] = np.arange(n)
    neighbours = np.stack([number[rows, columns], number[rows + 1, columns + 1]], axis=1)
    first, side = np.nonzero(neighbours >= 0)
    second = neighbours[first, side]
    at, *strokes = _strokes(arrays, head, number[1:, :-1], n)
    pixels, pairs = np.arange(n), np.arange(len(first))
    if not whole:
        held = _joined(at, first, second, n)
        pixels, pairs = np.flatnonzero(held), np.flatnonzero(held[first])
        anew = np.cumsum(held) - 1
        first, second, rows, columns = anew[first[pairs]], anew[second[pairs]], rows[held], columns[held]
        strokes, n = [each[held] for each in strokes], len(pixels)
    weight, target, lower = strokes
    later: list[list[int]] = [[] for _ in range(n)]
    earlier: list[list[int]] = [[] for _ in range(n)]
    for e, (i, j) in enumerate(zip(first.tolist(), second.tolist())):
        later[min(i, j)].append(e)
        earlier[max(i, j)].append(e)
    w_beta = _number(head, "w_beta", 0.0, MOST_WEIGHT)
    claim = head_of(arrays)
    norm, white = norm_of(claim), (rows + columns) % 2 == 1
    offset = 0.5 * white if norm == 2 else np.zeros(n)
    slope = np.zeros(n) if whole else _slopes(arrays, norm, n)
    runs = _runs(first, second, first > second, n), _runs(first, second, first < second, n)
    terms = first, second, weight, target, lower, w_beta, later, earlier, runs
    return Sketch(norm, pixels, pairs, offset, slope, *terms)


def _joined(at: Array, first: Array, second: Array, n: int) -> Array:
    """True for the pixels (n,) that pairs join, directly or by others, to some of the pixels `at`."""
    near: list[list[int]] = [[] for _ in range(n)]
    for i, j in zip(first.tolist(), second.tolist()):
        near[i].append(j)
        near[j].append(i)
    held, waiting = np.zeros(n, bool), at.tolist()
    while waiting:
        i = waiting.pop()
        if not held[i]:
            held[i] = True
            waiting += near[i]
    return held


def _runs(first: Array, second: Array, chosen: Array, n: int) -> list[Run]:
    """The runs of the chosen pairs: those to upper neighbours, or those to right ones."""
    numbers = np.flatnonzero(chosen).tolist()
    next_of = {min(ends): (e, max(ends)) for e in numbers for ends in [(int(first[e]), int(second[e]))]}
    runs: list[Run] = []
    for begin in sorted(set(range(n)) - {j for _, j in next_of.values()}):
        pixels, pairs = [begin], list[int]()
        while pixels[-1] in next_of:
            e, j = next_of[pixels[-1]]
            pixels.append(j)
            pairs.append(e)
        runs.append((pixels, pairs))
    return runs


def _slopes(arrays: dict[str, Array], norm: Any, n: int) -> Array:
    """The slope l of each pixel's stroke, shape (n,)."""
    if norm == 2:
        return np.zeros(n)
    found = _given(arrays, "slopes", "<f8", n)
    _need(np.abs(found) <= (1.0 if norm == 1 else HALF), "slopes", "is too steep")
    return found


def _strokes(
    arrays: dict[str, Array], head: dict[str, Any], number: Array, n: int
) -> tuple[Array, Array, Array, Array]:
    """Pixels of the strokes; W and theta of each pixel, 0 without one, and its least alpha, shapes (n,)."""
    theta = _given(arrays, "instance_theta", "<f8", None)
    w = _given(arrays, "instance_w", "<f8", len(theta))
    places = _given(arrays, "instance_stroke_pixels", "<i4", len(theta), 2).astype(np.int64)
    gauge = head.get("gauge")
    _need(gauge in ("strokes", "box"), "gauge", "is unknown")
    _need((theta >= 0) & (theta < np.pi), "instance_theta", "is not in [0, pi)")
    _need((w > 0) & (w <= 1), "instance_w", "is not in (0, 1]")
    _need(((places >= 0) & (places < number.shape)).all(axis=1), "instance_stroke_pixels", "is no pixel")
    at = number[tuple(places.T)]
    _need(at >= 0, "instance_stroke_pixels", "is outside the mask")
    _need(np.diff(at) > 0, "instance_stroke_pixels", "is out of order")
    weight, target, lower = np.zeros((3, n))
    weight[at] = _number(head, "w_strokes", 0.0, MOST_WEIGHT) * w
    if gauge == "strokes":
        target[at] = theta
        lower[at] = theta - QUARTER
    else:
        target[at] = np.where(theta >= 3 * QUARTER - 1e-9, np.maximum(theta - np.pi, -QUARTER), theta)
    return at, weight, target, lower


def field_of(arrays: dict[str, Array], sketch: Sketch) -> Field:
    """The angles alpha, beta (n,) and jumps p (m,) of the field, which must lie in the windows."""
    n, m = len(sketch.offset), len(sketch.first)
    alpha, beta = (_given(arrays, name, "<f8", n).astype(np.float64) for name in ("alpha", "beta"))
    p = _given(arrays, "p", "<i4", m).astype(np.int64)
    inside = (alpha >= sketch.lower - SLIVER) & (alpha <= sketch.lower + HALF + SLIVER)
    _need(inside, "alpha", "is outside the window of the gauge")
    _need(np.abs(beta) <= QUARTER + SLIVER, "beta", "is beyond pi/4")
    _need(np.abs(p) <= MOST_JUMP, "p", "is no jump")
    return alpha, beta, p


def sign(p: Array) -> Array:
    """The sign (-1)^p of each jump."""
    return 1.0 - 2.0 * (p & 1)


def energy_of(sketch: Sketch, alpha: Array, beta: Array, p: Array) -> tuple[float, float]:
    """The energy of a field by its definition, and the greatest error of the number."""
    i, j = sketch.first, sketch.second
    a = alpha[i] - alpha[j] + HALF * p
    b = sign(p) * beta[i] - beta[j]
    r = np.where(sketch.weight > 0, alpha + beta - sketch.target, 0.0)
    (size_a, of_a), (size_b, of_b) = (sized(each, sketch.norm == 2) for each in (a, b))
    (size_r, of_r), (size_beta, _) = (sized(each, sketch.norm != 1) for each in (r, beta))
    total = math.fsum([*2 * size_a, *2 * size_b, *sketch.weight * size_r, *sketch.w_beta * size_beta])
    size = np.abs(alpha[i]) + np.abs(alpha[j]) + HALF * np.abs(p) + 1
    error = np.sum(4 * size * (of_a + of_b)) + np.sum(sketch.weight * 8 * of_r)
    return total, PRECISION * (float(error) + 8 * total)


def sized(residual: Array, squared: bool) -> tuple[Array, Array]:
    """The squares or absolute values of residuals, and the size of their slopes."""
    if squared:
        return residual * residual, 2 * np.abs(residual)
    return np.abs(residual), np.ones_like(residual)


def slack_of(weight: Array, w_beta: float, levels: int) -> float:
    """Greatest change of F when every angle moves by SLIVER at each level.

    At most four pairs with slopes of 4 |A| and 4 |B|, both at most pi / 2 at the best jumps, 2 W pi/2 and
    2 w_beta pi/4. Those of absolute values are less.
    """
    slopes = 64.0 + 8.0 * weight + 4.0 * w_beta
    return 2 * (levels + 1) * SLIVER * float(np.sum(slopes))


# A level ---------------------------------------------------------------------------------------------------


def level_of(arrays: dict[str, Array], number: int, sketch: Sketch) -> Level:
    """Level `number` of the certificate."""
    n = len(sketch.offset)
    at = f"level_{number}_"
    h = float(_given(arrays, f"{at}h", "<f8", 1)[0])
    _need(1e-5 <= h <= QUARTER + SLIVER, f"{at}h", "is no spacing")
    alpha, beta = (_given(arrays, at + name, "<f8", n).astype(np.float64) for name in ("alpha", "beta"))
    _need(np.abs(alpha) <= MOST_ANGLE, f"{at}alpha", "is too large")
    _need(np.abs(beta) <= MOST_ANGLE, f"{at}beta", "is too large")
    if sketch.norm != 2:
        _need(h * round(HALF / h) == HALF, f"{at}h", "does not divide pi/2")
        _need(sketch.norm == 1 or h <= HALF / 8, f"{at}h", "is too wide")
        _need(alpha == h * np.round(alpha / h), f"{at}alpha", "is no multiple of the spacing")
        _need(beta == 0, f"{at}beta", "is not 0")
    ranges = _given(arrays, f"{at}ranges", "<i4", n, 4).astype(np.int64)
    shapes = ranges[:, 1::2]
    _need(((shapes >= 2) & (shapes <= MOST_COUNT)).all(axis=1), f"{at}ranges", "has no cell, or too many")
    reach = h * (np.abs(ranges[:, ::2]) + shapes)
    _need((reach <= MOST_ANGLE).all(axis=1), f"{at}ranges", "leads too far away")
    counts = shapes.prod(axis=1)
    _need(counts.sum() <= MOST_LABELS, f"{at}ranges", "has too many labels in all")
    packed = _given(arrays, f"{at}allowed", "|u1", (int(counts.sum()) + 7) // 8)
    allowed = _cut(np.unpackbits(packed, count=int(counts.sum())).astype(bool), shapes)
    _need([corners(each, np.logical_and).any() for each in allowed], f"{at}allowed of pixel", "has no cell")
    clusters = _clusters(arrays, at, sketch, shapes) if f"{at}quads" in arrays else []
    tables: dict[int, Array] = {}
    for cluster in clusters:
        for e, table in zip(cluster.pairs, cluster.tables):
            tables[e] = tables[e] + table if e in tables else table
    messages = Messages(arrays, at, sketch, np.array([int(each.sum()) for each in allowed]))
    return Level(h, alpha, beta, ranges, allowed, messages, clusters, tables)


def _clusters(arrays: dict[str, Array], at: str, sketch: Sketch, shapes: Array) -> list[Cluster]:
    """The clusters of a level."""
    lower_left = _given(arrays, f"{at}quads", "<i4", None).astype(np.int64)
    _need((lower_left >= 0) & (lower_left < len(shapes)), f"{at}quads", "is no pixel")
    _need(np.diff(lower_left) > 0, f"{at}quads", "is out of order")
    pair_of = {ends: e for e, ends in enumerate(zip(sketch.first.tolist(), sketch.second.tolist()))}
    upper = {i: j for i, j in pair_of if j < i}
    right = {i: j for i, j in pair_of if j > i}
    found = []
    for a in lower_left.tolist():
        b, d = right.get(a, -1), upper.get(a, -1)
        c = right.get(d, -1)
        _need(c >= 0 and upper.get(b, -1) == c, f"{at}quads", f"has no quad at pixel {a}")
        found.append(Cluster([a, b, c, d], [pair_of[ends] for ends in ((a, b), (b, c), (d, c), (a, d))], []))
    ends = np.array([[cluster.pixels[k] for k in (0, 1, 1, 2, 3, 2, 0, 3)] for cluster in found], np.int64)
    sides = shapes[ends.reshape(-1, 2), 0]
    counts = sides.prod(axis=1)
    scale = _given(arrays, f"{at}table_scale", "<f8", len(counts))
    _need((scale >= 0) & (scale <= MOST_SCALE), f"{at}table_scale", "is not in [0, 1]")
    steps = _given(arrays, f"{at}table_steps", "<i4", int(counts.sum()))
    end = 0
    for number, (count, shape) in enumerate(zip(counts.tolist(), sides.tolist())):
        whole = np.cumsum(steps[end : end + count], dtype=np.int64).astype(np.int32)  # modulo 2^32
        found[number // 4].tables.append((whole * scale[number]).reshape(shape))
        end += count
    return found


class Messages(Sequence[Array]):
    """The messages of the pairs to their earlier pixels: whole numbers, given by their steps, times a scale.

    Each is computed whenever it is asked for, because all of them together take much memory.
    """

    def __init__(self, arrays: dict[str, Array], at: str, sketch: Sketch, labels: Array) -> None:
        """Find the steps of each pair. labels (n,): number of the allowed labels of each pixel."""
        self.name, self.norm = f"{at}steps", sketch.norm
        counts = labels[np.minimum(sketch.first, sketch.second)]
        self.scale = _given(arrays, f"{at}scale", "<f8", len(counts))
        _need((self.scale >= 0) & (self.scale <= MOST_SCALE), f"{at}scale", "is not in [0, 1]")
        wide = _given(arrays, f"{at}wide", "|b1", len(counts))
        kinds = {"steps_16": "<i2", "steps_32": "<i4", "steps_64": "<i8"}
        self.steps: list[Array] = [None] * len(counts)
        for chosen, name in zip((~wide, wide), STEP_PARTS[sketch.norm]):
            given = _given(arrays, f"{at}{name}", kinds[name], int(counts[chosen].sum()))
            ends = np.cumsum(counts[chosen])
            for e, end in zip(np.flatnonzero(chosen).tolist(), ends.tolist()):
                self.steps[e] = given[end - counts[e] : end]

    def __len__(self) -> int:
        return len(self.steps)

    def __getitem__(self, e: Any) -> Array:
        whole = np.cumsum(self.steps[e], dtype=np.int64)  # modulo 2^64
        if self.norm == 2:
            whole = whole.astype(np.int32)  # modulo 2^32
        _need(np.abs(whole / MOST_WHOLE).max() <= 1, self.name, "lead too far")
        message: Array = whole * self.scale[e]
        return message


def _cut(flat: Array, shapes: Array) -> list[Array]:
    """Consecutive blocks of those shapes."""
    ends = np.cumsum(shapes.prod(axis=1))
    return (
        [part.reshape(shape) for part, shape in zip(np.split(flat, ends[:-1]), shapes)] if len(ends) else []
    )


def positions(level: Level, sketch: Sketch, i: int) -> tuple[Array, Array]:
    """Alpha (a,) and beta (b,) of the labels of pixel i."""
    o = sketch.offset[i]
    k, a, first, b = level.ranges[i].tolist()
    return (
        level.alpha[i] + level.h * (np.arange(k, k + a) + o),
        level.beta[i] + level.h * (np.arange(first, first + b) + o),
    )


def kept(level: Level, sketch: Sketch, i: int) -> tuple[Array, Array]:
    """The alphas and the betas of pixel i that have an allowed label, both increasing."""
    alpha, beta = positions(level, sketch, i)
    return alpha[level.rows[i]], beta[level.columns[i]]


def unary(level: Level, sketch: Sketch, i: int) -> tuple[Array, float]:
    """The cost D of each allowed label of pixel i, and the size of its terms."""
    alpha, beta = positions(level, sketch, i)
    h, weight = level.h, float(sketch.weight[i])
    k, l = np.nonzero(level.allowed[i])  # noqa: E741 - the letters of the equation
    skew = np.abs(beta) if sketch.norm == 1 else beta * beta - h * h / 4
    cost = (sketch.w_beta * skew)[l]
    size = 2.0 + float(np.abs(alpha).max() + np.abs(beta).max())
    if weight > 0:
        cost = cost + weight * _misfit(level, sketch, i, k, l)
    return cost, (weight + sketch.w_beta) * size * size


def _misfit(level: Level, sketch: Sketch, i: int, k: Array, l: Array) -> Array:  # noqa: E741
    """The least over lines and turns of R^2 and its deduction, or of d, at labels (k, l) of pixel i.

    k and l count from the first label of the pixel's range.
    """
    alpha, beta = (places[at] for places, at in zip(positions(level, sketch, i), (k, l)))
    theta, half = float(sketch.target[i]), level.h * level.h / 2
    own = round((float(level.alpha[i] + level.beta[i]) - theta) / math.pi)
    u = alpha + beta - theta
    v = alpha + HALF - beta - theta
    if sketch.norm != 2:
        u, v = (line - math.pi * np.round(line / math.pi) for line in (u, v))
        return _near_slope(u, v, float(sketch.slope[i]), level.h, sketch.norm)
    turns = np.round(u / math.pi)
    nearest = np.abs(u - math.pi * turns)
    other = np.where(turns == own, math.pi - nearest, nearest)
    best = np.minimum(other, np.abs(v - math.pi * np.round(v / math.pi))) ** 2 - half
    steps = np.abs(level.ranges[i, 0] + level.ranges[i, 2] + int(2 * sketch.offset[i]) + k + l)
    lost = np.where(steps <= 1, 2 * half * steps, half)
    return np.minimum(best, (u - math.pi * own) ** 2 - lost)


def _near_slope(u: Array, v: Array, slope: float, h: float, norm: Any) -> Array:
    """The least of d for both lines, where rounding could put a value on either side the lesser one."""
    near = 2 * h * (1 + 1e-12) + 1e-12
    if norm == 1:
        of_u = np.where(np.abs(u) < near, slope * u, np.abs(u))
        return np.minimum(of_u, np.where(np.abs(v) < near, 0.0, np.abs(v)))
    away = np.abs(u - slope / 2)
    return np.minimum(u * u - np.where(away < near, away * away, h * h / 2), v * v - h * h / 2)


def jumps(alpha_i: Array, alpha_j: Array) -> range:
    """Every jump that is the best of its parity at some of two pixels' labels, with a margin for rounding.

    alpha_i, alpha_j: increasing.
    """
    low = -2 * float(alpha_i[-1] - alpha_j[0]) / math.pi - 1
    high = -2 * float(alpha_i[0] - alpha_j[-1]) / math.pi + 1
    return range(math.ceil(low - 1e-6), math.floor(high + 1e-6) + 1)


class Pair:
    """The costs c of a pair: for each parity of the jump the sum of a matrix in alpha and one in beta.

    c is the lesser of the two. Alphas and betas without an allowed label are left out, because no minimum
    needs them. parts: for each parity, the matrix in alpha by the alphas of the later and of the earlier
    pixel, and that in beta by the betas of the earlier and of the later one; back: with the pixels exchanged.
    """

    def __init__(self, level: Level, sketch: Sketch, e: int, places: list[tuple[Array, Array]]) -> None:
        """places: `kept` of every pixel."""
        i, j = int(sketch.first[e]), int(sketch.second[e])
        self.used, self.spans = zip(*((level.used[x], level.spans[x]) for x in sorted((i, j))))
        (alpha_i, beta_i), (alpha_j, beta_j) = places[i], places[j]
        span, apart = jumps(alpha_i, alpha_j), alpha_i[:, None] - alpha_j[None, :]
        reach = [max(-float(each[0]), float(each[-1])) for each in (alpha_i, alpha_j, beta_i, beta_j)]
        self.size = (1.0 + sum(reach) + HALF * max(abs(p) for p in span)) ** 2
        tables: Any = 0.0
        if e in level.tables:
            tables = level.tables[e][np.ix_(level.rows[i], level.rows[j])]
            self.size += float(np.abs(tables).max())
        squared = sketch.norm == 2
        parts: list[tuple[Array, Array]] = []
        for parity in (0, 1):
            a = [p for p in span if p % 2 == parity]
            b = np.abs((1 - 2 * parity) * beta_i[:, None] - beta_j[None, :])
            if a:
                least = np.abs(apart + HALF * a[0])
                for p in a[1:]:
                    least = np.minimum(least, np.abs(apart + HALF * p), out=least)
                along, b = (2 * (each * each if squared else each) for each in (least, b))
                along = along - squared * level.h * level.h + tables
                parts.append((along, b) if i < j else (along.T, b.T))
        _drop_idle(parts)
        plain = np.ascontiguousarray
        self.parts = [(plain(along.T), plain(b)) for along, b in parts]
        self.back = [(plain(along), plain(b.T)) for along, b in parts]
        self.numbers = 2 * sum(along.size + b.size for along, b in parts)

    def across(self, given: Array, product: Product, *, back: bool = False) -> Array:
        """The least given(x) + c(x, y) over x of the earlier pixel, for each label y of the later one.

        given and the result have one number for each allowed label. back: with the pixels exchanged.
        """
        way = -1 if back else 1
        (used, other), (finite, wanted) = self.used[::way], self.spans[::way]
        spread = np.full(used.shape, np.inf)
        spread[used] = given
        ends = []
        for along, b in self.back if back else self.parts:
            half = product(spread, b, (finite, whole(len(spread), b.shape[1])))
            ends.append(product(along, half, (whole(*along.shape), wanted))[other])
        least: Array = np.minimum.reduce(ends)
        return least


def _drop_idle(parts: list[tuple[Array, Array]]) -> None:
    """Drop a parity that is nowhere less than the other."""
    for worse, better in ((0, 1), (1, 0)):
        if len(parts) == 2:
            least = sum(float(part.min()) for part in parts[worse])
            if least >= sum(float(part.max()) for part in parts[better]):
                parts.pop(worse)


def whole(rows: int, columns: int) -> Array:
    """Spans of rows that are all in use."""
    spans = np.zeros((rows, 2), np.int64)
    spans[:, 1] = columns
    return spans


def min_plus(left: Array, right: Array, spans: Spans) -> Array:
    """The (min,+) product of two matrices, by NumPy.

    spans: (rows, 2) each, those of the rows of `left` outside which they are inf, and those of the product
    outside which any number will do. Some rows are computed at a time, without the terms that are nowhere
    less than the best one of its row.
    """
    finite, wanted = spans
    out = np.full((len(left), right.shape[1]), np.inf)
    for begin in range(0, len(left), ROWS):
        rows = slice(begin, begin + ROWS)
        (k, end), (first, last) = ((each[rows, 0].min(), each[rows, 1].max()) for each in (finite, wanted))
        part, terms = left[rows, k:end], right[k:end, first:last]
        least, most = terms.min(axis=1), terms.max(axis=1)
        lowest = part + least
        best = lowest.argmin(axis=1)
        enough = part[np.arange(len(part)), best] + most[best]
        some = (lowest < enough[:, None]).any(axis=0)
        some[best] = True
        out[rows, first:last] = _min_plus(part[:, some], terms[some])
    return out


def _min_plus(left: Array, right: Array) -> Array:
    """The product with all terms; NumPy is quicker along the longer side, and with few calls."""
    if left.shape[0] > right.shape[1]:
        turned: Array = _min_plus(np.ascontiguousarray(right.T), np.ascontiguousarray(left.T)).T
        return turned
    columns, many = np.ascontiguousarray(left.T)[:, :, None], max(1, BLOCK // (len(left) * right.shape[1]))
    work = np.empty((min(many, len(right)), len(left), right.shape[1]))
    out = np.full(work.shape[1:], np.inf)
    for k in range(0, len(right), many):
        sums = np.add(columns[k : k + many], right[k : k + many, None], out=work[: len(right) - k])
        np.minimum(out, np.minimum.reduce(sums), out=out)
    return out


def compiled() -> Product:
    """`min_plus` compiled by Numba: the same numbers, as minima do not depend on the order of their terms.

    Without Numba, `min_plus` itself.
    """
    try:
        from numba import njit
    except ImportError:
        return min_plus
    product = in_loops(njit(nogil=True, error_model="numpy", fastmath=ANY_ORDER))
    one = np.zeros((1, 1))
    product(one, one, (whole(1, 1), whole(1, 1)))  # compiles
    return product


def in_loops(compile_: Callable[[Any], Any]) -> Product:
    """The product by `fill_in`, compiled."""
    fill = compile_(fill_in)

    def product(left: Array, right: Array, spans: Spans) -> Array:
        out = np.full((len(left), right.shape[1]), np.inf)
        fill(np.ascontiguousarray(left), np.ascontiguousarray(right), spans, out)
        return out

    return product


def fill_in(  # noqa: C901, PLR0912 - calls in the inner loops would take as long as these
    left: Array, right: Array, spans: Spans, out: Array
) -> None:
    """Fill in the product of `min_plus` in loops, for Numba.

    Four rows and four terms are computed at a time, so that few numbers are loaded and stored. The terms next
    to the best one come first; others that are nowhere less are left out.
    """
    (finite, wanted), (rows, count) = spans, left.shape
    if rows < 4 or count < 4:
        for x in range(rows):
            for k in range(finite[x, 0], finite[x, 1]):
                for y in range(wanted[x, 0], wanted[x, 1]):
                    out[x, y] = min(out[x, y], left[x, k] + right[k, y])
        return
    least, sums = np.full(count, np.inf), np.full(count, np.inf)
    for k in range(count):
        for y in range(right.shape[1]):
            least[k] = min(least[k], right[k, y])
    for turn in range(0, rows, 4):
        x = min(turn, rows - 4)
        low, high, first, last = count, 0, right.shape[1], 0
        for z in range(x, x + 4):
            low, high = min(low, finite[z, 0]), max(high, finite[z, 1])
            first, last = min(first, wanted[z, 0]), max(last, wanted[z, 1])
        sums[:], lowest, reached, best = np.inf, np.inf, np.inf, low
        for k in range(low, high):
            sums[k] = min(left[x, k], left[x + 1, k], left[x + 2, k], left[x + 3, k]) + least[k]
            lowest = min(lowest, sums[k])
        while sums[best] > lowest:
            best += 1
        o0, o1 = out[x, first:last], out[x + 1, first:last]
        o2, o3 = out[x + 2, first:last], out[x + 3, first:last]
        for begin in range(low - 4, high, 4):
            k = min(begin if begin >= low else max(best - 1, 0), count - 4)
            if begin >= low and min(sums[k], sums[k + 1], sums[k + 2], sums[k + 3]) >= reached:
                continue
            r0, r1 = right[k, first:last], right[k + 1, first:last]
            r2, r3 = right[k + 2, first:last], right[k + 3, first:last]
            a0, a1, a2, a3 = left[x, k], left[x, k + 1], left[x, k + 2], left[x, k + 3]
            b0, b1, b2, b3 = left[x + 1, k], left[x + 1, k + 1], left[x + 1, k + 2], left[x + 1, k + 3]
            c0, c1, c2, c3 = left[x + 2, k], left[x + 2, k + 1], left[x + 2, k + 2], left[x + 2, k + 3]
            d0, d1, d2, d3 = left[x + 3, k], left[x + 3, k + 1], left[x + 3, k + 2], left[x + 3, k + 3]
            for y in range(last - first):
                v0, v1, v2, v3 = r0[y], r1[y], r2[y], r3[y]
                o0[y] = min(o0[y], v0 + a0, v1 + a1, v2 + a2, v3 + a3)
                o1[y] = min(o1[y], v0 + b0, v1 + b1, v2 + b2, v3 + b3)
                o2[y] = min(o2[y], v0 + c0, v1 + c1, v2 + c2, v3 + c3)
                o3[y] = min(o3[y], v0 + d0, v1 + d1, v2 + d2, v3 + d3)
            if begin < low:
                reached = -np.inf
                for y in range(last - first):
                    reached = max(reached, o0[y], o1[y], o2[y], o3[y])


# The pass --------------------------------------------------------------------------------------------------


@dataclass
class Way:
    """How to compute: a product like `min_plus`, and a function like `map` for the levels."""

    product: Product = min_plus
    levels: Callable[[Callable[[int], Any], range], Iterable[Any]] = map


PLAIN = Way()


class Pass:
    """The pass of 3. over a level."""

    def __init__(self, level: Level, sketch: Sketch, way: Way) -> None:
        self.level, self.sketch, self.way = level, sketch, way
        self.places = [kept(level, sketch, i) for i in range(len(sketch.offset))]
        self.before: dict[int, Array] = {}  # S of the pairs whose later pixel is still to come
        self.ends: dict[int, tuple[Array, Array]] = {}  # a and b of all pairs after the pass
        self.sizes: dict[int, float] = {}  # the sum of the greatest of both
        self.pairs: dict[int, Pair] = {}  # those that are kept for the combs
        self.room = KEPT
        self.errors: list[float] = []

    def run(self, stop: Over, most: float = math.inf) -> Passed:
        """Do the pass. Raises StoppedError when it has to end before the last pixel.

        most: greatest energy of interest. Where the bound exceeds it, the combs are left out: the last
        visit alone excludes all cells of its pixel.
        """
        numbers: list[Array] = []
        least: list[float] = []
        waiting: list[float] = []
        for i in range(len(self.sketch.offset)):
            if stop():
                raise StoppedError
            over, mu, before = self._visit(i)
            numbers.append(over)
            least.append(mu)
            waiting.append(before)
        quads = [self._quad(cluster) for cluster in self.level.clusters]
        error = 2 * math.fsum(self.errors)
        rights = [
            over + math.fsum([*quads, *least[: i + 1], *waiting[i + 1 :]]) for i, over in enumerate(numbers)
        ]
        bound = math.fsum([*quads, *least])
        tests = [Test(rights, error)]
        for excesses, wrong in self._combs(numbers, stop) if bound - error <= most + error else ():
            tests.append(Test([bound + excess for excess in excesses], error + wrong))
        return Passed(bound - error, tests)

    def _combs(self, over: list[Array], stop: Over) -> Iterable[tuple[list[Array], float]]:
        """For both kinds of combs, the excess of each label of each pixel, and the greatest error of all.

        over: t of each pixel.
        """
        sketch = self.sketch
        single = [
            t * (1 - len(later) / max(1, len(earlier), len(later)))
            for t, earlier, later in zip(over, sketch.earlier, sketch.later)
        ]
        columns, rows = sketch.runs
        for teeth, spines in ((columns, rows), (rows, columns)):
            self.errors = []
            hanging = self._along(teeth, single, stop)
            yield self._along(spines, hanging, stop), 2 * math.fsum(self.errors)

    def _along(self, runs: list[Run], given: list[Array], stop: Over) -> list[Array]:
        """The excess of each label, plus the least of the rest of its run from both sides."""
        found = list(given)
        for pixels, pairs in runs:
            if stop():
                raise StoppedError
            costs = [self._pair(e) for e in pairs]
            for way in (1, -1):
                carried = given[pixels[::way][0]]
                for e, pair, j in zip(pairs[::way], costs[::way], pixels[::way][1:]):
                    message = self._carried(e, pair, carried, back=way < 0)
                    found[j], carried = found[j] + message, given[j] + message
        return found

    def _carried(self, e: int, pair: Pair, carried: Array, *, back: bool) -> Array:
        """The least of the excess carried to one end of pair e and the pair's, at labels of the other end."""
        mine, other = self.ends[e][:: -1 if back else 1]
        found = pair.across(carried - mine, self.way.product, back=back) - other
        self._err(pair.size + self.sizes[e] + greatest(carried) + greatest(found))
        return found

    def _pair(self, e: int) -> Pair:
        """The costs of pair e, which are kept as long as there is room."""
        if e in self.pairs:
            return self.pairs[e]
        pair = Pair(self.level, self.sketch, e, self.places)
        if pair.numbers <= self.room:
            self.room -= pair.numbers
            self.pairs[e] = pair
        return pair

    def _visit(self, i: int) -> tuple[Array, float, float]:
        """t_i, mu_i and mu*_i; what the pairs to later pixels send is stored."""
        earlier, later = self.sketch.earlier[i], self.sketch.later[i]
        cost, size = unary(self.level, self.sketch, i)
        held = [self.level.messages[e] for e in later]
        _, waiting = self._theta(cost, size, held + [self.before.pop(e) for e in earlier])
        over, least = self._theta(cost, size, held + [self.ends[e][1] for e in earlier])
        for e, message in zip(later, held):
            self._send(e, message, over / max(1, len(earlier), len(later)))
        return over, least, waiting

    def _quad(self, cluster: Cluster) -> float:
        """The least cost of a quad over the alphas that have an allowed label."""
        a, b, c, d = (self.level.rows[i] for i in cluster.pixels)
        ab, bc, dc, ad = (-table for table in cluster.tables)
        self._err(sum(float(np.abs(table).max()) for table in cluster.tables))
        diagonal = self._product(ab[np.ix_(a, b)], bc[np.ix_(b, c)])
        return float((self._product(ad.T[np.ix_(d, a)], diagonal) + dc[np.ix_(d, c)]).min())

    def _product(self, left: Array, right: Array) -> Array:
        """The product of two matrices without infinite numbers."""
        return self.way.product(left, right, (whole(*left.shape), whole(len(left), right.shape[1])))

    def _theta(self, cost: Array, size: float, shares: list[Array]) -> tuple[Array, float]:
        """Excess of theta over its minimum at each label of a pixel, and the minimum.

        cost, size: as of `unary`. shares: messages and shares of its pairs.
        """
        total: Array = np.sum([cost, *shares], axis=0)
        self._err(size + sum(greatest(share) for share in shares))
        least = float(total.min())
        return total - least, least

    def _send(self, e: int, held: Array, handed: Array) -> None:
        """Send the message of pair e to its later pixel, without and with what its earlier pixel hands on."""
        pair, given = self._pair(e), handed - held
        self.before[e], share = (pair.across(each, self.way.product) for each in (-held, given))
        self.ends[e], self.sizes[e] = (-given, share), greatest(given) + greatest(share)
        self._err(pair.size + self.sizes[e] + greatest(held))

    def _err(self, size: float) -> None:
        self.errors.append(ROUNDING * PRECISION * size)


def greatest(numbers: Array) -> float:
    """The greatest absolute value."""
    return max(float(numbers.max()), -float(numbers.min()))


def surviving(level: Level, passed: Passed, most: float) -> list[Array]:
    """The cells (a - 1, b - 1) of each pixel in which a field of energy up to `most` may have its cross."""
    kept = []
    for i, allowed in enumerate(level.allowed):
        cells = corners(allowed, np.logical_and)
        for test in passed.tests:
            alive = np.zeros_like(allowed)
            alive[allowed] = test.least[i] <= most + test.error
            cells &= corners(alive, np.logical_or)
        kept.append(cells)
    return kept


def corners(labels: Array, both: Any) -> Array:
    """Combine the values at the four vertices of each cell with `both`."""
    return both(both(labels[:-1, :-1], labels[1:, :-1]), both(labels[:-1, 1:], labels[1:, 1:]))


# Coverage --------------------------------------------------------------------------------------------------


def need_whole_strip(level: Level, sketch: Sketch) -> None:
    """Raise RefusedError unless the domain of each pixel holds every cross."""
    for i, allowed in enumerate(level.allowed):
        alpha, beta = positions(level, sketch, i)
        _need(allowed.all(), f"level_0_allowed of pixel {i}", "leaves out labels")
        _need(alpha[-1] - alpha[0] >= HALF - SLIVER, f"level_0_ranges[{i}]", "is less than pi/2 of alpha")
        full = beta[0] <= -QUARTER + SLIVER and beta[-1] >= QUARTER - SLIVER
        _need(full, f"level_0_ranges[{i}]", "is less than all of beta")


def need_covered(coarse: Level, cells: list[Array], fine: Level, sketch: Sketch, number: int) -> None:
    """Raise RefusedError unless the cells left of a level lie in the domain of the next one.

    Parts of cells beyond |beta| = pi/4 need no cover. number: of the next level.
    """
    for i, kept in enumerate(cells):
        at, other = positions(coarse, sketch, i), positions(fine, sketch, i)
        a, b = np.nonzero(kept)
        low, high = np.maximum(at[1][b], -QUARTER), np.minimum(at[1][b + 1], QUARTER)
        there = high > low + 2 * SLIVER  # cells that stick out of the strip need no cover
        a, low, high = a[there], low[there], high[there]
        rows = _spanned(at[0][a], at[0][a + 1], other[0][0], fine.h)
        columns = _spanned(low, high, other[1][0], fine.h)
        held = _held(corners(fine.allowed[i], np.logical_and), rows, columns)
        _need(held, f"level {number}, pixel {i}, cell", "of the level before is not covered")


def _spanned(low: Array, high: Array, origin: float, h: float) -> tuple[Array, Array]:
    """The first cell that intervals meet by more than SLIVER, and the cell after the last."""
    first = np.floor((low + SLIVER - origin) / h).astype(np.int64)
    return first, np.ceil((high - SLIVER - origin) / h).astype(np.int64)


def _held(domain: Array, rows: tuple[Array, Array], columns: tuple[Array, Array]) -> Array:
    """True for the rectangles of cells that lie completely in the domain."""
    total = np.zeros((domain.shape[0] + 1, domain.shape[1] + 1), np.int64)
    total[1:, 1:] = domain.cumsum(axis=0).cumsum(axis=1)
    (a, c), (b, d) = rows, columns
    inside = (a >= 0) & (b >= 0) & (c <= domain.shape[0]) & (d <= domain.shape[1])
    a, b, c, d = (np.where(inside, each, 0) for each in (a, b, c, d))
    count = total[c, d] - total[a, d] - total[c, b] + total[a, b]
    held: Array = inside & (count == (c - a) * (d - b))
    return held


def boxes_of(level: Level, cells: list[Array], sketch: Sketch, margin: float) -> tuple[Array, Array]:
    """Boxes round the cells of each pixel within |beta| <= pi/4, wider by a margin; twice (n, 4).

    Columns: alpha from, to, beta from, to. The first ones have the labels of the level. In the second ones
    the cells above a gap in alpha have their other label, (alpha - pi/2, -beta), if the box is narrower then:
    so crosses at both ends of the strip, where it is glued, are close.
    """
    found = np.zeros((2, len(cells), 4))
    for i, kept in enumerate(cells):
        (alpha, beta), (a, b) = positions(level, sketch, i), np.nonzero(kept)
        found[:, i] = alpha[a.min()], alpha[a.max() + 1], beta[b.min()], beta[b.max() + 1]
        rows = np.unique(a)
        if len(rows) == rows[-1] - rows[0] + 1:
            continue
        gap = int(np.diff(rows).argmax())
        last, next_ = alpha[rows[gap] + 1], alpha[rows[gap + 1]]
        sides = min(found[0, i, 0], next_ - HALF), max(last, found[0, i, 1] - HALF)
        if sides[1] - sides[0] < found[0, i, 1] - found[0, i, 0]:
            above = a > rows[gap]
            (low, high), (least, most) = (
                (beta[b[of].min()], beta[b[of].max() + 1]) for of in (~above, above)
            )
            found[1, i] = *sides, min(low, -most), max(high, -least)
    found += np.array([-margin, margin, -margin, margin])
    found[:, :, 2:] = np.clip(found[:, :, 2:], -QUARTER, QUARTER)
    return found[0], found[1]


# Optimality ------------------------------------------------------------------------------------------------


def forced(sketch: Sketch, p: Array, boxes: Array) -> Array:
    """True for the pairs at which p is a best jump everywhere in the boxes; shape (m,)."""
    i, j = boxes[sketch.first], boxes[sketch.second]
    a = np.maximum(np.abs(i[:, 0] - j[:, 1] + HALF * p), np.abs(i[:, 1] - j[:, 0] + HALF * p)) + 1e-12
    least = np.min([sign(p) * i[:, x] * j[:, y] for x in (2, 3) for y in (2, 3)], axis=0)
    if sketch.norm == 2:
        found: Array = (a <= HALF) & (math.pi * a - math.pi**2 / 4 <= 4 * least - 1e-12)
        return found
    (above, below), (same, other) = sides(i[:, 2:]), sides(sign(p)[:, None] * j[:, 2:])
    unlike = np.maximum(np.minimum(above, other), np.minimum(below, same))
    alike = [np.where(box[:, 2] * box[:, 3] > 0, np.abs(box[:, 2:]).min(axis=1), 0.0) for box in (i, j)]
    g = np.where(unlike > 0, unlike, -np.minimum(*alike))
    best: Array = (a <= HALF) & (a + g <= QUARTER)
    return best


def sides(intervals: Array) -> tuple[Array, Array]:
    """How far intervals, with their ends in any order, reach above and below 0; two arrays (m,)."""
    return np.maximum(intervals.max(axis=1), 0.0), np.maximum(-intervals.min(axis=1), 0.0)


def beyond_windows(turned: Array, boxes: Array) -> Array:
    """Distances by which the boxes exceed the windows of the strokes, above and below; shape (2, n)."""
    found: Array = np.stack([boxes[:, 1] - turned, turned - boxes[:, 0]]) - QUARTER
    return found


def convex_error(
    weight: Array, w_beta: float, angles: tuple[Array, Array, Array], terms: float, far: Array
) -> float:
    """The greatest rounding error of a bound of `Quadratic`.

    angles: x (2n,), directions of lines, and jumps. terms: the sum of the value and of the sizes of its
    residuals with their weights; a residual is wrong by three units of `size` at most, its square by 16 times
    the residual. far (2n,): the distances from x to both sides of the box; at each, the slope may be wrong.
    """
    x, goal, p = angles
    size = 1 + float(2 * np.abs(x).max() + np.abs(goal).max(initial=0) + HALF * np.abs(p).max(initial=0))
    slopes = ROUNDING * float(np.sum((1 + w_beta + np.tile(weight, 2)) * far))
    return PRECISION * size * (16 * terms + slopes)


@dataclass
class Piece:
    """A part of the boxes (n, 4), and the lines that carry the strokes there.

    lines (n,): 0 where u carries the stroke; 1 above the window and -1 below it, where v does. bound: bound
    of the piece that it was cut from.
    """

    boxes: Array
    lines: Array
    bound: float

    def cut(self, at: int, turned: Array, bound: float) -> list[Piece]:
        """The parts below, in and above the window of the stroke of pixel `at`; some may be empty."""
        ends = (-math.inf, turned[at] - QUARTER, turned[at] + QUARTER, math.inf)
        parts = []
        for line in (-1, 0, 1):
            boxes, lines = self.boxes.copy(), self.lines.copy()
            boxes[at, 0], boxes[at, 1] = max(boxes[at, 0], ends[line + 1]), min(boxes[at, 1], ends[line + 2])
            lines[at] = line
            parts.append(Piece(boxes, lines, bound))
        return parts

    @property
    def is_empty(self) -> bool:
        """Whether it holds no crosses."""
        return bool((self.boxes[:, 0] > self.boxes[:, 1]).any())


class Quadratic:
    """The convex quadratic G of 4. on a piece, at fixed jumps."""

    def __init__(self, sketch: Sketch, p: Array, turned: Array, piece: Piece) -> None:
        self.sketch, self.p, self.piece = sketch, p, piece
        self.goal = turned + HALF * piece.lines
        self.sign = np.where(piece.lines == 0, 1.0, -1.0)
        beyond = np.maximum(beyond_windows(turned, piece.boxes), 0.0) * (piece.lines == 0)
        self.above, self.below = 4 * sketch.weight * beyond
        self.low, self.high = piece.boxes[:, ::2].T.ravel(), piece.boxes[:, 1::2].T.ravel()

    def given(self, beta: Array) -> Array:
        """Deduction at each pixel for the edges that the piece crosses."""
        found: Array = self.above * (QUARTER + beta) + self.below * (QUARTER - beta)
        return found

    def _residuals(self, x: Array) -> tuple[Array, Array, Array]:
        """A, B (m,) and R (n,) at the angles x (2n,)."""
        alpha, beta = np.split(x, 2)
        i, j = self.sketch.first, self.sketch.second
        a = alpha[i] - alpha[j] + HALF * self.p
        return a, sign(self.p) * beta[i] - beta[j], alpha + self.sign * beta - self.goal

    def value(self, x: Array) -> float:
        """The value at the angles x."""
        sketch, (a, b, r), beta = self.sketch, self._residuals(x), x[len(x) // 2 :]
        parts = (2 * a * a, 2 * b * b, sketch.weight * r * r, sketch.w_beta * beta * beta, -self.given(beta))
        return math.fsum(np.concatenate(parts).tolist())

    def slope(self, x: Array) -> Array:
        """The gradient at the angles x."""
        sketch, (a, b, r), beta = self.sketch, self._residuals(x), x[len(x) // 2 :]
        i, j, n, s = sketch.first, sketch.second, len(beta), sign(self.p)
        slope = 4 * (np.bincount(i, a, n) - np.bincount(j, a, n)) + 2 * sketch.weight * r
        skew = 4 * (np.bincount(i, s * b, n) - np.bincount(j, b, n)) + 2 * self.sign * sketch.weight * r
        skew += 2 * sketch.w_beta * beta + self.below - self.above
        return np.concatenate([slope, skew])

    def bound(self, x: Array) -> float:
        """A lower bound on the piece: the value at x plus the least change that its gradient allows."""
        value, slope, sketch = self.value(x), self.slope(x), self.sketch
        falls = np.maximum(slope * (x - self.low), slope * (x - self.high))
        a, b, r = (np.abs(each) for each in self._residuals(x))
        terms = math.fsum([value, *(a + b), *(sketch.weight * r), *(self.above + self.below)])
        terms += sketch.w_beta * float(np.abs(x[len(x) // 2 :]).sum())
        far = np.abs(x - self.low) + np.abs(x - self.high)
        lost = convex_error(sketch.weight, sketch.w_beta, (x, self.goal, self.p), terms, far)
        return value - math.fsum(falls) - lost

    def least(self, x: Array) -> Array:
        """A point near the minimum of the piece, by Newton steps on the angles that no bound holds.

        The bound is valid for any point.
        """
        x = np.clip(x, self.low, self.high)
        for _ in range(50):
            value, slope = self.value(x), self.slope(x)
            free = ~(((x <= self.low) & (slope > 0)) | ((x >= self.high) & (slope < 0)))
            step = self._newton(np.where(free, slope, 0.0), free)
            ends = [np.clip(x + 0.5**k * step, self.low, self.high) for k in range(30)]
            better = next((end for end in ends if self.value(end) < value), None)
            if better is None:
                break
            x = better
        return x

    def _newton(self, slope: Array, free: Array) -> Array:
        """The step on the free angles to zero slope, by conjugate gradients."""
        still = self.slope(np.zeros(len(slope)))
        step, rest = np.zeros(len(slope)), -slope
        way, size = rest, float(np.sum(rest * rest))
        enough = 1e-22 * size
        for _ in range(len(slope)):
            if size <= enough:
                break
            change = np.where(free, self.slope(way) - still, 0.0) + 1e-9 * way
            length = size / float(np.sum(way * change))
            step, rest = step + length * way, rest - length * change
            size, before = float(np.sum(rest * rest)), size
            way = rest + size / before * way
        return step

    def cut(self, x: Array, turned: Array, bound: float) -> list[Piece]:
        """The piece cut at the edges of the window of the pixel with the largest deduction, if any."""
        over = self.above + self.below > 0
        if not over.any():
            return []
        at = int(np.argmax(np.where(over, 1e-12 + self.given(x[len(x) // 2 :]), 0.0)))
        return [part for part in self.piece.cut(at, turned, bound) if not part.is_empty]


def relabelled(sketch: Sketch, field: Field, centres: Array) -> tuple[Field, Array]:
    """The field with the labels nearest to the centres, and the direction of each stroke.

    Each stroke takes the turn that line u has there.
    """
    alpha, beta, p = field
    steps = np.round((centres[:, 0] - alpha) / HALF).astype(np.int64)
    alpha, beta = alpha + HALF * steps, sign(steps) * beta
    turned = sketch.target + math.pi * np.round((alpha - sketch.target) / math.pi)
    return (alpha, beta, p - steps[sketch.first] + steps[sketch.second]), turned


def pieces_bound(sketch: Sketch, p: Array, turned: Array, boxes: Array, steps: tuple[Array, Array]) -> float:
    """A lower bound of F in the boxes. steps: the cuts, and multipliers of each piece that stays whole."""
    waiting, found = [Piece(boxes, np.zeros(len(boxes)), -math.inf)], list[float]()
    cuts, multipliers = steps
    for at in cuts.tolist():
        _need(waiting, CUTS, "has a piece too many")
        piece = waiting.pop()
        if at < 0:
            least = linear_bound(sketch, p, turned, piece, multipliers[len(found)])
            found.append(math.inf if piece.is_empty else least)
        else:
            waiting += reversed(piece.cut(at, turned, -math.inf))
    _need(not waiting, CUTS, "leaves a piece without multipliers")
    return min(found)


def linear_bound(sketch: Sketch, p: Array, turned: Array, piece: Piece, multipliers: Array) -> float:
    """A lower bound of F in a piece by the multipliers of A and B (m,), R and beta (n,); see 5."""
    i, j, n, m, boxes = sketch.first, sketch.second, len(turned), len(p), piece.boxes
    by_u, goal = piece.lines == 0, turned + HALF * piece.lines
    of_a, of_b = np.clip(np.split(multipliers[: 2 * m], 2), -1.0, 1.0)
    of_r, of_beta = np.split(multipliers[2 * m :], 2)
    above, below = np.maximum(beyond_windows(turned, boxes), 0.0) * sketch.weight * by_u
    if sketch.norm == 1:
        of_r, of_beta = np.clip([of_r, of_beta], -1.0, 1.0)
        lost, tilt = 2 * (above + below), np.zeros(n)
    else:
        lost = (sketch.weight * of_r * of_r + sketch.w_beta * of_beta * of_beta) / 4
        lost += math.pi * (above + below)
        tilt = 4 * (above - below)
    along, upright = sketch.weight * of_r, sketch.w_beta * of_beta - tilt
    slope = 2 * (np.bincount(i, of_a, n) - np.bincount(j, of_a, n)) + along
    pulled = 2 * (np.bincount(i, sign(p) * of_b, n) - np.bincount(j, of_b, n))
    skew = pulled + np.where(by_u, along, -along) + upright  # without pairs, bincount returns whole numbers
    low, high = np.concatenate(boxes[:, ::2].T), np.concatenate(boxes[:, 1::2].T)
    slopes = np.concatenate([slope, skew])
    terms = [math.pi * of_a * p, -along * goal, -lost, np.minimum(slopes * low, slopes * high)]
    # What may fail is below 16 roundings of every product that enters.
    far = np.maximum(np.abs(low), np.abs(high))[:n]
    size = np.sum(4 * np.abs(of_a) * (far[i] + far[j] + HALF * np.abs(p))) + 4.0 * m
    size += np.sum(np.abs(along) * (far + 1 + np.abs(goal)) + np.abs(upright) + np.abs(lost))
    return math.fsum(np.concatenate(terms)) - 16 * PRECISION * float(size)


def best_jumps(sketch: Sketch, alpha: Array, beta: Array) -> Array:
    """The best jump of each pair at some angles, in the norm 2; shape (m,)."""
    i, j = sketch.first, sketch.second
    near = np.round((alpha[j] - alpha[i]) / HALF).astype(np.int64) + np.array([[0], [-1], [1]])
    a, b = alpha[i] - alpha[j] + HALF * near, sign(near) * beta[i] - beta[j]
    found: Array = near[np.argmin(a * a + b * b, axis=0), np.arange(near.shape[1])]
    return found


def lower_bound(
    sketch: Sketch,
    labels: tuple[Field, Array],
    boxes: Array,
    enough: float,
    *,
    steps: tuple[Array, Array],
    over: Over,
) -> float:
    """A lower bound of F in the boxes, -inf where a jump is not forced.

    labels: jumps to be forced, angles near the best ones, and directions of the strokes, as of `relabelled`.
    Boxes that cross edges of windows are cut until the bound is `enough`, there are MOST_PIECES, or time is
    over.
    """
    (alpha, beta, p), turned = labels
    reach = QUARTER if sketch.norm == 1 else HALF
    far = (beyond_windows(turned, boxes) > reach - 1e-9) & (sketch.weight > 0)
    if not forced(sketch, p, boxes).all() or far.any():
        return -math.inf
    if sketch.norm != 2:
        return pieces_bound(sketch, p, turned, boxes, steps)
    above, below = beyond_windows(turned, boxes[:, [1, 0, 2, 3]]) > 1e-12  # the whole box is beyond
    waiting = [Piece(boxes, above.astype(np.int64) - below, -math.inf)]
    found = []
    for _ in range(MOST_PIECES):
        if over():
            break
        piece = waiting.pop()
        quadratic, x = Quadratic(sketch, p, turned, piece), np.concatenate([alpha, beta])
        bound = quadratic.bound(x)
        if bound < enough:
            x = quadratic.least(x)
            bound = max(bound, quadratic.bound(x))
        parts = quadratic.cut(x, turned, bound) if bound < enough else []
        waiting += parts
        if not parts:
            found.append(bound)
        if not waiting:
            break
    return min([*found, *(piece.bound for piece in waiting)])


# The whole -------------------------------------------------------------------------------------------------


def check(arrays: dict[str, Array], over: Over = lambda: False, way: Way = PLAIN) -> Verdict:
    """Check the arrays of a certificate and return what they prove.

    over: called repeatedly, returns whether to end; then only the levels passed by then count. way: a
    quicker one to compute the same. Raises RefusedError when a level does not follow from the one before, or
    when less is proven than claimed. Raises UnreadableError for arrays that are not a certificate, and
    StoppedError when time is over before the first level was passed.
    """
    try:
        return _check(arrays, over, way)
    except (ValueError, TypeError, KeyError, IndexError, OverflowError, RecursionError) as error:
        raise UnreadableError(f"is damaged ({type(error).__name__}: {str(error)[:80]})") from error


def _check(arrays: dict[str, Array], over: Over, way: Way) -> Verdict:
    head = head_of(arrays)
    whole, sketch = sketch_of(arrays, whole=True), sketch_of(arrays)
    field = field_of(arrays, whole)
    energy, error = energy_of(whole, *field)
    count = _levels(head)
    slack = slack_of(sketch.weight, sketch.w_beta, count)
    most, enough = energy + error + slack, energy - error - OPTIMAL / 2 * max(1.0, energy)
    steps = _last_steps(arrays, sketch)
    regions = _descend(arrays, sketch, most, over, way)
    centres = np.stack([regions[0].level.alpha, regions[0].level.beta], axis=1)
    held = field[0][sketch.pixels], field[1][sketch.pixels], field[2][sketch.pairs]
    own = relabelled(sketch, held, centres)

    def last(boxes: tuple[Array, Array]) -> float:
        """A lower bound of F in one of two equivalent sets of boxes."""
        found = lower_bound(sketch, own, boxes[0], enough, steps=steps, over=over)
        if found > -math.inf or sketch.norm != 2:
            return found
        alpha, beta = boxes[1].reshape(-1, 2, 2).mean(axis=2).T
        turned = sketch.target + math.pi * np.round((alpha - sketch.target) / math.pi)
        labels = (alpha, beta, best_jumps(sketch, alpha, beta)), turned
        return lower_bound(sketch, labels, boxes[1], enough, steps=steps, over=over)

    proven, boxes = _settled(regions, 0, last, (slack, most))
    _need(boxes is not None, "the last level", "leaves nothing, not even the field")
    proven = max(0.0, min(proven, energy - error))
    bound = max(0.0, proven - SPARE * (1 + proven))
    boxes, centres, jumps = _of_whole(
        whole, sketch, field, (boxes, centres, forced(sketch, own[0][2], boxes))
    )
    bounds = [region.bound for region in regions]
    verdict = Verdict(status_of(energy, bound), sketch.norm, energy, bound, boxes, centres, jumps, bounds)
    _compare(head, verdict, proven, error)
    return verdict


def _of_whole(
    whole: Sketch, sketch: Sketch, field: Field, proven: tuple[Array, Array, Array]
) -> tuple[Array, Array, Array]:
    """Boxes, centres and forced pairs of the whole mask: in parts without strokes, anything is possible."""
    n = len(whole.pixels)
    quarter = np.full(n, QUARTER)
    boxes = np.stack([whole.lower, whole.lower + HALF, -quarter, quarter], axis=1)
    centres, pairs = np.stack(field[:2], axis=1), np.zeros(len(whole.pairs), bool)
    boxes[sketch.pixels], centres[sketch.pixels], pairs[sketch.pairs] = proven
    return boxes, centres, pairs


def status_of(energy: float, bound: float) -> str:
    """Status of a field with that energy, if no field has less than the bound: `optimal` or `gap`."""
    return "optimal" if energy - bound <= OPTIMAL * max(1.0, energy) else "gap"


def gap_of(energy: float, bound: float) -> float:
    """The relative gap, (energy - bound) / energy; 0 with the status `optimal`."""
    return 0.0 if status_of(energy, bound) == "optimal" else (energy - bound) / energy


def _settled(
    regions: list[Region],
    number: int,
    last: Callable[[tuple[Array, Array]], float],
    slack_and_most: tuple[float, float],
) -> tuple[float, Array | None]:
    """A lower bound of F in the domain of a level, and boxes round all fields of energy U or less there."""
    region, (slack, most) = regions[number], slack_and_most
    if region.parts:
        found = [_settled(regions, each, last, slack_and_most) for each in region.parts]
        bound = min(bound for bound, _ in found)
        boxes = [boxes for _, boxes in found if boxes is not None]
    else:
        bound = math.inf if region.boxes is None else last(region.boxes)
        boxes = [] if region.boxes is None else [region.boxes[0]]
    bound = max(region.bound - slack, bound)
    if bound > most or not boxes:
        return bound, None
    least, greatest = np.min(boxes, axis=0), np.max(boxes, axis=0)
    return bound, np.stack([least[:, 0], greatest[:, 1], least[:, 2], greatest[:, 3]], axis=1)


def _last_steps(arrays: dict[str, Array], sketch: Sketch) -> tuple[Array, Array]:
    """The cuts of boxes, and the multipliers of A, B, R and beta on each piece; not used in the norm 2.

    A cut is the pixel at whose window a piece is cut into three, or -1 for a piece that stays whole. Each
    piece comes before its parts. Multipliers have the shape (pieces that stay whole, 2m + 2n).
    """
    cuts, each = np.array([-1]), 2 * (len(sketch.first) + len(sketch.offset))
    if sketch.norm == 2:
        return cuts, np.zeros((1, each))
    if CUTS in arrays:
        cuts = _given(arrays, CUTS, "<i4", None)
        _need(1 < len(cuts) <= 2 * MOST_PIECES, CUTS, "has too few or too many pieces")
        _need((cuts >= -1) & (cuts < len(sketch.offset)), CUTS, "is no pixel")
    count = int((cuts < 0).sum())
    found = _given(arrays, "multipliers", "<f8", count * each).reshape(count, each)
    _need((np.abs(found) <= MOST_WEIGHT).all(axis=1), "multipliers", "is too large")
    return cuts, found


def _branches(arrays: dict[str, Array], sketch: Sketch, count: int) -> Array:
    """For each level, the level whose cells it covers, and the part of these.

    Columns: number of that level; pixel of a cut, or -1 for all cells; 0 for the cells below a step of alpha,
    1 for those above, 2 and 3 the same for beta; the step.
    """
    if BRANCHES not in arrays:
        rows = np.zeros((count, 4), dtype=np.int64)
        rows[:, 0], rows[:, 1] = np.arange(count) - 1, -1
        return rows
    _need(sketch.norm == 2, BRANCHES, "is for the norm 2 only")
    rows = _given(arrays, BRANCHES, "<i4", count, 4).astype(np.int64)
    above, pixel, side = rows[:, 0], rows[:, 1], rows[:, 2]
    _need(rows[0].tolist() == [-1, -1, 0, 0], BRANCHES, "does not begin with the whole first level")
    _need((above[1:] >= 0) & (above[1:] <= np.arange(count - 1)), BRANCHES, "is no earlier level")
    _need((pixel >= -1) & (pixel < len(sketch.offset)), BRANCHES, "is no pixel")
    _need((side >= 0) & (side < 4), BRANCHES, "is no side")
    for number in range(count):
        parts = rows[1:][above[1:] == number, 1:]
        single = len(parts) < 2
        cut = len(parts) == 2 and parts[0, 0] >= 0 and (parts[0] ^ parts[1] == [0, 1, 0]).all()
        _need(single or cut, BRANCHES, f"has parts of level {number} that do not belong together")
    return rows


def part_of(level: Level, cells: list[Array], branch: Array) -> list[Array]:
    """The part of a level's cells that a row of `_branches` names."""
    _, pixel, side, step = branch.tolist()
    if pixel < 0:
        return cells
    found = list(cells)
    found[pixel] = cells[pixel].copy()
    along = found[pixel] if side < 2 else found[pixel].T
    place = max(0, step - int(level.ranges[pixel, side // 2 * 2]))
    along[slice(0, place) if side % 2 else slice(place, None)] = False
    return found


def _descend(arrays: dict[str, Array], sketch: Sketch, most: float, over: Over, way: Way) -> list[Region]:
    """All levels, each with its bound and with boxes round the cells that it leaves."""

    def left_by(number: int) -> tuple[Level, float, list[Array]]:
        """A level without its messages, which take much memory, its bound, and the cells that it leaves."""
        level = level_of(arrays, number, sketch)
        passed = Pass(level, sketch, way).run(over, most)
        bare = replace(level, messages=(), clusters=[], tables={})
        return bare, passed.bound, surviving(level, passed, most)

    count = _levels(head_of(arrays))
    branches, margin = _branches(arrays, sketch, count), 2 * (count + 1) * SLIVER
    parents = branches[:, 0].tolist()
    regions: list[Region] = []
    waiting: dict[int, list[Array]] = {}
    try:
        for level, bound, cells in way.levels(left_by, range(count)):
            number = len(regions)
            if not number:
                need_whole_strip(level, sketch)
            else:
                centred = (level.alpha == regions[0].level.alpha) & (level.beta == regions[0].level.beta)
                _need(centred, f"level_{number}_alpha or beta", "is not that of the first level")
                coarse = regions[parents[number]].level
                part = part_of(coarse, waiting[parents[number]], branches[number])
                need_covered(coarse, part, level, sketch, number)
            some = all(kept.any() for kept in cells)
            regions.append(Region(level, bound, boxes_of(level, cells, sketch, margin) if some else None))
            waiting[number] = cells
            for done in [each for each in waiting if each not in parents[number + 1 :]]:
                del waiting[done]
    except StoppedError:
        if not regions:
            raise
    for number, region in enumerate(regions):
        parts = [each for each in range(1, len(regions)) if parents[each] == number]
        region.parts = parts if len(parts) == 2 or branches[parts, 1].tolist() == [-1] else []
    return regions


def _compare(head: dict[str, Any], verdict: Verdict, most: float, error: float) -> None:
    """Raise RefusedError unless the claim is proven. most: the greatest bound that is."""
    energy = _number(head, "energy", 0.0, math.inf)
    bound = _number(head, "bound", -math.inf, math.inf)
    close = abs(energy - verdict.energy) <= error + 1e-12 * max(1.0, verdict.energy)
    _need(close, "energy", f"is claimed as {energy!r}, but the field has {verdict.energy!r}")
    _need(head.get("status") in ("optimal", "gap"), "status", "is neither 'optimal' nor 'gap'")
    proven = f"only {most!r} is proven, for an energy of {verdict.energy!r}"
    _need(bound <= most, "bound", f"is claimed as {bound!r}, but {proven}")
    if head["status"] == "optimal":
        _need(verdict.status == "optimal", "status", f"is claimed as optimal, but {proven}")
        _need(status_of(energy, bound) == "optimal", "status", "is claimed as optimal, but not by the bound")


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the verdict and return the exit code."""
    parser = argparse.ArgumentParser(description="Check a certificate of a cross field.")
    parser.add_argument("file", help="a certificate (.npz)")
    parser.add_argument("--plain", action="store_true", help="one process, and no package but NumPy")
    given = parser.parse_args(arguments)
    try:
        verdict = checked(given.file, plain=given.plain)
    except RefusedError as error:
        print(f"refused: {error}")
        return 1
    except UnreadableError as error:
        print(f"unreadable: {given.file} {error}")
        return 2
    except MemoryError:
        print(f"unchecked: {given.file} takes more memory than there is")
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


def checked(path: str, *, plain: bool = False) -> Verdict:
    """The verdict on the certificate in a file; plain: by NumPy alone, in this process."""
    arrays = read(path)
    if plain or sum(array.size for array in arrays.values()) < LARGE:
        return check(arrays)
    way = Way(compiled())
    try:
        return check(arrays, way=replace(way, levels=side_by_side))
    except BrokenProcessPool:  # perhaps for want of memory
        return check(arrays, way=way)


def side_by_side(work: Callable[[int], Any], numbers: range) -> Iterable[Any]:
    """As `map`, in one process for each processor, if processes can fork here."""
    if "fork" not in multiprocessing.get_all_start_methods():
        return map(work, numbers)
    allowed = getattr(os, "sched_getaffinity", lambda _: range(os.cpu_count() or 1))
    count = min(len(allowed(0)), len(numbers))
    fork = multiprocessing.get_context("fork")
    with ProcessPoolExecutor(count, fork, initializer=_inherit, initargs=(work,)) as pool:
        # Later levels tend to be larger: begun first, they end together with the small ones.
        return [*pool.map(_inherited, numbers[::-1])][::-1]


INHERITED: list[Callable[[int], Any]] = []  # by a process, whose parent could not send a function with arrays


def _inherit(work: Callable[[int], Any]) -> None:
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    INHERITED.append(work)


def _inherited(number: int) -> Any:
    return INHERITED[0](number)


if __name__ == "__main__":
    sys.exit(main())
