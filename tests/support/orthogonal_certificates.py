"""Certificates of orthogonal crosses of one level, made by hand round any field: also those that lie."""

import crossfield as cf
import numpy as np
from certificate_arrays import with_head
from crossfield.models.instance.file import instance_arrays
from crossfield.models.orthogonal.energy import OrthogonalEnergy, field_of
from crossfield.models.proof.checkers import check_orthogonal as checker

UNIT = 2.0**-30


def certificate_at(instance, z, divisions=15, rings=(), shares=None, tables=None, unit=UNIT, **changes):
    """A certificate of one level round the best field of integers z, which claims the bound 0.

    rings: those in use, each with its pairs and their signs. shares: a function of the level and its costs
    that returns the share of each label of the first points of pairs, by default 0. tables: in multiples of
    the unit, a function that returns the tables of all steps, by default 0. changes: other arrays.
    """
    energy = OrthogonalEnergy.of(instance)
    best, m, kappa = field_of(instance, z, energy), len(instance.domain.first), instance.domain.kappa
    arrays = {f"instance_{name}": array for name, array in instance_arrays(instance).items()}
    arrays |= {} if kappa is None else {"kappa": kappa}
    pairs, signs = ([x for ring in rings for x in ring[part]] for part in (0, 1))
    start = np.cumsum([0, *(len(ring[0]) for ring in rings)])
    arrays |= {
        "alpha": best.alpha, "p": best.p, "centre": energy.fit_angles(z),
        "divisions": np.array([divisions], "i4"), "half": np.zeros(len(best.alpha), "u1"),
        "ring_start": start.astype("i4"), "ring_pair": np.array(pairs, "i4"),
        "ring_sign": np.array(signs, "i1"), "level_0_rings": np.arange(len(rings), dtype="i4"),
        "level_0_unit": np.array([unit]),
    }  # fmt: skip
    arrays |= changes
    rows = checker.CentredRows(arrays)
    level = checker.first_level(rows, divisions)
    costs, sizes = checker.costs_of(level), np.diff(level.pairs.begin)
    given = (
        np.zeros(level.pairs.first_line[m])
        if shares is None
        else np.nan_to_num(shares(level, costs), posinf=0, neginf=0)
    )
    of_rings = [np.zeros(int(sizes[pairs].sum()))] if tables is None else tables(level)
    numbers = np.concatenate([np.round(given / unit), *map(np.ravel, of_rings)])
    arrays["level_0_shares"] = numbers.astype("i4")
    excess = checker.Excess(level, costs, *checker.stored_shares(arrays, 0, level))
    total, error = checker.energy_of(arrays, rows)[:2]
    most = total * (1 + 1e-9) + 2 * error + 1e-12
    squares = checker.kept_of(level, excess, most)
    turns = checker.possible_turns(level, squares)
    cases = [
        energy.fit_angles((rows.nearest + np.array(case)).astype("i4")) for case in checker.cases_of(turns)
    ]
    arrays["cases"] = np.array(cases).reshape(-1, rows.size)
    arrays["level_0_squares"] = np.packbits(squares[: level.squares.begin[m]])
    head = {
        "format": checker.FORMAT, "version": checker.VERSION, "status": "gap", "bound": 0.0,
        "energy": total, "threshold": most,
    }  # fmt: skip
    return with_head({"head": np.frombuffer(b"{}", "u1")} | arrays, **head)


def star():
    """A pixel between three with strokes, which has two good angles; the better one costs 0.606."""
    near = np.pi / 4 - 0.1
    mask, at = np.array([[0, 1, 0], [1, 1, 1]], bool), np.array([[0, 1], [1, 0], [1, 2]])
    theta = np.array([near / 2 + np.pi / 4, 0.0, near])
    more = {"stroke_coefficient": 20.0, "orthogonal": True, "pair_weights": np.array([1.0, 0.16, 1.0])}
    return cf.Instance.on_pixels("star", mask, at, theta, np.ones(3), **more)


def shares_of_star(level, costs):
    """Shares that leave the cost of the pair to the upper pixel with that pair, and others to the middle."""
    rows, pairs = level.rows, level.pairs
    blocks = pairs.start[:-1], pairs.start[1:]
    of_stroke = {int(rows.first[r]): pairs.matrix(costs, r)[:, 0] for r in range(rows.pairs, len(rows.first))}
    shares = []
    for e, (first, second) in enumerate(rows.ends[: rows.pairs]):
        size = blocks[1][first] - blocks[0][first]
        if 0 in (first, second):
            shares.append(np.zeros(size))
        else:
            to_middle = (pairs.matrix(costs, e) + of_stroke.get(second, 0.0)).min(axis=1)
            shares.append(to_middle if second in of_stroke and first == 2 else -of_stroke[first])
    return np.concatenate(shares)
