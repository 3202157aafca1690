"""A second checker of optimality certificates, after the documentation: `second_checker.py FILE`.

It follows docs/proofs.md and docs/files.md with dense arrays. It imports nothing of crossfield, and shares no
code with models/proof. Section numbers are those of docs/proofs.md. Clarity comes before speed.
"""

import io
import json
import sys
import zipfile
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

PI = np.pi
SLIVER = 2e-14
"""Radians by which a domain may fall short of the cells that it covers, as places of labels are rounded."""
TOLERANCE = 1e-8
"""Energy, relative to max(1, U), by which a field may be better than one that counts as optimal."""
MOST_LABELS = 6000
"""Labels of a pixel: the costs of a pair are one dense table."""


class Refused(Exception):  # noqa: N818 - a verdict
    """The archive is no certificate, or does not prove what it claims; the message names the place."""


def need(holds, message):
    """Raise Refused unless a condition holds."""
    if not holds:
        raise Refused(message)


@dataclass
class Problem:
    """Instance and field: pixels row by row, and per pixel its pairs with the upper, then the right one."""

    pixels: np.ndarray  # [n, 2]: row, column
    pairs: np.ndarray  # [m, 2]: i, j
    theta: np.ndarray  # [n], 0 where there is no stroke
    weight: np.ndarray  # [n]: W_i, 0 where there is no stroke
    w_beta: float
    alpha: np.ndarray  # [n]
    beta: np.ndarray  # [n]
    p: np.ndarray  # [m]
    norm: object  # 1, 2 or "mixed"
    slope: np.ndarray  # [n]: l of the stroke, unless the norm is 2
    cuts: np.ndarray  # [pieces]: pixel of the cut, -1 for a piece that stays whole; unless the norm is 2
    multipliers: np.ndarray  # [pieces that stay whole, 2m + 2n], unless the norm is 2
    elsewhere: float = 0.0  # energy of the field in the parts of the mask without strokes, which are left out

    def energy(self):
        """Energy U of the field."""
        (i, j), p = self.pairs.T, self.p
        a = self.alpha[i] - self.alpha[j] + PI / 2 * p
        b = (-1.0) ** p * self.beta[i] - self.beta[j]
        phi, psi = (np.square if self.norm == 2 else abs), (abs if self.norm == 1 else np.square)
        strokes = self.weight @ psi(self.alpha + self.beta - self.theta)
        here = 2 * (phi(a) + phi(b)).sum() + strokes + self.w_beta * psi(self.beta).sum()
        return float(here + self.elsewhere)


@dataclass
class Level:
    """Lattice of a level: places and allowed labels of every pixel, and the shares of every pair."""

    number: int
    h: float
    centre: np.ndarray  # [n, 2]
    steps: list  # per pixel, the numbers k + o and l + o
    allowed: list  # per pixel, bool[k, l]
    shares: list  # per pair, at the allowed labels of its earlier pixel
    quads: list  # pixels a, b, c, d and the tables of the pairs (a, b), (b, c), (d, c), (a, d)
    absolute: bool  # whether pairs count with absolute values
    bound: float = 0.0
    left: list = field(default_factory=list)  # per pixel, remaining cells as rows (a0, a1, b0, b1, k, l)

    def places(self, i):
        """Alpha of every k and beta of every l of a pixel."""
        return tuple(c + self.h * steps for c, steps in zip(self.centre[i], self.steps[i], strict=True))

    def labels(self, i):
        """Alpha, beta and s of the allowed labels of a pixel."""
        a, b = np.nonzero(self.allowed[i])
        (alpha, beta), (k, low) = self.places(i), self.steps[i]
        return alpha[a], beta[b], k[a] + low[b]


def all_four(labels):
    """The cells of a lattice whose four corners have a property."""
    return labels[:-1, :-1] & labels[1:, :-1] & labels[:-1, 1:] & labels[1:, 1:]


# Reading ----------------------------------------------------------------------------------------------------


def arrays_of(path):
    """All arrays of an archive, by name."""
    try:
        with zipfile.ZipFile(path) as archive:
            names = archive.namelist()
            need(len({name.lower() for name in names}) == len(names), f"{path}: an array occurs twice")
            need(all(name.endswith(".npy") for name in names), f"{path}: has a member that is no array")
            return {name[:-4]: np.load(io.BytesIO(archive.read(name)), allow_pickle=False) for name in names}
    except (OSError, ValueError, EOFError, RuntimeError, SyntaxError, zipfile.BadZipFile) as error:
        raise Refused(f"{path}: {error}") from error


def take(arrays, name, kind, *shape):
    """Remove and return an array of this type and shape; None stands for any length."""
    need(name in arrays, f"{name} is missing")
    a = arrays.pop(name)
    fits = a.ndim == len(shape) and all(n in {None, m} for n, m in zip(shape, a.shape, strict=True))
    same = a.dtype.str == np.dtype(kind).str and fits and a.flags.c_contiguous
    need(same, f"{name}: is {a.dtype.str}{a.shape}, not {kind}{shape}, in row order")
    need(a.dtype.kind != "f" or np.isfinite(a).all(), f"{name}: contains NaN or infinity")
    return a


