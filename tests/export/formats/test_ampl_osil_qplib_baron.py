"""AMPL .mod and .dat, OSiL, QPLIB and BARON files, read by the programs of others and evaluated as text.

.mod, .dat: GLPK reads the linear ones. Of the others it evaluates every expression once variables are
parameters: its MathProg is a second implementation of the language, and AMPL itself cannot be had for free.
.osil: SCIP. .qplib: pyqplib. .bar: BARON itself in its free size.
"""

from __future__ import annotations

import hashlib
import importlib.util
import re
import subprocess
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from cases import CASES, SKEWED, make_field, make_instance, make_problem, names_of, points_of, problem_of
from crossfield.export.bundle.manifest import read_manifest
from crossfield.export.bundle.problem_files import write_all, write_problem
from crossfield.export.formats.registry import DEFAULTS, FORMATS, problem_in_format, write
from crossfield.export.programs import glpk as glpk_program
from crossfield.export.programs import scip as scip_program
from crossfield.export.programs.comparison import behaviour_difference, problem_algebra, values_at
from crossfield.export.programs.model_content import Points
from crossfield.export.solutions.solution import read_solution
from crossfield.export.writing.canonical import CanonicalForm
from crossfield.export.writing.curvature import probtype
from crossfield.models.errors import UnsupportedByFormatError
from crossfield.models.formulations.names import column_names, row_names
from crossfield.models.formulations.problem import Problem, with_integers_fixed
from crossfield.models.instance.instance import Instance
from folders import contents
from loops import for_each
from oracles import random_points

MORE = ("mod", "osil", "qplib", "bar")
PINNED = [label for label in CASES if "pinned" in label]
FREE = [label for label in CASES if "pinned" not in label]
POLYNOMIAL = [label for label in CASES if not label.startswith("minlp-parity") or "pixel" in label]
LINEAR = [label for label in FREE if problem_of(label).problem_class == "MILP"]


def held(label: str, name: str) -> Problem:
    return problem_in_format(problem_of(label), FORMATS[name])


def written(problem: Problem, path: Path, **options: Any) -> str:
    write(problem, path, **options)
    return path.read_text("ascii")


def names(problem: Problem) -> tuple[list[str], list[str]]:
    return names_of(column_names(problem.instance, problem.blocks)), names_of(
        row_names(problem.rows)
    ) if problem.rows else []


def limits(problem: Problem) -> tuple[Any, Any]:
    """Left and right sides of all rows, the row `c_ONE` of LP and MPS left out."""
    model = problem_algebra(problem)
    return model.row_lower[: problem.n_rows], model.row_upper[: problem.n_rows]


def assert_values(values: list[float], expected: Any) -> None:
    np.testing.assert_allclose(values, expected, rtol=1e-9, atol=1e-9)


def feasible_points(problem: Problem) -> Points:
    """Two random points, and two of fields with the jumps that `problem_of` may have fixed."""
    one, other = (make_field(problem.instance, seed) for seed in (2, 3))
    moved = other if problem.instance.orthogonal and problem.pinned is None else replace(other, p=one.p)
    return random_points(problem, 2, [problem.point(field) for field in (one, moved)])


def tiny() -> Instance:
    """Two pixels with strokes that no field follows without loss: the window is the box's."""
    pixels = [[0, 0], [0, 1]]
    return Instance.on_pixels(
        "small", np.ones((1, 2), bool), pixels, [2.2, 1.3], [1.0, 0.7], skew_coefficient=1e-2, gauge="box"
    )


def pixel() -> Instance:
    return Instance.on_pixels(
        "small", np.ones((1, 1), bool), [[0, 0]], [2.2], [0.8], skew_coefficient=1e-2, gauge="box"
    )


# all of them


@for_each("name", MORE)
@for_each("formulation", SKEWED)
def test_every_formulation_is_written_or_refused_by_name(formulation: str, name: str, tmp_path: Path):
    problem = make_problem(formulation, make_instance())
    path = tmp_path / f"model.{name}"
    if formulation == "minlp-parity" and name in {"qplib", "bar"}:
        with pytest.raises(UnsupportedByFormatError, match="write minlp-quartic, which is the same problem"):
            write(problem, path)
        assert list(tmp_path.iterdir()) == []
        return
    done = write(problem, path)
    beside = {"model.dat"} if name == "mod" else set()
    assert contents(tmp_path).keys() == set(done.files) == {path.name} | beside
    lifts = name == "qplib" and formulation in {"minlp-quartic", "minlp-cubic"}
    assert done.lifted == ("z = p1 beta_i with the hull facets (26)-(29), exact" if lifts else "")


