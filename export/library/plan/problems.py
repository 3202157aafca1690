"""Problems of entries, without what makes their instances."""

from __future__ import annotations

from ....models.formulations.catalogue import FORMULATIONS
from ....models.formulations.problem import Problem, formulate
from ....models.instance.domain import Ints
from ....models.instance.instance import Instance


def formulate_entry(instance: Instance, formulation: str, facet: str, jumps: Ints | None) -> Problem:
    """Return the problem of an entry in its full windows. jumps: fixed ones, which only `qp-fixed` has."""
    declared = FORMULATIONS[formulation]
    options = {"facet": facet} if "facet" in declared.option_names else {}
    return formulate(instance, formulation, p=jumps if declared.fixed else None, **options)
