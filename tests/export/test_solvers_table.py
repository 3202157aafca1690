"""The table of solvers is the only place with their facts."""

from __future__ import annotations

import os
import shutil
import subprocess
from importlib.util import find_spec
from pathlib import Path

import crossfield as cf
import pytest
from cases import make_instance
from crossfield.export.bundle.manifest import read_manifest
from crossfield.export.bundle.problem_files import write_all
from crossfield.export.cli.tables import tables
from crossfield.export.licences import licence_error
from crossfield.export.solvers_table import BUNDLED, PROGRAMS, SOLVERS, Refusal, Solver
from crossfield.models.errors import MissingSolverError
from crossfield.models.formulations.catalogue import FORMULATIONS

pytestmark = pytest.mark.smoke

TOY = Solver(
    "toy", "Toy", ("lp",), "cbc", {"quadratic rows": Refusal("read", "Toy reads no products, at no price")}
)


def test_a_solver_that_others_run_is_one_entry(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """`list`, the manifest and the table of programs show it without other changes."""
    monkeypatch.setitem(SOLVERS, "toy", TOY)
    answers = {row["formulation"]: row["toy"] for row in tables()["externals"]}
    assert set(answers) == set(FORMULATIONS)
    assert answers["milp-mccormick"] == "yes"
    assert "Toy reads no products" in answers["miqcp-bilinear"]
    write_all(make_instance("hole"), tmp_path, formulations=["milp-mccormick"], formats=["lp"])
    (manifest,) = tmp_path.glob("*.manifest.json")
    assert read_manifest(manifest).document["solvers"]["toy"]["format"] == "lp"
    assert PROGRAMS["cbc"].solvers == ("cbc", "toy")


def test_a_program_that_is_not_here_says_how_to_get_it():
    absent = Solver("absent", "Absent", ("lp",), "highs", package="no_such_package")
    assert find_spec("no_such_package") is None
    assert absent.missing == "Absent is not installed; pip install no_such_package"
    assert BUNDLED["highs"].missing == ""


@pytest.fixture
def fresh_licences():
    """Licences are tried again in this test, and after it."""
    licence_error.cache_clear()
    yield
    licence_error.cache_clear()


@pytest.mark.parametrize(
    "name, variable, words",
    [
        pytest.param("gurobi", "GRB_LICENSE_FILE", "No HostID", marks=pytest.mark.needs("gurobi")),
        pytest.param("xpress", "XPAUTH_PATH", "Xpress licensing error 1", marks=pytest.mark.needs("xpress")),
    ],
)
@pytest.mark.usefixtures("fresh_licences")
def test_a_program_that_refuses_its_licence_is_absent(name, variable, words, tmp_path, monkeypatch):
    """A file without a licence is refused by the same error as a licence that has ended."""
    (tmp_path / "empty.lic").write_text("nothing\n")
    monkeypatch.setenv(variable, str(tmp_path / "empty.lic"))
    title, package = PROGRAMS[name].title, PROGRAMS[name].needs
    assert PROGRAMS[name].missing.startswith(f"{title} does not accept its licence ({words}")
    assert PROGRAMS[name].missing.endswith(
        f"; pip install --upgrade {package}, or install a licence of your own"
    )
    with pytest.raises(MissingSolverError, match="does not accept its licence"):
        cf.solve(cf.formulate(make_instance(), "milp-mccormick"), name)


@pytest.mark.parametrize(
    "code, line, words",
    [
        (7, "*** Time-limited license expired 1 days ago", "Time-limited license expired 1 days ago"),
        (2, "*** Status: Compilation error(s)", ""),
        (0, "*** Status: Normal completion", ""),
    ],
)
@pytest.mark.usefixtures("fresh_licences")
def test_gams_that_ends_with_an_error_of_its_licence_has_none(tmp_path, monkeypatch, code, line, words):
    """The codes are those of GAMS: 2 is an error of the model, 7 one of the licence."""
    package = tmp_path / "gamspy_base"
    package.mkdir()
    (package / "__init__.py").write_text("")
    (package / "gams").write_text(f"#!/bin/sh\necho '{line}'\nexit {code}\n")
    (package / "gams").chmod(0o755)
    monkeypatch.syspath_prepend(tmp_path)
    assert licence_error("gams") == words


def test_a_program_that_is_hidden_is_absent_and_its_neighbours_are_not(tmp_path, monkeypatch, hidden):
    for name in ("glpsol", "neighbour"):
        (tmp_path / name).write_text("#!/bin/sh\n")
        (tmp_path / name).chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path), prepend=os.pathsep)
    assert SOLVERS["glpk"].missing == ""
    hidden("glpsol")
    assert SOLVERS["glpk"].missing == "GLPK is not installed; apt install glpk-utils"
    assert subprocess.run([shutil.which("neighbour")], check=False).returncode == 0
