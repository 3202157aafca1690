"""The top-level package: its names, their docstrings, and the cost of importing it."""

import inspect
import re
import subprocess
import sys
from pathlib import Path

import crossfield
import pytest
from crossfield.models import errors

ROOT = Path(crossfield.__file__).parent


def loaded_after(code):
    """Top-level names of the modules that are loaded after some lines of Python in a fresh process."""
    command = [
        sys.executable,
        "-c",
        f"import sys\n{code}\nprint(*sorted({{name.split('.')[0] for name in sys.modules}}))",
    ]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    return set(done.stdout.split())


def test_the_public_names_are_there():
    for name in crossfield.__all__:
        assert getattr(crossfield, name) is not None
    assert set(crossfield.__all__) <= set(dir(crossfield))
    with pytest.raises(AttributeError, match="no attribute 'wings'"):
        _ = crossfield.wings


def test_every_error_that_is_raised_on_purpose_is_public():
    family = {name for name, thing in vars(errors).items() if is_error(thing)}
    assert family <= set(crossfield.__all__)


def is_error(thing):
    return inspect.isclass(thing) and issubclass(thing, crossfield.CrossfieldError)


WORDS = {
    "limits": {"Limits | None"},
    "progress": {"Progress"},
    "stop": {"Stop | None"},
    "jobs": {"int"},
    "start": {"CrossField", "CrossField | None"},
}
"""What a parameter of a public function is by its name."""
POSITIONAL = {"hints", "size", "solver"}
"""Parameters with a default that may be given by position."""


def test_one_word_has_one_meaning_and_options_are_keywords():
    faults = []
    for name in crossfield.__all__:
        thing = getattr(crossfield, name)
        if not inspect.isfunction(thing):
            continue
        for number, parameter in enumerate(inspect.signature(thing).parameters.values()):
            if parameter.name in WORDS and parameter.annotation not in WORDS[parameter.name]:
                faults.append((name, parameter.name, parameter.annotation))
            if parameter.name in {"seconds", "time_limit", "gap", "threads", "is_over", "deadline"}:
                faults.append((name, parameter.name))
            is_keyword = parameter.kind in {parameter.KEYWORD_ONLY, parameter.VAR_KEYWORD}
            optional = number > 0 and parameter.default is not parameter.empty
            if optional and not is_keyword and parameter.name not in POSITIONAL:
                faults.append((name, parameter.name, "by position"))
    assert faults == []


def test_type_checkers_see_the_same_names():
    """The names that are imported for type checkers only are those of the table."""
    text = (ROOT / "__init__.py").read_text()
    static = {
        line.split(" as ")[1].strip(" ,()")
        for line in text.splitlines()
        if " as " in line and "import" in line
    }
    assert static == set(crossfield.__all__)


SOLVERS_AND_LAYOUT = {
    "jinja2",
    "matplotlib",
    "pyomo",
    "casadi",
    "highspy",
    "pyscipopt",
    "gurobipy",
    "rich",
    "typer",
}


def test_a_sketch_becomes_a_field_without_solvers_or_pictures():
    loaded = loaded_after("import crossfield as cf\ncf.greedy_field(cf.sample('skew', 6))")
    assert not loaded & SOLVERS_AND_LAYOUT


def test_the_table_of_entries_needs_numpy_alone():
    loaded = loaded_after("import crossfield as cf\ncf.entries()")
    assert not loaded & (SOLVERS_AND_LAYOUT | {"scipy", "sympy", "numba", "PIL", "jsonschema"})


def test_importing_the_package_loads_nothing_heavy():
    loaded = loaded_after("import crossfield")
    assert not loaded & (SOLVERS_AND_LAYOUT | {"numpy", "scipy", "sympy", "numba", "PIL"})


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
    assert [
        parameter for parameter in named if not parameter.startswith("_") and parameter not in listed
    ] == []
