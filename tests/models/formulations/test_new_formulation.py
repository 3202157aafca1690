"""A tenth formulation with a new symbol, a ninth format and another solver are additions to tables: they are
listed, written, read, solved, verified and put into libraries like the others.
"""

import subprocess
import sys

import crossfield as cf
import numpy as np
import pytest
from additions import additions
from crossfield.export.bundle.manifest import read_manifest
from crossfield.export.bundle.problem_files import write_all
from crossfield.export.cli.tables import tables
from crossfield.export.formats.registry import FORMATS
from crossfield.export.library.building.verification import verify_library
from crossfield.export.solvers_table import SOLVERS
from crossfield.export.verify.checks import Verdict
from crossfield.export.verify.verify import verify
from libraries import library_of

LIBRARY = """formulations = ["toy"]
[rungs.medium]
sizes = [3]
formats = ["mps", "toy"]
[[sketches]]
name = "rand"
random = "full"
seeds = [1]
points = "greedy"
"""
ENTRY = "cf_rand_n003_s1_toy"


@pytest.fixture
def toy():
    with additions() as declaration:
        yield declaration


@pytest.fixture
def instance():
    return cf.sample("skew", 4)


def test_a_new_formulation_is_listed(toy, instance):
    problem = cf.formulate(instance, "toy")
    (listed,) = (row for row in tables()["formulations"] if row["name"] == "toy")
    assert (listed["class"], listed["summary"]) == ("MILP", "directions alone")
    assert (problem.problem_class, problem.is_convex, toy.option_names) == (
        "MILP",
        True,
        {"relax", "stroke_norm"},
    )
    assert cf.formulate(instance, "toy", stroke_norm=2).problem_class == "MIQP"
    assert r"\sum_{(i,j) \in E} 2 v_{ij}" in problem._repr_latex_()


@pytest.mark.parametrize("solver", ["highs", "twin"])
def test_a_new_formulation_is_written_solved_and_read(toy, instance, solver, tmp_path):
    problem, field = cf.formulate(instance, "toy"), cf.greedy_field(instance)
    (manifest,) = write_all(instance, tmp_path, formulations=["toy"], formats=tuple(FORMATS), start=field)
    assert {file["format"] for file in manifest.document["files"]} == set(FORMATS)
    assert set(manifest.document["solvers"]) == set(SOLVERS)
    assert read_manifest(manifest.path).problem().sha256 == problem.sha256
    solution = cf.solve(problem, solver, folder=tmp_path / "solve", start=field)
    grid, alpha = instance.grid, solution.field.alpha
    turned = alpha[grid.first] - alpha[grid.second] + np.pi / 2 * solution.field.p
    least = 2 * np.abs(turned).sum() + solution.field.energy(1).strokes + solution.field.energy(1).beta
    assert solution.objective == pytest.approx(least, abs=1e-6)
    assert solution.violation.worst < 1e-6


@pytest.mark.slow
def test_a_new_formulation_is_verified(toy, instance, tmp_path):
    write_all(instance, tmp_path, formulations=["toy"], formats=tuple(FORMATS))
    checked = verify(tmp_path, seconds=10, programs=["highs", "casadi"])
    assert checked.is_ok
    agreed = {check.program for check in checked.checks if check.verdict is Verdict.AGREES}
    assert agreed == {"highs", "twin", "casadi", "bonmin"}


@pytest.mark.slow
def test_a_new_formulation_is_in_a_library(toy, tmp_path):
    library = library_of(tmp_path, LIBRARY)
    assert library.document["entries"] == [ENTRY]
    sidecar = library.entry(ENTRY)
    assert {file["format"] for file in sidecar["files"]} >= {"mps", "toy"}
    assert sidecar["best"]["objective"] >= 0
    assert verify_library(library.folder) == []
    command = [sys.executable, "-I", "check_point.py", f"{ENTRY}.mps", f"{ENTRY}.sol"]
    done = subprocess.run(command, cwd=library.folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
