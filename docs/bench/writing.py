"""The benchmark of the writers: `python docs/bench writing`, or `... writing nl gms` for other formats.

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
from importlib.metadata import version
from pathlib import Path
from typing import Any, Final

import numpy as np
from crossfield.export.formats.registry import FORMATS, problem_in_format, write
from crossfield.models.formulations.problem import Problem, formulate
from crossfield.models.instance.instance import Instance
from machine import machine_facts

SIZES: Final = (64, 128, 256, 512)
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

Row = dict[str, Any]
Writer = Callable[[Problem, Path], None]


# The writers: from a problem to a closed file.


def make_square(size: int) -> Instance:
    """A full square of pixels, a fifth of them with a stroke, each in its own direction."""
    row, column = np.mgrid[:size, :size]
    pixels = np.argwhere((7 * row + 3 * column) % 5 == 0)
    theta = (2 * np.arctan2(pixels[:, 0] + 0.5, pixels[:, 1] + 0.5) + 1e-3 * pixels[:, 0]) % np.pi
    w = 0.1 + 0.9 * ((13 * pixels[:, 0] + 7 * pixels[:, 1]) % 101) / 101
    return Instance.on_pixels("square", np.ones((size, size), dtype=bool), pixels, theta, w)


def write_with_crossfield(problem: Problem, path: Path) -> None:
    """With names, hash and, for .nl, the files of names."""
    write(problem, path)


def write_with_pyomo(problem: Problem, path: Path) -> None:
    """Pyomo: building the model, and its own writer with numbered names."""
    suffix = path.suffix[1:]
    held = problem_in_format(problem, FORMATS[suffix]) if suffix in {"lp", "mps"} else problem
    kind = {"nl": "nl_v2", "lp": "lp_v2", "mps": "mps", "gms": "gams"}[suffix]
    held.to_pyomo().write(str(path.with_suffix(f".{kind}")), format=kind)
    path.with_suffix(f".{kind}").replace(path)


def write_with_linopy(problem: Problem, path: Path) -> None:
    """linopy: building the model from whole arrays, and its LP writer or, for MPS, that of HiGHS behind."""
    problem.to_linopy().to_file(path, progress=False)


def write_with_highs(problem: Problem, path: Path) -> None:
    """HiGHS: a model passed as whole arrays, with our names left out, and its writeModel."""
    from crossfield.export.packages.highs import highs_of

    highs_of(problem.to_arrays(names=False), "square").writeModel(str(path))


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


def time_writer(writer: Writer, size: int, path: Path) -> Row:
    """Wall and CPU seconds from an instance to its file, in an empty folder.

    To replace a file, a file system may send the new blocks to the disk at once, as ext4 does.
    """
    for written in path.parent.iterdir():
        written.unlink()
    instance = make_square(size)
    gc.collect()
    before, wall = resource.getrusage(resource.RUSAGE_SELF), time.perf_counter()
    writer(formulate(instance, "milp-mccormick"), path)
    seconds, after = time.perf_counter() - wall, resource.getrusage(resource.RUSAGE_SELF)
    return {"seconds": seconds, "cpu": sum(after[:2]) - sum(before[:2])}


def measure_writer(writer: str, suffix: str, size: int) -> Row:
    """A row of measurements: of three runs the one of median CPU time, or of one run where it is long."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"model.{suffix}"
        time_writer(WRITERS[writer], WARM, path)
        runs = [time_writer(WRITERS[writer], size, path)]
        memory = peak_memory()
        if runs[0]["cpu"] <= ONCE:
            runs += [time_writer(WRITERS[writer], size, path) for _ in range(2)]
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


# The page


def compare_peers(suffix: str, sizes: Sequence[int]) -> tuple[list[Row], list[float]]:
    """A row per size and writer, compared by CPU time, which the load changes little; and the loads."""
    rows, loads = [], []
    going = [*PEERS] if suffix in {"lp", "mps"} else ["crossfield", "pyomo"]
    for size in sizes:
        ours = 0.0
        for writer in list(going):
            row = measure_in_child(writer, suffix, size)
            if row is None or row["cpu"] * 4.2 > LONG or row["memory"] * 4.2 > MUCH:
                going.remove(writer)
            if row is None:
                continue
            ours = ours or row["cpu"]
            loads.append(row["load"])
            ratio = row["cpu"] / ours
            facts = {
                "size": size,
                "writer": PEERS[writer],
                "MB": f"{row['bytes'] / 1e6:.3g}",
                "seconds": f"{row['seconds']:.3g}",
                "CPU s": f"{row['cpu']:.3g}",
                "peak MB": f"{row['memory'] / 1e6:.0f}",
                "CPU / ours": f"{ratio:.1f}" if ratio < 10 else f"{ratio:.0f}",
            }
            rows.append(facts)
    return rows, loads


def format_table(rows: Sequence[Row]) -> str:
    """The CPU seconds of each size and writer, and how many times as many as ours."""
    from make import markdown

    cells = {(row["size"], row["writer"]): f"{row['CPU s']} ({row['CPU / ours']}x)" for row in rows}
    cells |= {(row["size"], row["writer"]): row["CPU s"] for row in rows if row["writer"] == "crossfield"}
    sizes = sorted({row["size"] for row in rows})
    lines = [[str(size), *(cells.get((size, name), "") for name in PEERS.values())] for size in sizes]
    return markdown(("size", *PEERS.values()), lines)


def describe_machine(loads: Sequence[float]) -> str:
    """Facts that numbers depend on, without the name of the host. loads: load averages while measuring."""
    facts, memory = machine_facts(), os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 2**30
    packages = ", ".join(f"{package} {version(package)}" for package in PACKAGES)
    return (
        f"{facts['cores']} cores, {facts['processor']}, {memory:.0f} GB, {platform.system()}. "
        f"Python {facts['python']}, {packages}. Load average: {min(loads):.1f} to {max(loads):.1f}."
    )


def main(page: Path, arguments: Sequence[str]) -> None:
    """Measure, and replace the tables of a page."""
    parser = argparse.ArgumentParser(
        prog="python docs/bench writing", description="Measure the writers next to those of other programs."
    )
    parser.add_argument(
        "formats", nargs="*", default=["lp", "mps"], metavar="FORMAT", help=", ".join(FORMATS)
    )
    parser.add_argument("--page", type=Path, default=page)
    parser.add_argument("--sizes", type=int, nargs="+", default=SIZES, help="pixels per side")
    parser.add_argument("--one", help=argparse.SUPPRESS)
    options = parser.parse_args(arguments)
    if options.one:
        print(json.dumps(measure_writer(*json.loads(options.one))))
        return
    from make import csv_text, replace_between

    folder = options.page.with_name("performance")
    folder.mkdir(exist_ok=True)
    for suffix in options.formats:
        rows, loads = compare_peers(suffix, options.sizes)
        (folder / f"{suffix}.csv").write_text(csv_text(rows))
        if suffix == "lp":
            replace_between(options.page, "lp", format_table(rows))
            replace_between(options.page, "writing", describe_machine(loads))
