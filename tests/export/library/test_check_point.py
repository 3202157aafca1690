"""The standalone checker: against our own evaluation, against real solvers, against calculation by hand,
and bad input.
"""

import ast
import gzip
import math
import re
import sys
import tracemalloc
from fractions import Fraction
from pathlib import Path

import crossfield as cf
import pytest
from cases import LOW_DEGREE, SKEWED, make_field, make_instance, names_of, points_of, problem_of
from crossfield.export.formats.registry import FORMATS, problem_in_format, write
from crossfield.export.library.documents import check_point
from crossfield.export.library.documents.check_point import BadInputError, check
from crossfield.models.formulations.names import column_names
from crossfield.models.formulations.problem import formulate
from loops import for_each


def save_point(path, problem, point, *, zeros=True):
    """A list of names and values as any program might write it."""
    pairs = zip(names_of(column_names(problem.instance, problem.blocks)), point.tolist(), strict=True)
    path.write_text("".join(f"{name} {value!r}\n" for name, value in pairs if zeros or value != 0))
    return str(path)


def called(capsys, *arguments):
    """Exit code and output of the checker in this process."""
    code = check_point.main(list(map(str, arguments)))
    said = capsys.readouterr()
    return code, said.out, said.err


# against our own evaluation


@for_each("case", LOW_DEGREE)
def test_objective_and_violations_are_those_of_the_problem(case, tmp_path):
    problem = problem_in_format(problem_of(case), FORMATS["mps"])
    write(problem_of(case), tmp_path / "m.mps.gz")
    for point in points_of(problem, count=2):
        verdict = check(str(tmp_path / "m.mps.gz"), save_point(tmp_path / "p.sol", problem, point))
        ours, objective = problem.violation(point), problem.objective_value(point)
        assert float(verdict.objective) == pytest.approx(objective, rel=1e-11, abs=1e-11)
        for kind, value in (("bounds", ours.bounds), ("rows", ours.rows), ("integers", ours.integrality)):
            assert float(verdict.violations[kind][0]) == pytest.approx(value, rel=1e-11, abs=1e-11)


@for_each("name", [name for name in SKEWED if name != "minlp-parity"])
def test_the_complete_point_of_a_field_is_feasible_also_without_its_zeros(name, tmp_path):
    field = make_field(make_instance("full"))
    whole = formulate(field.instance, name, p=field.p if name == "qp-fixed" else None)
    problem = problem_in_format(whole, FORMATS["mps"])
    write(whole, tmp_path / "m.mps")
    verdict = check(
        str(tmp_path / "m.mps"), save_point(tmp_path / "p.sol", problem, problem.point(field), zeros=False)
    )
    assert verdict.worst < 1e-14
    if name in {"minlp-quartic", "minlp-cubic", "miqp-exact", "qp-fixed"}:
        assert float(verdict.objective) == pytest.approx(field.energy(2).total, rel=1e-12)
    if name in {"milp-mccormick", "miqcp-bilinear-l1"}:
        assert float(verdict.objective) == pytest.approx(field.energy(1).total, rel=1e-12)


def test_integers_that_are_not_quite_whole_count_as_they_are(tmp_path):
    field = make_field(make_instance("full"))
    problem = formulate(field.instance, "miqp-exact")
    write(problem, tmp_path / "m.mps")
    point = problem.point(field)
    point[problem.integer] += 1e-6
    file = save_point(tmp_path / "p.sol", problem, point)
    assert float(check(str(tmp_path / "m.mps"), file).violations["integers"][0]) == pytest.approx(1e-6)


# against real solvers


