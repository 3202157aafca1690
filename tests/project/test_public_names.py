"""The top-level package: its names, their docstrings, and the cost of importing it."""

import inspect
import re
import subprocess
import sys

import crossfield
import pytest
from crossfield.models import errors


def loaded_after(code):
    """Top-level names of the modules that are loaded after some lines of Python in a fresh process."""
    program = f"import sys\n{code}\nprint(*sorted({{name.split('.')[0] for name in sys.modules}}))"
    return {*subprocess.check_output([sys.executable, "-c", program], text=True).split()}


def test_the_public_names_are_there():
    assert set(crossfield.__all__) <= set(dir(crossfield))
    with pytest.raises(AttributeError, match="no attribute 'wings'"):
        _ = crossfield.wings


def test_every_error_that_is_raised_on_purpose_is_of_a_public_kind_besides_the_base():
    for thing in filter(is_error, vars(errors).values()):
        kinds = {base.__name__ for base in thing.__mro__} & set(crossfield.__all__)
        assert "CrossfieldError" in kinds
        assert len(kinds) > 1 or thing is crossfield.CrossfieldError


def is_error(thing):
    return inspect.isclass(thing) and issubclass(thing, crossfield.CrossfieldError)


HEAVY = {"jinja2", "pyomo", "casadi", "highspy", "pyscipopt", "gurobipy", "rich", "typer"}


@pytest.mark.parametrize(
    "code, more",
    [
        ("import crossfield", {"numpy", "scipy", "sympy", "numba", "PIL"}),
        ("import crossfield as cf\ncf.entries()", {"scipy", "sympy", "numba", "PIL", "jsonschema"}),
        ("import crossfield as cf\ncf.greedy_field(cf.sample('skew', 6))", set()),
    ],
)
def test_what_a_call_does_not_need_is_not_loaded(code, more):
    assert not loaded_after(code) & (HEAVY | more)


@pytest.mark.parametrize("name", crossfield.__all__)
def test_the_reference_describes_every_parameter(name):
    """In numpydoc sections, which the API reference shows; errors have their message alone."""
    public = getattr(crossfield, name)
    if inspect.isclass(public) and issubclass(public, Exception):
        return
    text = inspect.getdoc(public) or ""
    named = list(inspect.signature(public).parameters)
    described = re.split(r"^(?:Parameters|Attributes)\n-+\n", text, maxsplit=1, flags=re.MULTILINE)
    assert len(described) == 2 or not named
    entries = re.findall(r"^([a-z_]\w*(?:, \w+)*)$", described[-1].partition("\n\n")[0], re.MULTILINE)
    listed = {word for entry in entries for word in entry.split(", ")}
    assert [word for word in named if not word.startswith("_") and word not in listed] == []


def test_results_print_on_one_line_with_what_they_are(tmp_path):
    instance = crossfield.sample("skew", 4, name="mine")
    problem = crossfield.formulate(instance, "milp-mccormick")
    field = crossfield.greedy_field(instance)
    manifest = crossfield.write(problem, tmp_path, formats=["lp", "mps"])
    proof = crossfield.prove(instance)
    crossfield.write_certificate(proof, tmp_path / "c.npz")
    for thing, words in (
        (crossfield.sample("disc").mesh, "<Mesh: 54 faces"),
        (problem.to_arrays(), f"<ProblemArrays: {problem.n_columns} columns"),
        (manifest, f"<Manifest {manifest.path}: milp-mccormick in lp, mps>"),
        (crossfield.surface(field), "<Surface on mine: "),
        (proof, f"<Proof on mine: optimal, norm 2, energy {proof.energy:.6g}, bound"),
        (crossfield.read_certificate(tmp_path / "c.npz"), "<Claim on mine: optimal, norm 2, energy"),
    ):
        assert repr(thing).startswith(words)
        assert len(repr(thing)) < 250
        assert "\n" not in repr(thing)
