"""The benchmark of export: `python tests/bench` measures and writes docs/performance.md.

Every measurement is a process of its own, one at a time; ours and the peers take turns on the same instance.
A peer goes on to the next size as long as that would take it about a minute and bearable memory.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import page
from crossfield.models.formulations.catalogue import FORMULATIONS

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
SIZES = (64, 128, 256, 512)
PEERS = ("linopy", "highs", "pyomo")
MILP = "milp-mccormick"
LONG = 75.0
"""Seconds that the next size of a peer may be expected to take."""
MUCH = 8e9
"""Bytes of memory that it may be expected to need."""

Found = dict[str, Any]


class Bench:
    """Runs measurements in a folder and remembers them by their arguments."""

    def __init__(self, folder: Path, measure: Callable[[Found], Found | None]) -> None:
        self._folder = folder
        self._measure = measure
        self.found: dict[str, Found] = {}

    def run(
        self, task: str, size: int, formulation: str = MILP, suffix: str = "lp", **given: Any
    ) -> Found | None:
        """Measure a task; return None when it failed."""
        key = " ".join(map(str, (task, formulation, suffix, size, *given.values())))
        whole = {
            "task": task,
            "size": size,
            "formulation": formulation,
            "suffix": suffix,
            "folder": str(self._folder),
        }
        found = self._measure(whole | given)
        if found is not None:
            self.found[key] = found
            print(f"{key}: {found['seconds']:.3f} s, {found['cpu']:.3f} CPU s", file=sys.stderr, flush=True)
        return found


def in_child(given: Found) -> Found | None:
    """Measure in a separate process; return None, with the reason on standard error, when it fails."""
    command = [sys.executable, str(HERE / "work.py"), json.dumps(given)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        print(f"{given['task']}: {done.stderr.strip().splitlines()[-1]}", file=sys.stderr)
        return None
    return dict(json.loads(done.stdout.splitlines()[-1]))


def here(given: Found) -> Found | None:
    """A single run in this process; None for a peer that is not installed."""
    import work

    try:
        return work.measured(once=True, **given)
    except ImportError as error:
        print(f"{given['task']}: {error}", file=sys.stderr)
        return None


def writers(bench: Bench, sizes: tuple[int, ...]) -> None:
    """LP and MPS of the MILP: ours, a copy, and the peers."""
    for suffix in ("lp", "mps"):
        going = set(PEERS)
        for size in sizes:
            for task in ("ours", "copied", *(peer for peer in PEERS if peer in going)):
                found = bench.run(task, size, MILP, suffix)
                if found is None or found["seconds"] * 4.2 > LONG or found["memory"] * 4.2 > MUCH:
                    going.discard(task)


def formulations(bench: Bench, size: int, names: tuple[str, ...]) -> None:
    """Every formulation in every format that holds it, against Pyomo."""
    for name in names:
        for suffix in ("nl", "lp", "mps", "gms"):
            if name != "minlp-parity" or suffix in {"nl", "gms"}:
                bench.run("ours", size, name, suffix)
                bench.run("pyomo", size, name, suffix)


def ours(bench: Bench, sizes: tuple[int, ...], pixels: int) -> None:
    """Measurements without a peer: all formats, growth and solutions."""
    for size in sizes[-2:]:
        for dialect in ("text", "binary"):
            bench.run("ours", size, MILP, "nl", dialect=dialect)
        bench.run("ours", size, MILP, "gms")
    for jobs in (1, 2):
        bench.run("everything", sizes[-1], MILP, "", jobs=jobs)
    bench.run("everything", min(24, sizes[-1]), "all", "", jobs=1)
    bench.run("ours", sizes[-2], MILP, "lp.gz")
    for suffix in ("highs", "ampl"):
        bench.run("solution", pixels, MILP, suffix)


def main() -> None:
    """Measure and write the page."""
    parser = argparse.ArgumentParser(
        description="Measure export against its peers and write docs/performance.md."
    )
    parser.add_argument("--output", type=Path, default=ROOT / "docs" / "performance.md")
    parser.add_argument(
        "--smoke", action="store_true", help="sizes 4 and 8, one run each, in one process: shows that it runs"
    )
    parser.add_argument("--data", type=Path, help="write the measurements, or read them if the file is there")
    options = parser.parse_args()
    sizes, names, middle, pixels = (
        ((4, 8), ("minlp-quartic",), 8, 8) if options.smoke else (SIZES, tuple(FORMULATIONS), 128, 552)
    )
    if options.data and options.data.exists():
        document = json.loads(options.data.read_text())
    else:
        with tempfile.TemporaryDirectory() as folder:
            bench = Bench(Path(folder), here if options.smoke else in_child)
            ours(bench, sizes, pixels)
            writers(bench, sizes)
            formulations(bench, middle, names)
        document = {"found": bench.found, "machine": page.machine()}
    if options.data:
        options.data.write_text(json.dumps(document, indent=1))
    options.output.write_text(page.page(document, sizes, names, middle, pixels))


if __name__ == "__main__":
    main()
