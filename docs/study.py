"""Measure methods, and make docs/evidence.md: `python docs/study.py --page`.

    python docs/study.py [--jobs N | --scheduler ADDRESS] [--parts PART ...] [--sketches FOLDER]
    python docs/study.py --quick --data FOLDER
    python docs/study.py --plan | --page

Without options it does all runs that have no row yet in docs/studying/data, then makes the page. After an
interruption, the same command continues. --quick does small runs in a minute, in another folder.
--plan counts the runs and their seconds. With --scheduler, dask workers do the runs: scheduler and workers
have the folder docs on their PYTHONPATH, and OPENBLAS_NUM_THREADS=1.

The plan (studying/plan.py), every run on one thread:

    quality   drawings without one of their curves, surfaces with known answers, sizes 24 and 32: fields of
              many energies, both norms, several weights; the error and the gap to the best
    practice  drawings at 24, 48, 128, 256, whole and without their three longest curves: eight ways to a
              field, 1 s or 10 s for those with a limit

docs/solver_study.py measures the solvers, and docs/fields.py drawings by others, for the same page.
"""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path
from typing import Final

# Every run is on one thread: libraries read this when they are loaded, here and in all children.
os.environ |= dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"), "1")

from studying.plan import FULL, QUICK, Plan, expected_seconds, stages
from studying.rows import DATA, PARTS
from studying.work import carry_out

DOCS: Final = Path(__file__).resolve().parent


def overview(plan: Plan, folder: Path | None) -> str:
    """The stages of a plan, with their runs and the most hours on one core."""
    lines, count, seconds = [], 0, 0.0
    for stage in stages(plan, folder):
        most = sum(map(expected_seconds, stage.runs))
        lines.append(f"{stage.name:<14}{len(stage.runs):>6} runs, at most {most:>6.0f} s")
        count, seconds = count + len(stage.runs), seconds + most
    return "\n".join([*lines, f"{'all':<14}{count:>6} runs, at most {seconds / 3600:.1f} h on one core"])


def main() -> None:
    """Do the remaining runs of the plan, and make the page."""
    parser = argparse.ArgumentParser(description="Measure methods; make docs/evidence.md.")
    parser.add_argument("--quick", action="store_true", help="a small plan of a minute; give --data too")
    parser.add_argument("--plan", action="store_true", help="only print the runs and their seconds")
    parser.add_argument("--page", action="store_true", help="only make the page from the rows")
    parser.add_argument("--data", type=Path, default=DATA, help="folder of the rows")
    parser.add_argument("--parts", nargs="+", choices=PARTS, default=[], help="only these parts")
    parser.add_argument("--sketches", type=Path, help="folder of line drawings by others, beside the samples")
    parser.add_argument("--jobs", type=int, default=2, help="processes at once")
    parser.add_argument("--scheduler", help="address of a dask scheduler whose workers do the runs")
    options = parser.parse_args()
    plan = QUICK if options.quick else FULL
    if options.quick and options.data == DATA:
        parser.error("--quick is another plan; give --data FOLDER for its rows")
    if options.plan:
        print(overview(plan, options.sketches))
        return
    if not options.page:
        carry_out(
            plan, options.data, jobs=options.jobs, scheduler=options.scheduler, folder=options.sketches,
            parts=options.parts, progress=lambda line: print(line, file=sys.stderr, flush=True),
        )  # fmt: skip
    if options.data == DATA:
        from studying.page import write_page

        write_page(DOCS)


if __name__ == "__main__":
    main()
