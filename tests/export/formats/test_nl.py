"""AMPL .nl files, text and binary, read back by CasADi, AMPL's library and SCIP, and counted by Pyomo."""

from __future__ import annotations

import io
import struct
from pathlib import Path

import numpy as np
import places
import pytest
from cases import CASES, make_field, make_problem, points_of, problem_of
from crossfield.export.formats import nl
from crossfield.export.formats.pyomo_model import to_pyomo
from crossfield.export.formats.registry import write
from crossfield.export.programs import casadi as casadi_program
from crossfield.export.programs import scip as scip_program
from crossfield.export.programs.comparison import behaviour_difference
from crossfield.export.writing.canonical import CanonicalForm
from crossfield.export.writing.nl_order import NlOrder
from crossfield.models.formulations.problem import Problem
from crossfield.models.instance.instance import Instance
from folders import contents
from loops import for_each
from oracles import by_asl, by_casadi, random_points
from pyomo.repn.plugins.nl_writer import NLWriter

GOLDEN = places.GOLDEN


def save(problem: Problem, path: Path, *, binary: bool = False, start: np.ndarray | None = None) -> Path:
    path.write_bytes(b"".join(nl.generate(CanonicalForm(problem), binary=binary, start=start)))
    return path


def values_at(problem: Problem, point: np.ndarray) -> tuple[float, np.ndarray]:
    """Objective, and rows in file order without their constants."""
    layout = NlOrder(problem)
    rows = [family.values(point) + family.limit for family in layout.rows]
    return problem.objective_value(point), np.concatenate([*rows, np.zeros(0)])


@pytest.mark.slow
@for_each("label", CASES)
def test_casadi_sees_the_problem(label: str, tmp_path: Path):
    problem, field = problem_of(label), make_field(problem_of(label).instance)
    write(problem, tmp_path / "model.nl", start=field)
    points = random_points(problem, 20)
    values = casadi_program.evaluate(tmp_path / "model.nl", points)
    assert behaviour_difference(values, problem, points) == ""
    start = by_casadi(tmp_path / "model.nl").start
    np.testing.assert_array_equal(start, problem.point(field)[NlOrder(problem).order])


@pytest.mark.slow
@pytest.mark.needs("asl")
@for_each("label", CASES)
def test_the_solver_library_sees_the_problem(label: str, tmp_path: Path):
    """Values at random points, text and binary by turns, and once the derivatives; 15 digits come back."""
    problem = problem_of(label)
    order = NlOrder(problem).order
    main = "gauge=" in label
    for turn, point in enumerate(points_of(problem, 20 if main else 4)):
        path = save(problem, tmp_path / "model.nl", start=point, binary=turn % 2 == 1)
        statistics, objective, gradient, rows, jacobian = by_asl(path)
        expected = values_at(problem, point)
        assert objective == pytest.approx(expected[0], rel=1e-9, abs=1e-9)
        np.testing.assert_allclose(rows, expected[1], rtol=1e-9, atol=1e-9)
        assert statistics["total no. of variables"] == problem.n_columns
        assert statistics["total no. of constraints"] == problem.n_rows
        if main and turn == 0:
            differences = [difference(problem, point, column) for column in order]
            np.testing.assert_allclose(gradient, [goal for goal, _ in differences], rtol=1e-5, atol=1e-5)
            np.testing.assert_allclose(jacobian.T, [row for _, row in differences], rtol=1e-5, atol=1e-5)


def difference(problem: Problem, point: np.ndarray, column: int) -> tuple[float, np.ndarray]:
    """Derivatives by a column, as central differences."""
    step = 1e-5 * (np.arange(problem.n_columns) == column)
    (high, high_rows), (low, low_rows) = values_at(problem, point + step), values_at(problem, point - step)
    return (high - low) / 2e-5, (high_rows - low_rows) / 2e-5


@pytest.mark.slow
@for_each("binary", [False, True])
@for_each("label", CASES)
def test_scip_sees_the_problem(label: str, binary: bool, tmp_path: Path):
    """Names, integrality, bounds, linear rows; SCIP makes bounds of integers whole, and ours are."""
    problem = problem_of(label)
    write(problem, tmp_path / "model.nl", dialect="binary" if binary else "text")
    points = random_points(problem, 2)
    values = scip_program.evaluate(tmp_path / "model.nl", points)
    assert behaviour_difference(values, problem, points) == ""


# the header


def pyomo_text(problem: Problem) -> list[str]:
    stream = io.StringIO()
    NLWriter().write(to_pyomo(problem), stream, linear_presolve=False, scale_model=False)
    return stream.getvalue().splitlines()


