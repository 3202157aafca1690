"""The standalone checker: against our own evaluation, HiGHS and calculation by hand, and bad input."""

import ast
import gzip
import math
import re
import sys
import tracemalloc
from fractions import Fraction
from pathlib import Path

import crossfield as cf
import highspy
import pytest
from cases import RIGHT, SKEWED, make_field, make_instance, make_problem, points_of, write_point
from crossfield.export.formats.registry import FORMATS, problem_in_format, write
from crossfield.export.library.documents import check_point
from crossfield.export.library.documents.check_point import check
from loops import for_each


def verdict_on(folder, model, point):
    """What the checker states about the texts of a model and of a point."""
    (folder / "m.mps").write_text(model)
    (folder / "p").write_text(point)
    return check(str(folder / "m.mps"), str(folder / "p"))


def linear(entries="x obj 1 c 1", bounds="FR B x", extra=""):
    return f"NAME m\nROWS\n N obj\n L c\nCOLUMNS\n {entries}\nRHS\n R c 1\nBOUNDS\n {bounds}\n{extra}ENDATA\n"


def called(capsys, *arguments):
    """Exit code and output of the checker in this process."""
    code = check_point.main(list(map(str, arguments)))
    said = capsys.readouterr()
    return code, said.out, said.err


@for_each("shape", ["hole", "parts", "tetrahedron"])
@for_each("name", [name for name in (*SKEWED, *RIGHT) if name != "minlp-parity"])
def test_objective_and_violations_are_those_of_the_problem(name, shape, tmp_path):
    whole = make_problem(name, make_instance(shape, orthogonal=name in RIGHT))
    problem = problem_in_format(whole, FORMATS["mps"])
    write(whole, tmp_path / "m.mps.gz")
    for point in points_of(problem, count=2):
        verdict = check(str(tmp_path / "m.mps.gz"), str(write_point(tmp_path / "p.sol", problem, point)))
        ours, objective = problem.violation(point), problem.objective_value(point)
        assert float(verdict.objective) == pytest.approx(objective, rel=1e-11, abs=1e-11)
        for kind, value in (("bounds", ours.bounds), ("rows", ours.rows), ("integers", ours.integrality)):
            assert float(verdict.violations[kind][0]) == pytest.approx(value, rel=1e-11, abs=1e-11)


BOUNDS = [
    "LO B x -2\n UP B x 7.5",
    "MI B x\n UP B x -3",
    "FR B x",
    "FX B x 2.5",
    "LO B x 1\n PL B x",
    "LO B x -1e30\n UP B x 1e30",
]


@for_each("integer", [False, True])
@for_each("bounds", BOUNDS)
def test_bounds_mean_what_they_mean_to_highs(bounds, integer, tmp_path):
    marked = " M1 'MARKER' 'INTORG'\n x obj 1 c 1\n M2 'MARKER' 'INTEND'" if integer else "x obj 1 c 1"
    (tmp_path / "m.mps").write_text(linear(marked, bounds))
    highs = highspy.Highs()
    highs.setOptionValue("output_flag", False)
    assert highs.readModel(str(tmp_path / "m.mps")) == highspy.HighsStatus.kOk
    lp = highs.getLp()
    (column,) = check_point.Model(str(tmp_path / "m.mps")).columns.values()
    lower = -math.inf if column.bounds["lower"] is None else float(column.bounds["lower"])
    upper = math.inf if column.bounds["upper"] is None else float(column.bounds["upper"])
    assert (lower, upper, column.integer) == (lp.col_lower_[0], lp.col_upper_[0], integer)


EVERYTHING = """* every section
NAME everything FREE
ROWS
 N obj
 L c1
 E c2
COLUMNS
 x obj 0.1 c1 1
 M1 'MARKER' 'INTORG'
 k obj -3 c2 1
 M2 'MARKER' 'INTEND'
 y c1 0.2
RHS
 R obj -7 c1 1
 R c2 2
BOUNDS
 LO B x 0
 UP B x 10
 LO B k 0
 UP B k 9
 FR B y
QUADOBJ
 x x 4
 x y 0.5
QCMATRIX c1
 x x 1
 x y 0.25
 y x 0.25
ENDATA
"""


def test_every_section_of_an_mps_counts_as_by_hand(tmp_path, capsys):
    """At x = 0.5, k = 2.25, y = -0.1: 0.05 - 6.75 + 7 + 2/4 - 0.5/20 = 0.775;
    c1 = 0.5 - 0.02 + 0.25 - 0.025 = 0.705.
    """
    (tmp_path / "m.mps").write_text(EVERYTHING)
    (tmp_path / "p.sol").write_text("=obj= 0.775\nx 0.5\nk 2.25\ny -0.1\n")
    code, out, err = called(capsys, tmp_path / "m.mps", tmp_path / "p.sol")
    lines = dict(line.split(None, 1) for line in out.splitlines() if " " in line)
    assert (code, err) == (1, "")
    assert lines["objective"] == "0.775"
    assert lines["claimed"] == "0.775 (differs by 0)"
    assert lines["rows"] == "0.25 at c2"
    assert lines["integers"] == "0.25 at k"
    assert lines["bounds"] == "0"
    assert "NOT feasible" in out
    assert called(capsys, tmp_path / "m.mps", tmp_path / "p.sol", "--tolerance", "0.25")[0] == 0


@pytest.mark.parametrize(
    "section, entries, value",
    [
        ("QUADOBJ", "x x 4\n y x 3", 2 * 4 + 3 * 6),
        ("QCMATRIX obj", "x x 4\n y x 3\n x y 3", 4 * 4 + 2 * 3 * 6),
    ],
)
def test_quadratic_sections_differ_in_triangles_and_one_half(section, entries, value, tmp_path):
    model = linear("x obj 0\n y obj 0", "FR B x\n FR B y", f"{section}\n {entries}\n")
    assert verdict_on(tmp_path, model, "x 2\ny 3\n").objective == value


