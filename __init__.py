"""From a concept sketch to optimization instances, and from solvers' answers back to a cross field.

All public names are here; they are imported on first use, so that `import crossfield` itself takes
milliseconds. Classes that only functions return have no name here. Every error that crossfield raises on
purpose is a `CrossfieldError`.

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

import re
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from .models import above

if TYPE_CHECKING:
    from .export.bundle.manifest import read_manifest as read_manifest
    from .export.bundle.problem_files import write as write
    from .export.bundle.problem_files import write_all as write_all
    from .export.library.building.shipped_entries import entries as entries
    from .export.pictures.draw import draw as draw
    from .export.runs.run import run as run
    from .export.solutions.read import read_solution as read_solution
    from .export.solving.local import solve as solve
    from .export.surfaces.files import write_surface as write_surface
    from .models.errors import CrossfieldError as CrossfieldError
    from .models.errors import FormulationError as FormulationError
    from .models.errors import InputError as InputError
    from .models.errors import InstanceError as InstanceError
    from .models.errors import MissingSolverError as MissingSolverError
    from .models.errors import OutputError as OutputError
    from .models.errors import SolutionError as SolutionError
    from .models.errors import SolverError as SolverError
    from .models.errors import UnsupportedByFormatError as UnsupportedByFormatError
    from .models.errors import UnsupportedBySolverError as UnsupportedBySolverError
    from .models.field.field import CrossField as CrossField
    from .models.field.file import read_field as read_field
    from .models.field.file import write_field as write_field
    from .models.formulations.problem import formulate as formulate
    from .models.instance.file import read_instance as read_instance
    from .models.instance.file import write_instance as write_instance
    from .models.instance.instance import Instance as Instance
    from .models.instance.mesh import Mesh as Mesh
    from .models.mesh.read import read_mesh as read_mesh
    from .models.processes.limits import Limits as Limits
    from .models.proof.certificate import read_certificate as read_certificate
    from .models.proof.certificate import write_certificate as write_certificate
    from .models.proof.prove import prove as prove
    from .models.samples.samples import sample as sample
    from .models.search.greedy import greedy_field as greedy_field
    from .models.search.improvement import improved_field as improved_field
    from .models.search.search import search as search
    from .models.sketch.random_strokes import random_instance as random_instance
    from .models.sketch.read import read_sketch as read_sketch
    from .models.sketch.surfaces import analytic as analytic
    from .models.smooth.bend import bend_field as bend_field
    from .models.smooth.polyvector import polyvector_field as polyvector_field
    from .models.smooth.polyvector import power_field as power_field
    from .models.surface.hints import Hint as Hint
    from .models.surface.lift import surface as surface

_IMPORT: Final = re.compile(r"^    from (\.\S+) import (\w+) as \2$", re.MULTILINE)
_HOME: Final = {name: module for module, name in _IMPORT.findall(Path(__file__).read_text("utf-8"))}
"""Every public name and the module it comes from: the imports above are the one list."""

__all__ = sorted(_HOME)  # noqa: PLE0605 - the imports above are the one list of names


above.packages = lambda: import_module(".export.packages.registry", __name__)
above.pictures = lambda: import_module(".export.pictures.draw", __name__)


def __getattr__(name: str) -> Any:
    """The public object of that name, imported now."""
    if name not in _HOME:
        raise AttributeError(f"module 'crossfield' has no attribute {name!r}")
    return getattr(import_module(_HOME[name], __name__), name)


def __dir__() -> list[str]:
    """The public names."""
    return sorted({*globals(), *_HOME})
