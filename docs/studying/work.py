"""Execution of the runs of a plan; runs with a row are skipped."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from functools import partial
from pathlib import Path
from typing import Any, Final

from crossfield.export.library.building.executor import Tasks, ahead, executor
from crossfield.export.library.documents.lock import locked
from crossfield.export.solvers_table import SOLVERS

from .facts import is_proven
from .fields import fielded
from .plan import FEWEST_PROVEN, Plan, Stage, stages
from .rows import EVERY, NOT_RUN, Row, Rows, Run, tables
from .solving import FAILED, proved, solved

Progress = Callable[[str], object]
_LONGEST: Final = 200  # characters of a note
_FOLDERS: Final = re.compile(r"(?:/[\w.+-]+)+/")  # of this machine


def perform(task: tuple[Run, Path | None]) -> dict[str, Any]:
    """The result of a run; an exception makes a failed run, and the study continues."""
    run, folder = task
    try:
        found = _find(run, folder)
    except Exception as error:  # noqa: BLE001 - a row records the exception
        found = {"status": FAILED, "note": f"{type(error).__name__}: {error}"}
    note = _FOLDERS.sub("", str(found.get("note") or ""))
    return found | {"note": note[:_LONGEST], **_machine()}


def _find(run: Run, folder: Path | None) -> dict[str, Any]:
    if run.part == "proofs":
        return proved(run)
    return solved(run) if run.part == "solvers" else fielded(run, folder)


def _machine() -> dict[str, Any]:
    from proofs import machine  # it loads the drawing library

    facts = machine()
    return {"machine": f"{facts['processor']}, {facts['cores']} cores", "load": round(facts["load"], 2)}


def carry_out(
    plan: Plan,
    data: Path,
    *,
    jobs: int = 1,
    scheduler: str | None = None,
    folder: Path | None = None,
    parts: Iterable[str] = (),
    progress: Progress = print,
) -> None:
    """Do all runs of a plan that have no row yet; each row is on the disk before another run begins.

    jobs: processes, of one thread each; scheduler: address of a dask scheduler instead; it and its workers
    have the folder docs on their PYTHONPATH. folder: of drawings by others. parts: only these, by default
    all.
    """
    wanted = frozenset(parts)
    data.mkdir(parents=True, exist_ok=True)
    with locked(data, "a study", progress), executor(jobs, scheduler) as chosen:
        kept = tables(data)
        for stage in stages(plan, folder):
            runs = [run for run in stage.runs if (not wanted or run.part in wanted) and _can_run(run)]
            runs = left(runs, stage, kept)
            progress(f"{stage.name}: {len(runs)} of {len(stage.runs)} runs")
            tasks = Tasks(chosen, ahead(jobs, scheduler))
            for run in reversed(runs):  # the last one added is the first to be done
                tasks.add(perform, (run, folder), partial(_keep, kept[run.part], run))
            tasks.run()


def _can_run(run: Run) -> bool:
    """Whether its solver is installed; runs without one can run anywhere."""
    return not run.solver or not SOLVERS[run.solver].missing


def _keep(table: Rows, run: Run, found: dict[str, Any]) -> None:
    table.append(run, found)


def left(runs: list[Run], stage: Stage, kept: dict[str, Rows]) -> list[Run]:
    """The runs of a stage without a row, except for pairs that proved too little of the rung before.

    Each of these pairs gets one row that states this.
    """
    found, judged = [], dict[tuple[Any, ...], str]()
    for run in runs:
        if run.key in kept[run.part].done:
            continue
        if stage.after:
            kind = pair_of(run)
            if kind not in judged:
                judged[kind] = reason(kind, stage.after, kept["solvers"])
                _say(run, judged[kind], kept["solvers"])
            if judged[kind]:
                continue
        found.append(run)
    return found


def _say(run: Run, why: str, table: Rows) -> None:
    from dataclasses import replace

    every = replace(run, instance=EVERY)
    if why and every.key not in table.done:
        table.append(every, {"status": NOT_RUN, "note": why})


def pair_of(run: Run) -> tuple[Any, ...]:
    """The unit that a rule skips: formulation, solver and variant."""
    return (run.way, run.solver, run.start, run.facet, run.windows, run.limit)


def reason(kind: tuple[Any, ...], rung: int, table: Rows) -> str:
    """The reason why a pair is not run on the next rung; empty if it is."""
    rows = [row for row in table.rows if row["size"] == rung and _pair(row) == kind]
    if any(row["status"] == NOT_RUN for row in rows):
        return next(row["note"] for row in rows if row["status"] == NOT_RUN)
    proven = sum(map(is_proven, rows))
    if rows and proven < FEWEST_PROVEN * len(rows):
        return f"proved {proven} of {len(rows)} on the rung of {rung}"
    return ""


def _pair(row: Row) -> tuple[Any, ...]:
    return (row["way"], row["solver"], row["start"], row["facet"], row["windows"], row["limit"])
