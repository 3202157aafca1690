"""Wall time of every method under a time limit, with busy processes running at the same time.

`python tests/bench limits --busy 2` prints one row per method, size and limit. The time ends when the field
and, for `prove`, the checked certificate are written. Imports, the reading of the sketch and the compilation
of proofs come before it, in a solve of a tiny sample. A row passes if it takes at most the limit, 10 % of it
and 1 s.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from crossfield.export.cli.solve_command import _by_method
from crossfield.export.solving.methods import METHODS, Request
from crossfield.models.processes.deadline import Deadline
from crossfield.models.processes.limits import Limits
from crossfield.models.sketch.samples import sample

HERE = Path(__file__).resolve().parent
SIZES = (24, 48, 128)
LIMITS = (1.0, 10.0, 30.0)
WARM = (6, 3.0)
"""Pixels and seconds of the solve that comes first."""
HEAD = f"{'method':>10} {'size':>5} {'limit':>6} {'seconds':>8} {'allowed':>8} {'energy':>10} {'bound':>9}"
BUSY = """
import os, sys, threading
threading.Thread(target=lambda: (sys.stdin.read(), os._exit(0)), daemon=True).start()
while True: pass
"""
"""Program of a busy process; it ends when its standard input closes."""

Row = dict[str, Any]


def allowed(limit: float) -> float:
    """Seconds that a method may take under a limit."""
    return 1.1 * limit + 1.0


def measured(method: str, name: str, size: int, limit: float) -> Row:
    """Wall seconds of one solve, and the energy of its field."""
    with tempfile.TemporaryDirectory() as folder:
        instance = sample(name, size)
        begin, deadline = time.perf_counter(), Deadline.after(limit)
        found, proven, _ = _by_method(method, Request(instance, Path(folder), Limits(limit)), deadline)
        seconds = time.perf_counter() - begin
    row = {"method": method, "size": size, "limit": limit, "seconds": seconds}
    return row | {"energy": found.field.energy().total, "bound": proven and proven.bound}


def in_child(given: Row) -> Row:
    """The row of one measurement in a process of its own."""
    command = [sys.executable, str(HERE / "limits.py"), json.dumps(given)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        return given | {"seconds": None, "failed": done.stderr.strip().splitlines()[-1]}
    return dict(json.loads(done.stdout.splitlines()[-1]))


@contextmanager
def busy(count: int) -> Iterator[None]:
    """A context in which that many processes compute all the time."""
    others = [subprocess.Popen([sys.executable, "-c", BUSY], stdin=subprocess.PIPE) for _ in range(count)]
    try:
        yield
    finally:
        for other in others:
            other.kill()
            other.wait()


def line(row: Row) -> str:
    """One line of the table."""
    what = f"{row['method']:>10} {row['size']:>5} {row['limit']:>6g}"
    if row["seconds"] is None:
        return f"{what}  {row['failed']}"
    verdict = "met" if row["seconds"] <= allowed(row["limit"]) else "NOT MET"
    bound = "" if row["bound"] is None else f"{row['bound']:.5g}"
    times = f"{row['seconds']:>8.2f} {allowed(row['limit']):>8.2f}"
    return f"{what} {times} {row['energy']:>10.5g} {bound:>9} {verdict}"


def run(options: argparse.Namespace) -> None:
    """Print the table; rows that the data file holds are not measured again."""
    known: list[Row] = json.loads(options.data.read_text()) if options.data and options.data.exists() else []
    found = {(row["method"], row["size"], row["limit"], row["busy"]): row for row in known}
    print(HEAD)
    with busy(options.busy):
        for method in options.method or METHODS:
            for size in options.size or SIZES:
                for limit in options.limit or LIMITS:
                    key = (method, size, limit, options.busy)
                    if key not in found:
                        given = {"method": method, "name": options.sample, "size": size, "limit": limit}
                        found[key] = in_child(given) | {"busy": options.busy}
                    print(line(found[key]), flush=True)
                    if options.data:
                        options.data.write_text(json.dumps(list(found.values()), indent=1))


def arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of this benchmark."""
    parser.add_argument("--busy", type=int, default=2, help="busy processes that run at the same time")
    parser.add_argument("--method", action="append", choices=list(METHODS), help="all when not given")
    parser.add_argument("--size", action="append", type=int, help="pixels; 24, 48 and 128 when not given")
    parser.add_argument("--limit", action="append", type=float, help="seconds; 1, 10, 30 when not given")
    parser.add_argument("--sample", default="mouse", help="the built-in sample to solve")
    parser.add_argument("--data", type=Path, help="keeps the rows, so that an interrupted run continues")


if __name__ == "__main__":
    task = json.loads(sys.argv[1])
    measured(task["method"], task["name"], *WARM)
    print(json.dumps(measured(**task)))
