"""LP and MPS files, read back by HiGHS, SCIP and Gurobi, and solved by CBC and GLPK."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import places
import pytest
from cases import CASES, LOW_DEGREE, SKEWED, make_instance, make_problem, names_of, points_of, problem_of
from crossfield.export.formats import lp, mps
from crossfield.export.formats.registry import FORMATS, header_lines, problem_in_format, write
from crossfield.export.programs.comparison import algebra_difference
from crossfield.export.writing.canonical import CanonicalForm
from crossfield.models.errors import UnsupportedByFormatError
from crossfield.models.formulations.names import column_names, row_names
from crossfield.models.formulations.problem import Problem
from crossfield.models.instance.instance import Instance
from loops import for_each
from oracles import Model, by_gurobi, by_highs, by_scip, problem_algebra

GOLDEN = places.GOLDEN
READERS = {"highs": by_highs, "scip": by_scip, "gurobi": by_gurobi}
GENERATE = {"lp": lp.generate, "mps": mps.generate}
both = pytest.mark.parametrize("suffix", GENERATE)


def held(label: str) -> Problem:
    """The problem of a case as LP and MPS hold it."""
    return problem_in_format(problem_of(label), FORMATS["lp"])


def text_of(problem: Problem, suffix: str) -> str:
    return b"".join(GENERATE[suffix](CanonicalForm(problem), header_lines(problem))).decode("ascii")


def assert_same(model: Model, expected: Model) -> None:
    for name in vars(expected):
        np.testing.assert_array_equal(getattr(model, name), getattr(expected, name), err_msg=name)


@pytest.mark.slow
@both
@pytest.mark.parametrize("reader", [pytest.param(name, marks=pytest.mark.needs(name)) for name in READERS])
@for_each("label", LOW_DEGREE)
def test_readers_see_the_problem(label: str, reader: str, suffix: str, tmp_path: Path):
    if (reader, label[:5]) == ("highs", "miqcp"):
        return  # HiGHS reads no quadratic rows
    problem = held(label)
    path = tmp_path / f"model.{suffix}"
    assert write(problem_of(label), path).problem.sha256 == problem.sha256
    model = READERS[reader](path)
    if reader != "scip":  # SCIP sorts columns by type
        assert [name for name in model.columns if not name.startswith("ONE_")] == names_of(
            column_names(problem.instance, problem.blocks)
        )
    if reader == "highs":  # Gurobi lists quadratic rows after the others
        assert model.rows == problem_algebra(problem).rows
    assert algebra_difference(model, problem, 0.0, points_of(problem)) == ""


@both
@for_each("label", [label for label in CASES if label not in LOW_DEGREE and "pixel" not in label])
def test_parity_is_refused_before_a_byte(label: str, suffix: str, tmp_path: Path):
    # Relaxed, it is no other problem's equal.
    remedy = "choose nl or gms" if "relax" in label else "minlp-quartic"
    with pytest.raises(UnsupportedByFormatError, match=remedy):
        write(problem_of(label), tmp_path / f"model.{suffix}")
    assert list(tmp_path.iterdir()) == []


@both
def test_parity_without_pairs_is_quadratic(suffix: str, tmp_path: Path):
    problem = problem_of("minlp-parity shape=pixel")
    assert problem.problem_class == "QP"
    write(problem, tmp_path / f"model.{suffix}")
    assert_same(
        by_scip(tmp_path / f"model.{suffix}").reordered(problem_algebra(problem).columns, ["c_ONE"]),
        problem_algebra(problem),
    )


@both
def test_no_weight_at_all_is_written(suffix: str, tmp_path: Path):
    problem = make_problem("milp-mccormick", make_instance(skew_coefficient=0))
    write(problem, tmp_path / f"model.{suffix}")
    expected = problem_algebra(problem)
    model = by_highs(tmp_path / f"model.{suffix}").reordered(expected.columns, expected.rows)
    assert_same(model, expected)
    assert not model.costs[[name.startswith("psi") for name in model.columns]].any()


@both
@pytest.mark.parametrize("angle", [1e-16, np.pi - 1e-15, 0.0])
def test_an_angle_next_to_nothing_is_written(angle: float, suffix: str, tmp_path: Path):
    instance = Instance.on_pixels(
        "flat", np.ones((1, 2), bool), np.array([[0, 0]]), np.array([angle]), np.ones(1)
    )
    problem = make_problem("qp-fixed", instance)
    write(problem, tmp_path / f"model.{suffix}")
    expected = problem_algebra(problem)
    assert_same(by_highs(tmp_path / f"model.{suffix}").reordered(expected.columns, expected.rows), expected)


# names


@for_each("label", CASES)
def test_names_suit_every_reader(label: str):
    problem = problem_of(label)
    problems = [problem, held(label)] if label in LOW_DEGREE else [problem]
    for form in problems:
        names = names_of(column_names(form.instance, form.blocks)) + (
            names_of(row_names(form.rows)) if form.rows else []
        )
        assert (
            len({name.lower() for name in [*names, CanonicalForm(form).one.decode(), "obj", "c_one"]})
            == form.n_columns + form.n_rows + 3
        )
        assert all(re.fullmatch(r"[a-df-hj-mo-z][a-z0-9_]{0,14}", name) for name in names)
        assert re.fullmatch(r"ONE_[0-9a-f]{11}", CanonicalForm(form).one.decode())


@for_each("name", SKEWED)
def test_names_on_the_largest_grid_are_15_long_at_most(name: str):
    mask = np.zeros((2, 9999), dtype=bool)
    mask[:, -2:] = True
    instance = Instance.on_pixels("largest", mask, np.array([[1, 9998]]), np.array([3.0]), np.ones(1))
    problem = make_problem(name, instance)
    names = names_of(column_names(problem.instance, problem.blocks))
    assert {"alpha_0000_9998", "beta_0001_9997"} < set(names)
    assert max(map(len, names + names_of(row_names(problem.rows)))) == 15


# text


@both
@for_each("label", LOW_DEGREE)
def test_text_is_plain(label: str, suffix: str):
    text = text_of(held(label), suffix)
    lines = text.splitlines()
    assert "OBJSENSE" not in text.upper()
    assert max(map(len, lines)) <= 250
    assert "\0" not in text
    assert "\r" not in text
    assert text.endswith("\n")
    assert all(line == line.rstrip() for line in lines)
    body = [line for line in lines if line[0] not in "\\*"]
    assert not any(re.search(r"(^|\s)-0(\.0*)?(\s|$)|nan|\+ ?-|- ?-", line) for line in body)
    assert len([line for line in lines if line[0] in "\\*"]) == len(header_lines(held(label)))


@for_each("label", LOW_DEGREE)
def test_lp_keeps_to_the_common_subset(label: str):
    problem = held(label)
    text = text_of(problem, "lp")
    order = ["Minimize", "Subject To", "Bounds", "Generals", "Binaries", "End"]
    sections = [line for line in text.splitlines() if line[0] not in " \\"]
    assert sections == [section for section in order if section in sections]
    assert not {"Generals", "Binaries"} & set(sections) or problem.integer.any()
    assert {"Minimize", "Subject To", "Bounds", "End"} <= set(sections)
    parts = dict(re.findall(r"^(\w[\w ]*)\n((?: .*\n)*)", text, re.MULTILINE))
    names = [CanonicalForm(problem).one.decode(), *names_of(column_names(problem.instance, problem.blocks))]

    linear, _, products = parts["Minimize"].partition(" + [\n")
    assert re.findall(r"[+-] \S+ ([A-Za-z]\w+)\n", linear) == names
    if products:
        assert products.endswith(" ] / 2\n")
        assert all(re.fullmatch(r" [+-] \S+ \w+( \^2| \* \w+)", line) for line in products.splitlines()[:-1])
    assert "/ 2" not in parts["Subject To"]
    assert parts["Subject To"].strip()  # a model without rows has one all the same
    number = r"-?[0-9.]+(?:e[+-]?\d+)?"
    for line in parts["Subject To"].splitlines():
        assert re.fullmatch(
            rf" \w+:(?: [+-] {number} \w+)+(?: \+ \[(?: [+-] {number} \w+ \* \w+)+ \])? (?:<=|>=|=) {number}",
            line,
        )
        linear_names = re.findall(r"[+-] \S+ (\w+)(?! \*)\b", line.partition("[")[0])
        assert len(set(linear_names)) == len(linear_names)
    bounds = [
        re.fullmatch(rf" (-inf|{number}) <= (\w+) <= (\+inf|{number})", line)
        for line in parts["Bounds"].splitlines()
    ]
    assert sorted(match[2] for match in bounds if match) == sorted(names)
    whole = [name.strip() for title in ("Generals", "Binaries") for name in parts.get(title, "").splitlines()]
    assert sorted(whole) == sorted(
        np.array(names_of(column_names(problem.instance, problem.blocks)))[problem.integer].tolist()
    )


@for_each("label", LOW_DEGREE)
def test_mps_keeps_to_the_common_subset(label: str):
    problem = held(label)
    text = text_of(problem, "mps")
    heads = [line.split()[0] for line in text.splitlines() if line[0] not in " *"]
    order = ["NAME", "ROWS", "COLUMNS", "RHS", "BOUNDS", "QUADOBJ", "QCMATRIX", "ENDATA"]
    assert list(dict.fromkeys(heads)) == [head for head in order if head in heads]
    assert f"NAME tiny_{held(label).stamp} FREE\n" in text
    assert "inf" not in text.partition("ROWS")[2].lower()
    parts = {
        title: body.splitlines()
        for title, body in re.findall(r"^(\w+)(?: FREE)?\n((?: .*\n)*)", text, re.MULTILINE)
    }
    assert [line for line in parts["ROWS"] if line.startswith(" N")] == [" N obj"]

    columns = [line.split() for line in parts["COLUMNS"]]
    assert all(len(line) == 3 for line in columns)
    assert [line[0] for line in columns if line[1] == "obj"] == [
        *names_of(column_names(problem.instance, problem.blocks)),
        CanonicalForm(problem).one.decode(),
    ]
    markers = [line[2] for line in columns if line[1] == "'MARKER'"]
    assert markers == ["'INTORG'", "'INTEND'"] * (len(markers) // 2)
    assert bool(markers) == problem.integer.any()
    assert all(line.split()[0] == "RHS1" and line.split()[1] != "obj" for line in parts["RHS"])

    bounds: dict[str, list[str]] = {}
    for kind, group, name, *_ in (line.split() for line in parts["BOUNDS"]):
        assert group == "BND1"
        bounds.setdefault(name, []).append(kind)
    assert sorted(bounds) == sorted(line[0] for line in columns if line[1] == "obj")
    assert all(
        kinds in (["FX"], ["FR"], ["LO", "UP"], ["LO", "PL"], ["MI", "UP"]) for kinds in bounds.values()
    )

    pairs = [tuple(line.split()[:2]) for line in parts.get("QUADOBJ", [])]
    assert len({frozenset(pair) for pair in pairs}) == len(pairs)  # one triangle
    for body in re.findall(r"^QCMATRIX \w+\n((?: .*\n)*)", text, re.MULTILINE):
        entries = {tuple(line.split()[:2]): line.split()[2] for line in body.splitlines()}
        assert entries
        assert all(
            entries[second, first] == value for (first, second), value in entries.items()
        )  # both triangles


# golden files


@pytest.mark.parametrize(
    "file, pixels", [("milp-mccormick.lp", 3), ("miqcp-bilinear.lp", 3), ("milp-mccormick.mps", 2)]
)
def test_small_models_have_the_bytes_of_their_golden_files(file: str, pixels: int, tmp_path: Path):
    """Small models that people can read, one stroke at 2.5 radians of weight 0.5 on two or three pixels.

    Each was compared with the formulas by hand: signs of (14)-(17) and (22)-(29), pi/2 and pi before p1 and
    p2, twice the stroke's square in the brackets, jumps 0..3 towards the stroke and -1..1 away from it. HiGHS
    or SCIP read them as the problem.
    """
    mask = np.array([[True, True], [True, False]])[: pixels - 1]
    instance = Instance.on_pixels("golden", mask, np.array([[0, 1]]), np.array([2.5]), np.array([0.5]))
    name, suffix = file.split(".")
    problem = make_problem(name, instance)
    text = b"".join(GENERATE[suffix](CanonicalForm(problem), ["for people to read"]))
    assert text == (GOLDEN / file).read_bytes()
    expected = problem_algebra(problem)
    assert_same(by_scip(GOLDEN / file).reordered(expected.columns, expected.rows), expected)


@both
def test_rows_of_a_mesh_have_numbers_of_faces_and_pairs(suffix: str, tmp_path: Path):
    """(14): s - alpha_i + alpha_j - pi/2 p1 - pi p2 >= kappa."""
    problem = problem_of("milp-mccormick shape=tetrahedron orthogonal=True")
    mesh = problem.instance.mesh
    write(problem, tmp_path / f"model.{suffix}")
    model = by_highs(tmp_path / f"model.{suffix}")
    for pair, (i, j) in enumerate(zip(mesh.first.tolist(), mesh.second.tolist(), strict=True)):
        row = model.rows.index(f"c14_{pair:02}")
        at = model.matrix_at[:, 0] == row
        names = [model.columns[column] for column in model.matrix_at[at, 1]]
        assert dict(zip(names, model.matrix[at].tolist(), strict=True)) == {
            f"s_{pair:02}": 1,
            f"alpha_{i:02}": -1,
            f"alpha_{j:02}": 1,
            f"p1_{pair:02}": -np.pi / 2,
            f"p2_{pair:02}": -np.pi,
        }
        assert model.row_lower[row] == mesh.kappa[pair]
        assert model.costs[model.columns.index(f"s_{pair:02}")] == 2 * problem.instance.pair_weights[pair]
