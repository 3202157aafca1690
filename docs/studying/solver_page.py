"""Tables and sentences on formulations and solvers."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from crossfield.export.solvers_table import SOLVERS
from crossfield.models.formulations.catalogue import FORMULATIONS

from . import facts, plots
from .rows import EVERY, NOT_RUN, Row, Table
from .solving import FAILED, JUMPS_GIVEN, TOO_LARGE

HALF: Final = 0.5
LINES: Final = 7  # of a panel of profiles, the best ones
Kept = dict[str, list[Row]]
Pair = tuple[str, str]


def is_cold(row: Row) -> bool:
    """Whether the row is of a run with only the file as it is."""
    return (row["start"], row["facet"], row["windows"]) == ("cold", "hull", "gauge")


def label(pair: Pair) -> str:
    """Solver and formulation in words."""
    return f"{SOLVERS[pair[1]].title}, {pair[0]}"


@dataclass(frozen=True)
class Rung:
    """Results of a pair on a rung. left_out: the reason if it was not run, else empty."""

    runs: tuple[Row, ...]
    left_out: str = ""

    @property
    def proven(self) -> int:
        """Number of instances with a proof."""
        return sum(map(facts.is_proven, self.runs))

    @property
    def share(self) -> float:
        """Share of the instances that are proven; none if it was not run."""
        return self.proven / len(self.runs) if self.runs else 0.0

    @property
    def tried(self) -> list[Row]:
        """The runs on instances that are not too large for the solver's edition."""
        return [row for row in self.runs if row["status"] != TOO_LARGE]

    @property
    def seconds(self) -> float:
        """Shifted geometric mean of the seconds; runs without a proof count with their limit."""
        return facts.shifted_mean(min(facts.spent(row), row["limit"]) for row in self.tried)

    def cell(self) -> str:
        """Its cell of the table."""
        if self.left_out:
            return "-"
        if not self.runs:
            return ""
        large = len(self.runs) - len(self.tried)
        if not self.tried:
            return "too large"
        text = f"{self.proven} of {len(self.tried)}, {self.seconds:.1f} s"
        return f"{text}; {large} too large" if large else text


def rungs_of(rows: Iterable[Row]) -> dict[Pair, dict[int, Rung]]:
    """Results of the cold runs of each pair on each rung that has rows."""
    found: dict[Pair, dict[int, Rung]] = {}
    for (way, solver, size), group in facts.grouped(rows, "way", "solver", "size").items():
        runs = tuple(facts.measured(group))
        why = next((row["note"] for row in group if row["status"] == NOT_RUN), "")
        found.setdefault((way, solver), {})[int(size)] = Rung(runs, why)
    return {pair: found[pair] for pair in sorted(found, key=_place)}


def _place(pair: Pair) -> tuple[int, int]:
    """Place of a pair in the tables of formulations and solvers."""
    return list(FORMULATIONS).index(pair[0]), list(SOLVERS).index(pair[1])


def proof_rungs(proofs: list[Row], norm: int) -> dict[int, Rung]:
    """Results of `prove`, as from `rungs_of`."""
    chosen = [row for row in proofs if row["way"] == "prove" and row["norm"] == norm]
    return {int(size): Rung(tuple(rows)) for (size,), rows in facts.grouped(chosen, "size").items()}


def rank(of: dict[int, Rung]) -> tuple[int, float]:
    """Key that ranks pairs: by proofs, then by speed."""
    return (
        sum(each.proven for each in of.values()),
        -sum(each.seconds for each in of.values() if each.tried),
    )


def best_solvers(standing: dict[Pair, dict[int, Rung]]) -> dict[str, Pair]:
    """The pair with most proofs for each formulation."""
    return {
        way: max((pair for pair in standing if pair[0] == way), key=lambda pair: rank(standing[pair]))
        for way in dict.fromkeys(pair[0] for pair in standing)
    }


def reach(standing: dict[Pair, dict[int, Rung]]) -> tuple[int, Pair] | None:
    """The largest rung of which a pair with free jumps proves half or more, and the pair."""
    found = [
        (size, of[size].share, pair)
        for pair, of in standing.items()
        if pair[0] != JUMPS_GIVEN
        for size in of
        if of[size].share >= HALF
    ]
    if not found:
        return None
    size, _, pair = max(found)
    return size, pair


