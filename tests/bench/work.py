"""One measurement in its own process: `python work.py JSON` prints seconds, CPU seconds,
bytes and peak memory as JSON.

A task is a function that prepares what is not measured and gives the function that is. The same small model
goes through it first, so that imports and compiled expressions, which a process pays once, count for nobody.
"""

from __future__ import annotations

import gc
import json
import os
import resource
import shutil
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from crossfield.export.formats.registry import FORMATS, carried, write
from crossfield.models.formulations.problem import Problem, formulate
from crossfield.models.instance.instance import Instance

Measured = Callable[[], object]
WARM = 6
"""Pixels per side of the warm-up model."""
ONCE = 5.0
"""Seconds above which a task is measured once, instead of three times."""


def square(size: int) -> Instance:
    """A full square of pixels, a fifth of them with a stroke, each in its own direction."""
    row, column = np.mgrid[:size, :size]
    pixels = np.argwhere((7 * row + 3 * column) % 5 == 0)
    theta = (2 * np.arctan2(pixels[:, 0] + 0.5, pixels[:, 1] + 0.5) + 1e-3 * pixels[:, 0]) % np.pi
    w = 0.1 + 0.9 * ((13 * pixels[:, 0] + 7 * pixels[:, 1]) % 101) / 101
    return Instance("square", np.ones((size, size), dtype=bool), pixels, theta, w)


def formulated(name: str, instance: Instance) -> Problem:
    """The problem; where jumps are data, they are 0."""
    pairs = len(instance.grid.first)
    return formulate(instance, name, p=np.zeros(pairs, np.int32) if name == "qp-fixed" else None)


def ours(
    instance: Instance, formulation: str, suffix: str, path: Path, dialect: str | None = None
) -> Measured:
    """From the instance to the closed file, with names, hash and, for .nl, the files of names."""
    return lambda: write(formulated(formulation, instance), path, dialect=dialect)


def pyomo(instance: Instance, formulation: str, suffix: str, path: Path) -> Measured:
    """Pyomo: building the model, and its own writer with numbered names."""
    from crossfield.export.formats.pyomo_model import to_pyomo

    def run() -> None:
        problem = formulated(formulation, instance)
        held = carried(problem, FORMATS[suffix]) if suffix in {"lp", "mps"} else problem
        form = {"nl": "nl_v2", "lp": "lp_v2", "mps": "mps", "gms": "gams"}[suffix]
        to_pyomo(held).write(str(path.with_suffix(f".{form}")), format=form)
        path.with_suffix(f".{form}").replace(path)

    return run


def linopy(instance: Instance, formulation: str, suffix: str, path: Path) -> Measured:
    """linopy: building the model from whole arrays, and its LP writer or, for MPS,
    that of HiGHS behind it.
    """
    import linopy as lib
    import xarray as xr

    def expression(model: Any, dim: str, terms: list[tuple[Any, Any]], count: int) -> Any:
        columns = np.stack([column for column, _ in terms], axis=1)
        values = np.stack([np.broadcast_to(value, (count,)) for _, value in terms], axis=1).astype(float)
        data = {"coeffs": ((dim, "_term"), values), "vars": ((dim, "_term"), columns)}
        return lib.LinearExpression(xr.Dataset(data, coords={dim: np.arange(count)}), model)

    def run() -> None:
        problem = formulated(formulation, instance)
        model = lib.Model()
        for block in problem.blocks.values():
            lower, upper = (xr.DataArray(end, dims=block.over) for end in (block.lower, block.upper))
            model.add_variables(lower, upper, name=block.name, integer=block.integer)
        for family in problem.rows:
            terms = [(term.factors[0], term.coefficient) for term in family.of_degree(1)]
            left = expression(model, family.family.tag, terms, family.count)
            sense = {"==": "="}.get(family.family.sense, family.family.sense)
            right = xr.DataArray(family.limit, dims=family.family.tag)
            model.add_constraints(left, sense, right, name=family.family.tag)
        index, cost = problem.merged_objective(1)
        model.add_objective(expression(model, "cost", [(index[:, 0], cost)], len(cost)).sum())
        model.to_file(path, progress=False)

    return run


def highs(instance: Instance, formulation: str, suffix: str, path: Path) -> Measured:
    """HiGHS: a model passed as whole arrays, with our names left out, and its writeModel."""
    from crossfield.models.formulations.arrays import highs_of

    def run() -> None:
        arrays = formulated(formulation, instance).to_arrays(names=False)
        highs_of(arrays, "square").writeModel(str(path))

    return run


def copied(
    instance: Instance, formulation: str, suffix: str, path: Path, dialect: str | None = None
) -> Measured:
    """Write the bytes of the finished file at once: no writer can be faster."""
    write(formulated(formulation, instance), path, dialect=dialect)
    data = path.read_bytes()
    copy = path.with_name("copy")

    def run() -> None:
        with copy.open("wb") as stream:
            stream.write(data)

    return run