def head_of(arrays, name):
    """A JSON object in an array of bytes."""

    def once(items):
        need(len(dict(items)) == len(items), f"{name}: a key occurs twice")
        return dict(items)

    try:
        head = json.loads(take(arrays, name, "u1", None).tobytes().decode(), object_pairs_hook=once)
    except ValueError as error:
        raise Refused(f"{name}: {error}") from error
    need(isinstance(head, dict), f"{name}: is no JSON object")
    return head


def number(head, name, low, high):
    """A number of a head within its limits."""
    x = head.get(name)
    need(type(x) in {int, float} and low <= x <= high, f"head: {name} is {x}, not from {low} to {high}")
    return x


def problem_of(arrays, norm):
    """Instance and field."""
    head = head_of(arrays, "instance_head")
    need(head.get("gauge") in {"strokes", "box"}, "instance_head: unknown gauge")
    mask = take(arrays, "instance_mask", "?", None, None)
    take(arrays, "instance_origin", "<f8", 2)
    pixels = np.argwhere(mask)
    n, at = len(pixels), {(r, c): i for i, (r, c) in enumerate(pixels.tolist())}
    need(n > 0, "instance_mask: has no pixel")
    pairs = [(i, at[q]) for (r, c), i in at.items() for q in ((r - 1, c), (r, c + 1)) if q in at]

    given = take(arrays, "instance_theta", "<f8", None)
    w = take(arrays, "instance_w", "<f8", len(given))
    places = take(arrays, "instance_stroke_pixels", "<i4", len(given), 2).tolist()
    where = [at.get((r, c), -1) for r, c in places]
    need(
        -1 not in where and where == sorted(set(where)), "instance_stroke_pixels: not row by row in the mask"
    )
    need(((w > 0) & (w <= 1)).all(), "instance_w: outside (0, 1]")
    need(((given >= 0) & (given < PI)).all(), "instance_theta: outside [0, pi)")
    theta, weight, window = np.zeros((3, n))
    weight[where] = number(head, "w_strokes", 0, 1e6) * w
    if head["gauge"] == "strokes":
        theta[where], window[where] = given, given - PI / 4
    else:
        theta[where] = np.where(given >= 3 * PI / 4 - 1e-9, np.maximum(given - PI, -PI / 4), given)

    alpha, beta = (take(arrays, name, "<f8", n) for name in ("alpha", "beta"))
    p = take(arrays, "p", "<i4", len(pairs)).astype(int)
    outside = (abs(alpha - window - PI / 4) > PI / 4 + SLIVER) | (abs(beta) > PI / 4 + SLIVER)
    need(not outside.any(), f"alpha, beta: outside the window at pixel {pixels[outside.argmax()]}")
    need((abs(p) <= 64).all(), "p: too large")
    pairs, w_beta = np.array(pairs, int).reshape(-1, 2), number(head, "w_beta", 0, 1e6)
    none = np.zeros(n), np.array([-1]), np.zeros((1, 2 * (len(pairs) + n)))
    whole = Problem(pixels, pairs, theta, weight, w_beta, alpha, beta, p, norm, *none)
    held = np.isin(np.arange(n), where)
    while (grown := held | np.isin(np.arange(n), pairs[held[pairs].any(axis=1)])).sum() > held.sum():
        held = grown
    inside, anew = held[pairs].all(axis=1), np.cumsum(held) - 1
    pixels, theta, weight, alpha, beta = (each[held] for each in (pixels, theta, weight, alpha, beta))
    n, pairs, p = len(pixels), anew[pairs[inside]], p[inside]
    slope, cuts, multipliers = np.zeros(n), np.array([-1]), np.zeros((1, 2 * (len(pairs) + n)))
    if norm != 2:
        slope = take(arrays, "slopes", "<f8", n)
        need((abs(slope) <= (1 if norm == 1 else PI / 2)).all(), "slopes: too steep")
        if "cuts" in arrays:
            cuts = take(arrays, "cuts", "<i4", None)
            need(1 < len(cuts) <= 400, "cuts: too few or too many")
            need(((cuts >= -1) & (cuts < n)).all(), "cuts: no pixel")
        shape = (cuts < 0).sum(), multipliers.shape[1]
        multipliers = take(arrays, "multipliers", "<f8", shape[0] * shape[1]).reshape(shape)
    part = Problem(pixels, pairs, theta, weight, w_beta, alpha, beta, p, norm, slope, cuts, multipliers)
    return replace(part, elsewhere=whole.energy() - part.energy())


