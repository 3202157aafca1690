"""The two stages of section 5 of the paper: a MILP for the jumps, then the box QP for the angles."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from ...models.arguments import check_arguments
from ...models.field.field import CrossField
from ...models.formulations.catalogue import FORMULATIONS
from ...models.formulations.declaration import Options
from ...models.formulations.problem import formulate
from ...models.instance.instance import Instance
from ...models.processes.deadline import Deadline, Stop
from ...models.processes.limits import Limits
from ...models.search.starts import first_field
from ..solutions.solution import Solution
from .local import solve

_ANGLES: Final = 0.2
"""Share of the time, and least seconds, reserved for the second stage: its process has to start."""
_ANGLES_LEAST: Final = 2.0
_STARTING: Final = 0.5  # share of the time of the first stage for its start


@dataclass(frozen=True, eq=False)
class TwoStage:
    """Solutions of both stages.

    Parameters
    ----------
    milp
        Solution of `milp-mccormick`, whose jumps the second stage takes.
    qp
        Solution of `qp-fixed`. `field` comes from it, or from the first stage if it has no point.

    """

    milp: Solution
    qp: Solution

    @property
    def field(self) -> CrossField:
        """The field with the jumps of the first stage and the angles of the second."""
        return self.qp.field if self.qp.point is not None else self.milp.field


@check_arguments
def fit_angles(
    field: CrossField,
    *,
    folder: str | Path | None = None,
    limits: Limits | None = None,
    stop: Stop | None = None,
) -> Solution:
    """Solve `qp-fixed` by Ipopt for the jumps of a field, from its angles: the second stage.

    The answer is the field of minimum 2-norm energy for these jumps within the windows (section 5 of the
    paper; a convex QP).

    Parameters
    ----------
    field
        The field.
    folder, limits, stop
        As for `solve`.

    Returns
    -------
    Solution
        The answer.

    Raises
    ------
    MissingSolverError, SolverError, SolutionError
        As for `solve`.

    """
    problem = formulate(field.instance, "qp-fixed", p=field.p)
    return solve(problem, "ipopt", folder=folder, limits=limits, start=field, stop=stop)


def find_jumps(
    instance: Instance,
    *,
    folder: str | Path | None = None,
    limits: Limits | None = None,
    start: CrossField | None = None,
    stop: Stop | None = None,
    **options: Any,
) -> Solution:
    """Solve `milp-mccormick` by HiGHS: the first stage.

    start: the incumbent passed to HiGHS, the first field when None: without a start HiGHS finds no good field
    beyond 10 x 10 pixels. limits: from now on. options: facet, stroke_norm, beta_norm. Raises SolverError,
    SolutionError.
    """
    limits = Limits.finite_or_default(limits)
    deadline = Deadline.after(limits.time_limit)
    start = start or first_field(instance, deadline.share(_STARTING).passed)
    foreign = set(Options.__dataclass_fields__) - set(FORMULATIONS["milp-mccormick"].option_names)
    chosen = {key: value for key, value in options.items() if key not in foreign}
    problem = formulate(instance, "milp-mccormick", **chosen)
    return solve(problem, None, folder=folder, limits=limits.until(deadline), start=start, stop=stop)


@check_arguments
def two_stage(
    instance: Instance,
    *,
    folder: str | Path | None = None,
    limits: Limits | None = None,
    start: CrossField | None = None,
    stop: Stop | None = None,
    **options: Any,
) -> TwoStage:
    """Solve `milp-mccormick` by HiGHS and then, with its jumps fixed, `qp-fixed` by Ipopt.

    This is section 5 of the paper.

    Parameters
    ----------
    instance
        The instance.
    folder
        As for `solve`.
    limits
        Limits of both stages together; `Limits()` by default.
    start
        The first incumbent. None: the first field.
    stop
        A function that returns whether to stop, or an event. The second stage then starts with the best
        point of the first.
    options
        Options of `milp-mccormick`: facet, stroke_norm, beta_norm.

    Returns
    -------
    TwoStage
        `.milp` and `.qp`, the two solutions, and `.field`, with the jumps of the first and the angles of the
        second.

    Raises
    ------
    MissingSolverError, SolverError, SolutionError
        As for `solve`.

    """
    limits = Limits.finite_or_default(limits)
    deadline = Deadline.after(limits.time_limit)
    first = limits.until(jumps_until(deadline))
    milp = find_jumps(instance, folder=folder, limits=first, start=start, stop=stop, **options)
    return TwoStage(milp, fit_angles(milp.field, folder=folder, limits=limits.until(deadline), stop=stop))


def jumps_until(deadline: Deadline) -> Deadline:
    """Deadline of the first stage: a fifth or 2 s before the whole deadline, but not before half the time."""
    left = deadline.left()
    return deadline.later(-min(max(_ANGLES * left, _ANGLES_LEAST), left / 2))
