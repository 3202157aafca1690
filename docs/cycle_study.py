"""Measure what cycles and limits of residuals do for solvers; the rows go to docs/studying/data/cycles.csv.

    python docs/cycle_study.py [--minutes N] [--limit SECONDS] [--data FILE]
    python docs/cycle_study.py --skewed [--limit SECONDS] [--data FILE]
    python docs/cycle_study.py --page

It does the runs that have no row yet, one after the other on one thread, and continues after an interruption.
Each solver reads a file without a start. Other work on the machine delays runs: the rows have the processor
time too. --skewed adds rows of cycles and limits to the file of miqp-exact, for crosses that may be skewed.
--page draws the plots of docs/cycles.md.
"""

from __future__ import annotations

import argparse
import os
import resource
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass, fields, replace
from itertools import pairwise
from pathlib import Path
from typing import Final

# Every run is on one thread: libraries read this when they are loaded, here and in all children.
os.environ |= dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"), "1")

import crossfield as cf
import numpy as np
from crossfield.export.solvers_table import SOLVERS
from crossfield.export.solving.local import Solvers
from crossfield.export.statuses import Status
from crossfield.models.errors import CrossfieldError, UnsupportedBySolverError
from crossfield.models.formulations.names import column_names
from crossfield.models.formulations.residuals import limit_residuals
from crossfield.models.instance.cycles import find_cycles
from crossfield.models.instance.instance import Instance
from crossfield.models.instance.mesh import Mesh
from crossfield.models.mesh.shapes import blocks
from studying.plots import open_panels, styles
from studying.rows import DATA as FOLDER
from studying.rows import Keyed, Row, Rows
from studying.solvers.plan import make_instance
from studying.solvers.statistics import FAILED, TOO_LARGE

DATA: Final = FOLDER / "cycles.csv"
SKEWED_DATA: Final = FOLDER / "cycles-skewed.csv"
PAGE: Final = Path(__file__).parent / "cycles.md"
LIMIT: Final = 60.0
GAP: Final = 1e-4
MESHES: Final = ("tetrahedron", "cube", "disc", "doughnut", "icosphere")
GRIDS: Final = ("pixels 5 7001", "mouse 8", "mouse 11", "skew 15")
"""Sketches of the study of solvers with some 25, 50, 100 and 200 pairs, with right angles."""
TWO_NORM: Final = (
    ("miqp-exact", False),
    ("miqp-orthogonal", False),
    ("miqp-orthogonal", True),
    ("miqp-cycle", False),
    ("miqp-cycle", True),
)
ONE_NORM: Final = (("milp-mccormick", False), ("milp-orthogonal", False), ("milp-cycle", False))
"""Formulations, and whether with limits."""


@dataclass(frozen=True)
class Run(Keyed):
    """One run."""

    instance: str
    formulation: str
    limits: bool
    solver: str


FOUND: Final = (
    "pairs", "integers", "columns", "limit", "version", "status", "objective", "bound", "cpu", "wall",
    "nodes", "note",
)  # fmt: skip


def runs() -> Iterator[Run]:
    """All runs, the most useful ones first."""
    for solvers, formulations in (
        (("scip", "gurobi"), TWO_NORM),
        (("highs", "scip", "cbc"), ONE_NORM),
        (("bonmin",), TWO_NORM),
    ):
        for name in (*MESHES, *GRIDS):
            for solver in solvers:
                yield from (Run(name, *formulation, solver) for formulation in formulations)


def instance_of(name: str) -> Instance:
    """The instance of that name, with orthogonal crosses."""
    if name in GRIDS:
        return replace(make_instance(name), orthogonal=True)
    if name in {"disc", "doughnut"}:
        return cf.sample(name)
    if name == "cube":
        return _with_features(name, blocks(np.ones((2, 2, 2), dtype=bool)))
    import trimesh

    shape = trimesh.creation.icosphere(1) if name == "icosphere" else trimesh.creation.icosahedron()
    if name == "tetrahedron":
        corners = [[1, 1, 1], [-1, 1, -1], [1, -1, -1], [-1, -1, 1]]
        return _without_strokes(name, np.array(corners, float), [[0, 2, 1], [0, 3, 2], [0, 1, 3], [1, 2, 3]])
    return _without_strokes(name, np.round(shape.vertices, 9), shape.faces)


