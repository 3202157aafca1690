"""Both GAMS layouts, read back by GAMS: compiled, translated by CONVERT, evaluated by CasADi, solved."""

from __future__ import annotations

import importlib.util
import json
import re
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import places
import pytest
from crossfield import templates
from crossfield.export.formats import gams_indexed, lp
from crossfield.export.formats import gams_scalar as gams
from crossfield.export.writing import records
from crossfield.export.writing.canonical import Canonical
from crossfield.models.errors import UnsupportedByFormatError
from crossfield.models.field.field import CrossField, relabelled
from crossfield.models.formulations.catalogue import FORMULATIONS
from crossfield.models.formulations.names import column_names, row_names
from crossfield.models.formulations.problem import Problem, formulate
from crossfield.models.instance.instance import Instance
from loops import for_each

GOLDEN = places.GOLDEN
LAYOUTS = {"scalar": gams.generate, "indexed": gams_indexed.generate}
HEADER = ["a comment with %per cent%, a $dollar and an é", "$call in a comment"]

CASES: dict[str, dict[str, Any]] = {
    **{name: {} for name in FORMULATIONS},
    "minlp-parity box": {"gauge": "box"},
    "minlp-quartic relaxed": {"relax": True},
    "miqcp-bilinear l1 strokes": {"stroke_norm": 1},
    "miqcp-bilinear relaxed": {"relax": True},
    "miqp-mccormick printed": {"facet": "printed", "beta_norm": 1},
    "miqp-mccormick relaxed box": {"relax": True, "gauge": "box"},
    "milp-mccormick printed box": {"facet": "printed", "gauge": "box"},
    "milp-mccormick relaxed": {"relax": True},
    "milp-mccormick squares": {"stroke_norm": 2, "beta_norm": 2},
    "miqp-exact box": {"gauge": "box"},
    "qp-fixed box": {"gauge": "box"},
    "qp-fixed lonely": {"mask": [[True, False], [False, True]]},
    "milp-mccormick lonely": {"mask": [[True, False], [False, True]]},
    "minlp-quartic line": {"mask": [[True] * 12]},
}
"""Formulation, a word for people, and what differs from the default."""

CHILD = """
import json, sys
import casadi
answers = []
for path, points in json.load(sys.stdin):
    read = casadi.NlpBuilder()
    read.import_nl(path)
    x = casadi.vertcat(*read.x)
    evaluate = casadi.Function("fg", [x], [read.f, casadi.vertcat(*read.g)])
    found = [evaluate(point) for point in points]
    row = lambda values: casadi.DM(values).full().ravel().tolist()
    answers.append({"f": [float(f) for f, _ in found], "g": [row(g) for _, g in found],
                    "x_lb": row(read.x_lb), "x_ub": row(read.x_ub), "g_lb": row(read.g_lb),
                    "g_ub": row(read.g_ub), "discrete": list(read.discrete)})
json.dump(answers, open(sys.argv[1], "w"))
"""


def make_instance(
    shape: tuple[int, int] = (3, 3), *, gauge: str = "strokes", mask: Any = None, seed: int = 3
) -> Instance:
    rng = np.random.default_rng(seed)
    area = np.ones(shape, dtype=bool) if mask is None else np.array(mask)
    if mask is None and min(shape) > 2:
        area[2, 0] = False
    chosen = area & (rng.random(area.shape) < 0.4)
    chosen[0, 0] = True
    pixels = np.argwhere(chosen)
    theta, w = rng.uniform(0, np.pi, len(pixels)), rng.uniform(0.1, 1, len(pixels))
    return Instance("tiny", area, pixels, theta, w, skew_coefficient=1e-3, gauge=gauge)


def make_field(instance: Instance, seed: int = 5) -> CrossField:
    rng = np.random.default_rng(seed)
    alpha, beta = rng.uniform(-3, 3, instance.grid.size), rng.uniform(-0.7, 0.7, instance.grid.size)
    return relabelled(instance, alpha, beta, np.zeros(len(instance.grid.first), dtype=np.int32))


def make_problem(name: str, instance: Instance, **options: Any) -> Problem:
    return formulate(instance, name, p=make_field(instance).p if name == "qp-fixed" else None, **options)


def problem_of(case: str) -> Problem:
    given = dict(CASES[case])
    instance = make_instance(**{key: given.pop(key) for key in ("gauge", "mask") if key in given})
    return make_problem(case.split(maxsplit=1)[0], instance, **given)


def text_of(problem: Problem, layout: str, **options: Any) -> bytes:
    return b"".join(LAYOUTS[layout](Canonical(problem), HEADER, **options))


def names_of(matrix: np.ndarray) -> list[str]:
    return [bytes(row).rstrip(b"\0").decode() for row in matrix]


