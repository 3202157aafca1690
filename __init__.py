"""Crossfield: from a rough concept sketch to optimization instances, and from solvers' answers back to a cross field.

The verbs are imported on first use, so that `import crossfield` itself takes milliseconds.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from .export.draw import draw as draw
    from .export.formats import write as write
    from .export.manifest import read_manifest as read_manifest
    from .export.manifest import write_all as write_all
    from .export.manifest import write_problem as write_problem
    from .export.pyomo_model import to_pyomo as to_pyomo
    from .export.run import run as run
    from .export.solution import Solution as Solution
    from .export.solution import read_solution as read_solution
    from .export.solvers import Limits as Limits
    from .export.solvers import solve as solve
    from .export.stages import fit_angles as fit_angles
    from .export.stages import two_stage as two_stage
    from .models.analytic import analytic as analytic
    from .models.errors import CrossfieldError as CrossfieldError
    from .models.field import CrossField as CrossField
    from .models.field_file import read_field as read_field
    from .models.field_file import write_field as write_field
    from .models.greedy import greedy as greedy
    from .models.improvement import improved as improved
    from .models.instance import Instance as Instance
    from .models.instance_file import read_instance as read_instance
    from .models.instance_file import write_instance as write_instance
    from .models.power_field import power_field as power_field
    from .models.problem import Problem as Problem
    from .models.problem import formulate as formulate
    from .models.problem import with_integers_fixed as with_integers_fixed
    from .models.samples import sample as sample
    from .models.samples import samples as samples
    from .models.search import Search as Search
    from .models.search import search as search
    from .models.sketch import read_sketch as read_sketch

_HOME: Final = {
    "CrossField": ".models.field",
    "CrossfieldError": ".models.errors",
    "Instance": ".models.instance",
    "Limits": ".export.solvers",
    "Problem": ".models.problem",
    "Search": ".models.search",
    "Solution": ".export.solution",
    "analytic": ".models.analytic",
    "draw": ".export.draw",
    "fit_angles": ".export.stages",
    "formulate": ".models.problem",
    "greedy": ".models.greedy",
    "improved": ".models.improvement",
    "power_field": ".models.power_field",
    "read_field": ".models.field_file",
    "read_instance": ".models.instance_file",
    "read_manifest": ".export.manifest",
    "read_sketch": ".models.sketch",
    "read_solution": ".export.solution",
    "run": ".export.run",
    "sample": ".models.samples",
    "samples": ".models.samples",
    "search": ".models.search",
    "solve": ".export.solvers",
    "to_pyomo": ".export.pyomo_model",
    "two_stage": ".export.stages",
    "with_integers_fixed": ".models.problem",
    "write": ".export.formats",
    "write_all": ".export.manifest",
    "write_field": ".models.field_file",
    "write_instance": ".models.instance_file",
    "write_problem": ".export.manifest",
}
"""Every public name and the module it comes from."""

__all__ = sorted(_HOME)  # noqa: PLE0605 - the table above is the one list of names


def __getattr__(name: str) -> Any:
    """The public object of that name, imported now."""
    if name not in _HOME:
        raise AttributeError(f"module 'crossfield' has no attribute {name!r}")
    return getattr(import_module(_HOME[name], __name__), name)


def __dir__() -> list[str]:
    """The public names."""
    return sorted({*globals(), *_HOME})
