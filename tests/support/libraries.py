"""Specifications of libraries, and libraries built from them."""

from crossfield.export.library.building.build import build, rebuild
from crossfield.export.library.contributions.points import add_points
from crossfield.export.library.documents.documents import read_library
from crossfield.export.library.plan.spec import read_spec
from crossfield.models.written_files import LIST

HEAD = 'format = "crossfield-library-spec"\nversion = 1\ntitle = "a library for tests"\n'
OPEN = """formulations = ["milp", "bilin1", "miqp", "exact", "cubic", "qp"]
[rungs.medium]
sizes = [4]
formats = ["mps"]
[[sketches]]
name = "rand"
random = "full"
seeds = [6, 7]
"""


def spec_of(folder, text):
    """Write a specification without its head to a folder, and read it."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "spec.toml").write_text(HEAD + text)
    return read_spec(folder / "spec.toml")


def library_of(folder, text, name="lib"):
    """Build the library of a specification in a folder in it."""
    return build(spec_of(folder, text), folder / name)


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
