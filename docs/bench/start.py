"""The benchmark of the first second: `python docs/bench start`.

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
    "crossfield --help": ["--help"],
    "export mouse.json, 4 x 4 pixels": ["export", "mouse.json", "-f", "milp", "-o", "files"],
    "export mouse --size 4": ["export", "mouse", "--size", "4", "-f", "milp", "-o", "files"],
    "crossfield read": ["read", "mouse.sol", "--manifest", f"{SET}.manifest.json", "-o", "mouse.npz"],
    "cf.entries()": "import crossfield as cf; cf.entries()",
    "cf.entries(NAME)[0].problem": ("import crossfield as cf; cf.entries('cf_mouse_n004_exact')[0].problem"),
}
"""Measured actions: their names, and the code or the arguments of `crossfield` of each."""
SHOWN: Final = ("crossfield --help", "export mouse --size 4", "crossfield read")
"""Actions that the page shows."""


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


def measure_commands(runs: int, folder: Path) -> str:
    """The medians of some runs as a CSV file in a folder; three of them, and the machine, as a sentence."""
    from make import csv_text

    with tempfile.TemporaryDirectory() as name:
        work = Path(name)
        write_inputs(work)
        rounds = [
            [measure(command, work) for command in COMMANDS.values()]
            for _ in range(runs + 1)  # the first one fills caches, and counts for nobody
        ]
    medians = dict(zip(COMMANDS, map(statistics.median, zip(*rounds[1:], strict=True)), strict=True))
    folder.mkdir(exist_ok=True)
    rows = [{"start": what, "CPU s": f"{seconds:.2f}"} for what, seconds in medians.items()]
    (folder / "start.csv").write_text(csv_text(rows))
    shown = ", ".join(f"{medians[what]:.2f} of `{what}`" for what in SHOWN)
    facts = machine_facts()
    return (
        f"CPU seconds: {shown}. {facts['processor']}, {facts['cores']} cores, Python {facts['python']}, "
        f"load average {facts['load']:.1f}. Medians of {runs} runs."
    )


def main(page: Path, arguments: Sequence[str]) -> None:
    """Measure, and replace the table of a page."""
    parser = argparse.ArgumentParser(
        prog="python docs/bench start", description="Measure the CPU seconds of short commands."
    )
    parser.add_argument("--page", type=Path, default=page)
    parser.add_argument("--runs", type=int, default=RUNS, help="runs of each command (default: %(default)s)")
    options = parser.parse_args(arguments)
    from make import replace_between

    text = measure_commands(options.runs, options.page.with_name("performance"))
    replace_between(options.page, "start", text)
