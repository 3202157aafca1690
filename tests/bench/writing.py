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
import resource
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
"""Formats in which all formulations are compared with Pyomo."""
SIZES: Final = (64, 128, 256, 512)
GROWTH: Final = (64, 128, 256, 512, 724, 1024, 1448)
"""Pixels per side of the files whose growth is drawn; the last one has 4.2 million pairs."""
PEERS: Final = {"crossfield": "crossfield", "linopy": "linopy", "highs": "HiGHS", "pyomo": "Pyomo"}
PACKAGES: Final = ("numpy", "pyomo", "linopy", "highspy")
WARM: Final = 6
"""Pixels per side of the model that goes first."""
ONCE: Final = 5.0
"""CPU seconds above which a writer is measured once, instead of three times."""
LONG: Final = 75.0
"""CPU seconds that the next size of a peer may be expected to take."""
MUCH: Final = 8e9
"""Bytes of memory that it may be expected to need."""

PARTS: Final = ("peers", "growth", "formulations")

Row = dict[str, Any]
Writer = Callable[[Instance, str, Path], None]
Measure = Callable[..., Row | None]


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
    before, wall = resource.getrusage(resource.RUSAGE_SELF), time.perf_counter()
    writer(instance, name, path)
    seconds, after = time.perf_counter() - wall, resource.getrusage(resource.RUSAGE_SELF)
    user, system = after.ru_utime - before.ru_utime, after.ru_stime - before.ru_stime
    return {"seconds": seconds, "cpu": user + system, "user": user}


