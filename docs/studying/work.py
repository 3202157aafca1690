"""Execution of the runs of a plan; runs with a row are skipped."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from functools import partial
from pathlib import Path
from typing import Any, Final

from crossfield.export.library.building.executor import open_tasks
from crossfield.export.library.documents.lock import library_lock
from machine import machine_facts

from .fields import field_row
from .plan import Plan, stages
from .rows import FAILED, Rows, Run, tables

Progress = Callable[[str], object]
_LONGEST: Final = 200  # characters of a note
_FOLDERS: Final = re.compile(r"(?:/[\w.+-]+)+/")  # of this machine


def perform(task: tuple[Run, Path | None]) -> dict[str, Any]:
    """The result of a run; an exception makes a failed run, and the study continues."""
    run, folder = task
    try:
        row = field_row(run, folder)
    except Exception as error:  # noqa: BLE001 - a row records the exception
        row = {"status": FAILED, "note": f"{type(error).__name__}: {error}"}
    note = _FOLDERS.sub("", str(row.get("note") or ""))
    return row | {"note": note[:_LONGEST], **_machine()}


def _machine() -> dict[str, Any]:
    facts = machine_facts()
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
    with library_lock(data, "a study", progress), open_tasks(jobs, scheduler) as tasks:
        rows_of = tables(data)
        for stage in stages(plan, folder):
            runs = [run for run in stage.runs if not wanted or run.part in wanted]
            runs = [run for run in runs if run.key not in rows_of[run.part].done]
            progress(f"{stage.name}: {len(runs)} of {len(stage.runs)} runs")
            for run in reversed(runs):  # the last one added is the first to be done
                tasks.add(perform, (run, folder), partial(_keep, rows_of[run.part], run))
            tasks.run()


def _keep(table: Rows, run: Run, row: dict[str, Any]) -> None:
    table.append(run, row)
