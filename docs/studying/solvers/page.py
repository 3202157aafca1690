"""Tables and sentences on the runs of solvers."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterable
from typing import Any, Final

import crossfield as cf
import numpy as np
from crossfield.export.solvers_table import SOLVERS

from ..rows import Row, Table
from ..wording import series
from . import statistics
from .plan import COMMERCIAL, PAIRS, PROBLEMS, PROVE, STARTS, Plan, make_instance
from .statistics import (
    FAILED,
    TOO_LARGE,
    contradicted,
    gap,
    interval,
    is_solved,
    seconds,
    shifted_geometric_mean,
)

Kind = tuple[str, str, str]
"""Formulation, solver and start."""
KINDS: Final[tuple[Kind, ...]] = (
    *((formulation, PROVE, "cold") for formulation in PROBLEMS),
    *((*pair, start) for start in STARTS for pair in PAIRS),
)
MISSING: Final = "-"


def solver_title(solver: str) -> str:
    """The name of a solver in a table."""
    return PROVE if solver == PROVE else SOLVERS[solver].title


def groups(rows: Iterable[Row], plan: Plan) -> dict[int, dict[Kind, list[Row]]]:
    """The rows of instances as they are, under the limit of the plan: by number of pairs and kind."""
    about = {name: count for count, names in plan.instances.items() for name in names}
    by_count: dict[int, dict[Kind, list[Row]]] = {count: defaultdict(list) for count in plan.instances}
    for row in rows:
        if row["instance"] in about and (row["turns"], row["limit"]) == (0, plan.limit):
            kind = row["formulation"], row["solver"], row["start"]
            by_count[about[row["instance"]]][kind].append(row)
    return by_count


def with_interval(values: np.ndarray, statistic: statistics.Statistic, form: str) -> str:
    """A mean with its bootstrap interval."""
    low, high = interval(values, statistic)
    return f"{statistic(values):{form}} [{low:{form}}, {high:{form}}]"


def solvers_of(formulation: str) -> list[str]:
    """The solvers that read the files of a formulation."""
    return [solver for name, solver in PAIRS if name == formulation]


def solved_table(rows: list[Row], plan: Plan) -> Table:
    """Numbers of instances that at least one solver solves, and `prove`; a dash where no file was taken."""
    cells = []
    for formulation in PROBLEMS:
        runs = (
            *((solvers_of(formulation), start, start) for start in STARTS),
            (list(COMMERCIAL), "cold", "cold, free commercial editions"),
            ([PROVE], "cold", f"`{PROVE}`"),
        )
        for names, start, words in runs:
            cells.append([f"`{formulation}`, {words}"])
            for of in groups(rows, plan).values():
                ran = [
                    row
                    for name in names
                    for row in of[formulation, name, start]
                    if row["status"] != TOO_LARGE
                ]
                solved = {row["instance"] for row in ran if is_solved(row)}
                cells[-1].append(str(len(solved)) if ran else MISSING)
    return ("file and start", *(f"{count} pairs" for count in plan.instances)), cells


def details_table(rows: list[Row], plan: Plan) -> Table:
    """Solved instances, mean seconds, PAR-10, primal-dual integrals and root bounds."""
    best = known_values(rows)
    cells = []
    for count, of in groups(rows, plan).items():
        for kind in KINDS:
            mine = of[kind]
            areas = np.array([row["integral"] for row in mine if row["integral"] is not None])
            roots = np.array(
                [
                    gap(row["root_bound"], best[problem(row)][0])
                    for row in mine
                    if row["root_bound"] is not None
                ]
            )
            cells.append(
                [
                    str(count), kind[0], solver_title(kind[1]), "" if kind[1] == PROVE else kind[2],
                    f"{sum(map(is_solved, mine))} of {len(mine)}",
                    with_interval(seconds(mine), shifted_geometric_mean, ".1f"),
                    with_interval(seconds(mine, statistics.PENALTY), statistics.mean, ".0f"),
                    _some(areas, len(mine), ".1f"), _some(100 * roots, len(mine), ".0f"),
                ]
            )  # fmt: skip
    return (
        "pairs", "formulation", "solver", "start", "solved", "CPU, s", "PAR-10, s",
        "primal-dual integral, s", "gap at the root, %",
    ), cells  # fmt: skip


def _some(values: np.ndarray, count: int, form: str) -> str:
    """A mean with its interval, and the number of its runs where others have no value."""
    if not len(values):
        return MISSING
    text = with_interval(values, statistics.mean, form)
    return text if len(values) == count else f"{text} ({len(values)} runs)"


def problem(row: Row) -> tuple[str, str]:
    """Instance and problem of a row; turned instances have the same optima."""
    return row["instance"], row["formulation"]


def known_values(rows: Iterable[Row]) -> dict[tuple[str, str], tuple[float, float]]:
    """Least energy of any run and greatest bound of `prove`, by instance and problem."""
    best: dict[tuple[str, str], float] = defaultdict(lambda: np.inf)
    bound: dict[tuple[str, str], float] = defaultdict(float)
    for row in rows:
        if row["objective"] is not None and row["status"] != "unknown":
            best[problem(row)] = min(best[problem(row)], row["objective"])
        if row["solver"] == PROVE and row["bound"] is not None:
            bound[problem(row)] = max(bound[problem(row)], row["bound"])
    return {known: (best[known], bound[known]) for known in best}


def instances_table(rows: list[Row], plan: Plan) -> Table:
    """The instances with their sizes, and the energies that `prove` finds."""
    proofs = {problem(row): row for row in rows if row["solver"] == PROVE and row["limit"] == plan.limit}
    cells = []
    for names in plan.instances.values():
        for name in names:
            instance = make_instance(name)
            problems = [cf.formulate(instance, formulation) for formulation in PROBLEMS]
            integers = {int(problem.integer.sum()) for problem in problems}
            line = [name, str(len(instance.grid.first)), str(len(instance.theta)), *map(str, integers)]
            line += [str(problem.n_columns) for problem in problems]
            cells.append(line + [_energy(proofs.get((name, formulation))) for formulation in PROBLEMS])
    return (
        "instance", "pairs", "stroke pixels", "integers",
        *(f"columns of {formulation}" for formulation in PROBLEMS), "energy, 1-norm", "energy, 2-norm",
    ), cells  # fmt: skip


def _energy(row: Row | None) -> str:
    if row is None:
        return MISSING
    text = f"{row['objective']:.6g}"
    return text if is_solved(row) else f"{text}, bound {row['bound']:.6g}"


def turned_table(rows: list[Row], plan: Plan) -> Table:
    """Solved instances and seconds of pairs on instances as they are and turned, and their variation."""
    cells = []
    for pair in PAIRS:
        of: dict[str, list[Row]] = defaultdict(list)
        for row in rows:
            mine = (row["formulation"], row["solver"], row["start"], row["limit"]) == (
                *pair,
                "cold",
                plan.limit,
            )
            if mine and row["instance"] in plan.turned:
                of[row["instance"]].append(row)
        whole = [sorted(turned, key=lambda row: row["turns"]) for turned in of.values() if len(turned) == 3]
        if not whole:
            continue
        times = np.array([seconds(turned) for turned in whole]).T
        ratio = statistics.SHIFT + times
        cells.append(
            [
                pair[0], solver_title(pair[1]), f"{len(whole)} of {len(plan.turned)}",
                *(
                    f"{sum(map(is_solved, column))}, {shifted_geometric_mean(times[turns]):.1f} s"
                    for turns, column in enumerate(zip(*whole, strict=True))
                ),
                f"{np.exp(np.log(ratio.max(axis=0) / ratio.min(axis=0)).mean()):.2f}",
            ]
        )  # fmt: skip
    heads = ("solved as it is", "turned by a quarter", "turned by a half", "slowest / fastest")
    return ("formulation", "solver", "instances", *heads), cells


def long_table(rows: list[Row], plan: Plan) -> Table:
    """The runs of an hour."""
    cells = [
        [
            row["instance"], row["formulation"], solver_title(row["solver"]),
            "yes" if is_solved(row) else "no",
            *(MISSING if row[name] is None else f"{row[name]:.6g}" for name in ("objective", "bound")),
            f"{row['cpu']:.0f}",
        ]
        for row in rows
        if row["limit"] == plan.long and row["cpu"] is not None
    ]  # fmt: skip
    return ("instance", "formulation", "solver", "solved", "objective", "bound", "CPU, s"), sorted(cells)


def editions_table(rows: list[Row], plan: Plan) -> Table:
    """Free commercial editions on the instances that all of them take, in alphabetical order."""
    cells = []
    for formulation in PROBLEMS:
        of = {
            solver: {
                row["instance"]: row
                for row in rows
                if (row["formulation"], row["solver"], row["limit"]) == (formulation, solver, plan.limit)
            }
            for solver in sorted(COMMERCIAL)
        }
        taken = (
            {name for name, row in runs.items() if row["status"] not in {TOO_LARGE, FAILED}}
            for runs in of.values()
        )
        common = sorted(set.intersection(*taken))
        if common:
            pairs = [of[COMMERCIAL[0]][name]["pairs"] for name in common]
            line = [formulation, str(len(common)), f"{min(pairs):.0f} to {max(pairs):.0f}"]
            line += [
                f"{sum(map(is_solved, mine))}, {shifted_geometric_mean(seconds(mine)):.1f} s"
                for runs in of.values()
                for mine in [[runs[name] for name in common]]
            ]
            cells.append(line)
    return (
        "formulation",
        "instances",
        "pairs",
        *(solver_title(solver) for solver in sorted(COMMERCIAL)),
    ), cells


def taken(rows: list[Row]) -> str:
    """Numbers of files that each free edition takes, by formulation."""
    return series(
        f"{solver_title(solver)} {len(statuses) - statuses.count(TOO_LARGE)} of {len(statuses)} "
        f"of `{formulation}`"
        for solver in sorted(COMMERCIAL)
        for formulation in PROBLEMS
        for statuses in [
            [row["status"] for row in rows if (row["solver"], row["formulation"]) == (solver, formulation)]
        ]
    )


def claims(rows: list[Row]) -> str:
    """Sentence on answers that contradict a proven bound or a known field, and on failures."""
    best = known_values(rows)
    ran = [row for row in rows if row["status"] != TOO_LARGE]
    wrong = [row for row in ran if problem(row) in best and contradicted(row, *best[problem(row)])]
    lost = [row for row in ran if row["status"] in {FAILED, "unknown"}]
    return (
        f"{sum(map(is_solved, ran))} of {len(ran)} runs end with a proven optimum. {len(rows) - len(ran)} "
        "more did not take place, because the file is too large for a free edition. Answers that "
        f"contradict another run: {_listed(wrong)}. Runs without a usable answer: {_listed(lost)}."
    )


def _listed(rows: list[Row]) -> str:
    """The numbers of rows by solver and formulation."""
    counts = Counter(f"{solver_title(row['solver'])} on `{row['formulation']}`" for row in rows)
    return "; ".join(f"{name} {count}" for name, count in sorted(counts.items())) or "none"


def tables(rows: list[Row], plan: Plan) -> dict[str, Table]:
    """The tables of this part by name."""
    return {
        "solver-instances": instances_table(rows, plan),
        "solved": solved_table(rows, plan),
        "solvers": details_table(rows, plan),
        "solvers-turned": turned_table(rows, plan),
        "solvers-in-an-hour": long_table(rows, plan),
        "solvers-free-editions": editions_table(rows, plan),
    }


def sentences(rows: list[Row], plan: Plan) -> dict[str, Any]:
    """The sentences of this part by name."""
    _, solved = solved_table(rows, plan)
    ratios = sorted(line[-1] for line in turned_table(rows, plan)[1])
    long_runs = [row for row in rows if row["limit"] == plan.long and row["cpu"] is not None]
    closed = [row for row in long_runs if is_solved(row)]
    return {
        "claims": claims(rows),
        "taken": taken(rows),
        "solved_cold": series(solved[0][1:]),
        "solvers": " or of ".join(
            f"{series(map(solver_title, solvers_of(formulation)))} (`{formulation}`)"
            for formulation in PROBLEMS
        ),
        "turned": f"{ratios[0]} to {ratios[-1]}",
        "long_by_solvers": sum(row["solver"] != PROVE for row in closed),
        "long_runs": sum(row["solver"] != PROVE for row in long_runs),
        "long_by_prove": sum(row["solver"] == PROVE for row in closed),
    }