# Tables


def proven_table(standing: dict[Pair, dict[int, Rung]], proofs: list[Row]) -> Table:
    """Proofs and seconds of every pair on every rung."""
    sizes = sorted({size for of in standing.values() for size in of} | {int(row["size"]) for row in proofs})
    cells = [
        [f"`{way}`", SOLVERS[solver].title, *(of[s].cell() if s in of else "" for s in sizes)]
        for (way, solver), of in standing.items()
    ]
    for norm in (2, 1):
        of = proof_rungs(proofs, norm)
        cells.append([f"energy, {norm}-norm", "`prove`", *(of[s].cell() if s in of else "" for s in sizes)])
    return ("formulation", "solver", *(f"{size} pixels" for size in sizes)), cells


def best_table(standing: dict[Pair, dict[int, Rung]], proofs: list[Row]) -> Table:
    """The pair with free jumps that proves most on each rung, and `prove` in the 2-norm."""
    ours = proof_rungs(proofs, 2)
    cells = []
    for size in sorted(ours):
        ran = {
            pair: of[size]
            for pair, of in standing.items()
            if pair[0] != JUMPS_GIVEN and size in of and of[size].tried
        }
        best = max(ran, key=lambda pair: (ran[pair].proven, -ran[pair].seconds), default=None)
        line = [label(best), ran[best].cell()] if best else ["none was run", "-"]
        cells.append([str(size), *line, ours[size].cell()])
    return ("pixels", "best pair", "proven by it", "proven by `prove`"), cells


def kinds_table(rows: list[Row]) -> Table:
    """Proven instances by kind of instance, problem and size, for any solver."""
    sizes = sorted({int(row["size"]) for row in rows})
    cells = []
    for problem in facts.PROBLEMS:
        for kind in KINDS:
            mine = [r for r in rows if facts.problem_of(r) == problem and r["instance"].startswith(kind)]
            line = []
            for size in sizes:
                have = {row["instance"] for row in mine if row["size"] == size}
                done = {row["instance"] for row in mine if row["size"] == size and facts.is_proven(row)}
                line.append(f"{len(done)} of {len(have)}" if have else "")
            cells.append([problem, KINDS[kind], *line])
    return ("problem", "instances", *(f"{size} pixels" for size in sizes)), cells


KINDS: Final = {
    "whole": "whole samples",
    "crop": "squares of samples",
    "lines": "straight strokes at random",
    "noise": "random directions",
}
"""Kinds of instances by the first word of their names."""


def open_table(rows: list[Row], known: facts.Optima) -> Table:
    """Results of pairs without a proof: points, their excess over the optimum, and gaps."""
    given_up = {TOO_LARGE, FAILED}
    left = [row for row in rows if not facts.is_proven(row) and row["status"] not in given_up]
    sizes = sorted({int(row["size"]) for row in left})
    groups = facts.grouped(left, "way", "solver")
    cells = []
    for way, solver in sorted(groups, key=_place):
        of = facts.grouped(groups[way, solver], "size")
        line = [_left(of[size,], known) if (size,) in of else "" for size in sizes]
        cells.append([f"`{way}`", SOLVERS[solver].title, *line])
    return ("formulation", "solver", *(f"{size} pixels" for size in sizes)), cells


def _left(rows: list[Row], known: facts.Optima) -> str:
    """A cell of that table."""
    over = [share for row in rows if (share := facts.over(row, known)) is not None]
    points = sum(row["objective"] is not None for row in rows)
    gap = f"{100 * float(np.median([facts.gap(row) for row in rows])):.0f} %"
    above = f"+{percent(max(float(np.median(over)), 0.0))}, gap {gap}" if over else f"gap {gap}"
    return f"{points} of {len(rows)}: {above}"


Both = list[tuple[Row, Row]]
"""Runs of an instance: cold, and as a variant."""


def variants(rows: list[Row]) -> dict[str, dict[Pair, Both]]:
    """The runs of each variant and pair with their cold runs, on instances that are not too large."""
    cold = {(row["way"], row["solver"], row["instance"], row["size"]): row for row in rows if is_cold(row)}
    found: dict[str, dict[Pair, Both]] = {}
    for row in rows:
        key = (row["way"], row["solver"], row["instance"], row["size"])
        if not is_cold(row) and key in cold and TOO_LARGE not in {row["status"], cold[key]["status"]}:
            of = found.setdefault(variant(row), {})
            of.setdefault((row["way"], row["solver"]), []).append((cold[key], row))
    return {name: found[name] for name in sorted(found)}


