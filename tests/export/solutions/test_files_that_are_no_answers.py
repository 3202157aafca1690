"""Files that are taken for answers are called what they are, with the way to the right file."""

import io
import re
import subprocess
import zipfile

import crossfield as cf
import highspy
import pytest
from answers import GOOD, HERE, problem
from crossfield.export.cli.app import invoke
from crossfield.export.formats.registry import write
from crossfield.export.solutions.readers.registry import parse_raw, read_raw
from crossfield.export.solutions.readers.siblings import sibling_of
from crossfield.models.errors import SolutionError
from loops import for_each
from places import DATA

MODELS = {
    "lp": "LP", "mps": "MPS", "nl": ".nl", "gms": "GAMS", "osil": "OSiL", "qplib": "QPLIB", "bar": ".bar",
    "mod": "AMPL", "dat": "AMPL",
}  # fmt: skip


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """The files that `export` writes for a sample, in all formats, with starts."""
    folder = tmp_path_factory.mktemp("written")
    formats = [word for name in MODELS if name != "dat" for word in ("-F", name)]
    start = cf.write_field(cf.greedy_field(cf.sample("skew", 4)), folder / "start.npz")
    arguments = ["export", "skew", "--size", "4", "-f", "milp", *formats, "--start", str(start)]
    assert invoke([*arguments, "-o", str(folder), "-q"]) == 0
    return folder


@pytest.fixture(scope="module")
def model(tmp_path_factory):
    """A small model for solvers."""
    path = tmp_path_factory.mktemp("model") / "m.mps"
    write(problem("milp"), path)
    return path


def refusal(path):
    with pytest.raises(SolutionError) as caught:
        read_raw(path)
    message = str(caught.value)
    assert re.search("write|give|unpack|run", message)
    assert "known kind" not in message
    return message


def test_a_model_is_no_answer(written):
    for suffix, name in MODELS.items():
        (path,) = written.glob(f"*.{suffix}")
        assert f"this is the model file ({name}); solve it" in refusal(path)
    for pattern, words in (
        ("*.col", "names in an .nl"), ("*.row", "names in an .nl"), ("*.manifest.json", "a manifest"),
        ("*.instance.json", "an instance of crossfield"), ("start.npz", "a zip archive"),
    ):  # fmt: skip
        (path,) = written.glob(pattern)
        assert words in refusal(path)


def test_starts_that_crossfield_writes_are_called_starts(written):
    for solver in ("gurobi", "cplex"):
        (path,) = written.glob(f"*.{solver}.start.mst")
        assert "this is a MIP start (.mst)" in refusal(path)


@pytest.mark.needs("gurobi")
@pytest.mark.filterwarnings("ignore")
def test_parameters_of_gurobi_are_named_as_such(tmp_path):
    import gurobipy

    with gurobipy.Env(params={"OutputFlag": 0}) as environment, gurobipy.Model(env=environment) as model:
        for name, value in (("IISMethod", 1), ("TimeLimit", 7), ("MIPGap", 0.01)):
            model.setParam(name, value)
        model.write(str(tmp_path / "x.prm"))
    assert "this is a parameter file of Gurobi" in refusal(tmp_path / "x.prm")
    (tmp_path / "list.sol").write_text("".join(f"X{number} {number}\n" for number in range(5)))
    assert read_raw(tmp_path / "list.sol").has_point


def test_starts_in_a_layout_of_answers_are_read(written):
    for pattern in ("*.highs.start.sol", "*.scip.start.sol", "*.xpress.start.slx"):
        (path,) = written.glob(pattern)
        assert read_raw(path).has_point


@pytest.fixture(scope="module")
def highs(model, tmp_path_factory):
    """Files that HiGHS writes besides its solution: its basis, its log and its pretty styles."""
    folder = tmp_path_factory.mktemp("highs")
    solver = highspy.Highs()
    solver.setOptionValue("log_to_console", False)
    solver.setOptionValue("log_file", str(folder / "x.log"))
    solver.readModel(str(model))
    solver.run()
    for style in (1, 3):
        solver.writeSolution(str(folder / f"style{style}.sol"), style)
    solver.setOptionValue("solve_relaxation", True)
    solver.run()
    solver.writeBasis(str(folder / "x.bas"))
    return folder


@pytest.mark.parametrize(
    "file, words",
    [
        ("x.log", r"this is a log of HiGHS.* give the solution file"),
        ("x.bas", r"this is a basis file.* option solution_file"),
        ("style1.sol", r"HiGHS style 1 \(pretty\).*write_solution_style = 0"),
        ("style3.sol", r"HiGHS, style 3 \(GLPK pretty\).*write_solution_style = 0"),
    ],
)
def test_what_highs_writes_besides_its_solution_is_named(highs, file, words):
    assert re.search(words, refusal(highs / file))