def measure_writer(writer: str, name: str, suffix: str, size: int, *, once: bool = False) -> Row:
    """A row of measurements: of three runs the one of median CPU time, or of one run where it is long.

    once: one run, and no small model before it.
    """
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"model.{suffix}"
        if not once:
            WRITERS[writer](make_square(WARM), name, path)
        runs = [time_writer(WRITERS[writer], make_square(size), name, path)]
        memory = peak_memory()
        if not once and runs[0]["cpu"] <= ONCE:
            runs += [time_writer(WRITERS[writer], make_square(size), name, path) for _ in range(2)]
        middle = sorted(runs, key=lambda run: float(run["cpu"]))[len(runs) // 2]
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


def format_ratio(row: Row, ours: Row) -> str:
    """The ratio of CPU times with significant digits."""
    value = row["cpu"] / ours["cpu"] if ours["cpu"] else 0.0
    return f"{value:.1f}" if value < 10 else f"{value:.0f}"


def compare_peers(measure: Measure, sizes: Sequence[int], folder: Path) -> dict[str, str]:
    """Ours and the peers, by size, for LP and MPS; compared by CPU time, which the load changes little.

    folder: for a CSV file with a row per writer and size.
    """
    from make import csv_text, markdown

    tables, loads = {}, []
    for suffix in ("lp", "mps"):
        rows, lines, going = [], [], list(PEERS)
        for size in sizes:
            ours: Row = {}
            line = dict.fromkeys(PEERS, "")
            for writer in list(going):
                row = measure(writer, MILP, suffix, size)
                if row is None or row["cpu"] * 4.2 > LONG or row["memory"] * 4.2 > MUCH:
                    going.remove(writer)
                if row is None:
                    continue
                ours = ours or row
                loads.append(row["load"])
                seconds = format_seconds(row, "cpu")
                line[writer] = seconds if row is ours else f"{seconds} ({format_ratio(row, ours)}x)"
                facts = {
                    "size": size,
                    "writer": PEERS[writer],
                    "MB": f"{row['bytes'] / 1e6:.3g}",
                    "seconds": format_seconds(row),
                    "CPU s": seconds,
                    "peak MB": f"{row['memory'] / 1e6:.0f}",
                    "CPU / ours": format_ratio(row, ours),
                }
                rows.append(facts)
            lines.append([str(size), *line.values()])
        (folder / f"{suffix}.csv").write_text(csv_text(rows))
        tables[suffix] = markdown(["size", *PEERS.values()], lines)
    return {"writing": describe_machine(loads), **tables}


def measure_growth(measure: Measure, sizes: Sequence[int], folder: Path) -> dict[str, str]:
    """Time and memory of an MPS by its size, as a CSV file and a picture with straight lines through them.

    folder: for the CSV file. The picture belongs into `pictures` next to it.
    """
    from make import csv_text
    from studying.plots import INK, open_panels

    rows = {size: row for size in sizes if (row := measure("crossfield", MILP, "mps", size)) is not None}
    pairs = np.array([2 * size * (size - 1) for size in rows]) / 1e6
    drawn = {
        "CPU seconds of the program": ("s", np.array([row["user"] for row in rows.values()])),
        "peak memory, MB": ("MB", np.array([row["memory"] / 1e6 for row in rows.values()])),
    }
    fits = []
    picture = folder.with_name("pictures") / "performance.svg"
    with open_panels(picture, len(drawn), wide=4.9, high=5.0, stacked=True) as axes:
        for axis, (title, (unit, values)) in zip(axes, drawn.items(), strict=True):
            slope, level = np.polyfit(pairs, values, 1)
            off = float(np.abs(values - level - slope * pairs).max())
            fits.append(
                f"{level:.3g} {unit} + {slope:.3g} {unit} per million pairs, at most {off:.2g} {unit} off"
            )
            ends = np.array([0.0, pairs[-1]])
            axis.plot(ends, level + slope * ends, color=INK[1], linewidth=1.2)
            axis.plot(pairs, values, "o", color=INK[0], markersize=5)
            axis.set(xlabel="pairs, millions", title=title, xlim=(0, None), ylim=(0, None))
    facts = [
        {
            "size": size,
            "million pairs": f"{number:.3g}",
            "MB": f"{row['bytes'] / 1e6:.4g}",
            "seconds": format_seconds(row),
            "CPU s of the program": format_seconds(row, "user"),
            "CPU s of the system": f"{row['cpu'] - row['user']:.3g}",
            "peak MB": f"{row['memory'] / 1e6:.0f}",
        }
        for number, (size, row) in zip(pairs, rows.items(), strict=True)
    ]
    (folder / "growth.csv").write_text(csv_text(facts))
    loads = describe_loads([row["load"] for row in rows.values()])
    largest = facts[-1]
    system = (
        f"At {largest['million pairs']} million pairs, the system takes {largest['CPU s of the system']} s "
        f"and the program {largest['CPU s of the program']} s."
    )
    return {"growth": f"Straight lines, without time of the system: {'; '.join(fits)}. {system} {loads}"}


def compare_formulations(measure: Measure, names: Sequence[str], size: int) -> dict[str, str]:
    """Ours and Pyomo for every formulation and format."""
    from make import markdown

    rows, loads = [], []
    for name in names:
        cells = []
        for suffix in SUFFIXES:
            if name == "minlp-parity" and suffix not in {"nl", "gms"}:
                cells.append("")
                continue
            ours, theirs = (measure(writer, name, suffix, size) for writer in ("crossfield", "pyomo"))
            loads += [row["load"] for row in (ours, theirs) if row]
            cell = format_seconds(ours, "cpu")
            if ours and theirs:
                cell += f" ({format_ratio(theirs, ours)}x)"
            cells.append(cell)
        rows.append([f"`{name}`", *cells])
    sentence = f"{size} x {size}: CPU seconds of crossfield, and how many times as many Pyomo takes."
    facts = describe_machine(loads)
    return {"formulations": f"{facts}\n\n{sentence}\n\n{markdown(['', *SUFFIXES], rows)}"}


def describe_machine(loads: Sequence[float]) -> str:
    """Facts that numbers depend on, without the name of the host. loads: load averages while measuring."""
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 2**30
    packages = []
    for package in PACKAGES:
        try:
            packages.append(f"{package} {version(package)}")
        except PackageNotFoundError:
            packages.append(f"{package} not installed")
    return (
        f"{os.cpu_count()} cores, {processor_name()}, {memory:.0f} GB, {platform.system()}. "
        f"Python {platform.python_version()}, {', '.join(packages)}. {describe_loads(loads)}"
    )


def describe_loads(loads: Sequence[float]) -> str:
    """The range of load averages while measuring."""
    return f"Load average: {min(loads):.1f} to {max(loads):.1f}."


def main(page: Path, arguments: Sequence[str]) -> None:
    """Measure, and replace the tables of a page."""
    parser = argparse.ArgumentParser(
        prog="python tests/bench writing", description="Measure the writers next to those of other programs."
    )
    parser.add_argument("parts", nargs="*", default=PARTS, metavar="PART", help=", ".join(PARTS))
    parser.add_argument("--page", type=Path, default=page)
    parser.add_argument(
        "--smoke", action="store_true", help="sizes 4 and 8, one run each, in one process: shows that it runs"
    )
    parser.add_argument("--one", help=argparse.SUPPRESS)
    options = parser.parse_args(arguments)
    if options.one:
        print(json.dumps(measure_writer(*json.loads(options.one))))
        return
    from make import replace_between

    small = options.smoke
    measure = measure_here if small else measure_in_child
    folder = options.page.with_name("performance")
    folder.mkdir(exist_ok=True)
    measured: dict[str, Callable[[], dict[str, str]]] = {
        "peers": lambda: compare_peers(measure, (4, 8) if small else SIZES, folder),
        "growth": lambda: measure_growth(measure, (4, 8) if small else GROWTH, folder),
        "formulations": lambda: compare_formulations(
            measure, ["minlp-quartic"] if small else list_formulations(), 8 if small else 128
        ),
    }
    for part in options.parts:
        for name, table in measured[part]().items():
            replace_between(options.page, name, table)