@for_each("label", CASES)
def test_header_agrees_with_the_writer_of_pyomo(label: str):
    """Pyomo counts on its own; it leaves out alpha of a pixel without stroke and neighbour."""
    problem = problem_of(label)
    domain = problem.instance.domain
    alone = domain.size - len(
        {*domain.first.tolist(), *domain.second.tolist(), *problem.instance.stroke_index.tolist()}
    )
    alone *= "alpha" in problem.blocks
    ours = b"".join(nl.generate(CanonicalForm(problem))).decode().splitlines()
    theirs = [line.partition("#")[0].split() for line in pyomo_text(problem)[:10]]
    mine = [line.split() for line in ours[:10]]
    assert mine[0] == ["g4", "1", "1", "0", str(int(problem.sha256[:7], 16))]
    assert mine[1] == [str(int(theirs[1][0]) + alone), *theirs[1][1:5]]
    assert mine[2] == theirs[2][:2]
    for line in (3, 4, 6, 7, 9):  # networks; nonlinear columns; integers; nonzeros; common expressions
        assert mine[line] == theirs[line], line
    assert mine[5] == ["0", "0", "0", "1"]


@for_each("label", CASES)
def test_text_keeps_to_the_common_subset(label: str):
    problem = problem_of(label)
    text = b"".join(nl.generate(CanonicalForm(problem), start=points_of(problem)[0])).decode("ascii")
    lines = text.splitlines()
    assert "#" not in text
    assert "\r" not in text
    assert "\0" not in text
    assert "inf" not in text.lower()
    segments = [line[0] for line in lines[10:] if line[0] in "CLOVdxrbkJGS" and not line.startswith("o")]
    kinds = list(dict.fromkeys(segments))
    assert kinds == [kind for kind in "COxrbkJG" if kind in kinds]
    assert ("k" in kinds) == bool(problem.rows)
    assert {line for line in lines if line[0] == "o"} <= {"o0", "o2", "o5", "o16", "o46", "o54"}
    assert all(int(lines[place + 1]) >= 3 for place, line in enumerate(lines) if line == "o54")
    entries = [line for line in lines if line[0] in "JG"]
    assert all(int(line.split()[1]) > 0 for line in entries)
    assert sum(int(line.split()[1]) for line in entries if line[0] == "J") == int(lines[7].split()[0])
    order = np.argsort(NlOrder(problem).group, kind="stable")
    assert (NlOrder(problem).order == order).all()


def test_names_stand_in_file_order_and_the_objective_comes_last(tmp_path: Path):
    problem = problem_of("miqcp-bilinear gauge=strokes")
    write(problem, tmp_path / "model.nl")
    columns = (tmp_path / "model.col").read_text().splitlines()
    rows = (tmp_path / "model.row").read_text().splitlines()
    assert len(columns) == problem.n_columns
    assert len(rows) == problem.n_rows + 1
    assert rows[-1] == "obj"
    assert rows[0].startswith("c16")  # nonlinear rows first
    header = (tmp_path / "model.nl").read_text().splitlines()
    assert header[8].split() == [str(max(map(len, rows))), str(max(map(len, columns)))]
    assert list(contents(tmp_path)) == ["model.col", "model.nl", "model.row"]


def test_binary_holds_the_numbers_themselves():
    problem = problem_of("milp-mccormick gauge=strokes")
    point = points_of(problem)[0]
    data = b"".join(nl.generate(CanonicalForm(problem), binary=True, start=point))
    head = data.split(b"\n", 10)
    assert head[0] == b"b4 1 1 0 %d" % int(problem.sha256[:7], 16)
    assert head[5].split() == [b"0", b"0", b"1", b"1"]
    assert head[10].startswith(b"C" + struct.pack("<i", 0))
    place = data.index(b"x" + struct.pack("<i", problem.n_columns)) + 5
    entries = np.frombuffer(data[place : place + 12 * problem.n_columns], dtype="<i4, <f8")
    np.testing.assert_array_equal(entries["f0"], np.arange(problem.n_columns))
    np.testing.assert_array_equal(entries["f1"], point[NlOrder(problem).order])


def test_a_small_model_has_the_bytes_of_its_golden_file():
    """A model of two pixels that people can read: (9) with a stroke at 2.5 radians of weight 0.5.

    Compared with the formula term by term: v0, v1 are alpha, v2, v3 beta, v4 is p1 and v5 p2, for which the
    window of the stroke leaves 0 and 1. All six are nonlinear in the objective alone, the last two whole. The
    real solver library reads it.
    """
    instance = Instance.on_pixels(
        "golden", np.ones((1, 2), bool), np.array([[0, 1]]), np.array([2.5]), np.array([0.5])
    )
    problem = make_problem("minlp-cubic", instance)
    assert b"".join(nl.generate(CanonicalForm(problem))) == (GOLDEN / "minlp-cubic.nl").read_bytes()
    read = by_casadi(GOLDEN / "minlp-cubic.nl")
    a, b, x, y, p1, p2 = 0.5, 2.0, 0.25, -0.125, 1, 0
    smooth = 2 * ((a - b + np.pi / 2 * (p1 + 2 * p2)) ** 2 + ((1 - 2 * p1) * x - y) ** 2)
    expected = smooth + 0.5 * (b + y - 2.5) ** 2 + 1e-6 * (x**2 + y**2)
    assert read.evaluate(np.array([a, b, x, y, p1, p2]))[0] == pytest.approx(expected, rel=1e-12)
