"""The benchmark of the writers: `python tests/bench writing`.

Every measurement is a process of its own, one at a time: the option `--one JSON` prints seconds, CPU seconds,
bytes and peak memory. A small model goes through it first, so that imports and compiled
expressions, which a process pays once, count for nobody. A peer goes on to the next size as long as that
would take it about a minute and bearable memory.
"""

from __future__ import annotations

import argparse
import gc
import json
import os
import platform
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any, Final

import numpy as np
from crossfield.export.formats.registry import FORMATS, problem_in_format, write
from crossfield.models.formulations.catalogue import FORMULATIONS, list_formulations
from crossfield.models.formulations.problem import Problem, formulate
from crossfield.models.instance.instance import Instance
from machine import processor_name

MILP: Final = "milp-mccormick"
SUFFIXES: Final = ("nl", "lp", "mps", "gms")
SIZES: Final = (64, 128, 256, 512)
PEERS: Final = {"crossfield": "crossfield", "linopy": "linopy", "highs": "HiGHS", "pyomo": "Pyomo"}
PACKAGES: Final = ("numpy", "sympy", "pyomo", "linopy", "highspy")
WARM: Final = 6
"""Pixels per side of the model that goes first."""
ONCE: Final = 5.0
"""Seconds above which a writer is measured once, instead of three times."""
LONG: Final = 75.0
"""Seconds that the next size of a peer may be expected to take."""
MUCH: Final = 8e9
"""Bytes of memory that it may be expected to need."""

Row = dict[str, Any]
Writer = Callable[[Instance, str, Path], None]


# The writers: from an instance and the name of a formulation to a closed file.


def make_square(size: int) -> Instance:
    """A full square of pixels, a fifth of them with a stroke, each in its own direction."""
    row, column = np.mgrid[:size, :size]
    pixels = np.argwhere((7 * row + 3 * column) % 5 == 0)
    theta = (2 * np.arctan2(pixels[:, 0] + 0.5, pixels[:, 1] + 0.5) + 1e-3 * pixels[:, 0]) % np.pi
    w = 0.1 + 0.9 * ((13 * pixels[:, 0] + 7 * pixels[:, 1]) % 101) / 101
    return Instance.on_pixels("square", np.ones((size, size), dtype=bool), pixels, theta, w)


def make_problem(instance: Instance, name: str) -> Problem:
    """The problem; where jumps are data, they are 0."""
    pairs = len(instance.grid.first)
    return formulate(instance, name, p=np.zeros(pairs, np.int32) if FORMULATIONS[name].fixed else None)


def write_with_crossfield(instance: Instance, name: str, path: Path) -> None:
    """With names, hash and, for .nl, the files of names."""
    write(make_problem(instance, name), path)


def write_with_pyomo(instance: Instance, name: str, path: Path) -> None:
    """Pyomo: building the model, and its own writer with numbered names."""
    from crossfield.export.formats.pyomo_model import to_pyomo

    problem, suffix = make_problem(instance, name), path.suffix[1:]
    held = problem_in_format(problem, FORMATS[suffix]) if suffix in {"lp", "mps"} else problem
    kind = {"nl": "nl_v2", "lp": "lp_v2", "mps": "mps", "gms": "gams"}[suffix]
    to_pyomo(held).write(str(path.with_suffix(f".{kind}")), format=kind)
    path.with_suffix(f".{kind}").replace(path)


def write_with_linopy(instance: Instance, name: str, path: Path) -> None:
    """linopy: building the model from whole arrays, and its LP writer or, for MPS, that of HiGHS behind."""
    import linopy as lib
    import xarray as xr

    def expression(model: Any, dim: str, terms: list[tuple[Any, Any]], count: int) -> Any:
        columns = np.stack([column for column, _ in terms], axis=1)
        values = np.stack([np.broadcast_to(value, (count,)) for _, value in terms], axis=1).astype(float)
        data = {"coeffs": ((dim, "_term"), values), "vars": ((dim, "_term"), columns)}
        return lib.LinearExpression(xr.Dataset(data, coords={dim: np.arange(count)}), model)

    problem, model = make_problem(instance, name), lib.Model()
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


