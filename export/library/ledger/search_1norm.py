"""Fields of low 1-norm energy by HiGHS, with a limit of nodes: every build finds the same."""

from __future__ import annotations

import tempfile
from importlib.metadata import version
from pathlib import Path
from typing import Final

from ....models.errors import SolutionError
from ....models.field.field import CrossField
from ....models.formulations.problem import Problem, formulate, with_integers_fixed
from ...bundle.starts import write_start
from ...formats.registry import write
from ...solutions.solution import read_solution
from .points import Known, Provenance, field_of

NODES: Final = {"tiny": 1000, "small": 20}
"""Nodes of the branch and bound on a rung; none where the rung is missing."""
LP_UP_TO: Final = 1000
"""Pixels up to which the angles are fitted in the 1-norm."""


def better_in_1norm(start: CrossField, rung: str) -> list[Known]:
    """Return fields of lower 1-norm energy than a start.

    One has the best angles for its jumps; on the lower rungs another one comes from a search over jumps.
    """
    if start.instance.grid.size > LP_UP_TO:
        return []
    problem = formulate(start.instance, "milp-mccormick")  # whose objective is the 1-norm energy
    fitted = _solved(with_integers_fixed(problem, start), nodes=0, start=None)
    found = [] if fitted is None else [fitted]
    if rung in NODES:
        searched = _solved(problem, nodes=NODES[rung], start=fitted or start)
        found += [] if searched is None else [searched]
    return [Known(each, Provenance("HiGHS", version("highspy"))) for each in found]


def _solved(problem: Problem, nodes: int, start: CrossField | None) -> CrossField | None:
    """The field that HiGHS finds within a number of nodes, or None."""
    with tempfile.TemporaryDirectory(prefix="crossfield-") as folder:
        model, first, answer = (Path(folder) / name for name in ("model.mps", "start.sol", "answer.sol"))
        write(problem, model)
        if start is not None:
            write_start(problem, start, first, "highs")
        _run(model, first, answer, nodes)
        try:
            found = read_solution(answer, problem)
        except SolutionError:
            return None
    return None if found.point is None else field_of(problem, found.point)


def _run(model: Path, first: Path, answer: Path, nodes: int) -> None:
    from ...programs.highs import loaded, set_options, solved, write_solution

    highs = loaded(model, threads=1, parallel="off", mip_rel_gap=1e-6, mip_abs_gap=1e-9)
    if nodes:
        set_options(highs, mip_max_nodes=nodes)
    if first.exists():
        highs.readSolution(str(first), 0)
    write_solution(solved(highs, model), answer)
