"""Make docs/bounds.md, the limits of open MIP solvers: `python docs/bounds.py` (some five minutes)."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import crossfield as cf
import highspy
import numpy as np
from crossfield.export.programs.highs import loaded
from crossfield.models.formulations.problem import Problem
from crossfield.models.instance.instance import Instance
from make import generated, markdown

DOCS: Final = Path(__file__).resolve().parent
SECONDS: Final = 15.0
SIDES: Final = (4, 5, 6, 7, 8)
MILP_SECONDS: Final = 30.0
TRIED: Final = tuple((4, 5, seed) for seed in range(1, 7)) + tuple((5, 5, seed) for seed in range(7, 13))
"""Height, width and seed of the instances for the trials of rows and bounds."""
RUNS: Final = (
    ("milp-mccormick", "highs", False),
    ("milp-mccormick", "highs", True),
    ("miqp-exact", "bonmin", False),
)
VARIANTS: Final = ((), ("odd cycles",), ("bounds",), ("odd cycles", "bounds"))


def instance_of(height: int, width: int, seed: int) -> Instance:
    """Random directions on two pixels in five of a full grid."""
    rng = np.random.default_rng(seed)
    pixels = np.argwhere(rng.random((height, width)) < 0.4)
    theta = rng.uniform(0, np.pi, len(pixels))
    return Instance(f"random_{seed}", np.ones((height, width), bool), pixels, theta, np.ones(len(pixels)))


def odd_cycles(problem: Problem, model: highspy.Highs) -> None:
    """Add a row for every quad C and odd subset F of its pairs.

    Sum of p1 over F minus that over C - F <= |F| - 1 + (2/pi) sum of s over C. If the sum of the p1 round C
    is odd, so is the sum of the jumps, the crosses turn, and the |A| round C add up to at least pi/2.
    """
    p1, s = (np.arange(problem.n_columns)[problem.blocks[name].slice] for name in ("p1", "s"))
    for quad in problem.instance.grid.quads:
        for subset in range(16):
            inside = np.array([subset >> place & 1 for place in range(4)])
            if inside.sum() % 2:
                columns = np.concatenate([p1[quad], s[quad]]).astype(np.int32)
                values = np.concatenate([2.0 * inside - 1, np.full(4, -2 / np.pi)])
                model.addRow(-np.inf, float(inside.sum() - 1), len(columns), columns, values)


def bounds(problem: Problem, model: highspy.Highs) -> None:
    """Bound s and t by pi/2: the two nearest jumps make |A| smaller, and |beta| is at most pi/4."""
    for name in ("s", "t"):
        for column in range(problem.n_columns)[problem.blocks[name].slice]:
            model.changeColBounds(column, 0.0, np.pi / 2)


@dataclass(frozen=True)
class Trial:
    """Result of a solve by HiGHS."""

    proven: bool
    objective: float
    bound: float
    nodes: int
    seconds: float


def strengthened(task: tuple[tuple[int, int, int], tuple[str, ...]]) -> Trial:
    """Solve the written MPS of `milp-mccormick` by HiGHS on one thread, with rows or bounds added."""
    size, chosen = task
    problem = cf.formulate(instance_of(*size), "milp-mccormick")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "model.mps"
        cf.write(problem, path)
        model = loaded(path, threads=1, time_limit=MILP_SECONDS, mip_rel_gap=1e-6)
    for name, add in (("odd cycles", odd_cycles), ("bounds", bounds)):
        if name in chosen:
            add(problem, model)
    begin = time.process_time()
    model.run()
    seconds, info = time.process_time() - begin, model.getInfo()
    proven = model.getModelStatus() == highspy.HighsModelStatus.kOptimal
    return Trial(proven, info.objective_function_value, info.mip_dual_bound, info.mip_node_count, seconds)


def strengthening() -> tuple[list[list[str]], list[list[str]]]:
    """A row for each variant over all instances, and a row for each instance and variant."""
    tasks = [(size, chosen) for size in TRIED for chosen in VARIANTS]
    with ProcessPoolExecutor() as pool:
        found = dict(zip(tasks, pool.map(strengthened, tasks), strict=True))
    rows = [
        [
            f"{height} x {width}, seed {seed}",
            " + ".join(chosen) or "as written",
            f"{each.objective:.5f}",
            f"{each.bound:.5f}",
            "yes" if each.proven else "no",
            str(each.nodes),
            f"{each.seconds:.1f}",
        ]
        for ((height, width, seed), chosen), each in found.items()
    ]
    return [
        overall(chosen, [found[size, chosen] for size in TRIED], [found[size, ()] for size in TRIED])
        for chosen in VARIANTS
    ], rows


def overall(chosen: tuple[str, ...], found: list[Trial], plain: list[Trial]) -> list[str]:
    """Results of a variant on all instances: proofs, shifted geometric means, wins in time."""
    return [
        " + ".join(chosen) or "as written",
        f"{sum(each.proven for each in found)} of {len(found)}",
        f"{shifted_mean([each.seconds for each in found], 1.0):.2f}",
        f"{shifted_mean([each.nodes for each in found], 10.0):.0f}",
        f"{sum(each.seconds < other.seconds for each, other in zip(found, plain, strict=True))}"
        if chosen
        else "",
    ]


def shifted_mean(values: list[float] | list[int], shift: float) -> float:
    """The geometric mean of values + shift, minus the shift."""
    return float(np.exp(np.mean(np.log(np.array(values) + shift))) - shift)


def closing() -> Iterator[list[str]]:
    """A row for each size and solver: MILP and relaxation by HiGHS, exact MIQP by Bonmin."""
    for side in SIDES:
        instance = instance_of(side, side, 0)
        start = cf.search(instance, rounds=10).field
        for name, solver, relax in RUNS:
            problem = cf.formulate(instance, name, relax=relax)
            found = cf.solve(problem, solver, start=start, limits=cf.Limits(SECONDS))
            proven = found.status == "optimal-global"
            yield [
                f"{side} x {side}",
                f"`{name}`" + (" relaxed" if relax else ""),
                solver,
                "" if found.objective is None else f"{found.objective:.5f}",
                "none told" if found.bound is None else f"{found.bound:.5f}",
                "yes" if proven else f"no: {found.status}",
                "" if found.seconds is None else f"{found.seconds:.1f}",
            ]


def main() -> None:
    """Solve and write the page."""
    closed = list(closing())
    sizes = markdown(("grid", "formulation", "solver", "objective", "dual bound", "proven", "s"), closed)
    means, each = strengthening()
    means_table = markdown(
        ("rows and bounds", "proven", "CPU s, mean", "nodes, mean", "quicker than as written on"), means
    )
    variants = markdown(
        ("instance", "rows and bounds", "objective", "dual bound", "proven", "nodes", "CPU s"), each
    )
    (DOCS / "bounds.md").write_text(
        PAGE.format(
            said=generated("python docs/bounds.py"),
            short=in_short(closed, means),
            seconds=SECONDS,
            sizes=sizes,
            milp_seconds=MILP_SECONDS,
            means=means_table,
            variants=variants,
        )
    )


def in_short(closed: list[list[str]], means: list[list[str]]) -> str:
    """Summary: the reach of proofs, the quality of the relaxation, and the effect of strengthening.

    Rows of the page's first two tables.
    """
    whole = {
        name: [row[0] for row in closed if row[1] == f"`{name}`" and row[5] == "yes"] for name, _, _ in RUNS
    }
    reach = {name: f"up to {grids[-1]}" if grids else "nowhere" for name, grids in whole.items()}
    relaxed = max(float(row[3]) for row in closed if row[1].endswith("relaxed"))
    plain, *others = means
    best = min(others, key=lambda row: float(row[2]))
    return (
        f"In {SECONDS:g} s HiGHS proves the optimum of `milp-mccormick` {reach['milp-mccormick']}, "
        f"and Bonmin that of `miqp-exact` {reach['miqp-exact']}. "
        f"The bound that the relaxation of the MILP gives is {relaxed:.5f} at most. "
        f'Of the rows and bounds tried to strengthen it, "{best[0]}" does best, '
        f"with a mean of {best[2]} s against {plain[2]} s as written."
    )


PAGE: Final = """# What MIP solvers do

{said}

{short}

This page is a part of [proven optima](proofs.md): the bounds of `crossfield prove` close far larger
problems, and what solvers prove of files that are [tightened by
them](proofs.md#what-mip-solvers-prove) stands there.

Random directions on two pixels in five of a full grid, {seconds:g} s each in the first table. What is proven
with other solvers, and how the search compares, stands in [energies.md](energies.md#against-proven-optima);
bounds of all entries of the instance library in its sidecars. Beyond these sizes the bounds that these
solvers give are those of the relaxation, which say next to nothing.

## How far open solvers get

{sizes}

## Strengthening the MILP

On one thread, {milp_seconds:g} s each. *Odd cycles*: for every quad C, 2 x 2 pixels, and every odd subset F
of its four pairs, the sum of p1 over F, less that over the others, is at most |F| - 1 + (2/pi) times the sum
of s over C. *Bounds*: s and t at most pi/2, which some optimum keeps.
Means are geometric, shifted by 1 s and by 10 nodes, runs that met the limit counted as they stand.

{means}

{variants}
"""

if __name__ == "__main__":
    main()
