"""Specifications of libraries, libraries built from them, and what they hold."""

import json

from crossfield.export.library.building.build import build, rebuild
from crossfield.export.library.building.verification import verify_library
from crossfield.export.library.contributions.points import add_points
from crossfield.export.library.documents.documents import problem_of, read_library
from crossfield.export.library.plan.spec import read_spec
from folders import LIST

HEAD = 'format = "crossfield-library-spec"\nversion = 1\ntitle = "a library for tests"\n'
OPEN = """formulations = ["milp", "bilin1", "miqp", "exact", "cubic", "qp"]
[rungs.medium]
sizes = [4]
formats = ["mps"]
[[sketches]]
name = "rand"
random = "full"
seeds = [6, 7]
points = "greedy"
"""


def write_spec(folder, text):
    """Write a specification without its head to a folder; return its path."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "spec.toml"
    path.write_text(HEAD + text)
    return path


def spec_of(folder, text):
    """Write a specification without its head to a folder, and read it."""
    return read_spec(write_spec(folder, text))


def library_of(folder, text, name="lib", **options):
    """Build the library of a specification in a folder in it."""
    return build(spec_of(folder, text), folder / name, **options)


def improve(library, points):
    """Bring a library up to date with a folder of points; return what they improve, and refusals, by name."""
    improved, refused = add_points(read_library(library), points)
    rebuild(library)
    return {path.name: names for path, names in improved.items()}, {
        path.name: reason for path, reason in refused.items()
    }


def content(folder):
    """All files of a folder, hidden ones too, except the list of written files."""
    return {path.name: path.read_bytes() for path in folder.iterdir() if path.name != LIST}


def document(library, name):
    """A JSON document of a library: the sidecar of an entry by the name of the entry."""
    return json.loads((library / f"{name}.json").read_text())


def problem(library, name):
    """The problem of an entry."""
    return problem_of(library, document(library, name))


def defects(library):
    """What a verification reports, by file."""
    return {defect.file: defect.what for defect in verify_library(library)}
