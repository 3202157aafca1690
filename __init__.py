"""From a concept sketch to optimization instances, and from solvers' answers back to a cross field.

All public names are here, the errors too: every error that crossfield raises on purpose is a
`CrossfieldError`. Names are imported on first use, so that `import crossfield` itself takes milliseconds.

Options are keywords, and one word has one meaning in every function:

- `limits`: a `Limits` with the time limit in seconds, the relative gap, and the threads.
- `jobs`: number of processes, or of files written at the same time; `threads`, in `Limits`, are those inside
  one solver.
- `progress`: a function that receives lines of text.
- `stop`: a function without arguments that returns whether to stop, or an event such as `threading.Event`.
  The work then ends early and returns the best result so far.
- `start`: a field to begin with.

Results have the field that was found as `.field`: `Search`, `Proof`, `Solution` and `Report`.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from .export.bundle.manifest import read_manifest as read_manifest
    from .export.bundle.problem_files import write_all as write_all
    from .export.bundle.problem_files import write_problem as write_problem
    from .export.formats.pyomo_model import to_pyomo as to_pyomo
    from .export.formats.registry import write as write
    from .export.library.building.shipped_entries import LibraryEntry as LibraryEntry
    from .export.library.building.shipped_entries import entries as entries
    from .export.library.building.shipped_entries import entry as entry
    from .export.pictures.draw import draw as draw
    from .export.pictures.draw import preview as preview
    from .export.pictures.mask import write_mask as write_mask
    from .export.runs.report import Report as Report
    from .export.runs.run import run as run
    from .export.shading.colours import Light as Light
    from .export.solutions.solution import Solution as Solution
    from .export.solutions.solution import read_solution as read_solution
    from .export.solving.local import solve as solve
    from .export.surfaces.files import write_surface as write_surface
    from .models.errors import CrossfieldError as CrossfieldError
    from .models.errors import DomainError as DomainError
    from .models.errors import FormulationError as FormulationError
    from .models.errors import InputError as InputError
    from .models.errors import InstanceError as InstanceError
    from .models.errors import MeshError as MeshError
    from .models.errors import MissingSolverError as MissingSolverError
    from .models.errors import NoStrokeError as NoStrokeError
    from .models.errors import OutputError as OutputError
    from .models.errors import SolutionError as SolutionError
    from .models.errors import SolverError as SolverError
    from .models.errors import UnsupportedByFormatError as UnsupportedByFormatError
    from .models.errors import UnsupportedBySolverError as UnsupportedBySolverError
    from .models.field.field import CrossField as CrossField
    from .models.field.file import read_field as read_field
    from .models.field.file import write_field as write_field
    from .models.formulations.arrays import ProblemArrays as ProblemArrays
    from .models.formulations.problem import Problem as Problem
    from .models.formulations.problem import formulate as formulate
    from .models.formulations.problem import with_integers_fixed as with_integers_fixed
    from .models.instance.file import read_instance as read_instance
    from .models.instance.file import write_instance as write_instance
    from .models.instance.instance import Instance as Instance
    from .models.instance.mesh import Mesh as Mesh
    from .models.mesh.read import read_mesh as read_mesh
    from .models.processes.limits import Limits as Limits
    from .models.proof.certificate import read_certificate as read_certificate
    from .models.proof.certificate import write_certificate as write_certificate
    from .models.proof.descent.record import Claim as Claim
    from .models.proof.descent.record import Proof as Proof
    from .models.proof.prove import prove as prove
    from .models.samples.samples import sample as sample
    from .models.samples.samples import samples as samples
    from .models.search.greedy import greedy_field as greedy_field
    from .models.search.improvement import improved_field as improved_field
    from .models.search.search import Search as Search
    from .models.search.search import search as search
    from .models.sketch.random_strokes import random_instance as random_instance
    from .models.sketch.read import read_sketch as read_sketch
    from .models.sketch.surfaces import analytic as analytic
    from .models.smooth.bend import bend_field as bend_field
    from .models.smooth.polyvector import polyvector_field as polyvector_field
    from .models.smooth.polyvector import power_field as power_field
    from .models.surface.hints import Hint as Hint
    from .models.surface.lift import surface as surface
    from .models.surface.surface import Surface as Surface

_HOME: Final = {
    "Claim": ".models.proof.descent.record",
    "CrossField": ".models.field.field",
    "CrossfieldError": ".models.errors",
    "DomainError": ".models.errors",
    "FormulationError": ".models.errors",
    "Hint": ".models.surface.hints",
    "InputError": ".models.errors",
    "Instance": ".models.instance.instance",
    "InstanceError": ".models.errors",
    "Mesh": ".models.instance.mesh",
    "MeshError": ".models.errors",
    "LibraryEntry": ".export.library.building.shipped_entries",
    "Light": ".export.shading.colours",
    "Limits": ".models.processes.limits",
    "MissingSolverError": ".models.errors",
    "NoStrokeError": ".models.errors",
    "OutputError": ".models.errors",
    "Problem": ".models.formulations.problem",
    "ProblemArrays": ".models.formulations.arrays",
    "Proof": ".models.proof.descent.record",
    "Report": ".export.runs.report",
    "Search": ".models.search.search",
    "Solution": ".export.solutions.solution",
    "SolutionError": ".models.errors",
    "SolverError": ".models.errors",
    "Surface": ".models.surface.surface",
    "UnsupportedByFormatError": ".models.errors",
    "UnsupportedBySolverError": ".models.errors",
    "analytic": ".models.sketch.surfaces",
    "bend_field": ".models.smooth.bend",
    "draw": ".export.pictures.draw",
    "entries": ".export.library.building.shipped_entries",
    "entry": ".export.library.building.shipped_entries",
    "formulate": ".models.formulations.problem",
    "greedy_field": ".models.search.greedy",
    "improved_field": ".models.search.improvement",
    "polyvector_field": ".models.smooth.polyvector",
    "power_field": ".models.smooth.polyvector",
    "preview": ".export.pictures.draw",
    "prove": ".models.proof.prove",
    "random_instance": ".models.sketch.random_strokes",
    "read_certificate": ".models.proof.certificate",
    "read_field": ".models.field.file",
    "read_instance": ".models.instance.file",
    "read_manifest": ".export.bundle.manifest",
    "read_mesh": ".models.mesh.read",
    "read_sketch": ".models.sketch.read",
    "read_solution": ".export.solutions.solution",
    "run": ".export.runs.run",
    "sample": ".models.samples.samples",
    "samples": ".models.samples.samples",
    "search": ".models.search.search",
    "solve": ".export.solving.local",
    "surface": ".models.surface.lift",
    "to_pyomo": ".export.formats.pyomo_model",
    "with_integers_fixed": ".models.formulations.problem",
    "write": ".export.formats.registry",
    "write_all": ".export.bundle.problem_files",
    "write_certificate": ".models.proof.certificate",
    "write_field": ".models.field.file",
    "write_instance": ".models.instance.file",
    "write_mask": ".export.pictures.mask",
    "write_problem": ".export.bundle.problem_files",
    "write_surface": ".export.surfaces.files",
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
