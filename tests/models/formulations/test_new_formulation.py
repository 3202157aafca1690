"""A tenth formulation is one function: declared here, and then listed, written, read,
solved and verified like the nine.
"""

import crossfield as cf
import numpy as np
import pytest
from crossfield.export.bundle.manifest import read_manifest, write_all
from crossfield.export.cli.tables import tables
from crossfield.export.formats.registry import FORMATS
from crossfield.export.library.checking.check_library import verify_library
from crossfield.export.verify.checks import Verdict
from crossfield.export.verify.verify import verify
from crossfield.models.formulations import declaration
from crossfield.models.formulations.catalogue import jump_bounds, skew, strokes
from crossfield.models.formulations.declaration import FORMULATIONS, E, formulation, row, term
from crossfield.models.formulations.latex import latex
from crossfield.models.formulations.symbols import A, s
from libraries import library_of

LIBRARY = """formulations = ["toy"]
[rungs.medium]
sizes = [3]
formats = ["mps"]
[[sketches]]
name = "rand"
random = "full"
seeds = [1]
points = "greedy"
"""


@pytest.fixture
def toy():
    """The declaration of a formulation that smooths directions alone,
    in the table as long as the test runs.
    """

    before = list(FORMULATIONS)

    @formulation(
        "toy", paper="a test", kind="MILP", short="toy", minimises="changes of direction", how="alone"
    )
    def directions(stroke_norm: int = 1):
        """Directions alone."""
        yield term("smooth", E, 2 * s)
        yield row(14, E, s >= A)
        yield row(15, E, s >= -A)
        yield from jump_bounds()
        yield from strokes(stroke_norm)
        yield from skew(norm=1)

    yield directions
    del declaration._TABLE["toy"]
    assert list(FORMULATIONS) == before


@pytest.mark.slow
def test_a_toy_formulation_is_one_function(toy, tmp_path):
    instance = cf.sample("skew", 4)
    field = cf.greedy_field(instance)
    problem = cf.formulate(instance, "toy")
    (listed,) = (each for each in tables()["formulations"][1] if each["name"] == "toy")
    assert (listed["class"], listed["summary"]) == ("MILP", "directions alone")
    assert (problem.problem_class, problem.convex, toy.settable) == ("MILP", True, {"relax", "stroke_norm"})
    assert cf.formulate(instance, "toy", stroke_norm=2).problem_class == "MIQP"
    assert r"\sum_{(i,j) \in E} 2 s_{ij}" in latex(problem.formulation)
    (manifest,) = write_all(instance, tmp_path, formulations=["toy"], formats=tuple(FORMATS), start=field)
    assert {each["format"] for each in manifest.document["files"]} >= set(FORMATS)
    assert read_manifest(manifest.path).problem().sha256 == problem.sha256
    solution = cf.solve(problem, folder=tmp_path / "solve", start=field)
    grid, alpha = instance.grid, solution.field.alpha
    turned = alpha[grid.first] - alpha[grid.second] + np.pi / 2 * solution.field.p
    least = 2 * np.abs(turned).sum() + solution.field.energy(1).strokes + solution.field.energy(1).beta
    assert solution.objective == pytest.approx(least, abs=1e-6)
    assert solution.violation.worst < 1e-6
    write_all(instance, tmp_path / "verified", formulations=["toy"], formats=["nl", "mps"])
    checked = verify(tmp_path / "verified")
    assert checked.ok
    assert sum(check.verdict is Verdict.AGREES for check in checked.checks) >= 2  # HiGHS and CasADi at least
    library = library_of(tmp_path / "library", LIBRARY)
    assert library.document["entries"] == ["cf_rand_n003_s1_toy"]
    assert library.entry("cf_rand_n003_s1_toy")["best"]["objective"] >= 0
    assert verify_library(library.folder) == []