def variant_rungs_table(rows: list[Row]) -> Table:
    """Proofs and seconds of every variant on every rung."""
    found = facts.grouped((row | {"variant": variant(row)} for row in rows if not is_cold(row)), "variant")
    sizes = sorted({int(row["size"]) for of in found.values() for row in of})
    cells = [
        [f"`{way}`", SOLVERS[solver].title, name, *(of[size].cell() if size in of else "" for size in sizes)]
        for (name,) in sorted(found)
        for (way, solver), of in rungs_of(found[name,]).items()
    ]
    return ("formulation", "solver", "variant", *(f"{size} pixels" for size in sizes)), cells


def variants_table(rows: list[Row], known: facts.Optima) -> Table:
    """Variants compared with the cold runs, pair by pair; then all pairs together."""
    cells = []
    for name, of in variants(rows).items():
        for (way, solver), both in of.items():
            cells.append([f"`{way}`", SOLVERS[solver].title, name, *_beside(both, known)])
        together = [each for both in of.values() for each in both]
        cells.append([ALL, "", name, *_beside(together, known)])
    return (
        "formulation", "solver", "variant", "runs", "proven: cold / variant", "s: cold / variant",
        "above the optimum: cold / variant",
    ), cells  # fmt: skip


ALL: Final = "all"
"""The formulation of lines about all pairs together."""


def _beside(both: Both, known: facts.Optima) -> list[str]:
    """Cells of that table: runs, proofs, seconds, and means where both runs have a point."""
    before, after = (Rung(tuple(each[i] for each in both)) for i in (0, 1))
    shares = [pair for a, b in both if None not in (pair := (facts.over(a, known), facts.over(b, known)))]
    above = " / ".join(percent(float(each)) for each in np.mean(shares, axis=0)) if shares else "-"
    proven, seconds = f"{before.proven} / {after.proven}", f"{before.seconds:.2f} / {after.seconds:.2f}"
    return [str(len(both)), proven, seconds, above]


PRINTED: Final = "with facet (26) as printed"


def variant(row: Row) -> str:
    """The difference from a cold run, in words."""
    if row["start"] != "cold":
        return f"from the {row['start']} field"
    return PRINTED if row["facet"] != "hull" else f"in the windows of a {row['windows']}"


def percent(share: float) -> str:
    """A share in percent: two digits, or whole percents of what is more than that."""
    if abs(share) < _NONE:
        return "0 %"
    return f"{100 * share:,.0f} %" if abs(share) >= _WHOLE else f"{100 * share:.2g} %"


_NONE: Final = 5e-6  # smaller values are rounding
_WHOLE: Final = 0.1


def claims_sentence(rows: list[Row], known: facts.Optima) -> str:
    """Numbers of claims of optimality, and the contradicted ones with an example."""
    claims = [row for row in rows if facts.is_proven(row) and row["facet"] == "hull"]
    judged = [r for r in claims if (facts.problem_of(r), r["instance"], r["size"]) in known]
    found = facts.contradictions(rows, known)
    kinds = Counter((row["solver"], row["way"], what.split(" ")[0]) for row, what in found)
    text = (
        f"Solvers claim {len(claims):,} optima. {len(judged):,} of them can be compared with the result of "
        "`prove`, or, for the mixed problem, with the best point of any solver. "
        f"{len(found)} answers contradict it by more than {facts.WITHIN:g}, relative to the larger of 1 and "
        "the optimum"
    )
    worst = {(row["solver"], row["way"], what.split(" ")[0]): (row, what) for row, what in found}
    examples = [
        f"{label((way, solver))}, {kinds[solver, way, first]} times, such as {row['instance']} at "
        f"{row['size']:.0f} pixels: {what}"
        for (solver, way, first), (row, what) in worst.items()
    ]
    return f"{text} ({'; '.join(examples)})." if examples else f"{text}."