def _without_strokes(name: str, vertices: np.ndarray, faces: object) -> Instance:
    mesh = Mesh(np.asarray(vertices, dtype=float), np.asarray(faces, dtype=np.int32))
    return Instance.on_faces(name, mesh, np.zeros(0, np.int32), np.zeros(0), np.zeros(0))


def _with_features(name: str, mesh: Mesh) -> Instance:
    from crossfield.models.mesh.strokes import combine_strokes, feature_edges

    edges = feature_edges(mesh, sharp=35.0, boundary=True, lines=np.zeros((0, 2), np.int32))
    return Instance.on_faces(name, mesh, *combine_strokes(mesh, edges, None)[:3], stroke_coefficient=20.0)


def measure(run: Run, limit: float) -> Row:
    """The row of a run."""
    options = {"limits": True} if run.limits else {}
    problem = cf.formulate(instance_of(run.instance), run.formulation, **options)
    facts: Row = {
        "pairs": len(problem.instance.domain.first), "integers": int(problem.integer.sum()),
        "columns": problem.n_columns, "limit": limit,
    }  # fmt: skip
    began, before = time.monotonic(), _child_seconds()
    try:
        with Solvers() as solvers, tempfile.TemporaryDirectory(prefix="crossfield-cycles-") as folder:
            facts["version"] = solvers.version(run.solver)
            began = time.monotonic()
            limits = cf.Limits(limit, GAP, 1)
            solution = solvers.solve(problem, run.solver, folder=folder, limits=limits)
            facts["wall"] = time.monotonic() - began
    except UnsupportedBySolverError as error:
        return facts | {"status": TOO_LARGE, "note": str(error)}
    except CrossfieldError as error:
        return facts | {"status": FAILED, "note": str(error), "wall": time.monotonic() - began}
    facts |= {"status": str(solution.status), "bound": solution.bound, "nodes": solution.nodes}
    facts["objective"] = None if solution.point is None else solution.objective
    return facts | {"cpu": _child_seconds() - before, "note": solution.doubt}


@dataclass(frozen=True)
class Skewed(Keyed):
    """A run with crosses that may be skewed: miqp-exact with limits of d, rows of cycles, or both."""

    instance: str
    limits: bool
    cycles: bool
    solver: str


_FEW: Final = ("pixels 5 7001", "singular 8", "mouse 8")
_MORE: Final = ("cylinder_bend 11", "bottle 11", "straight 5 7005", "curved 5 7009", "skew 8")
SKEWED: Final = tuple(
    Skewed(name, limits, cycles, solver)
    for solver, names in (("scip", _FEW), ("cplex", (*_FEW, *_MORE)))
    for name in names
    for limits, cycles in ((False, False), (True, False), (False, True), (True, True))
)