def quads_of(arrays, at, count, problem):
    """Quads of a level with their tables."""
    corners, ends = take(arrays, f"{at}quads", "<i4", None).tolist(), problem.pixels.tolist()
    places = {tuple(place): i for i, place in enumerate(ends)}
    need(corners == sorted(set(corners)), f"{at}quads: not ascending")
    need(all(0 <= a < len(ends) for a in corners), f"{at}quads: no pixel")
    walks = [[(r, c), (r, c + 1), (r - 1, c + 1), (r - 1, c)] for r, c in (ends[a] for a in corners)]
    need(all(q in places for walk in walks for q in walk), f"{at}quads: outside the mask")
    pixels = [[places[q] for q in walk] for walk in walks]
    shapes = [(count[q[x], 0], count[q[y], 0]) for q in pixels for x, y in ((0, 1), (1, 2), (3, 2), (0, 3))]
    scale = take(arrays, f"{at}table_scale", "<f8", len(shapes))
    need(((scale >= 0) & (scale <= 1)).all(), f"{at}table_scale: outside [0, 1]")
    steps = take(arrays, f"{at}table_steps", "<i4", sum(x * y for x, y in shapes))
    tables, used = [], 0
    for (x, y), unit in zip(shapes, scale, strict=True):
        sums = steps[used : used + x * y].cumsum(dtype=np.int32)  # modulo 2^32
        tables.append(unit * sums.reshape(x, y))
        used += x * y
    return [(q, tables[4 * k : 4 * k + 4]) for k, q in enumerate(pixels)]