def test_nothing_is_lost_to_rounding(tmp_path):
    """1e16 + 1 - 1e16 is 1, and a row that is broken by 1e-40 is broken."""
    model = linear("x obj 1e16 c 1\n y obj 1\n z obj -1e16", "FR B x\n FR B y\n FR B z")
    verdict = verdict_on(tmp_path, model, "x 1.0000000000000000000000000000000000000001\ny 1\nz 1\n")
    assert Fraction(verdict.objective) == 1 + Fraction(10**16, 10**40)
    assert Fraction(verdict.violations["rows"][0]) == Fraction(1, 10**40)


def test_columns_left_out_are_zero_or_what_they_are_fixed_to(tmp_path):
    model = linear("x obj 1 c 1\n ONE obj 2.5", "FR B x\n FX B ONE 1")
    verdict = verdict_on(tmp_path, model, "# nothing but a claim\n=obj= 2.5\n")
    assert (verdict.objective, verdict.worst, verdict.agrees) == (Fraction(5, 2), 0, True)


def test_it_is_one_file_for_python_3_9_with_the_standard_library_alone():
    tree = ast.parse(Path(check_point.__file__).read_text(), feature_version=(3, 9))
    imports = [node for node in ast.walk(tree) if isinstance(node, (ast.Import, ast.ImportFrom))]
    names = {alias.name for node in imports for alias in node.names if isinstance(node, ast.Import)}
    names |= {node.module.split(".")[0] for node in imports if isinstance(node, ast.ImportFrom)}
    assert names <= set(sys.stdlib_module_names)
    assert not any(node.level for node in imports if isinstance(node, ast.ImportFrom))


def refused(capsys, *arguments):
    code, out, err = called(capsys, *arguments)
    assert (code, out) == (2, "")
    assert err.startswith("check_point: ")
    assert err.count("\n") == 1
    assert len(err) < 600
    return err


BAD = {
    "a model cut off": (linear()[:-7], "x 1"),
    "an empty model": ("", "x 1"),
    "no objective": ("NAME m\nROWS\n L c\nCOLUMNS\n x c 1\nENDATA\n", "x 1"),
    "an unknown row": (linear("x obj 1 d 1"), "x 1"),
    "an unknown bound": (linear(bounds="SC B x 4"), "x 1"),
    "no upper bound": (linear(bounds="LO B x -4"), "x 1"),
    "a word for a number": (linear("x obj one"), "x 1"),
    "not a number": (linear("x obj nan"), "x 1"),
    "an unknown marker": (linear("M 'MARKER' 'INTBEG'"), "x 1"),
    "an unknown column": (linear(extra="QUADOBJ\n x y 1\n"), "x 1"),
    "no text": ("NAME \udcff\udcfe\n", "x 1"),
    "JSON": ("{}", "x 1"),
    "foreign names": (linear(), "x 1\nq 2\n"),
    "a name twice": (linear(), "x 1\nx 2\n"),
    "three words": (linear(), "x 1 2\n"),
    "a word for a value": (linear(), "x one\n"),
    "infinite": (linear(), "x inf\n"),
    "an endless value": (linear(), "x 1e999999999\n"),
    "an empty point": (linear(), "\n# nothing\n"),
    "without a point": (linear(), "=infeas=\n"),
    "a binary point": (linear(), "\udcff\udcfe\udc80"),
    "a word for a tolerance": (linear(), "x 1", "--tolerance", "x"),
    "a negative tolerance": (linear(), "x 1", "--tolerance", "-1"),
}


@for_each("fault", BAD)
def test_bad_models_points_and_options_are_one_line(fault, tmp_path, capsys):
    model, point, *options = BAD[fault]
    (tmp_path / "m.mps").write_text(model, errors="surrogateescape")
    (tmp_path / "p").write_text(point, errors="surrogateescape")
    line = refused(capsys, tmp_path / "m.mps", tmp_path / "p", *options)
    assert "m.mps: " in line or model == linear()


def test_an_absent_model_and_a_folder_are_one_line(tmp_path, capsys):
    (tmp_path / "p").write_text("x 1")
    for model in (tmp_path / "absent", tmp_path):
        assert f"{model}: " in refused(capsys, model, tmp_path / "p")


def test_a_packed_file_that_grows_without_end_is_refused_before_it_is_unpacked(tmp_path, capsys):
    (tmp_path / "m.mps.gz").write_bytes(gzip.compress(b"\0" * (1 << 27)))
    (tmp_path / "p").write_text("x 0\n")
    tracemalloc.start()
    assert "unreasonably long" in refused(capsys, tmp_path / "m.mps.gz", tmp_path / "p")
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 8 << 20


def test_a_point_that_states_another_problem_is_refused(tmp_path, capsys):
    """Both models have the same columns and rows, and one weight differs: ONE_... is named by the problem."""
    problems = [
        cf.formulate(make_instance("full", skew_coefficient=weight), "milp-mccormick")
        for weight in (1e-3, 2e-3)
    ]
    model = tmp_path / "own.mps"
    write(problems[0], model)
    for problem, expected in zip(problems, (0, 2), strict=True):
        write(problem, tmp_path / "other.mps")
        (one,) = set(re.findall(r"ONE_\w+", (tmp_path / "other.mps").read_text()))
        point = write_point(tmp_path / "p.sol", problem, problem.point(make_field(problem.instance)))
        point.write_text(f"{one} 1\n{point.read_text()}")
        code, out, err = called(capsys, model, point)
        assert code == expected, err
    assert (out, "another instance or formulation" in err) == ("", True)