@pytest.fixture(scope="session")
def gams_executable() -> str:
    return str(Path(importlib.util.find_spec("gamspy_base").origin).parent / "gams")


def run_gams(executable: str, folder: Path, text: bytes, *options: str) -> dict[str, float]:
    """The values that the results switch writes; fails on any error of GAMS."""
    (folder / "x.gms").write_bytes(text)
    done = subprocess.run(
        [executable, "x.gms", "lo=0", "o=x.lst", "--RESULTS=a result.csv", *options],
        cwd=folder,
        check=False,
        capture_output=True,
    )
    listing = (folder / "x.lst").read_text(errors="replace")
    errors = [line for line in listing.splitlines() if line.startswith("****")]
    assert done.returncode == 0, errors
    lines = (folder / "a result.csv").read_text().splitlines()
    pairs = (line.split(",") for line in lines)
    return {name: float(value) for name, value in pairs if name != "problem"}


@dataclass(frozen=True)
class Reading:
    """Result of CONVERT for a file: names, and CasADi's values at 20 random points (20, columns)."""

    problem: Problem
    points: np.ndarray
    results: dict[str, float]
    columns: list[str]
    rows: list[str]
    values: dict[str, Any]


def our_name(name: str) -> str:
    """`s(00,01,u)` as `s_00_01_u`."""
    return re.sub(r"[(,]", "_", name).rstrip(")")


@pytest.fixture(scope="session")
def readings(
    gams_executable: str, tmp_path_factory: pytest.TempPathFactory
) -> dict[tuple[str, str], Reading]:
    """Every case in both layouts through GAMS and CONVERT, then through CasADi in one child process."""
    gathered: dict[tuple[str, str], dict[str, Any]] = {}
    requests = []
    rng = np.random.default_rng(11)
    convert = [f"{model}=convert" for model in sorted(set(gams.MODEL_TYPES.values()))]
    for case in CASES:
        problem = problem_of(case)
        start = problem.point(make_field(problem.instance))
        points = rng.normal(size=(20, problem.n_columns))
        number = {name: index for index, name in enumerate(names_of(column_names(problem)))}
        for layout in LAYOUTS:
            folder = tmp_path_factory.mktemp("convert")
            (folder / "convert.opt").write_text("AmplNL out.nl\n")
            results = run_gams(
                gams_executable, folder, text_of(problem, layout, start=start), "optfile=1", *convert
            )
            columns, rows = (
                [our_name(line) for line in (folder / file).read_text().split()]
                for file in ("out.col", "out.row")
            )
            gathered[case, layout] = {
                "problem": problem,
                "points": points,
                "results": results,
                "columns": columns,
                "rows": rows,
            }
            requests.append((str(folder / "out.nl"), points[:, [number[name] for name in columns]].tolist()))
    answers = tmp_path_factory.mktemp("answers") / "values.json"
    subprocess.run(
        [sys.executable, "-c", CHILD, str(answers)], input=json.dumps(requests).encode(), check=True
    )
    values = json.loads(answers.read_text())
    return {
        key: Reading(**read, values=value)
        for (key, read), value in zip(gathered.items(), values, strict=True)
    }


@for_each("layout", LAYOUTS)
@for_each("case", CASES)
def test_read_energy(readings: dict[tuple[str, str], Reading], case: str, layout: str):
    read = readings[case, layout]
    expected = [read.problem.objective_value(point) for point in read.points]
    assert read.values["f"] == pytest.approx(expected, rel=1e-9)


@for_each("layout", LAYOUTS)
@for_each("case", CASES)
def test_read_rows(readings: dict[tuple[str, str], Reading], case: str, layout: str):
    read = readings[case, layout]
    names = [name for name in read.rows if name != "obj"]
    assert sorted(names) == sorted(names_of(row_names(read.problem)))
    row = dict(
        zip(
            names,
            zip(np.transpose(read.values["g"]), read.values["g_lb"], read.values["g_ub"], strict=True),
            strict=True,
        )
    )
    expected = iter(names_of(row_names(read.problem)))
    for family in read.problem.rows:
        for values in np.transpose([family.values(point) for point in read.points]):
            levels, low, high = row[next(expected)]
            sense = "==" if low == high else ">=" if np.isfinite(low) else "<="
            assert sense == family.family.sense
            limit = low if np.isfinite(low) else high
            assert levels - limit == pytest.approx(values, rel=1e-9, abs=1e-12)