def everything(instance: Instance, formulation: str, suffix: str, path: Path, jobs: int = 1) -> Measured:
    """Every format of one formulation, or of all, as `crossfield export` writes them."""
    from crossfield.export.bundle.manifest import write_all
    from crossfield.models.formulations.catalogue import FORMULATIONS

    names = [formulation] if formulation != "all" else list(FORMULATIONS)
    return lambda: write_all(instance, path.with_name("set"), formulations=names, jobs=jobs)


def solution(instance: Instance, formulation: str, suffix: str, path: Path) -> Measured:
    """A solution file, `highs` or `ampl`, to a field: read, mapped, rounded, cut into angles and jumps."""
    from crossfield.export.solutions.solution import read_solution

    problem = formulated(formulation, instance)
    point = np.random.default_rng(1).normal(size=problem.n_columns)
    point[problem.integer] = np.round(point[problem.integer])
    (write_highs if suffix == "highs" else write_ampl)(path, problem, point)
    return lambda: read_solution(path, formulated(formulation, instance)).field


def write_highs(path: Path, problem: Problem, point: Any) -> None:
    """A solution file as HiGHS writes it."""
    from crossfield.export.writing.names import Names
    from crossfield.export.writing.records import render, words

    head = (
        f"Model status\nOptimal\n\n# Primal solution values\nFeasible\nObjective 0\n# Columns {len(point)}\n"
    )
    names = Names(problem)
    with path.open("wb") as stream:
        stream.write(head.encode())
        for block in problem.blocks.values():
            parts = [names.of(block), b" ", words(point[block.slice]), b"\n"]
            stream.writelines(render(parts, block.count))
        stream.write(b"# Rows 0\n")


def write_ampl(path: Path, problem: Problem, point: Any) -> None:
    """A solution file as the AMPL Solver Library writes it."""
    from crossfield.export.formats.nl import Layout
    from crossfield.export.writing.records import render, words

    counts = (3, 1, 1, 0, problem.n_rows, 0, len(point), len(point))
    with path.open("wb") as stream:
        stream.write(b"optimal solution found\n\nOptions\n" + b"".join(b"%d\n" % count for count in counts))
        stream.writelines(render([words(point[Layout(problem).order]), b"\n"], len(point)))
        stream.write(b"objno 0 0\n")


TASKS = {
    task.__name__: task
    for task in (
        ours,
        pyomo,
        linopy,
        highs,
        copied,
        everything,
        solution,
    )
}


def peak_memory() -> int:
    """The largest resident size of this process so far, in bytes."""
    status = Path("/proc/self/status")
    if status.exists():  # ru_maxrss counts what the parent had before this program was loaded
        return 1024 * int(status.read_text().split("VmHWM:")[1].split()[0])
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024)


def measured(task: str, size: int, folder: str, *, once: bool = False, **given: Any) -> dict[str, Any]:
    """Measure a task, after the small model and after unmeasured preparation.

    Median of three, or one run when it is long.

    once: one run, and no small model first.
    """
    path = Path(folder) / f"model.{given['suffix']}"
    if not once:
        TASKS[task](square(WARM), path=path, **given)()
    run = TASKS[task](square(size), path=path, **given)
    before = (lambda: None) if task == "solution" else (lambda: remove_written(path))
    first = timed(run, before)
    memory = peak_memory()
    runs = [first] if once or first["seconds"] > ONCE else [first, timed(run, before), timed(run, before)]
    middle = sorted(runs, key=lambda found: float(found["seconds"]))[len(runs) // 2]
    written = path.stat().st_size if path.exists() else 0
    return middle | {"memory": memory, "bytes": written, "runs": len(runs), "load": os.getloadavg()[0]}


def remove_written(path: Path) -> None:
    """Every run writes new files: to replace one, a file system may send the new blocks to the disk at once,
    as ext4 does.
    """
    for old in (path, path.with_suffix(".row"), path.with_suffix(".col"), path.with_name("copy")):
        old.unlink(missing_ok=True)
    shutil.rmtree(path.with_name("set"), ignore_errors=True)


def timed(run: Measured, before: Measured) -> dict[str, Any]:
    """Wall and CPU seconds of one run, and its result. before: unmeasured preparation."""
    before()
    gc.collect()
    cpu, wall = time.process_time(), time.perf_counter()
    result = run()
    found = {"seconds": time.perf_counter() - wall, "cpu": time.process_time() - cpu}
    return found | (result if isinstance(result, dict) else {})


if __name__ == "__main__":
    print(json.dumps(measured(**json.loads(sys.argv[1]))))
