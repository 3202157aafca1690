"""Earlier results in a folder that are better than new ones, and therefore stay."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from ...models.errors import CrossfieldError
from ...models.field.field import CrossField
from ...models.field.file import SAME, earlier_field
from ...models.formulations.problem import Problem
from ...models.instance.instance import Instance
from ...models.processes.deadline import Progress
from ...models.storage import NewResults
from ...models.written_files import is_unchanged, kept_notice
from ..solutions.read import read_solution
from ..solutions.solution import Solution
from .manifest import file_stem, manifest_path, read_manifest


def keep_better_answer(
    new: NewResults, problem: Problem, log_name: str, solution_name: str, notice: Progress
) -> None:
    """Keep solution and log of an earlier solve of this problem by this solver if they are better.

    That is so with a lower objective, with the same one proven optimal, or if there is no new point.
    """
    path, manifest = new.folder / solution_name, manifest_path(new.folder, file_stem(problem))
    if not (is_unchanged(path) and is_unchanged(manifest)):
        return
    if read_manifest(manifest).document["sha256"] == problem.sha256:
        earlier, now = (_read_answer(folder / solution_name, problem) for folder in (new.folder, new.path))
        if _rank(earlier) < _rank(now):
            notice(kept_notice(solution_name, _describe_answer(earlier), _describe_answer(now)))
            new.kept.update((solution_name, log_name))


def _read_answer(path: Path, problem: Problem) -> Solution | None:
    """The answer in a file that this program wrote for the problem; None without one."""
    try:
        return read_solution(path, problem, identified=True)
    except CrossfieldError:
        return None


def _rank(answer: Solution | None) -> tuple[bool, float, bool]:
    """A key that sorts the best answer first."""
    if answer is None or answer.objective is None or answer.doubt:
        return True, 0.0, True
    return False, float(f"{answer.objective:.9g}"), not answer.status.is_optimal


def _describe_answer(answer: Solution | None) -> str:
    if answer is None or answer.objective is None:
        return "no point"
    return f"objective {answer.objective:.6g}, {answer.status}"


def keep_better_field(
    new: NewResults,
    name: str,
    now: CrossField | None,
    notice: Progress,
    *,
    on: Instance,
    value: Callable[[CrossField], float] = lambda field: field.energy().total,
    also_equal: bool = False,
) -> None:
    """Keep an earlier field on an instance if it is better than the one found now, or none is.

    value: what a better field has less of; by default its 2-norm energy. also_equal: whether the earlier one
    stays, without a notice, if both are equally good.
    """
    earlier = earlier_field(new.folder / name, on)
    if earlier is None:
        return
    was, found = value(earlier), None if now is None else value(now)
    if found is None or was < found - SAME * (1 + abs(found)):
        notice(kept_notice(name, f"energy {was:.6g}", "no field" if found is None else f"energy {found:.6g}"))
        new.kept.add(name)
    elif also_equal and was <= found + SAME * (1 + abs(found)):
        new.kept.add(name)


def objective_function(problem: Problem) -> Callable[[CrossField], float]:
    """The objective of fields; the 2-norm energy where jumps are data, as other jumps are another problem."""
    if problem.jumps is not None:
        return lambda field: field.energy().total
    return lambda field: problem.objective_value(problem.point(field))