def extended_model(run: Skewed, path: Path) -> None:
    """Write miqp-exact as LP, with |d| <= pi/2 (1 - r), and an integer column and a row for each cycle."""
    instance = make_instance(run.instance)
    problem = cf.formulate(instance, "miqp-exact")
    cf.write(problem, path)
    text = path.read_text()
    block = problem.blocks["d"]
    names = [
        name.tobytes().rstrip(b"\0").decode() for name in column_names(instance, problem.blocks)[block.slice]
    ]
    most = np.full(block.count, np.pi)
    if run.limits:
        most = 2 * limit_residuals(instance)[0]
        for name, end in zip(names, most.tolist(), strict=True):
            text = text.replace(f" -inf <= {name} <= +inf\n", f" -{end!r} <= {name} <= {end!r}\n")
    if run.cycles:
        cycles = find_cycles(instance.domain, np.zeros(0, np.int32))
        steps = [range(*ends) for ends in pairwise(cycles.start.tolist())]
        sums = ["".join(f" {cycles.sign[at]:+d} {names[cycles.pair[at]]}" for at in of) for of in steps]
        rows = [f" cyc_{n}:{line} -1.5707963267948966 k_{n} = 0\n" for n, line in enumerate(sums)]
        reach = [int(sum(most[cycles.pair[at]] for at in of) / (np.pi / 2)) for of in steps]
        bounds = [f" -{end} <= k_{n} <= {end}\n" for n, end in enumerate(reach)]
        text = text.replace("Bounds\n", "".join(rows) + "Bounds\n" + "".join(bounds), 1)
        integers = "".join(f" k_{n}\n" for n in range(len(rows)))
        text = text.replace("Generals\n", "Generals\n" + integers, 1)
    path.write_text(text)


def measure_skewed(run: Skewed, limit: float) -> Row:
    """The row of a run with an extended model."""
    with tempfile.TemporaryDirectory(prefix="crossfield-cycles-") as folder:
        path = Path(folder) / "model.lp"
        extended_model(run, path)
        began = time.monotonic()
        status, objective, bound, nodes, version = _ANSWERS[run.solver](path, limit)
    facts: Row = {"formulation": "miqp-exact", "status": status, "objective": objective, "bound": bound}
    return facts | {"limit": limit, "wall": time.monotonic() - began, "nodes": nodes, "version": version}


def _answer_of_scip(path: Path, limit: float) -> tuple[str, float | None, float, int, str]:
    from pyscipopt import Model

    model = Model()
    model.hideOutput()
    model.readProblem(str(path))
    model.setParams({"limits/time": limit, "limits/gap": GAP})
    model.optimize()
    objective = model.getObjVal() if model.getNSols() else None
    return model.getStatus(), objective, model.getDualbound(), model.getNTotalNodes(), str(model.version())


def _answer_of_cplex(path: Path, limit: float) -> tuple[str, float | None, float, int, str]:
    import cplex

    model = cplex.Cplex(str(path))
    for stream in (model.set_log_stream, model.set_results_stream, model.set_warning_stream):
        stream(None)
    model.parameters.threads.set(1)
    model.parameters.timelimit.set(limit)
    model.parameters.mip.tolerances.mipgap.set(GAP)
    model.solve()
    answer = model.solution
    objective = answer.get_objective_value() if answer.is_primal_feasible() else None
    bound, nodes = answer.MIP.get_best_objective(), answer.progress.get_num_nodes_processed()
    status = "optimal" if "optimal" in answer.get_status_string() else "limit"
    return status, objective, bound, nodes, model.get_version()


_ANSWERS: Final = {"scip": _answer_of_scip, "cplex": _answer_of_cplex}


def _child_seconds() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def table(path: Path, kind: type[Keyed] = Run) -> Rows:
    """The rows of a file of runs of a kind."""
    words = {"instance", "formulation", "limits", "cycles", "solver", "version", "status", "note"}
    asked = tuple(field.name for field in fields(kind))
    return Rows(path, asked, FOUND, frozenset(asked + FOUND) - words)