@for_each("layout", LAYOUTS)
@for_each("case", CASES)
def test_read_columns(readings: dict[tuple[str, str], Reading], case: str, layout: str):
    read = readings[case, layout]
    names = names_of(column_names(read.problem))
    families = (*read.problem.objective, *read.problem.rows)
    used = {
        column
        for family in families
        for symbol in family.variables
        for column in family.column_of(symbol).tolist()
    }
    assert sorted(read.columns) == sorted(names[column] for column in used)
    at = [names.index(name) for name in read.columns]
    np.testing.assert_allclose(read.values["x_lb"], read.problem.lower[at], rtol=0, atol=1e-14)
    np.testing.assert_allclose(read.values["x_ub"], read.problem.upper[at], rtol=0, atol=1e-14)
    assert read.values["discrete"] == read.problem.integer[at].tolist()


@for_each("layout", LAYOUTS)
@for_each("case", CASES)
def test_read_start_comes_back_under_our_names(
    readings: dict[tuple[str, str], Reading], case: str, layout: str
):
    """CONVERT solves nothing, so the results are the start."""
    read = readings[case, layout]
    start = read.problem.point(make_field(read.problem.instance))
    head, names = list(read.results)[:3], list(read.results)[3:]
    assert head == ["model_status", "solver_status", "objective"]
    assert names == names_of(column_names(read.problem))
    assert read.results["objective"] == pytest.approx(read.problem.objective_value(start), rel=1e-14)
    np.testing.assert_allclose([read.results[name] for name in names], start, rtol=1e-15, atol=0)


def solved(
    executable: str, folder: Path, problem: Problem, layout: str, *options: str
) -> tuple[float, np.ndarray]:
    results = run_gams(executable, folder, text_of(problem, layout), *options)
    assert results["solver_status"] == 1
    assert results["model_status"] in {1, 2, 8}
    return results["objective"], np.array([results[name] for name in names_of(column_names(problem))])


def highs_optimum(problem: Problem, folder: Path) -> float:
    import highspy

    path = folder / "x.lp"
    path.write_bytes(b"".join(lp.generate(Canonical(problem), [])))
    solver = highspy.Highs()
    solver.setOptionValue("output_flag", False)
    solver.setOptionValue("mip_rel_gap", 0.0)
    solver.readModel(str(path))
    solver.run()
    assert solver.getModelStatus() == highspy.HighsModelStatus.kOptimal
    return float(solver.getObjectiveValue())


@pytest.mark.parametrize("shape", [(2, 3), (3, 3)])
@pytest.mark.parametrize("name", ["milp-mccormick", "qp-fixed"])
def test_optimum_is_that_of_another_solver(
    gams_executable: str, tmp_path: Path, name: str, shape: tuple[int, int]
):
    problem = make_problem(name, make_instance(shape))
    expected = highs_optimum(problem, tmp_path)
    for layout in LAYOUTS:
        value, point = solved(gams_executable, tmp_path, problem, layout)
        assert value == pytest.approx(expected, rel=1e-6)
        assert problem.objective_value(point) == pytest.approx(value, rel=1e-9)
        assert problem.violation(point).worst < 1e-6


@pytest.mark.parametrize("layout", LAYOUTS)
def test_exact_convex_model_has_the_energy_of_its_field(gams_executable: str, tmp_path: Path, layout: str):
    """The point of `miqp-exact` by CPLEX costs the same in (8), and at most as much as any tried field."""
    problem = make_problem("miqp-exact", make_instance((2, 3)))
    value, point = solved(gams_executable, tmp_path, problem, layout, "miqcp=cplex")
    field = problem.field(point)
    quartic = make_problem("minlp-quartic", problem.instance)
    assert quartic.objective_value(quartic.point(field)) == pytest.approx(value, rel=1e-5)
    assert all(make_field(problem.instance, seed).energy().total >= value - 1e-9 for seed in range(20))


@pytest.mark.parametrize("layout", LAYOUTS)
def test_one_pixel(gams_executable: str, tmp_path: Path, layout: str):
    """Stroke at 120 degrees: gauge box forces beta = 30 degrees and alpha = 90; gauge strokes nothing."""
    for gauge, expected in (("box", (np.pi / 2, np.pi / 6)), ("strokes", (2 * np.pi / 3, 0.0))):
        instance = Instance("one", [[True]], [[0, 0]], [2 * np.pi / 3], [1.0], gauge=gauge)
        _, point = solved(gams_executable, tmp_path, make_problem("minlp-quartic", instance), layout)
        np.testing.assert_allclose(point[:2], expected, atol=1e-5)


@for_each("layout", LAYOUTS)
@for_each("case", CASES)
def test_text_is_plain(case: str, layout: str):
    problem = problem_of(case)
    text = text_of(problem, layout, start=problem.point(make_field(problem.instance)))
    assert text == text_of(problem, layout, start=problem.point(make_field(problem.instance)))
    lines = text.decode().splitlines()
    assert max(map(len, lines)) < 200
    assert "\t" not in text.decode()
    assert "**" not in text.decode()
    assert "\0" not in text.decode()
    assert all(re.match(r"\* ", line) for line in lines if line.startswith("*"))
    assert (
        max(len(word) for word in re.findall(r"[A-Za-z]\w*", text.decode().partition("$offListing")[2])) <= 63
    )
    before_switch = text.decode().partition("$ifThen set RESULTS")[0]
    assert not re.search(
        r"^\s*(\$include|\$call|execute|put|file)\b", before_switch, re.IGNORECASE | re.MULTILINE
    )