def test_they_are_written_only_when_asked_for(tmp_path: Path):
    assert DEFAULTS == ("nl", "gms", "lp", "mps")
    problem = make_problem("milp-mccormick", make_instance())
    assert {entry["format"] for entry in write_problem(problem, tmp_path).document["files"]} == set(DEFAULTS)
    (manifest,) = write_all(
        problem.instance, tmp_path / "more", formulations=["milp-mccormick"], formats=MORE
    )
    listed = [entry["name"] for entry in manifest.document["files"]]
    assert listed == [f"tiny.milp-mccormick.{suffix}" for suffix in ("mod", "dat", "osil", "qplib", "bar")]
    for entry in read_manifest(manifest.path).document["files"]:
        data = (tmp_path / "more" / entry["name"]).read_bytes()
        assert entry["sha256"] == hashlib.sha256(data).hexdigest()


# AMPL


def glpsol(*arguments: str | Path) -> str:
    done = subprocess.run(["glpsol", *map(str, arguments)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout
    return done.stdout


def indexed(problem: Problem) -> Iterator[tuple[str, str, Any]]:
    """Each block that is not empty: its name, its indices as data, and its columns."""
    for block in filter(lambda block: block.count, problem.blocks.values()):
        labels = names(problem)[0][block.slice]
        places = [
            re.sub(r"_0*(\d)", r" \1", label.removeprefix(block.name)).replace("_", " ") for label in labels
        ]
        yield block.name, places, range(block.offset, block.offset + block.count)


def as_parameters(text: str) -> tuple[str, list[str]]:
    """The model with variables as parameters, which prints `number value`, and what each number means."""
    meaning = ["objective"]

    def printed(label: str, domain: str, expression: str) -> str:
        meaning.append(label)
        return f'printf{domain}: "{len(meaning) - 1} %.17g\\n", {expression};\n'

    def row(match: re.Match[str]) -> str:
        tag, domain, left, sense, right = match.groups()
        return printed(f"{tag} {sense}", domain, f"({left}) - ({right})")

    def variable(match: re.Match[str]) -> str:
        name, domain, attributes = match.groups()
        parts = re.split(r", (?=[<>]=)|(?<=integer), ", attributes.strip())
        ends.extend((name, domain, end[:2], end[3:]) for end in parts if end[:1] in set("<>"))
        return f"param {name}{domain};"

    ends: list[tuple[str, str, str, str]] = []
    text = re.sub(r"[ ]*#.*", "", text)
    text = re.sub(r"^var (\w+)(\{[^}]*\})(.*);$", variable, text, flags=re.MULTILINE)
    text = re.sub(
        r"minimize energy:(.*?);\n", lambda m: f'printf "0 %.17g\\n", {m[1]};\n', text, flags=re.DOTALL
    )
    text = re.sub(r"subject to (\w+)(\{.*?\}):\s*(.*?) ([<>]?=) (.*?);\n", row, text, flags=re.DOTALL)
    bounds = [printed(f"{sign} {name}", domain, end) for name, domain, sign, end in ends]
    return text + "".join(bounds) + "end;\n", meaning


def as_data(problem: Problem, point: Any) -> str:
    """The values of all columns in the style of a .dat."""
    lines = []
    for name, places, columns in indexed(problem):
        values = (f"{place} {point[at]:.17g}" for place, at in zip(places, columns, strict=True))
        lines += [f"param {name} :=", *values, ";"]
    return "\n".join([*lines, "end;\n"])


@pytest.mark.needs("glpk")
@for_each("label", FREE)
def test_glpk_evaluates_the_ampl_model_like_the_problem(label: str, tmp_path: Path):
    """Bounds to the bit, and objective and rows at a random point, by GLPK's own translator."""
    problem = problem_of(label)
    text = written(problem, tmp_path / "model.mod")
    integer = re.findall(r"^var (\w+)\{[^}]*\} integer", text, re.MULTILINE)
    assert set(integer) == {block.name for block in problem.blocks.values() if block.integer and block.count}
    text, meaning = as_parameters(text)
    (tmp_path / "model.mod").write_text(text)
    point = points_of(problem, 1)[0]
    data = (tmp_path / "model.dat").read_text().removesuffix("end;\n") + as_data(problem, point)
    (tmp_path / "model.dat").write_text(data)
    out = glpsol("-m", tmp_path / "model.mod", "-d", tmp_path / "model.dat", "--check")
    lines = re.findall(r"^(\d+) (\S+)$", out, re.MULTILINE)
    printed: dict[str, list[float]] = {name: [] for name in meaning}
    for number, value in lines:
        printed[meaning[int(number)]].append(float(value))
    assert_values(printed.pop("objective"), [problem.objective_value(point)])
    for family in problem.rows:
        sense = family.family.sense.replace("==", "=")
        assert_values(printed.pop(f"{family.family.tag} {sense}"), family.values(point))
    for block in problem.blocks.values():
        for sign, ends in ((">=", block.lower), ("<=", block.upper)):
            stated = printed.pop(
                f"{sign} {block.name}", np.full(block.count, -np.inf if sign == ">=" else np.inf)
            )
            np.testing.assert_array_equal(stated, ends)
    assert printed == {}


@pytest.mark.needs("glpk")
@for_each("label", LINEAR)
def test_glpk_reads_the_linear_ampl_model_as_the_problem(
    label: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.chdir(tmp_path)  # where the program puts its files
    problem = problem_of(label)
    write(problem, tmp_path / "model.mod")
    points = feasible_points(problem)
    values = glpk_program.evaluate(tmp_path / "model.mod", points)
    assert behaviour_difference(values, problem, points) == ""
    assert values.integer.sum() == problem.integer.sum()


@pytest.mark.needs("glpk")
def test_an_answer_of_the_ampl_model_is_read_back(tmp_path: Path):
    problem = make_problem(
        "milp-mccormick",
        Instance.on_pixels("two", np.ones((2, 2), bool), [[0, 0], [1, 1]], [0.3, 2.0], [1, 1]),
    )
    text = written(problem, tmp_path / "model.mod")
    printed = (
        text[text.index("# printf") :]
        .replace("# printf", "printf")
        .replace("this.sol", str(tmp_path / "answer.sol"))
    )
    (tmp_path / "solved.mod").write_text(f"{text}\nsolve;\n{printed}end;\n")
    out = glpsol("-m", tmp_path / "solved.mod", "-d", tmp_path / "model.dat")
    assert "INTEGER OPTIMAL SOLUTION FOUND" in out
    solution = read_solution(tmp_path / "answer.sol", problem)
    assert solution.violation.worst < 1e-6
    (claim,) = re.findall(r"^=obj= (\S+)$", (tmp_path / "answer.sol").read_text(), re.MULTILINE)
    assert solution.objective == pytest.approx(float(claim), abs=1e-9)


@pytest.mark.parametrize("label", PINNED[:2])
def test_the_ampl_model_refuses_fixed_integers(label: str, tmp_path: Path):
    with pytest.raises(UnsupportedByFormatError, match="columns fixed one by one; write nl, lp or mps"):
        write(problem_of(label), tmp_path / "model.mod")
    assert list(tmp_path.iterdir()) == []


# OSiL


@for_each("label", CASES)
def test_scip_reads_osil_as_the_problem(label: str, tmp_path: Path):
    problem = problem_of(label)
    write(problem, tmp_path / "model.osil")
    points = feasible_points(problem)
    values = scip_program.evaluate(tmp_path / "model.osil", points)
    assert behaviour_difference(values, problem, points) == ""
    assert np.isfinite(values.objective[2:]).all()


def scip_optimum(path: Path) -> float:
    import pyscipopt

    scip = pyscipopt.Model()
    scip.hideOutput()
    scip.readProblem(str(path))
    scip.setParam("limits/gap", 1e-4)
    scip.setParam("limits/time", 10.0)
    scip.optimize()
    assert scip.getStatus() in {"optimal", "gaplimit"}
    return float(scip.getObjVal())


# QPLIB


KINDS = {
    "minlp-quartic": "CGL", "minlp-cubic": "QGL", "miqcp-bilinear": "CGQ", "miqcp-bilinear-l1": "LGQ",
    "miqp-mccormick": "CGL", "milp-mccormick": "LGL", "qp-fixed": "CCB", "miqp-exact": "CGL",
}  # fmt: skip


@for_each("formulation", KINDS)
def test_every_formulation_has_its_type_of_qplib(formulation: str):
    problem = problem_in_format(make_problem(formulation, make_instance("full")), FORMATS["qplib"])
    assert probtype(problem) == KINDS[formulation]


def without_names(text: str) -> str:
    """The file with numbers for names, which is all that pyqplib takes."""
    head = text[: text.index(" # names of variables")].rsplit("\n", 1)[0]
    return head + "\n0\n0\n"


@pytest.mark.needs("pyqplib")
@for_each("label", POLYNOMIAL)
def test_pyqplib_reads_the_problem(label: str, tmp_path: Path):
    import pyqplib

    problem = held(label, "qplib")
    (tmp_path / "model.qplib").write_text(without_names(written(problem_of(label), tmp_path / "model.qplib")))
    model = pyqplib.read_problem(str(tmp_path / "model.qplib"))
    low, high = limits(problem)
    np.testing.assert_array_equal([model.var_lb, model.var_ub], [problem.lower, problem.upper])
    np.testing.assert_array_equal([kind.name != "CONTINUOUS" for kind in model.var_types], problem.integer)
    np.testing.assert_array_equal([model.cons_lb, model.cons_ub], [low, high])
    points = points_of(problem, 5)
    objective, rows = values_at(problem, points)
    assert_values([model.obj_val(point) for point in points], objective)
    assert_values([model.cons_val(point) for point in points], rows)


@pytest.mark.parametrize("name", ["qplib", "bar"])
def test_a_start_has_its_place(name: str, tmp_path: Path):
    problem = make_problem("milp-mccormick", make_instance())
    field = make_field(problem.instance)
    point = problem.point(field)
    text = written(problem, tmp_path / f"model.{name}", start=field)
    labels = names(problem)[0]
    if name == "bar":
        labels = [*labels, CanonicalForm(problem).one.decode()]
        point = np.append(point, 1.0)
        levels = dict(re.findall(r"(\w+): (\S+);", text[text.index("STARTING_POINT") :]))
        assert {key: float(value) for key, value in levels.items()} == dict(
            zip(labels, point.tolist(), strict=True)
        )
        return
    usual, count, *rest = text[: text.index("start of a row's dual")].split("# start, where not listed")
    lines = (usual.rsplit("\n", 1)[1] + count).split("\n")
    values = np.full(problem.n_columns, float(lines[0]))
    for line in lines[2:-1]:
        values[int(line.split()[0]) - 1] = float(line.split()[1])
    assert rest == []
    np.testing.assert_array_equal(values, point)


# BARON


BARON = importlib.util.find_spec("gamspy_baron")
FITS = ["minlp-quartic", "minlp-cubic", "miqcp-bilinear", "miqp-mccormick", "miqp-exact", "qp-fixed"]
"""Formulations that fit BARON's free size on two pixels: 10 columns, 10 rows, 50 nonlinear operations."""


def by_baron(path: Path, problem: Problem) -> Any:
    """The answer of BARON, in its free edition of 10 columns and 10 rows, to the file."""
    program = Path(BARON.submodule_search_locations[0]) / "baron"
    done = subprocess.run([program, path.name], cwd=path.parent, capture_output=True, text=True, check=False)
    assert "Normal completion" in done.stdout, done.stdout
    return read_solution(path.parent / "res.lst", problem)


@pytest.mark.needs("baron")
@pytest.mark.parametrize("formulation", [*FITS, "miqcp-bilinear-l1", "milp-mccormick"])
def test_baron_solves_its_file_to_the_optimum(formulation: str, tmp_path: Path):
    """(9) takes BARON more than a minute as it stands, and nothing with its jumps fixed."""
    problem = make_problem(formulation, tiny() if formulation in FITS else pixel())
    if formulation == "minlp-cubic":
        problem = with_integers_fixed(problem, make_field(problem.instance))
    write(problem, tmp_path / "model.bar")
    solution = by_baron(tmp_path / "model.bar", problem)
    write(problem, tmp_path / "model.nl")
    assert solution.violation.worst < 1e-5
    assert solution.objective == pytest.approx(scip_optimum(tmp_path / "model.nl"), rel=2e-4, abs=1e-6)
