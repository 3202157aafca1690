"""The limits of free editions are those at which programs refuse a model, and no licence is no program."""

import re

import crossfield as cf
import pytest
from cases import make_instance
from crossfield.export.licences import licence_error
from crossfield.export.solvers_table import PROGRAMS


def gurobi(columns, rows, *, quadratic):
    import gurobipy

    with gurobipy.Env(params={"OutputFlag": 0}) as environment, gurobipy.Model(env=environment) as model:
        x = model.addVars(columns, ub=1.0)
        model.addConstrs(x[k % columns] + x[(k + 1) % columns] <= 1 for k in range(rows))
        model.setObjective(x.sum() + (x[0] * x[0] if quadratic else 0.0))
        model.optimize()


def cplex(columns, rows, *, quadratic):
    import cplex

    with cplex.Cplex() as model:
        for stream in (model.set_log_stream, model.set_results_stream, model.set_error_stream):
            stream(None)
        model.variables.add(obj=[1.0] * columns, ub=[1.0] * columns)
        pairs = [[[k % columns, (k + 1) % columns], [1.0, 1.0]] for k in range(rows)]
        model.linear_constraints.add(lin_expr=pairs, senses="L" * rows, rhs=[1.0] * rows)
        if quadratic:
            model.objective.set_quadratic([1.0] + [0.0] * (columns - 1))
        model.solve()


def xpress(columns, rows, *, quadratic):
    import xpress

    model = xpress.problem()
    model.controls.outputlog = 0
    x = [model.addVariable(ub=1.0) for _ in range(columns)]
    model.addConstraint([x[k % columns] + x[(k + 1) % columns] <= 1 for k in range(rows)])
    model.setObjective(xpress.Sum(x) + (x[0] * x[0] if quadratic else 0.0))
    model.optimize()


TOO_LARGE = "too large|size limits|too many rows and columns"
"""Words of an error by which an edition refuses a model for its size."""


@pytest.mark.parametrize(
    "takes, numbers, most, beyond",
    [
        pytest.param(
            gurobi, [2000, 2000, 200],
            [(2000, 2000, False), (200, 500, True)], [(2001, 1, False), (2, 2001, False), (201, 1, True)],
            marks=pytest.mark.needs("gurobi"),
        ),
        pytest.param(
            cplex, [1000, 1000],
            [(1000, 1000, False), (1000, 1000, True)], [(1001, 1, False), (2, 1001, False)],
            marks=pytest.mark.needs("cplex"),
        ),
        pytest.param(
            xpress, [5000, 200],
            [(2500, 2500, False), (150, 50, True)], [(2501, 2500, False), (151, 50, True)],
            marks=pytest.mark.needs("xpress"),
        ),
    ],
)  # fmt: skip
@pytest.mark.filterwarnings("ignore")  # Xpress warns that its edition is free
def test_a_free_edition_takes_models_up_to_its_limits(takes, numbers, most, beyond):
    assert [int(word) for word in re.findall(r"\d+", PROGRAMS[takes.__name__].free)] == numbers
    for columns, rows, quadratic in most:
        takes(columns, rows, quadratic=quadratic)
    for columns, rows, quadratic in beyond:
        with pytest.raises(Exception, match=TOO_LARGE):
            takes(columns, rows, quadratic=quadratic)


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
@pytest.mark.smoke
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
    with pytest.raises(cf.MissingSolverError, match="does not accept its licence"):
        cf.solve(cf.formulate(make_instance(), "milp-mccormick"), name)


@pytest.mark.parametrize(
    "code, line, words",
    [
        (7, "*** Time-limited license expired 1 days ago", "Time-limited license expired 1 days ago"),
        (2, "*** Status: Compilation error(s)", ""),
        (0, "*** Status: Normal completion", ""),
    ],
)
@pytest.mark.smoke
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