def failures_sentence(rows: list[Row]) -> str:
    """Answers that failed the check of points and claims, and runs that failed."""
    unsure = Counter((row["solver"], row["way"]) for row in rows if row["status"] == "unknown")
    failed = Counter((row["solver"], row["way"]) for row in rows if row["status"] == FAILED)
    parts = [
        f"{words}: " + ", ".join(f"{label((way, solver))} {n}" for (solver, way), n in sorted(found.items()))
        for words, found in (
            ("Answers whose point contradicts their claim, counted as unproven", unsure),
            ("Runs that failed", failed),
        )
        if found
    ]
    return ". ".join(parts) + "." if parts else "No run failed, and no point contradicts its claim."


# Plots


def times_of(rows: list[Row], proofs: list[Row], problem: str) -> facts.Times:
    """Seconds of the proofs of a problem by the pairs with most proofs, and by `prove`."""
    mine = [row for row in rows if facts.problem_of(row) == problem]
    standing = rungs_of(mine)
    chosen = sorted((p for p in standing if rank(standing[p])[0]), key=lambda p: rank(standing[p]))[-LINES:]
    found: facts.Times = {}
    cases = {(row["instance"], row["size"]) for row in mine if row["instance"] != EVERY}
    for pair in reversed(chosen):
        runs = [row for of in standing[pair].values() for row in of.runs]
        ran = {(row["instance"], row["size"]): facts.spent(row) for row in runs}
        skipped = {size for size, of in standing[pair].items() if of.left_out}
        found[label(pair)] = {case: float("inf") for case in cases if case[1] in skipped} | ran
    norm = {"2-norm": 2, "1-norm": 1}.get(problem)
    if norm and found:
        found[plots.OURS] = {
            (row["instance"], row["size"]): facts.spent(row)
            for row in proofs
            if row["way"] == "prove" and row["norm"] == norm
        }
    return found


def growth_lines(
    standing: dict[Pair, dict[int, Rung]], proofs: list[Row]
) -> tuple[dict[str, plots.Line], dict[str, plots.Line]]:
    """Share and seconds by size: for each formulation with its best solver, and for `prove`."""
    of_all = {label(pair): standing[pair] for pair in best_solvers(standing).values()}
    of_all |= {f"{plots.OURS}, {norm}-norm": proof_rungs(proofs, norm) for norm in (2, 1)}
    share: dict[str, plots.Line] = {}
    seconds: dict[str, plots.Line] = {}
    for name, of in of_all.items():
        sizes = sorted(of)
        share[name] = ([float(s) for s in sizes], [100 * of[s].share for s in sizes])
        ran = [s for s in sizes if of[s].tried]
        seconds[name] = ([float(s) for s in ran], [max(of[s].seconds, 1e-3) for s in ran])
    return share, seconds


def draw(kept: Kept, pictures: Path) -> None:
    """The plots of this part."""
    rows = [row for row in kept["solvers"] if is_cold(row)]
    panels = {name: facts.ratios(times_of(rows, kept["proofs"], name)) for name in facts.PROBLEMS}
    del panels["given jumps"]
    plots.profiles(pictures / "evidence_profiles.svg", panels)
    standing = rungs_of(rows)
    sizes = sorted({size for of in standing.values() for size in of})
    plots.growth(pictures / "evidence_growth.svg", sizes, *growth_lines(standing, kept["proofs"]))


def tables(kept: Kept) -> dict[str, Table]:
    """The tables of this part by name."""
    rows = kept["solvers"]
    known = facts.optima(kept["proofs"], facts.measured(rows))
    cold = [row for row in rows if is_cold(row)]
    standing = rungs_of(cold)
    return {
        "proofs-by-solver": proven_table(standing, kept["proofs"]),
        "best-pairs": best_table(standing, kept["proofs"]),
        "proofs-by-kind-of-instance": kinds_table(facts.measured(cold)),
        "runs-without-a-proof": open_table(facts.measured(cold), known),
        "variants-by-size": variant_rungs_table(rows),
        "variants": variants_table(facts.measured(rows), known),
    }


def sentences(kept: Kept) -> dict[str, str]:
    """The sentences of this part by name."""
    rows = facts.measured(kept["solvers"])
    known = facts.optima(kept["proofs"], rows)
    return {"claims": claims_sentence(rows, known), "failures": failures_sentence(rows)}


def reach_of(kept: Kept) -> tuple[int, Pair] | None:
    """The result of `reach` for the cold runs."""
    return reach(rungs_of([row for row in kept["solvers"] if is_cold(row)]))
