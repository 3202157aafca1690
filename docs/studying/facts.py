"""Facts from the rows: proofs by solver, contradictions to optima, and gaps of fields."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable
from typing import Any, Final

import numpy as np
from crossfield.export.solvers_table import SOLVERS

from .rows import EVERY, NOT_RUN, Row

PROVEN: Final = 1e-6
"""Gap, relative to 1 or the objective if that is more, of an optimum that is proven."""
WITHIN: Final = 1e-5
"""Tolerated excess of a claim over the proven optimum, in the same measure: solvers keep rows to 1e-6."""
CLAIMS: Final = frozenset({"optimal-global", "optimal"})
PROBLEMS: Final = {
    "2-norm": ("minlp-parity", "minlp-quartic", "minlp-cubic", "miqp-exact"),
    "1-norm and 2-norm": ("miqcp-bilinear", "miqp-mccormick"),
    "1-norm": ("miqcp-bilinear-l1", "milp-mccormick"),
    "given jumps": ("qp-fixed",),
}
"""Formulations by the problem that they are."""


def scale(value: float) -> float:
    """The reference value of a relative difference."""
    return max(1.0, abs(value))


def is_proven(row: Row) -> bool:
    """Whether a run ends with an optimum and its proof, by the solver's status or by its bound."""
    if row["objective"] is None or row["status"] in {"unknown", NOT_RUN}:
        return False
    if row["status"] in CLAIMS:
        return True
    if row["status"] == "optimal-local":  # of a convex problem: other pairs are not run
        return row["solver"] in SOLVERS and SOLVERS[row["solver"]].proves in {"convex", "local"}
    bound = row["bound"]
    return bound is not None and row["objective"] - bound <= PROVEN * scale(row["objective"])


def grouped(rows: Iterable[Row], *names: str) -> dict[tuple[Any, ...], list[Row]]:
    """The rows by the values of some columns, in their order."""
    found: dict[tuple[Any, ...], list[Row]] = defaultdict(list)
    for row in rows:
        found[tuple(row[name] for name in names)].append(row)
    return dict(found)


def measured(rows: Iterable[Row]) -> list[Row]:
    """The rows of runs, without rows about skipped runs."""
    return [row for row in rows if row["instance"] != EVERY]


Optima = dict[tuple[str, str, float], tuple[float, float]]
"""Least energy that is known and greatest bound, by problem, instance and size."""


MIXED: Final = "1-norm and 2-norm"
"""The problem that `prove` does not know."""


def optima(proofs: Iterable[Row], solvers: Iterable[Row] = ()) -> Optima:
    """Results of `prove` for every instance, and the best angles for given jumps.

    solvers: their rows, which give the best point of the mixed problem, without a bound.
    """
    problem = {("prove", 2.0): "2-norm", ("prove", 1.0): "1-norm"}
    found = {
        (problem.get((row["way"], row["norm"]), "given jumps"), row["instance"], row["size"]): (
            row["objective"], row["bound"],
        )
        for row in proofs
        if row["objective"] is not None
    }  # fmt: skip
    for row in solvers:
        if row["objective"] is not None and row["facet"] == "hull" and problem_of(row) == MIXED:
            key = (MIXED, row["instance"], row["size"])
            found[key] = (min(row["objective"], found.get(key, (np.inf,))[0]), -np.inf)
    return found


def problem_of(row: Row) -> str:
    """The problem that the formulation of a row is."""
    return next(name for name, members in PROBLEMS.items() if row["way"] in members)


def contradictions(rows: Iterable[Row], known: Optima) -> list[tuple[Row, str]]:
    """Rows of our own problems that contradict the proven optimum, with the contradiction."""
    found = []
    for row in rows:
        key = (problem_of(row), row["instance"], row["size"])
        if key not in known or row["facet"] != "hull":
            continue
        best, bound = known[key]
        slack = WITHIN * scale(best)
        if row["objective"] is not None and row["objective"] < bound - slack:
            found.append((row, f"objective {row['objective']:.8g} below the proven bound {bound:.8g}"))
        elif is_proven(row) and row["objective"] > best + slack:
            found.append((row, f"claims the optimum {row['objective']:.8g}, but {best:.8g} is feasible"))
        elif row["bound"] is not None and row["bound"] > best + slack:
            found.append((row, f"bound {row['bound']:.8g} above the feasible {best:.8g}"))
    return found


def gap(row: Row) -> float:
    """Relative distance of a run's bound below its objective, between 0 and 1; 1 without a bound."""
    if is_proven(row):
        return 0.0
    if row["objective"] is None or row["bound"] is None:
        return 1.0
    apart = (row["objective"] - row["bound"]) / max(abs(row["objective"]), 1e-9)
    return float(min(max(apart, 0.0), 1.0))


def over(row: Row, known: Optima) -> float | None:
    """Excess of a run's objective over the least known one, in that measure; None without a point.

    Negative below it, where a formulation is a relaxation.
    """
    key = (problem_of(row), row["instance"], row["size"])
    if key not in known or row["objective"] is None:
        return None
    return float((row["objective"] - known[key][0]) / scale(known[key][0]))


def spent(row: Row) -> float:
    """Seconds of a proof; infinite for a run without a proof."""
    return float(row["seconds"]) if is_proven(row) and row["seconds"] is not None else float("inf")


def shifted_mean(seconds: Iterable[float], shift: float = 1.0) -> float:
    """The shifted geometric mean."""
    values = np.array(list(seconds))
    return float(np.exp(np.log(values + shift).mean()) - shift)


Times = dict[str, dict[tuple[Any, ...], float]]
"""Seconds of proofs by name of a line, and case."""


def ratios(times: Times) -> dict[str, np.ndarray[Any, Any]]:
    """Performance ratios of Dolan and More, sorted: for each line, one per case that all lines have.

    The ratio is the time of a proof over that of the fastest; infinite without a proof. Cases without any
    proof count too.
    """
    common = sorted(set.intersection(*(set(each) for each in times.values()))) if times else []
    best = {each: min(of[each] for of in times.values()) for each in common}
    return {
        name: np.sort([of[c] / best[c] if np.isfinite(of[c]) else np.inf for c in common])
        for name, of in times.items()
    }