@pytest.mark.parametrize("layout", LAYOUTS)
@pytest.mark.parametrize("name", ["milp-mccormick", "minlp-cubic", "qp-fixed"])
def test_blocks_leave_no_seam(monkeypatch: pytest.MonkeyPatch, name: str, layout: str):
    problem = make_problem(name, make_instance())
    start = problem.point(make_field(problem.instance))
    expected = text_of(problem, layout, start=start)
    pixels, pairs = problem.instance.grid.size, len(problem.instance.grid.first)
    for size in {1, pixels - 1, pixels, pixels + 1, pairs - 1, pairs, pairs + 1}:
        monkeypatch.setattr(records, "BLOCK", size)
        assert text_of(problem, layout, start=start) == expected


@pytest.mark.parametrize("gauge", ["strokes", "box"])
def test_jump_bounds_computed_by_gams_are_ours(gams_executable: str, tmp_path: Path, gauge: str):
    """Directions in steps of pi/24 put differences of windows onto the jumps of floor and ceil."""
    rng = np.random.default_rng(2)
    mask = rng.random((30, 30)) < 0.9
    pixels = np.argwhere(mask & (rng.random(mask.shape) < 0.7))
    theta = rng.integers(0, 24, len(pixels)) * np.pi / 24
    instance = Instance("steps", mask, pixels, theta, np.ones(len(pixels)), gauge=gauge)
    model = text_of(make_problem("minlp-parity", instance), "indexed").partition(b"solve m")[0]
    values = b"p.lo(r,c,side):0:0 ' ' p.up(r,c,side):0:0"
    put = b"File out / bounds.txt /; put out; loop(E(r,c,side), put %b /);\n" % values
    (tmp_path / "x.gms").write_bytes(model + put)
    subprocess.run([gams_executable, "x.gms", "lo=0"], cwd=tmp_path, check=True)
    bounds = np.loadtxt(tmp_path / "bounds.txt", dtype=int)
    np.testing.assert_array_equal(bounds, np.stack([instance.p_min, instance.p_max], axis=1))


def test_no_lists_of_names_end_open(gams_executable: str, tmp_path: Path):
    """Declarations that end on the last place of a line, before and after it: of 8 to 28 pixels."""
    for count in range(8, 29, 5):
        problem = make_problem("miqp-mccormick", make_instance(mask=[[True] * count]), relax=True)
        _, point = solved(gams_executable, tmp_path, problem, "scalar")
        assert problem.violation(point).worst < 1e-6


def test_text_of_the_indexed_layout_grows_with_the_data_alone():
    """A rectangle is one line per row for any width; each stroke pixel is two lines."""
    sizes = []
    for width in (20, 40):
        mask = np.ones((10, width), dtype=bool)
        instance = Instance("wide", mask, [[0, 0]], [0.3], [1.0])
        sizes.append(text_of(make_problem("milp-mccormick", instance), "indexed").count(b"\n"))
    assert sizes[0] == sizes[1]


@pytest.mark.parametrize("layout", LAYOUTS)
def test_weights_that_solvers_drop_are_refused(layout: str):
    instance = Instance("faint", [[True, True]], [[0, 0]], [0.3], [1e-12])
    with pytest.raises(UnsupportedByFormatError, match="1e-12"):
        text_of(make_problem("milp-mccormick", instance), layout)


def test_stream_reads_a_block_when_its_place_comes(monkeypatch: pytest.MonkeyPatch):
    from jinja2 import DictLoader, UndefinedError

    monkeypatch.setattr(
        templates.ENVIRONMENT,
        "loader",
        DictLoader({"a.j2": "x {{ block.one }} {{ word }}\n", "b.j2": "{{ absent }}"}),
    )
    assert b"".join(templates.stream("a.j2", {"one": iter([b"1", b"2"])}, word="é")) == "x 12 é\n".encode()
    with pytest.raises(UndefinedError):
        list(templates.stream("b.j2", {}))


def test_golden_file():
    """A small model that people can read; the other tests check its meaning."""
    instance = Instance("golden", [[True, True], [True, False]], [[0, 1]], [2.5], [0.5])
    text = b"".join(
        gams_indexed.generate(
            Canonical(make_problem("minlp-quartic", instance)), ["minlp-quartic on three pixels"]
        )
    )
    assert text == (GOLDEN / "minlp-quartic.gms").read_bytes()
    assert text.count(b"\n") < 80
