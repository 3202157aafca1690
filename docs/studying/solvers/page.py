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
from .plan import COMMERCIAL, LONG, PAIRS, PROBLEMS, PROVE, STARTS, Plan, Run, make_instance, run_of
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
    return f"`{PROVE}`" if solver == PROVE else SOLVERS[solver].title


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


def count_solved(rows: list[Row]) -> str:
    """Number of solved runs."""
    return f"{sum(map(is_solved, rows))} of {len(rows)}"


def solved_table(rows: list[Row], plan: Plan) -> Table:
    """Solved instances and mean seconds of every kind; means of complete groups alone."""
    by_count = groups(rows, plan)
    cells = []
    for formulation, solver, start in KINDS:
        line = [f"`{formulation}`", solver_title(solver), "" if solver == PROVE else start]
        for count, names in plan.instances.items():
            mine = by_count[count][formulation, solver, start]
            text = count_solved(mine) if mine else MISSING
            if len(mine) == len(names):
                text += f", {with_interval(seconds(mine), shifted_geometric_mean, '.1f')} s"
            elif mine:
                text += f" so far, {len(names)} planned"
            line.append(text)
        cells.append(line)
    heads = (f"about {count} pairs, {2 * count} integers" for count in plan.instances)
    return ("formulation", "solver", "start", *heads), cells


def details_table(rows: list[Row], plan: Plan) -> Table:
    """PAR-10, primal-dual integrals and root bounds of complete groups."""
    best = known_values(rows)
    cells = []
    for count, of in groups(rows, plan).items():
        for kind in KINDS:
            mine = of[kind]
            if len(mine) < len(plan.instances[count]):
                continue
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
                    str(count), f"`{kind[0]}`", solver_title(kind[1]), "" if kind[1] == PROVE else kind[2],
                    with_interval(seconds(mine, statistics.PENALTY), statistics.mean, ".0f"),
                    _some(areas, len(mine), ".1f"), _some(100 * roots, len(mine), ".0f"),
                ]
            )  # fmt: skip
    return (
        "pairs", "formulation", "solver", "start", "PAR-10, s", "primal-dual integral, s",
        "gap at the root, %",
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
        *(f"columns of `{formulation}`" for formulation in PROBLEMS), "energy, 1-norm", "energy, 2-norm",
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
                f"`{pair[0]}`", solver_title(pair[1]), f"{len(whole)} of {len(plan.turned)}",
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
            row["instance"], f"`{row['formulation']}`", solver_title(row["solver"]),
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
            line = [f"`{formulation}`", str(len(common)), f"{min(pairs):.0f} to {max(pairs):.0f}"]
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


def part_of(run: Run) -> str:
    """The part of the plan that a run belongs to."""
    if run.limit == LONG:
        return "of an hour"
    if run.solver in COMMERCIAL:
        return "of free commercial editions"
    if run.solver == PROVE:
        return "proofs"
    return "turned" if run.turns else run.start


def completeness(rows: list[Row], plan: Plan) -> str:
    """Sentences on the completed share of the plan."""
    planned = Counter(map(part_of, [*plan.first(), *plan.last([*PAIRS[: statistics.BEST]])]))
    done = Counter(part_of(run_of(row)) for row in rows)
    parts = ", ".join(f"{done[part]} of {count} {part}" for part, count in planned.items())
    text = f"{len(rows)} of {plan.size} planned runs are done: {parts}."
    missing = plan.size - len(rows)
    return (
        text if not missing else f"{text} **{missing} runs are missing**, and nothing is claimed about them."
    )


def claims(rows: list[Row]) -> str:
    """Sentence on answers that contradict a proven bound or a known field, and on failures."""
    best = known_values(rows)
    wrong = [row for row in rows if problem(row) in best and contradicted(row, *best[problem(row)])]
    lost = [row for row in rows if row["status"] in {FAILED, "unknown"}]
    return (
        f"{sum(map(is_solved, rows))} runs end with a proven optimum. Answers that contradict another run: "
        f"{_listed(wrong)}. Runs without a usable answer: {_listed(lost)}."
    )


def _listed(rows: list[Row]) -> str:
    """The numbers of rows by solver and formulation."""
    counts = Counter(f"{solver_title(row['solver'])} on `{row['formulation']}`" for row in rows)
    return "; ".join(f"{name} {count}" for name, count in sorted(counts.items())) or "none"


def answer(rows: list[Row], plan: Plan) -> list[str]:
    """Answer on the reach of solvers, for the numbers of pairs with all cold runs done; then tightened."""
    by_count = groups(rows, plan)
    said = [_reach(by_count, plan, start) for start in STARTS]
    if said[0] is None:
        unfinished = f"{len(rows)} of {plan.size} planned runs are done, and no number of pairs is complete."
        return [f"The measurement is under way: {unfinished}"]
    counts, reach = said[0]
    count = len(next(iter(plan.instances.values())))
    cold = (
        f"Of {count} instances each with about {series(counts)} pairs of pixels, the following are proven "
        f"optimal in {plan.limit:g} s on one thread, from a cold start: {reach}."
    )
    sentences = [cold, "The [tables](#how-far-solvers-get) have each solver."]
    if said[1] is not None and said[1][0] == counts:
        tightened = (
            "In the windows that a certificate of `prove` leaves, these are proven optimal, the seconds of "
            f"that proof not counted: {said[1][1]}."
        )
        sentences.insert(1, tightened)
    return sentences


def _reach(
    by_count: dict[int, dict[Kind, list[Row]]], plan: Plan, start: str
) -> tuple[list[int], str] | None:
    """The complete numbers of pairs, and how many instances any solver and `prove` solve of each."""
    kinds = [kind for kind in KINDS if kind[2] == start]
    complete = [
        count
        for count, names in plan.instances.items()
        if all(len(by_count[count][kind]) == len(names) for kind in kinds)
    ]
    if not complete:
        return None
    parts = []
    for formulation in PROBLEMS:
        mine = [kind for kind in kinds if kind[0] == formulation]
        by = [[kind for kind in mine if kind[1] != PROVE], [kind for kind in mine if kind[1] == PROVE]]
        solved = [
            f"{series(len(_solved(by_count[count], some)) for count in complete)} by "
            f"{'at least one of ' if len(some) > 1 else ''}{series(solver_title(kind[1]) for kind in some)}"
            for some in by
            if some
        ]
        parts.append(f"as `{formulation}`, {', and '.join(solved)}")
    return complete, "; ".join(parts)


def _solved(by_kind: dict[Kind, list[Row]], kinds: list[Kind]) -> set[str]:
    """The instances that at least one of the kinds solves."""
    return {row["instance"] for kind in kinds for row in by_kind[kind] if is_solved(row)}


def tables(rows: list[Row], plan: Plan) -> dict[str, Table]:
    """The tables of this part by name."""
    return {
        "solver-instances": instances_table(rows, plan),
        "solvers": solved_table(rows, plan),
        "solvers-in-detail": details_table(rows, plan),
        "solvers-turned": turned_table(rows, plan),
        "solvers-in-an-hour": long_table(rows, plan),
        "solvers-free-editions": editions_table(rows, plan),
    }


def sentences(rows: list[Row], plan: Plan) -> dict[str, Any]:
    """The sentences of this part by name."""
    machines = sorted({row["machine"] for row in rows if row["machine"]})
    versions = sorted({f"{solver_title(row['solver'])} {row['version']}" for row in rows if row["version"]})
    return {
        "solvers_done": completeness(rows, plan),
        "claims": claims(rows),
        "solver_machine": "; ".join(machines),
        "solver_versions": ", ".join(versions),
    }