@for_each("solver", ["highs", "ipopt"])
def test_the_optimum_of_a_solver_is_feasible_and_has_its_objective(solver, tmp_path):
    field = make_field(make_instance("full"))
    name = "milp-mccormick" if solver == "highs" else "qp-fixed"
    problem = formulate(field.instance, name, p=field.p if name == "qp-fixed" else None)
    write(problem, tmp_path / "m.mps")
    answer = cf.solve(problem, solver)
    verdict = check(str(tmp_path / "m.mps"), save_point(tmp_path / "p.sol", problem, answer.point))
    assert verdict.worst < 1e-6
    assert float(verdict.objective) == pytest.approx(answer.reported or answer.objective, abs=1e-6)


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
    highspy = pytest.importorskip("highspy")
    open_, close = (" M1 'MARKER' 'INTORG'\n", " M2 'MARKER' 'INTEND'\n") if integer else ("", "")
    (tmp_path / "m.mps").write_text(
        f"NAME m\nROWS\n N obj\n L c\nCOLUMNS\n{open_} x obj 1 c 1\n{close}RHS\nBOUNDS\n {bounds}\nENDATA\n"
    )
    highs = highspy.Highs()
    highs.setOptionValue("output_flag", False)
    assert highs.readModel(str(tmp_path / "m.mps")) == highspy.HighsStatus.kOk
    lp = highs.getLp()
    (column,) = check_point.Model(check_point.lines_of(str(tmp_path / "m.mps"))).columns
    lower = -math.inf if column.bounds["lower"] is None else float(column.bounds["lower"])
    upper = math.inf if column.bounds["upper"] is None else float(column.bounds["upper"])
    assert (lower, upper) == (lp.col_lower_[0], lp.col_upper_[0])
    assert column.integer == integer


# by hand


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
    (tmp_path / "m.mps").write_text(
        f"NAME q\nROWS\n N obj\nCOLUMNS\n x obj 0\n y obj 0\nRHS\nBOUNDS\n FR B x\n FR B y\n"
        f"{section}\n {entries}\nENDATA\n"
    )
    (tmp_path / "p").write_text("x 2\ny 3\n")
    assert check(str(tmp_path / "m.mps"), str(tmp_path / "p")).objective == value


def linear(entries="x obj 1 c 1", bounds="FR B x", extra=""):
    return f"NAME m\nROWS\n N obj\n L c\nCOLUMNS\n {entries}\nRHS\n R c 1\nBOUNDS\n {bounds}\n{extra}ENDATA\n"


def test_nothing_is_lost_to_rounding(tmp_path):
    """1e16 + 1 - 1e16 is 1, and a row that is broken by 1e-40 is broken."""
    columns = "x obj 1e16 c 1\n y obj 1\n z obj -1e16"
    (tmp_path / "m.mps").write_text(linear(columns, "FR B x\n FR B y\n FR B z"))
    (tmp_path / "p").write_text("x 1.0000000000000000000000000000000000000001\ny 1\nz 1\n")
    verdict = check(str(tmp_path / "m.mps"), str(tmp_path / "p"))
    assert Fraction(verdict.objective) == 1 + Fraction(10**16, 10**40)
    assert Fraction(verdict.violations["rows"][0]) == Fraction(1, 10**40)


def test_columns_left_out_are_zero_or_what_they_are_fixed_to(tmp_path):
    (tmp_path / "m.mps").write_text(linear("x obj 1 c 1\n ONE obj 2.5", "FR B x\n FX B ONE 1"))
    (tmp_path / "p").write_text("# nothing but a claim\n=obj= 2.5\n")
    verdict = check(str(tmp_path / "m.mps"), str(tmp_path / "p"))
    assert (verdict.objective, verdict.worst, verdict.agrees) == (Fraction(5, 2), 0, True)


# as a program


def test_it_is_one_short_file_for_python_3_9_with_the_standard_library_alone():
    """A person reads it: 300 lines."""
    text = Path(check_point.__file__).read_text()
    assert text.count("\n") <= 300
    tree = ast.parse(text, feature_version=(3, 9))
    names = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        if isinstance(node, ast.ImportFrom):
            assert node.level == 0
            names.add(node.module.split(".")[0])
    assert names <= set(sys.stdlib_module_names)
    called_names = {
        node.func.id
        for node in ast.walk(tree)
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name)
    }
    assert not called_names & {"eval", "exec", "compile", "__import__"}


# bad input

