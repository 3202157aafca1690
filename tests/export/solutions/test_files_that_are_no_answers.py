"""Files that are taken for answers are called what they are, with the way to the right file."""

import io
import re
import zipfile

import crossfield as cf
import pytest
from answers import listed, problem
from command_line import invoke
from crossfield.export.formats.registry import FORMATS
from crossfield.export.solutions.readers.registry import parse_raw, read_raw
from loops import for_each
from places import DATA


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """The files that `export` writes for a sample, in all formats, with starts."""
    folder = tmp_path_factory.mktemp("written")
    start = cf.write_field(cf.greedy_field(cf.sample("skew", 4)), folder / "start.npz")
    formats = [word for name in FORMATS for word in ("-F", name)]
    arguments = ["export", "skew", "--size", "4", "-f", "milp", *formats, "--start", str(start)]
    assert invoke([*arguments, "-o", str(folder)]) == 0
    return folder


@pytest.fixture(scope="module")
def model(tmp_path_factory):
    """A small model for solvers."""
    path = tmp_path_factory.mktemp("model") / "m.mps"
    cf.write(problem("milp"), path)
    return path


def refusal(path):
    with pytest.raises(cf.SolutionError) as caught:
        read_raw(path)
    message = str(caught.value)
    assert re.search("write|give|unpack|run", message)
    assert "known kind" not in message
    return message


WRITTEN = {
    **{f"*.{suffix}": "this is a model file; solve it" for suffix in (*FORMATS, "dat")},
    "*.col": "names in an .nl",
    "*.row": "names in an .nl",
    "*.manifest.json": "a manifest",
    "*.instance.json": "an instance of crossfield",
    "start.npz": "a zip archive",
    "*.gurobi.start.mst": "this is a MIP start (.mst)",
    "*.cplex.start.mst": "this is a MIP start (.mst)",
}


@for_each("pattern", WRITTEN)
def test_what_crossfield_writes_is_no_answer(written, pattern):
    (path,) = written.glob(pattern)
    assert WRITTEN[pattern] in refusal(path)


def test_starts_in_a_layout_of_answers_are_read(written):
    for pattern in ("*.highs.start.sol", "*.scip.start.sol", "*.xpress.start.slx"):
        (path,) = written.glob(pattern)
        assert read_raw(path).has_point


@for_each("path", sorted((DATA / "logs").glob("*.log")))
def test_a_log_is_called_one(path):
    assert "this is a log of a solver, which holds no point" in refusal(path)


MST = """<?xml version = "1.0" encoding="UTF-8" standalone="yes"?>
<CPLEXSolutions version="1.2">
 <CPLEXSolution version="1.2">
  <header
    problemName="m.mps"
    solutionName="m1"
    MIPStartEffortLevel="0"
    writeLevel="2"/>
"""
BASIS = " XU alpha_00_00      c15_00_00_r\n XU alpha_00_01      c15_01_00_u\n"
SIBLINGS = {
    "GAMS 54.6.1  abc Linux   11/27/26   Page 1\nGeneral Algebraic\n": "listing of GAMS",
    "Maximize\n obj: x\nSubject To\n c: x <= 1\nEnd\n": "a model file",
    "NAME\nROWS\n N obj\n": "a model file",
    "p lp min 1 2 3\nn p x\n": "a model file",
    # As HiGHS 1.16.0, Gurobi 13.0.3, CPLEX 22.2.0.1, Xpress 9.9.1 and GLPK 5.0 begin them
    "HiGHS_basis_file v2\nNone\n": r"this is a basis file.* option solution_file",
    "# MIP start\np1_00_00_r 1\np1_01_00_u 0\n": r"line 1: this is a MIP start \(.mst\)",
    MST: r"this is a MIP start \(.mst\), which CPLEX reads",
    "TimeLimit  7\nMIPGap  0.01\nIISMethod  1\n": "this is a parameter file of Gurobi",
    f"NAME tiny_sha256_a1a5428ed32_copy 36 Variables 48 Constraints\n{BASIS}": "this is a basis file",
    f"* ENCODING=ISO-8859-1\nNAME   m.mps  Iterations 17  Rows 48  Cols 36\n{BASIS}": "this is a basis file",
    f"NAME          tiny_sha256_a1a5428ed32 FREE       \n{BASIS}": "this is a basis file",
    "Problem Statistics\nMatrix tiny_sha256_a1a5428ed32 FREE  \n": r"a report of Xpress \(.prt\)",
    "Problem:    tiny\nRows:       48\nColumns:    36 (8 integer, 5 binary)\n": "a report of GLPK",
}
"""The first lines of files that are no answers, and what they are called."""


@for_each("data, words", [
        *((data.encode(), words) for data, words in SIBLINGS.items()),
        (b"\x28\xb5\x2f\xfdabc", "zstd -d"), (b"7z\xbc\xaf\x27\x1c", "7z x"),
    ])  # fmt: skip
def test_siblings_are_recognised_by_their_first_lines(data, words):
    with pytest.raises(cf.SolutionError, match=words):
        parse_raw(data)


def test_a_zipped_answer_is_refused_with_the_way_to_unpack_it():
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w") as archive:
        archive.writestr("x.sol", "x 1\n")
    with pytest.raises(cf.SolutionError, match=r"a zip archive.*unzip FILE"):
        parse_raw(packed.getvalue())


@pytest.mark.needs("gurobi")
@pytest.mark.filterwarnings("ignore")
def test_tagged_columns_of_gurobi_are_read(model, tmp_path):
    import gurobipy

    environment = gurobipy.Env(params={"OutputFlag": 0, "JSONSolDetail": 1})
    with environment, gurobipy.read(str(model), environment) as read:
        for column in read.getVars():
            column.VTag = column.VarName
        read.optimize()
        read.write(str(tmp_path / "tagged.json"))
        values = {column.VarName.encode(): column.X for column in read.getVars()}
    raw = read_raw(tmp_path / "tagged.json")
    assert listed(raw) == pytest.approx(values, abs=1e-5)
