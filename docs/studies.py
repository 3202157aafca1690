"""Numbers of finished studies on their pages, from the CSV files beside them: `python docs/make.py studies`.

The pages state when each study ran, and at which commit its program stands.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator
from statistics import mean
from typing import Final

from make import markdown, read_rows

SIZES: Final = ("24 pixels", "32 pixels", "48 pixels")
PAIRS: Final = (25, 50, 100, 200)
"""Approximate numbers of pairs, by which instances of the study of solvers are grouped."""
SAME: Final = 1e-6
"""Gap of a proven optimum, relative to 1 or the energy if that is more."""


def span(values: Iterable[float], digits: int) -> str:
    """The least and the largest of some numbers."""
    values = list(values)
    return f"{min(values):.{digits}f} to {max(values):.{digits}f}"


# Evidence


def hidden_curves() -> str:
    """The differences of two methods on the same curves, and how many are more than chance."""
    rows = {row["difference"]: row for row in read_rows("evidence/methods-compared.csv")}
    row = rows["bend minus polyvector"]
    lines = [[size, row[f"by others, {size}"], row[f"of crossfield, {size}"]] for size in SIZES]
    others, own = (sum(is_clear(line[place]) for line in lines) for place in (1, 2))
    return (
        f"{markdown(('`bend` minus `polyvector`', 'drawings by others', 'our own'), lines)}\n\n"
        f"{others} of 3 differences exceed two standard errors on drawings by others, {own} of 3 on our own."
    )


def is_clear(cell: str) -> bool:
    """Whether a difference exceeds two standard errors."""
    difference, error = (float(part) for part in cell.partition("(")[0].split(" ± "))
    return abs(difference) > 2 * error


def known_surfaces() -> str:
    """Mean errors of the methods on surfaces with a known answer, by the noise of the strokes."""
    errors: dict[str, dict[str, list[float]]] = defaultdict(lambda: defaultdict(list))
    for row in read_rows("evidence/surfaces-by-weight.csv"):
        if (row["pixels"], row["weight"]) == ("48", "20"):
            errors[row["method"]][row["noise"]].append(float(row["degrees"]))
    lines = [
        [f"`{method}`", *(f"{mean(values):.1f}" for values in of.values())] for method, of in errors.items()
    ]
    noises = next(iter(errors.values()))
    return markdown(("48 pixels", *(f"noise {noise}" for noise in noises)), lines)


def missed_strokes() -> str:
    """Sentence on the stroke pixels that the default weight misses."""
    row = next(row for row in read_rows("evidence/weights.csv") if row["weight"] == "20")
    shares = [float(row[f"missed, {size}"].removesuffix("%")) for size in SIZES]
    return (
        f"At the default weight of 20, the line at {span(shares, 1)} % of the stroke pixels deviates by more "
        "than 10 degrees from the stroke."
    )


def energy_and_error() -> str:
    """Sentences on how the error changes with the energy."""
    rows = {row["change"]: row for row in read_rows("evidence/changes.csv")}
    names = ("greedy to best", "greedy to bend", "2-norm to 1-norm of best fields")
    cells = [list(rows[name].values()) for name in names]
    heads = list(rows[names[0]])
    above = [
        f"{row['energy above the least, median']} at {row['pixels']} pixels"
        for row in read_rows("evidence/practice.csv")
        if row["method"] == "greedy"
    ]
    return (
        f"{markdown(tuple(heads), cells)}\n\nAt the median over samples, greedy fields have "
        f"{', '.join(above[:-1])} and {above[-1]} more energy than the best known field."
    )


def is_solved(row: dict[str, str]) -> bool:
    """Whether a run ended within its CPU seconds with a proven optimum, by its status or its bound."""
    if not row["objective"] or float(row["cpu"]) > 1.05 * float(row["limit"]):
        return False
    if row["status"] in {"optimal-global", "optimal-local", "optimal"}:  # the problems are convex
        return True
    objective = float(row["objective"])
    near = bool(row["bound"]) and objective - float(row["bound"]) <= SAME * max(1.0, abs(objective))
    return near and row["status"] != "unknown"


def solved_instances() -> str:
    """Numbers of instances that at least one solver solves, by size, formulation and start."""
    about = {
        row["instance"]: min(PAIRS, key=lambda count: abs(count / int(row["pairs"]) - 1))
        for row in read_rows("evidence/solver-instances.csv")
    }
    solved: dict[tuple[str, str], set[str]] = defaultdict(set)
    ran: Counter[tuple[str, str, int]] = Counter()
    kinds = {"gurobi": "free editions", "cplex": "free editions", "xpress": "free editions", "prove": "prove"}
    for row in read_rows("evidence/runs/solvers.csv"):
        if (row["turns"], row["limit"]) == ("0", "300") and row["status"] != "too large":
            kind = row["formulation"], kinds.get(row["solver"], row["start"])
            ran[*kind, about[row["instance"]]] += 1
            solved[kind] |= {row["instance"]} if is_solved(row) else set()
    titles = {
        "cold": "cold", "tightened": "tightened", "free editions": "cold, commercial", "prove": "`prove`",
    }  # fmt: skip
    lines = []
    for formulation in ("milp-mccormick", "miqp-exact"):
        for kind, title in titles.items():
            counts = Counter(about[name] for name in solved[formulation, kind])
            cells = (str(counts[pairs]) if ran[formulation, kind, pairs] else "-" for pairs in PAIRS)
            lines.append([f"`{formulation}`, {title}", *cells])
    return markdown(("file and start", *(f"{pairs} pairs" for pairs in PAIRS)), lines)


def hours_of_solvers() -> str:
    """Sentence on the runs of an hour."""
    runs: dict[bool, list[bool]] = defaultdict(list)
    for row in read_rows("evidence/solvers-in-an-hour.csv"):
        runs[row["solver"] == "prove"].append(row["solved"] == "yes")
    return (
        f"In an hour, on two instances with about 100 pairs, HiGHS, SCIP and CBC solve {sum(runs[False])} of "
        f"{len(runs[False])} cold files of `milp-mccormick`, and `prove` solves {sum(runs[True])} of "
        f"{len(runs[True])} problems ([rows](evidence/solvers-in-an-hour.csv))."
    )


# Other pages


def cycles() -> str:
    """Sentence on SCIP and HiGHS with windows and with cycles."""
    rows = read_rows("mathematics/cycles.csv")
    seconds: dict[tuple[str, ...], dict[str, float]] = defaultdict(dict)
    for row in rows:
        if row["status"] == "optimal-global":
            kind = row["solver"], row["formulation"], row["limits"]
            seconds[kind][row["instance"]] = float(row["cpu"])
    windows, cycle = seconds["highs", "milp-orthogonal", "False"], seconds["highs", "milp-cycle", "False"]
    return (
        f"Of {len({row['instance'] for row in rows})} instances, within 300 CPU seconds, SCIP proves "
        f"{len(seconds['scip', 'miqp-orthogonal', 'False'])} as `miqp-orthogonal`, "
        f"{len(seconds['scip', 'miqp-cycle', 'False'])} as `miqp-cycle`, and "
        f"{len(seconds['scip', 'miqp-cycle', 'True'])} with limits. HiGHS proves {len(windows)} as "
        f"`milp-orthogonal` and {len(cycle)} as `milp-cycle` (`disc` in {cycle['disc']:.1f} instead of "
        f"{windows['disc']:.1f} s, `skew 15` in {cycle['skew 15']:.1f} instead of "
        f"{windows['skew 15']:.1f} s)."
    )


def proofs() -> str:
    """Sentences on small instances, compared with other solvers, and on public drawings."""
    small = [row for row in read_rows("proofs/optima.csv") if row["other"]]
    apart = [abs(float(row["energy"]) - float(row["other"])) / max(1.0, float(row["other"])) for row in small]
    same = sum(error <= SAME and row["status"] == "optimal" for error, row in zip(apart, small, strict=True))
    rows = [row for row in read_rows("proofs/sketches.csv") if row["part"] == "collections"]
    gaps = [100 * float(row["gap"]) for row in rows if row["status"] != "optimal"]
    most = [gap for gap in gaps if gap >= 5]
    limits = Counter(float(row["limit"]) for row in rows)
    return (
        f"On {same} of {len(small)} small instances, CPLEX or Gurobi proves the same optimum "
        f"([list](proofs/optima.csv)). Of {len(rows)} public drawings at 24 pixels, {len(gaps)} keep gaps: "
        f"{sum(gap < 1 for gap in gaps)} below 1 %, {sum(1 <= gap < 5 for gap in gaps)} of 1 to 5 %, and "
        f"{len(most)} of {span(most, 0)} %, in {limits.most_common()[0][0]:g} s or, for "
        f"{limits.most_common()[1][1]} drawings, {limits.most_common()[1][0]:g} s."
    )


def meshes() -> str:
    """Sentences on greedy and best known fields of meshes."""
    rows = {row["mesh"]: row for row in read_rows("meshes/energies.csv")}
    above = {name: float(row["greedy above best"].removesuffix(" %")) for name, row in rows.items()}
    worse = [value for value in above.values() if value > 0]
    most = max(above, key=lambda name: above[name])
    proven = sum(row["gap"] == "0, proven" for row in rows.values())
    other = [
        f"`{name}` {row['singularities, greedy']} instead of {row['singularities, best']}"
        for name, row in rows.items()
        if row["singularities, greedy"] != row["singularities, best"]
    ]
    return (
        f"On {len(worse)} of {len(rows)} meshes, the greedy field is above the best known field, by "
        f"{span(worse, 1)} % of its energy (`{most}`). {proven} of the best fields are proven optimal. The "
        f"numbers of singularities differ on {len(other)} meshes: {'; '.join(other)}."
    )


def texts() -> Iterator[tuple[str, str, str]]:
    """Page, name of the place and text of every number."""
    yield "evidence.md", "hidden", hidden_curves()
    yield "evidence.md", "surfaces", known_surfaces()
    yield "evidence.md", "weight", missed_strokes()
    yield "evidence.md", "energy", energy_and_error()
    yield "evidence.md", "solved", solved_instances()
    yield "evidence.md", "hour", hours_of_solvers()
    yield "mathematics.md", "cycles", cycles()
    yield "proofs.md", "proofs", proofs()
    yield "notebooks/mesh.md", "findings", meshes()