GOOD_POINT = "x 1\n"
BAD_MODELS = {
    "cut off": linear()[:-7],
    "empty": "",
    "no objective": "NAME m\nROWS\n L c\nCOLUMNS\n x c 1\nENDATA\n",
    "an unknown row": linear("x obj 1 d 1"),
    "an unknown bound": linear(bounds="SC B x 4"),
    "two bounds": linear(bounds="UP B x 4\n UP B x 5"),
    "no upper bound": linear(bounds="LO B x -4"),
    "an entry twice": linear("x obj 1 c 1\n x c 1"),
    "a word for a number": linear("x obj one"),
    "not a number": linear("x obj nan"),
    "an unknown marker": linear("M 'MARKER' 'INTBEG'"),
    "both triangles in QUADOBJ": linear("x obj 1\n y obj 1", "FR B x\n FR B y", "QUADOBJ\n x y 1\n y x 1\n"),
    "one triangle in QCMATRIX": linear("x obj 1\n y obj 1", "FR B x\n FR B y", "QCMATRIX c\n x y 1\n"),
    "a matrix entry twice": linear("x obj 1\n y obj 1", "FR B x\n FR B y", "QUADOBJ\n x x 1\n x x 1\n"),
    "a row twice": linear().replace(" L c\n", " L c\n G c\n"),
    "no text": "NAME \udcff\udcfe\n",
    "JSON": "{}",
}
BAD_POINTS = {
    "foreign names": "x 1\nq 2\n",
    "a name twice": "x 1\nx 2\n",
    "three words": "x 1 2\n",
    "a word for a value": "x one\n",
    "infinite": "x inf\n",
    "an endless value": "x 1e999999999\n",
    "empty": "\n# nothing\n",
    "without a point": "=infeas=\n",
    "binary": "\udcff\udcfe\udc80",
}


def refused(capsys, *arguments):
    code, out, err = called(capsys, *arguments)
    assert (code, out) == (2, "")
    assert err.startswith("check_point: ")
    assert err.count("\n") == 1
    assert len(err) < 600
    return err


@for_each("fault", BAD_MODELS)
def test_bad_models_are_one_line(fault, tmp_path, capsys):
    (tmp_path / "m.mps").write_text(BAD_MODELS[fault], errors="surrogateescape")
    (tmp_path / "p").write_text(GOOD_POINT)
    assert "m.mps: " in refused(capsys, tmp_path / "m.mps", tmp_path / "p")


@for_each("fault", BAD_POINTS)
def test_bad_points_are_one_line(fault, tmp_path, capsys):
    (tmp_path / "m.mps").write_text(linear())
    (tmp_path / "p").write_text(BAD_POINTS[fault], errors="surrogateescape")
    refused(capsys, tmp_path / "m.mps", tmp_path / "p")


@for_each(
    "arguments",
    [
        (),
        ("m",),
        ("m", "p", "q"),
        ("m", "p", "--tolerance", "x"),
        ("m", "p", "--tolerance", "-1"),
        ("m", "p", "--nothing"),
        ("absent", "p"),
        (".", "p"),
    ],
)
def test_wrong_usage_is_one_line(arguments, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "m").write_text(linear())
    (tmp_path / "p").write_text(GOOD_POINT)
    refused(capsys, *arguments)


def test_a_packed_file_that_grows_without_end_is_refused_before_it_is_unpacked(tmp_path, capsys):
    (tmp_path / "m.mps.gz").write_bytes(gzip.compress(b"\0" * (1 << 27)))
    (tmp_path / "p").write_text("x 0\n")
    tracemalloc.start()
    assert "unreasonably long" in refused(capsys, tmp_path / "m.mps.gz", tmp_path / "p")
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 8 << 20


def test_a_point_of_another_instance_is_named_as_such(tmp_path):
    one, other = make_field(make_instance("full")), make_field(make_instance("row"))
    problem, foreign = (formulate(field.instance, "minlp-quartic") for field in (one, other))
    write(problem, tmp_path / "m.mps")
    point = save_point(tmp_path / "p", foreign, foreign.point(other))
    with pytest.raises(BadInputError, match="another instance or formulation"):
        check(str(tmp_path / "m.mps"), point)


# the problem of a point


def test_a_point_that_states_another_problem_is_refused(tmp_path, capsys):
    """Both models have the same columns and rows, and one weight differs: ONE_... is named by the problem."""
    problems = [
        formulate(make_instance("full", skew_coefficient=weight), "milp-mccormick") for weight in (1e-3, 2e-3)
    ]
    model = tmp_path / "own.mps"
    write(problems[0], model)
    for problem, expected in zip(problems, (0, 2), strict=True):
        write(problem, tmp_path / "other.mps")
        (one,) = set(re.findall(r"ONE_\w+", (tmp_path / "other.mps").read_text()))
        point = save_point(tmp_path / "p.sol", problem, problem.point(make_field(problem.instance)))
        Path(point).write_text(f"{one} 1\n{Path(point).read_text()}")
        code, out, err = called(capsys, model, point)
        assert code == expected, err
    assert (out, "another instance or formulation" in err) == ("", True)