def level_of(arrays, number, problem):
    """One level of the certificate."""
    n, m, at = len(problem.pixels), len(problem.pairs), f"level_{number}_"
    h = float(take(arrays, f"{at}h", "<f8", 1)[0])
    centre = np.stack([take(arrays, at + name, "<f8", n) for name in ("alpha", "beta")], axis=1)
    ranges = take(arrays, f"{at}ranges", "<i4", n, 4).astype(int)
    first, count = ranges[:, ::2], ranges[:, 1::2]
    need(1e-5 <= h <= PI / 4 + SLIVER and (count >= 2).all(), f"{at}h, {at}ranges: no lattice")
    need(max(abs(centre).max(), (h * (abs(first) + count)).max()) <= 16, f"{at}ranges: too far away")
    sizes = count.prod(axis=1)
    bits = np.unpackbits(take(arrays, f"{at}allowed", "u1", -(-int(sizes.sum()) // 8))).astype(bool)
    ends = sizes.cumsum()
    allowed = [bits[ends[i] - sizes[i] : ends[i]].reshape(count[i]) for i in range(n)]
    for labels, pixel in zip(allowed, problem.pixels, strict=True):
        need(all_four(labels).any(), f"{at}allowed: no cell at pixel {pixel}")
        need(labels.sum() <= MOST_LABELS, f"{at}allowed: pixel {pixel} has too many labels for dense tables")

    scale, wide = take(arrays, f"{at}scale", "<f8", m), take(arrays, f"{at}wide", "?", m)
    need(((scale >= 0) & (scale <= 1)).all(), f"{at}scale: outside [0, 1]")
    earlier, labels = problem.pairs.min(axis=1), np.array([each.sum() for each in allowed])
    shares = [np.zeros(0)] * m
    bits = (16, 32) if problem.norm == 2 else (32, 64)
    for narrow, width in zip((True, False), bits, strict=True):
        chosen = np.flatnonzero(wide != narrow)
        kind, used = f"<i{width // 8}", 0
        steps = take(arrays, f"{at}steps_{width}", kind, labels[earlier[chosen]].sum())
        for e in chosen:
            own = steps[used : used + labels[earlier[e]]]
            shares[e] = scale[e] * own.cumsum(dtype=f"<i{bits[1] // 8}")  # modulo 2^32 or 2^64
            used += len(own)
    offset = 0.5 * (problem.pixels.sum(axis=1) % 2)
    if problem.norm != 2:
        offset = 0 * offset
        common = (centre == np.rint(centre / h) * h).all() and not centre[:, 1].any()
        need(common and h * np.rint(PI / 2 / h) == PI / 2, f"{at}alpha, {at}beta: no common lattice")
        need(problem.norm == 1 or h <= PI / 16, f"{at}h: too wide")
    k, low = (first + offset[:, None]).T
    steps = [(k[i] + np.arange(count[i, 0]), low[i] + np.arange(count[i, 1])) for i in range(n)]
    quads = quads_of(arrays, at, count, problem)
    return Level(number, h, centre, steps, allowed, shares, quads, problem.norm != 2)


# Sections 3 to 5: bound and remaining cells of a level ------------------------------------------------------


def pixel_costs(problem, level, i):
    """D_i of the allowed labels."""
    alpha, beta, s = level.labels(i)
    theta, weight, h2 = problem.theta[i], problem.weight[i], level.h**2
    cost = problem.w_beta * (abs(beta) if problem.norm == 1 else beta**2 - h2 / 4)
    if weight == 0:
        return cost
    if problem.norm != 2:
        return cost + weight * sloped_costs(problem, level, i)
    known = np.rint((level.centre[i].sum() - theta) / PI)  # the turn of u at the centre of the lattice
    sharp = np.choose(np.minimum(abs(s), 2).astype(int), [0, 1, 1 / 2])
    nearest = np.full(len(s), np.inf)
    for name, line in (("u", alpha + beta - theta), ("v", alpha + PI / 2 - beta - theta)):
        for turn in np.arange(np.floor(line.min() / PI), np.ceil(line.max() / PI) + 1):
            special = name == "u" and turn == known
            nearest = np.minimum(nearest, (line - PI * turn) ** 2 - h2 * (sharp if special else 1 / 2))
    return cost + weight * nearest


def sloped_costs(problem, level, i):
    """The least d of section 9 over both lines and all turns, at the allowed labels."""
    (alpha, beta, _), h, slope = level.labels(i), level.h * (1 + 1e-12) + 1e-12, problem.slope[i]
    nearest = np.full(len(alpha), np.inf)
    for line, l in ((alpha + beta, slope), (alpha + PI / 2 - beta, None)):  # noqa: E741 - the page's letter
        for turn in np.arange(-9, 10):
            r = line - problem.theta[i] - PI * turn
            if problem.norm == 1:
                d = np.where(abs(r) < 2 * h, (l or 0) * r, abs(r))
            elif l is None:
                d = r**2 - level.h**2 / 2
            else:
                d = r**2 - np.where(abs(r - l / 2) < 2 * h, (r - l / 2) ** 2, level.h**2 / 2)
            nearest = np.minimum(nearest, d)
    return nearest


def pair_costs(level, i, j):
    """c_ij with all tables, for allowed labels of i (rows) and j (columns); for (j, i) the transposed."""
    (a, b, _), (c, d, _) = level.labels(i), level.labels(j)
    phi, apart = abs if level.absolute else np.square, a[:, None] - c
    even = phi(apart - PI * np.rint(apart / PI)) + phi(b[:, None] - d)
    apart += PI / 2
    odd = phi(apart - PI * np.rint(apart / PI)) + phi(b[:, None] + d)
    costs = 2 * np.minimum(even, odd) - (0 if level.absolute else level.h**2)
    rows, columns = np.nonzero(level.allowed[i])[0], np.nonzero(level.allowed[j])[0]
    for (a, b, c, d), tables in level.quads:
        for ends, table in zip(((a, b), (b, c), (d, c), (a, d)), tables, strict=True):
            if ends == (i, j):
                costs += table[np.ix_(rows, columns)]
            if ends == (j, i):
                costs += table[np.ix_(columns, rows)].T
    return costs


def quad_least(level, pixels, tables):
    """Q of a quad: the least of minus the sum of its tables, where a label is allowed at each alpha."""
    a, b, c, d = (level.allowed[i].any(axis=1) for i in pixels)
    ab, bc, dc, ad = (-table for table in tables)
    over_b = (ab[np.ix_(a, b)][:, :, None] + bc[np.ix_(b, c)]).min(axis=1)
    over_d = (ad[np.ix_(a, d)][:, :, None] + dc[np.ix_(d, c)]).min(axis=1)
    return (over_b + over_d).min()


def examine(problem, level, slack):
    """Bound of a level (lemma 2), and the cells that its forward pass leaves (lemma 3)."""
    n, pairs = len(problem.pixels), np.sort(problem.pairs, axis=1)
    before = [pixel_costs(problem, level, i) for i in range(n)]
    for (i, _), a in zip(pairs, level.shares, strict=True):
        before[i] = before[i] + a
    quads = sum(quad_least(level, *quad) for quad in level.quads)
    after, size, slacks = list(before), sum(abs(cost).max() for cost in before), Slacks(level, pairs)
    size += sum(abs(table).max() for _, tables in level.quads for table in tables)
    for i in range(n):
        rest = after[i] - after[i].min()
        forward, backward = np.flatnonzero(pairs[:, 0] == i), np.flatnonzero(pairs[:, 1] == i)
        for e in forward:
            j, a = pairs[e, 1], level.shares[e]
            costs = pair_costs(level, i, j)
            shares = (costs - a[:, None]).min(axis=0)
            a = a - rest / max(len(forward), len(backward))
            slacks.shares[e] = a, (costs - a[:, None]).min(axis=0)
            before[j], after[j] = before[j] + shares, after[j] + slacks.shares[e][1]
            size += abs(a).max() + abs(shares).max() + costs.max()
    error = 1e-14 * size + slack
    lowest = np.array([[theta.min() for theta in each] for each in (after, before)])
    whole = quads + lowest[0].sum()
    rest = [
        (after[i] - lowest[0, i]) * (1 - (pairs[:, 0] == i).sum() / max(1, *(pairs == i).sum(axis=0)))
        for i in range(n)
    ]
    upright = problem.pairs[:, 0] > problem.pairs[:, 1]
    combs = [on_combs(rest, slacks, teeth) for teeth in (upright, ~upright)]
    for i in range(n):
        bound = quads + lowest[0, : i + 1].sum() + lowest[1, i + 1 :].sum()
        tests = [bound + after[i] - lowest[0, i] <= problem.energy() + error]
        tests += [whole + comb[i] <= problem.energy() + 2 * error for comb in combs]  # whose sums err as well
        level.left.append(remaining(level, i, tests))
    level.bound = whole - error


class Slacks:
    """The costs of pairs less their shares after the pass, which are not negative."""

    def __init__(self, level, pairs):
        self.level, self.pairs, self.shares, self.known = level, pairs, {}, {}

    def of(self, e):
        """The table of pair e; small ones are kept."""
        if e not in self.known:
            a, b = self.shares[e]
            table = pair_costs(self.level, *self.pairs[e]) - a[:, None] - b
            if table.size > 200_000:
                return table
            self.known[e] = table
        return self.known[e]


def on_combs(rest, slacks, teeth):
    """The least sum of `rest` and slacks on the comb of each pixel, for each of its labels.

    teeth: which pairs lie along the teeth; the others lie along the spines.
    """
    at = [np.flatnonzero((slacks.pairs == i).any(axis=1)) for i in range(len(rest))]
    known = {}

    def message(e, i):
        """The least sum over the part of the comb behind pair e, for each label of its pixel i."""
        if (e, i) not in known:
            first, second = slacks.pairs[e]
            k = first + second - i
            beyond = rest[k] + sum(message(f, k) for f in at[k] if f != e and (teeth[f] or not teeth[e]))
            table = slacks.of(e) if k == first else slacks.of(e).T
            known[e, i] = (beyond[:, None] + table).min(axis=0)
        return known[e, i]

    return [rest[i] + sum(message(e, i) for e in at[i]) for i in range(len(rest))]


def remaining(level, i, tests):
    """Cells of the domain with a good corner in each test, cut at |beta| = pi/4, as rows of `Level.left`."""
    cells = all_four(level.allowed[i])
    for test in tests:
        good = np.zeros_like(level.allowed[i])
        good[level.allowed[i]] = test
        cells = cells & ~all_four(~good)
    k, low = np.nonzero(cells)
    alpha, beta = level.places(i)
    ends = alpha[k], alpha[k + 1], np.maximum(beta[low], -PI / 4), np.minimum(beta[low + 1], PI / 4)
    steps = [np.floor(each[at]) for each, at in zip(level.steps[i], (k, low), strict=True)]
    return np.stack([*ends, *steps], axis=1)[ends[3] - ends[2] > 2 * SLIVER]


def covered(level, i, cells):
    """Whether the domain of a level contains each of the cells."""
    inside, (alpha, beta) = all_four(level.allowed[i]), level.places(i)
    result = np.zeros(len(cells), bool)
    for c, (a0, a1, b0, b1, *_) in enumerate(cells):
        ks = (alpha[:-1] < a1 - SLIVER) & (alpha[1:] > a0 + SLIVER)
        ls = (beta[:-1] < b1 - SLIVER) & (beta[1:] > b0 + SLIVER)
        reach = alpha[0] - SLIVER <= a0 and a1 <= alpha[-1] + SLIVER
        reach &= beta[0] - SLIVER <= b0 and b1 <= beta[-1] + SLIVER
        result[c] = reach and inside[np.ix_(ks, ls)].all()
    return result


def branches_of(arrays, problem, count):
    """For each level, the level whose cells it covers, and the part of them: pixel, side and step."""
    rows = [[k - 1, -1, 0, 0] for k in range(count)]
    if problem.norm == 2 and "branches" in arrays:
        rows = take(arrays, "branches", "<i4", count, 4).tolist()
    need(rows[0] == [-1, -1, 0, 0], "branches: the first level follows another one")
    for k, (above, pixel, side, _) in enumerate(rows[1:], 1):
        known = 0 <= above < k and -1 <= pixel < len(problem.pixels) and 0 <= side < 4
        need(known, f"branches: level {k} covers nothing known")
    for k in range(count):
        parts = [row[1:] for row in rows[1:] if row[0] == k]
        if len(parts) > 1:
            pixel, side, step = parts[0]
            need(pixel >= 0 and parts[1:] == [[pixel, side ^ 1, step]], f"branches: the parts of level {k}")
    return rows


def part_of(cells, i, pixel, side, step):
    """The remaining cells of pixel i that belong to a part."""
    if i != pixel:
        return cells
    above = cells[:, 4 + side // 2] >= step
    return cells[above if side % 2 else ~above]


def check_covers(problem, levels, branches):
    """The first level covers the strip, and each later one what remains of another, or a part of that."""
    for i, pixel in enumerate(problem.pixels):
        low = levels[0].places(i)[0][0]
        whole = covered(levels[0], i, [(low, low + PI / 2, -PI / 4, PI / 4)]).all()
        need(whole, f"level_0_allowed: does not cover the strip at pixel {pixel}")
    for after, (above, *part) in zip(levels[1:], branches[1:], strict=True):
        level = levels[above]
        for i, pixel in enumerate(problem.pixels):
            whole = covered(after, i, part_of(level.left[i], i, *part)).all()
            what = f"what level {level.number} leaves at pixel {pixel}"
            need(whole, f"level_{after.number}_allowed: does not cover {what}")


# Section 6: the last step -----------------------------------------------------------------------------------


def boxes_of(cells, margin):
    """Box of every pixel around its remaining cells: rows (a0, a1, b0, b1)."""
    ends = np.array([[*c.min(axis=0)[[0, 2]], *c.max(axis=0)[[1, 3]]] for c in cells])
    a0, b0, a1, b1 = (ends + np.array([-margin, -margin, margin, margin])).T
    return np.stack([a0, a1, np.maximum(b0, -PI / 4), np.minimum(b1, PI / 4)], axis=1)


def across_seam(cells):
    """The cells of a pixel, those above the widest gap with their other label if all are closer then."""
    steps = np.unique(cells[:, 4])
    if (np.diff(steps) <= 1).all():
        return cells
    other, above = cells.copy(), cells[:, 4] > steps[np.diff(steps).argmax()]
    other[above, :2] -= PI / 2
    other[above, 2], other[above, 3] = -cells[above, 3], -cells[above, 2]
    width = [each[:, 1].max() - each[:, 0].min() for each in (cells, other)]
    return other if width[1] < width[0] else cells


def in_the_middle(problem, boxes):
    """The crosses in the middle of boxes with their best jumps, in place of the field."""
    alpha, beta = boxes.reshape(-1, 2, 2).mean(axis=2).T
    i, j = problem.pairs.T
    p = np.rint((alpha[j] - alpha[i]) / (PI / 2)) + np.array([[0], [-1], [1]])
    costs = (alpha[i] - alpha[j] + PI / 2 * p) ** 2 + ((-1.0) ** p * beta[i] - beta[j]) ** 2
    return replace(problem, alpha=alpha, beta=beta, p=p[costs.argmin(axis=0), np.arange(len(i))])


def relabelled(problem, level):
    """The same field, with the label of every cross that is nearest to the centre of the lattice."""
    t, (i, j) = np.rint((level.centre[:, 0] - problem.alpha) / (PI / 2)), problem.pairs.T
    beta, p = (-1.0) ** t * problem.beta, problem.p - t[i] + t[j]
    return replace(problem, alpha=problem.alpha + PI / 2 * t, beta=beta, p=p)


def check_jumps(problem, boxes):
    """Lemma 4 for every pair, on all crosses of two boxes."""
    for (i, j), p in zip(problem.pairs, problem.p, strict=True):
        (a0, a1, b0, b1), (c0, c1, d0, d1) = boxes[i], boxes[j]
        most = max(abs(a0 - c1 + PI / 2 * p), abs(a1 - c0 + PI / 2 * p))
        least = min((-1.0) ** p * b * d for b in (b0, b1) for d in (d0, d1))
        forced = most <= PI / 2 and PI * most - PI**2 / 4 <= 4 * least
        if problem.norm != 2:
            nearest = [
                0 if low < 0 < high else min(abs(low), abs(high)) for low, high in ((b0, b1), (d0, d1))
            ]
            ends = [((-1.0) ** p * b, d) for b in (b0, b1) for d in (d0, d1)]
            g = max([min(abs(b), abs(d)) for b, d in ends if b * d < 0], default=-min(nearest))
            forced = most <= PI / 2 and most + g <= PI / 4
        need(forced, f"p: another jump may be better at the pixels {problem.pixels[[i, j]].tolist()}")


def convex_bound(problem, boxes, enough):
    """Least bound of all pieces of the boxes, which are cut at |alpha - theta| = pi/4 where that helps."""
    theta = problem.theta + PI * np.rint((problem.alpha - problem.theta) / PI)
    boxes = boxes - np.stack(
        [theta, theta, 0 * theta, 0 * theta], axis=1
    )  # alpha is now relative to the stroke
    far = (problem.weight > 0) & (abs(boxes[:, :2]).max(axis=1) > 3 * PI / 4)
    need(not far.any(), f"lemma 5 does not apply at the stroke of pixel {problem.pixels[far.argmax()]}")
    beyond = 1.0 * (boxes[:, 0] >= PI / 4) - (boxes[:, 1] <= -PI / 4)
    bound, count, pieces = np.inf, 0, [(boxes, beyond)]
    while pieces:
        (boxes, side), count = pieces.pop(), count + 1
        least, lost = piece_bound(problem, theta, boxes, side)
        which, i = np.unravel_index(lost.argmax(), lost.shape)  # the cut that helps most
        if least >= enough or lost[which, i] <= 0 or count > 200:
            bound = min(bound, least)
            continue
        inner, outer, sides = boxes.copy(), boxes.copy(), side.copy()
        sides[i] = 2 * which - 1
        inner[i, which] = outer[i, 1 - which] = sides[i] * PI / 4
        pieces += [(inner, side), (outer, sides)]
    return bound


def multipliers_bound(problem, boxes, _):
    """Least bound of the pieces of the boxes that section 9 describes."""
    theta = problem.theta + PI * np.rint((problem.alpha - problem.theta) / PI)
    away = abs(boxes[:, :2] - theta[:, None]).max(axis=1)[problem.weight > 0]
    far = away > (PI / 2 if problem.norm == 1 else 3 * PI / 4)
    need(not far.any(), "a box leads too far from its stroke")
    waiting, found = [(boxes, np.zeros(len(boxes)))], []
    for i in problem.cuts:
        need(waiting, "cuts: a piece too many")
        boxes, side = waiting.pop()
        if i < 0:
            least = piece_by_multipliers(problem, theta, boxes, side, problem.multipliers[len(found)])
            found.append(np.inf if (boxes[:, 0] > boxes[:, 1]).any() else least)
            continue
        ends, parts = [-np.inf, theta[i] - PI / 4, theta[i] + PI / 4, np.inf], []
        for k in range(3):
            part, sides = boxes.copy(), side.copy()
            part[i, 0], part[i, 1] = max(part[i, 0], ends[k]), min(part[i, 1], ends[k + 1])
            sides[i] = k - 1
            parts.append((part, sides))
        waiting += parts[::-1]
    need(not waiting, "cuts: a piece is left")
    return min(found)


def piece_by_multipliers(problem, theta, boxes, side, multipliers):
    """Lower bound of F on a piece; side: as of `piece_bound`."""
    n, m, (i, j) = len(boxes), len(problem.pairs), problem.pairs.T
    beyond = np.maximum([theta - PI / 4 - boxes[:, 0], boxes[:, 1] - theta - PI / 4], 0)  # e below and above
    below, above = beyond * (problem.weight > 0) * (side == 0)
    absolute = problem.norm == 1
    rows = np.zeros((2 * m + 2 * n, 2 * n))
    rows[np.arange(m), i], rows[np.arange(m), j] = 1, -1
    rows[np.arange(m, 2 * m), n + i], rows[np.arange(m, 2 * m), n + j] = (-1.0) ** problem.p, -1
    rows[2 * m : 2 * m + n] = np.concatenate([np.eye(n), np.diag(np.where(side, -1.0, 1.0))], axis=1)
    rows[2 * m + n :, n:] = np.eye(n)
    constant = np.concatenate([PI / 2 * problem.p, np.zeros(m), -theta - side * PI / 2, np.zeros(n)])
    weights = np.concatenate([np.full(2 * m, 2.0), problem.weight, np.full(n, problem.w_beta)])
    l, squared = multipliers.copy(), np.arange(2 * m + 2 * n) >= 2 * m  # noqa: E741 - the page's letter
    squared &= not absolute
    l[~squared] = l[~squared].clip(-1, 1)
    slope, lost = (weights * l) @ rows, (weights * l * l / 4)[squared].sum()
    if absolute:
        lost += 2 * problem.weight @ (below + above)
    else:
        slope[n:] -= 4 * problem.weight * (above - below)
        lost += PI * problem.weight @ (below + above)
    low, high = (boxes[:, ends].T.ravel() for ends in ([0, 2], [1, 3]))
    terms = [weights * l * constant, np.minimum(slope * low, slope * high)]
    size = sum(abs(each).sum() for each in terms) + (weights * abs(l)) @ (
        abs(rows) @ np.maximum(abs(low), abs(high))
    )
    return sum(each.sum() for each in terms) - lost - 1e-14 * (size + lost)


def piece_bound(problem, theta, boxes, side):
    """Lower bound of G on boxes, and what lemma 5 takes off there at both ends of every pixel.

    Where side is 1 or -1, alpha lies beyond it, and v carries the stroke.
    """
    n, m, (i, j) = len(boxes), len(problem.pairs), problem.pairs.T
    a, b = np.zeros((2, m, 2 * n))  # A and B of all pairs, as functions of all alpha and beta
    a[np.arange(m), i], a[np.arange(m), j] = 1, -1
    b[np.arange(m), n + i], b[np.arange(m), n + j] = (-1.0) ** problem.p, -1
    r = np.concatenate([np.eye(n), np.diag(np.where(side, -1.0, 1.0))], axis=1)
    rows = np.concatenate([a, b, r, np.eye(2 * n)[n:]])
    goal = [theta[j] - theta[i] - PI / 2 * problem.p, np.zeros(m), side * PI / 2, np.zeros(n)]
    goal = np.concatenate(goal)
    weights = np.concatenate([np.full(2 * m, 2.0), problem.weight, np.full(n, problem.w_beta)])
    beyond = np.maximum([-PI / 4 - boxes[:, 0], boxes[:, 1] - PI / 4], 0)  # the greatest e below and above
    below, above = 4 * problem.weight * beyond * (side == 0)
    linear, constant = np.concatenate([np.zeros(n), below - above]), -PI / 4 * (above + below).sum()
    low, high = (boxes[:, ends].T.ravel() for ends in ([0, 2], [1, 3]))

    def value(x):
        return weights @ (rows @ x - goal) ** 2 + linear @ x + constant

    def slope(x):
        return 2 * rows.T @ (weights * (rows @ x - goal)) + linear

    x = np.concatenate([problem.alpha - theta, problem.beta]).clip(low, high)
    hessian = 2 * rows.T @ (weights[:, None] * rows) + 1e-9 * np.eye(2 * n)
    for _ in range(
        100
    ):  # Newton steps on the angles that no bound holds: any x gives a bound, the least the best
        free = ~((x <= low) & (slope(x) > 0) | (x >= high) & (slope(x) < 0))
        step = np.zeros(2 * n)
        step[free] = np.linalg.solve(hessian[np.ix_(free, free)], -slope(x)[free])
        ends = ((x + 0.5**k * step).clip(low, high) for k in range(30))
        better = next((end for end in ends if value(end) < value(x)), None)
        if better is None:
            break
        x = better

    def least(x):
        rise = slope(x)
        size = value(x) + abs(linear) @ abs(x) - constant + abs(rise) @ (high - low)
        return value(x) + np.minimum(rise * (low - x), rise * (high - x)).sum() - 1e-13 * n**0.5 * size

    bound = max(least(x), least((x + step).clip(low, high)))  # the values of both differ by rounding only
    return bound, np.stack([below * (PI / 4 - x[n:]), above * (PI / 4 + x[n:])])


# Section 7: the theorem -------------------------------------------------------------------------------------


def check(arrays):
    """Bound that a certificate proves for the energy of every field; at least what it claims."""
    arrays = dict(arrays)  # each reader below removes its array
    head = head_of(arrays, "head")
    version = head.get("version")
    known = head.get("format") == "crossfield-certificate" and type(version) is int and version == 3
    need(known, "head: no certificate of version 3")
    need(head.get("status") in {"optimal", "gap"}, "head: the status is neither optimal nor gap")
    norm = head.get("norm")
    need(type(norm) in {int, str} and norm in {1, 2, "mixed"}, "head: the norm")
    problem, count = problem_of(arrays, norm), number(head, "levels", 1, 256)
    energy, claimed = problem.energy(), number(head, "energy", 0, 1e300)
    need(count == int(count), f"head: {count} levels")
    need(abs(energy - claimed) <= 1e-12 * max(1, energy), f"head: the energy is {energy}, not {claimed}")

    branches = branches_of(arrays, problem, int(count))
    levels = levels_of(arrays, problem, branches)
    below, why = proven_from(0, problem, levels, branches)
    need(below < np.inf, "the levels leave no cell, not even those of the field")
    bound = max(0.0, float(min(below, energy)))
    optimal = bound >= energy - TOLERANCE * max(1, energy)
    need(optimal or head["status"] == "gap", f"head: not optimal, with a bound of {bound}{why}")
    need(number(head, "bound", -1e300, 1e300) <= bound, f"head: the bound is {bound}, not {head['bound']}")
    close = claimed - head["bound"] <= TOLERANCE * max(1, claimed)
    need(close or head["status"] == "gap", "head: optimal, but not by its own bound")
    return bound


def proven_from(k, problem, levels, branches):
    """Lower bound of the fields of energy U or less in the domain of level k, and why it is not higher."""
    level, parts = levels[k], [part for part, row in enumerate(branches) if part and row[0] == k]
    if len(parts) == 2 or [branches[part][1] for part in parts] == [-1]:
        bound, why = min(proven_from(part, problem, levels, branches) for part in parts)
    elif not all(map(len, level.left)):
        bound, why = np.inf, ""
    else:
        bound, why = last_step(problem, levels[0], level, 2 * (len(levels) + 1) * SLIVER)
    return max(level.bound, bound), why


def last_step(problem, first, level, margin):
    """Section 6 after a level: a lower bound, -inf where the lemmas do not apply, and the reason."""
    enough = problem.energy() - TOLERANCE / 2 * max(1, problem.energy())
    boxes, turned = (boxes_of(cells, margin) for cells in (level.left, [*map(across_seam, level.left)]))
    tries = [(relabelled(problem, first), boxes), (in_the_middle(problem, turned), turned)]
    for crosses, these in tries[: 2 if problem.norm == 2 else 1]:
        try:
            check_jumps(crosses, these)
            return (convex_bound if problem.norm == 2 else multipliers_bound)(crosses, these, enough), ""
        except Refused as refusal:
            why = f"; {refusal}"
    return -np.inf, why


def levels_of(arrays, problem, branches):
    """All levels, each with its bound and with the domain that it needs."""
    count = len(branches)
    slack = 2 * (count + 1) * SLIVER * (64 + 8 * problem.weight + 4 * problem.w_beta).sum()
    levels = [level_of(arrays, k, problem) for k in range(count)]
    need(not arrays, f"{next(iter(arrays), '')} belongs to no certificate with {count} levels")
    for level in levels:
        need(
            (level.centre == levels[0].centre).all(), f"level_{level.number}_alpha or beta: not as at level 0"
        )
        examine(problem, level, slack)
    check_covers(problem, levels, branches)
    return levels


if __name__ == "__main__":
    try:
        print(f"every field has an energy of at least {check(arrays_of(Path(sys.argv[1]))):.15g}")
    except Refused as refusal:
        sys.exit(str(refusal))