def write_with_highs(instance: Instance, name: str, path: Path) -> None:
    """HiGHS: a model passed as whole arrays, with our names left out, and its writeModel."""
    from crossfield.models.formulations.arrays import build_highs

    build_highs(make_problem(instance, name).to_arrays(names=False), "square").writeModel(str(path))


WRITERS: Final[dict[str, Writer]] = {
    "crossfield": write_with_crossfield,
    "linopy": write_with_linopy,
    "highs": write_with_highs,
    "pyomo": write_with_pyomo,
}


# Measurements


def peak_memory() -> int:
    """The largest resident size of this process so far, in bytes; ru_maxrss counts that of the parent."""
    return 1024 * int(Path("/proc/self/status").read_text().split("VmHWM:")[1].split()[0])


def time_writer(writer: Writer, instance: Instance, name: str, path: Path) -> Row:
    """Wall and CPU seconds of one run, into an empty folder.

    To replace a file, a file system may send the new blocks to the disk at once, as ext4 does.
    """
    for written in path.parent.iterdir():
        written.unlink()
    gc.collect()
    cpu, wall = time.process_time(), time.perf_counter()
    writer(instance, name, path)
    return {"seconds": time.perf_counter() - wall, "cpu": time.process_time() - cpu}


def measure_writer(writer: str, name: str, suffix: str, size: int, *, once: bool = False) -> Row:
    """A row of measurements: the median of three runs, or one run where it is long.

    once: one run, and no small model before it.
    """
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"model.{suffix}"
        if not once:
            WRITERS[writer](make_square(WARM), name, path)
        runs = [time_writer(WRITERS[writer], make_square(size), name, path)]
        memory = peak_memory()
        if not once and runs[0]["seconds"] <= ONCE:
            runs += [time_writer(WRITERS[writer], make_square(size), name, path) for _ in range(2)]
        middle = sorted(runs, key=lambda run: float(run["seconds"]))[len(runs) // 2]
        return middle | {"memory": memory, "bytes": path.stat().st_size, "load": os.getloadavg()[0]}


def measure_in_child(*task: Any) -> Row | None:
    """Measure in a separate process; return None, with the reason on standard error, when it fails."""
    command = [sys.executable, str(Path(__file__).parent), "writing", "--one", json.dumps(task)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        print(f"{task}: {done.stderr.strip().splitlines()[-1]}", file=sys.stderr)
        return None
    row: Row = json.loads(done.stdout.splitlines()[-1])
    print(f"{task}: {row['seconds']:.3f} s, {row['cpu']:.3f} CPU s", file=sys.stderr, flush=True)
    return row


def measure_here(*task: Any) -> Row | None:
    """A single run in this process; None for a peer that is not installed."""
    try:
        return measure_writer(*task, once=True)
    except ImportError as error:
        print(f"{task}: {error}", file=sys.stderr)
        return None


# The page


def format_seconds(row: Row | None, column: str = "seconds") -> str:
    """Seconds with three significant digits."""
    return "" if row is None else f"{row[column]:.3g}" if row[column] < 100 else f"{row[column]:.0f}"


def format_ratio(row: Row, ours: Row, column: str) -> str:
    """A ratio with significant digits."""
    value = row[column] / ours[column] if ours[column] else 0.0
    return f"{value:.1f}" if value < 10 else f"{value:.0f}"


def compare_peers(
    measure: Callable[..., Row | None], suffix: str, sizes: Sequence[int], loads: list[float]
) -> str:
    """Ours and the peers, by size."""
    from make import markdown

    rows, going = [], list(PEERS)
    for size in sizes:
        ours: Row = {}
        for writer in list(going):
            row = measure(writer, MILP, suffix, size)
            if row is None or row["seconds"] * 4.2 > LONG or row["memory"] * 4.2 > MUCH:
                going.remove(writer)
            if row is None:
                continue
            ours = ours or row
            loads.append(row["load"])
            rate = f"{row['bytes'] / 1e6 / row['seconds']:.0f}"
            cells = [
                f"{row['bytes'] / 1e6:.3g}",
                format_seconds(row),
                format_seconds(row, "cpu"),
                rate,
                f"{row['memory'] / 1e6:.0f}",
            ]
            rows.append(
                [
                    str(size),
                    PEERS[writer],
                    *cells,
                    format_ratio(row, ours, "seconds"),
                    format_ratio(row, ours, "cpu"),
                ]
            )
    head = ["size", "writer", "MB", "seconds", "CPU s", "MB/s", "peak MB", "seconds / ours", "CPU / ours"]
    return markdown(head, rows)


def compare_formulations(measure: Callable[..., Row | None], names: Sequence[str], size: int) -> str:
    """Ours and Pyomo for every formulation and format."""
    from make import markdown

    rows = []
    for name in names:
        cells = []
        for suffix in SUFFIXES:
            if name == "minlp-parity" and suffix not in {"nl", "gms"}:
                cells.append("")
                continue
            ours, theirs = (measure(writer, name, suffix, size) for writer in ("crossfield", "pyomo"))
            cell = format_seconds(ours)
            if ours and theirs:
                cell += f" / {format_seconds(theirs)} = {format_ratio(theirs, ours, 'seconds')}x"
            cells.append(cell)
        rows.append([f"`{name}`", *cells])
    return markdown(["", *SUFFIXES], rows)


def describe_machine() -> str:
    """Facts about the machine that the numbers depend on, without the name of the host."""
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 2**30
    packages = []
    for package in PACKAGES:
        try:
            packages.append(f"{package} {version(package)}")
        except PackageNotFoundError:
            packages.append(f"{package} not installed")
    return (
        f"{os.cpu_count()} cores, {processor_name()}, {memory:.0f} GB, {platform.system()}. "
        f"Python {platform.python_version()}, {', '.join(packages)}."
    )


def measure_tables(
    measure: Callable[..., Row | None], sizes: Sequence[int], names: Sequence[str], middle: int
) -> dict[str, str]:
    """The generated parts of the page, by the names of their markers."""
    loads: list[float] = []
    tables = {suffix: compare_peers(measure, suffix, sizes, loads) for suffix in ("lp", "mps")}
    formulations = compare_formulations(measure, names, middle)
    facts = f"{describe_machine()}\nLoad average while measuring: {min(loads):.1f} to {max(loads):.1f}."
    sentence = f"{middle} x {middle}: seconds of crossfield, of Pyomo (model and writer), and their ratio."
    return {"writing": facts, **tables, "formulations": f"{sentence}\n\n{formulations}"}


def main(page: Path, arguments: Sequence[str]) -> None:
    """Measure, and replace the tables of a page."""
    parser = argparse.ArgumentParser(
        prog="python tests/bench writing", description="Measure the writers next to those of other programs."
    )
    parser.add_argument("--page", type=Path, default=page)
    parser.add_argument(
        "--smoke", action="store_true", help="sizes 4 and 8, one run each, in one process: shows that it runs"
    )
    parser.add_argument("--one", help=argparse.SUPPRESS)
    options = parser.parse_args(arguments)
    if options.one:
        print(json.dumps(measure_writer(*json.loads(options.one))))
        return
    if options.smoke:
        tables = measure_tables(measure_here, (4, 8), ["minlp-quartic"], 8)
    else:
        tables = measure_tables(measure_in_child, SIZES, list_formulations(), 128)
    from make import replace_between

    for name, table in tables.items():
        replace_between(options.page, name, table)