@pytest.mark.parametrize("path", sorted((DATA / "logs").glob("*.log")), ids=lambda path: path.stem)
def test_a_log_is_called_one(path):
    assert re.search(r"this is a log of \w+, which holds no point", refusal(path))


@pytest.mark.needs("glpk")
def test_the_report_of_glpsol_is_called_one(model, tmp_path):
    command = ["glpsol", "--freemps", model, "-o", tmp_path / "report.txt", "--log", tmp_path / "x.log"]
    subprocess.run(command, check=True, capture_output=True)
    assert re.search(r"a report of GLPK \(glpsol -o\).* with glpsol -w", refusal(tmp_path / "report.txt"))


@pytest.mark.needs("gurobi")
def test_what_gurobi_writes_besides_its_solution_is_named(model, tmp_path):
    import gurobipy

    with (
        gurobipy.Env(params={"OutputFlag": 0}) as environment,
        gurobipy.read(str(model), environment) as read,
    ):
        read.params.JSONSolDetail = 1
        read.optimize()
        read.write(str(tmp_path / "x.mst"))
        plain = [(column.VarName, column.X) for column in read.getVars()]
        for column in read.getVars():
            column.VTag = column.VarName
        read.optimize()
        read.write(str(tmp_path / "tagged.json"))
        relaxed = read.relax()
        relaxed.optimize()
        relaxed.write(str(tmp_path / "x.bas"))
    assert "line 1: this is a MIP start (.mst)" in refusal(tmp_path / "x.mst")
    assert "this is a basis file" in refusal(tmp_path / "x.bas")
    tagged = read_raw(tmp_path / "tagged.json")
    assert dict(zip(tagged.names.tolist(), tagged.values.tolist(), strict=True)) == pytest.approx(
        {name.encode(): value for name, value in plain}, abs=1e-5
    )


@pytest.mark.needs("cplex")
def test_what_cplex_writes_besides_its_solution_is_named(model, tmp_path):
    import cplex

    solver = cplex.Cplex(str(model))
    for silence in (solver.set_log_stream, solver.set_results_stream, solver.set_warning_stream):
        silence(None)
    solver.solve()
    solver.MIP_starts.write(str(tmp_path / "x.mst"))
    assert "this is a MIP start (.mst), which CPLEX reads" in refusal(tmp_path / "x.mst")
    solver.set_problem_type(solver.problem_type.LP)
    solver.solve()
    solver.solution.basis.write(str(tmp_path / "x.bas"))
    assert "this is a basis file" in refusal(tmp_path / "x.bas")


@pytest.mark.needs("xpress")
@pytest.mark.filterwarnings("ignore")
def test_what_xpress_writes_besides_its_solution_is_named(model, tmp_path):
    import xpress

    solver = xpress.problem()
    solver.controls.outputlog = 0
    solver.readProb(str(model))
    solver.optimize()
    solver.writeBasis(str(tmp_path / "x.bss"))
    solver.writePrtSol(str(tmp_path / "x.prt"))
    assert "this is a basis file" in refusal(tmp_path / "x.bss")
    assert "a report of Xpress (.prt)" in refusal(tmp_path / "x.prt")


@for_each("data, words", [
        (b"GAMS 54.6.1  abc Linux   11/27/26   Page 1\nGeneral Algebraic\n", "listing of GAMS"),
        (b"\x28\xb5\x2f\xfdabc", "zstd -d"), (b"7z\xbc\xaf\x27\x1c", "7z x"),
        (b"Maximize\n obj: x\nSubject To\n c: x <= 1\nEnd\n", r"model file \(LP\)"),
        (b"NAME\nROWS\n N obj\n", r"model file \(MPS\)"),
        (b"p lp min 1 2 3\nn p x\n", r"model file \(GLPK\)"),
    ])  # fmt: skip
def test_siblings_are_recognised_by_their_first_lines(data, words):
    with pytest.raises(SolutionError, match=words):
        parse_raw(data)


def test_a_zipped_answer_is_refused_with_the_way_to_unpack_it(tmp_path):
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w") as archive:
        archive.writestr("x.sol", "x 1\n")
    with pytest.raises(SolutionError, match=r"a zip archive.*unzip FILE"):
        parse_raw(packed.getvalue())


@for_each("path", [*GOOD, *HERE.glob("*.sol")])
def test_no_answer_is_taken_for_a_sibling(path):
    assert sibling_of(path.read_bytes()[: 1 << 16]) == ""