def main() -> None:
    """Do the runs that are left, or write the page."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--minutes", type=float, default=1e9)
    parser.add_argument("--limit", type=float, default=LIMIT)
    parser.add_argument("--data", type=Path)
    parser.add_argument("--skewed", action="store_true")
    parser.add_argument("--page", action="store_true")
    options = parser.parse_args()
    if options.page:
        rows = table(DATA).rows
        draw_runs(rows, TWO_NORM, ("scip", "gurobi"), PAGE.parent / "pictures" / "cycles_squares.svg")
        draw_runs(rows, ONE_NORM, ("highs", "scip", "cbc"), PAGE.parent / "pictures" / "cycles_values.svg")
        return
    kind, planned = (Skewed, SKEWED) if options.skewed else (Run, runs())
    results = table(options.data or (SKEWED_DATA if options.skewed else DATA), kind)
    end = time.monotonic() + 60 * options.minutes
    for run in planned:
        if run.key in results.done or time.monotonic() > end:
            continue
        row = measure_skewed(run, options.limit) if isinstance(run, Skewed) else measure(run, options.limit)
        results.append(run, row)
        print(f"{run}: {row['status']}, {row.get('wall') or 0:.1f} s", file=sys.stderr, flush=True)


def draw_runs(
    rows: list[Row], formulations: tuple[tuple[str, bool], ...], solvers: tuple[str, ...], path: Path
) -> None:
    """Plot the runs of solvers, a panel each: a line per instance, a mark per formulation."""
    runs = {
        (row["solver"], row["instance"], (row["formulation"], row["limits"] == "True")): row
        for row in rows
        if row["status"] not in {TOO_LARGE, FAILED}
    }
    best: dict[str, float] = {}
    for (_, name, form), row in runs.items():
        if row["objective"] is not None and form in formulations:
            best[name] = min(row["objective"], best.get(name, np.inf))
    titles = {form: f"{form[0]}{', limits' * form[1]}" for form in formulations}
    looks = styles(list(titles.values()))
    limit = max(row["limit"] for (by, _, form), row in runs.items() if by in solvers and form in formulations)
    seconds = [*(each for each in _SECONDS if each < limit / 5), limit]
    ticks = [*(_place_of_seconds(each, limit) for each in seconds), *map(_place_of_gap, (0.0, 0.5, 1.0))]
    words = [*(f"{each:g} s" for each in seconds), "0 %", "50 %", "100 %"]
    with open_panels(path, len(solvers), high=0.7 + 2.3 * len(solvers), wide=WIDE, stacked=True) as axes:
        for axis, solver in zip(axes, solvers, strict=True):
            names = [
                name
                for name in (*MESHES, *GRIDS)
                if any((solver, name, form) in runs for form in formulations)
            ]
            for form, title in titles.items():
                mine = [(number, runs.get((solver, name, form))) for number, name in enumerate(names)]
                points = [(_place(row, best[names[number]], limit), number) for number, row in mine if row]
                look = looks[title] | {"linestyle": "none", "markersize": 7, "alpha": 0.85}
                axis.plot(*zip(*points, strict=True), label=title, **look)
            version = next(row["version"] for row in rows if row["solver"] == solver).split(" ")[0]
            axis.set_title(
                f"{SOLVERS[solver].title} {version}: proven in, or gap after {limit:g} s", fontsize=9
            )
            axis.set_xticks(ticks, words)
            axis.set_yticks(range(len(names)), names)
            axis.axvline((1 + _place_of_gap(0)) / 2, color="#888888", linewidth=0.8)
            axis.set(xlim=(-0.04, ticks[-1] + 0.04), ylim=(len(names) - 0.5, -0.5))
        axes[0].figure.legend(*axes[0].get_legend_handles_labels(), loc="outside upper center", ncols=2)


WIDE: Final = 4.9
"""Inches, for words that are legible on a phone."""
_SECONDS: Final = (0.1, 1.0, 10.0)


def _place(row: Row, best: float, limit: float) -> float:
    """Place on the axis: seconds to a proven optimum, or the gap to the best objective of all runs."""
    if row["status"] in {str(Status.OPTIMAL_GLOBAL), str(Status.OPTIMAL_LOCAL)}:  # all are convex
        return _place_of_seconds(row["wall"], limit)
    return _place_of_gap(1 - max(row["bound"] or 0.0, 0.0) / best)


def _place_of_seconds(seconds: float, limit: float) -> float:
    return float(np.log(max(seconds, 0.05) / 0.05) / np.log(limit / 0.05))


def _place_of_gap(gap: float) -> float:
    return 1.25 + 0.8 * gap


if __name__ == "__main__":
    main()
