"""The benchmark of the first second: `python tests/bench start`.

Every command runs in a fresh process, one after the other and several times in turn; its CPU seconds count
with those of its children.
"""

from __future__ import annotations

import argparse
import os
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Final

import crossfield as cf
from machine import machine_facts

RUNS: Final = 5
SET: Final = "files/mouse.milp-mccormick"
COMMANDS: Final = {
    "Python with NumPy": "import numpy",
    "`crossfield --help`": ["--help"],
    "`export mouse.json`, 4 x 4 pixels": ["export", "mouse.json", "-f", "milp", "-o", "files"],
    "`export mouse --size 4`": ["export", "mouse", "--size", "4", "-f", "milp", "-o", "files"],
    "`read` of its answer": ["read", "mouse.sol", "--manifest", f"{SET}.manifest.json", "-o", "mouse.npz"],
    "`shade mouse`": ["shade", "mouse", "-o", "surface"],
    "`cf.entries()`": "import crossfield as cf; cf.entries()",
    "`cf.entry(...).problem`": "import crossfield as cf; cf.entry('cf_mouse_n004_exact').problem",
}
"""What is measured, and the code or the arguments of `crossfield` that do it."""


def write_inputs(folder: Path) -> None:
    """The instance, the set of files and the answer that the commands read."""
    instance = cf.sample("mouse", 4)
    cf.write_instance(instance, folder / "mouse.json")
    (manifest,) = cf.write_all(instance, folder / "files", formulations=["milp-mccormick"])
    problem = manifest.problem()
    point = zip(problem.to_arrays().column_names, problem.point(cf.greedy_field(instance)), strict=True)
    (folder / "mouse.sol").write_text("".join(f"{name} {float(value)}\n" for name, value in point))


def measure(command: str | Sequence[str], folder: Path) -> float:
    """The CPU seconds of code, or of `crossfield` with arguments, in a fresh process.

    Modules are compiled once, into the folder, even where the environment forbids to keep them.
    """
    words = ["-c", command] if isinstance(command, str) else ["-m", "crossfield", *command]
    keeping = {"PYTHONDONTWRITEBYTECODE": "", "PYTHONPYCACHEPREFIX": str(folder / "compiled")}
    environment = os.environ | keeping
    before = os.times()
    subprocess.run([sys.executable, *words], cwd=folder, env=environment, check=True, capture_output=True)
    after = os.times()
    return sum(after[2:4]) - sum(before[2:4])


def measure_table(runs: int) -> str:
    """The medians of some runs as a table, and the machine."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write_inputs(folder)
        rounds = [
            [measure(command, folder) for command in COMMANDS.values()]
            for _ in range(runs + 1)  # the first one fills caches, and counts for nobody
        ]
    medians = map(statistics.median, zip(*rounds[1:], strict=True))
    rows = [f"| {what} | {seconds:.2f} |" for what, seconds in zip(COMMANDS, medians, strict=True)]
    facts = machine_facts()
    machine = (
        f"{facts['processor']}, {facts['cores']} cores, Python {facts['python']}, "
        f"load average {facts['load']:.1f}. Medians of {runs} runs."
    )
    return "\n".join(["| start | CPU s |", "| --- | --- |", *rows, "", machine])


def main(page: Path, arguments: Sequence[str]) -> None:
    """Measure, and replace the table of a page."""
    parser = argparse.ArgumentParser(
        prog="python tests/bench start", description="Measure the CPU seconds of short commands."
    )
    parser.add_argument("--page", type=Path, default=page)
    parser.add_argument("--runs", type=int, default=RUNS, help="runs of each command (default: %(default)s)")
    options = parser.parse_args(arguments)
    from make import replace_between

    replace_between(options.page, "start", measure_table(options.runs))
