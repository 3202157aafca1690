import gzip
import random
import struct
import tracemalloc

import numpy as np
import places
import pytest
from crossfield.export.solutions.readers import grammar
from crossfield.export.solutions.readers.ampl import write_ampl_sol
from crossfield.export.solutions.readers.grammar import EntryForm
from crossfield.export.solutions.readers.registry import parse_raw, read_raw
from crossfield.export.solutions.readers.text import (
    read_entries,
    values_by_name,
    values_in_order,
)
from crossfield.models.errors import OutputError, SolutionError
from hypothesis import given, settings
from hypothesis import strategies as st
from loops import for_each

HERE = places.SOLUTIONS
GOOD = sorted(HERE.glob("*.sol"))
NAMES = np.array([b"x", b"y", b"b", b"u", b"one"], dtype="S15")
OPTIMUM = [10, -9.7, 1, 0, 1]

HIGHS = (
    "Model status\n{status}\n\n# Primal solution values\n{primal}\nObjective 1\n# Columns {count}\n{lines}"
)


def highs(lines, *, status="Optimal", primal="Feasible", count=None):
    text = "".join(f"{line}\n" for line in lines)
    return HIGHS.format(
        status=status, primal=primal, count=len(lines) if count is None else count, lines=text
    ).encode()


def ampl(
    message="done",
    *,
    options=(1, 1, 0),
    rows=2,
    duals=0,
    values=(1.5, -2),
    columns=None,
    tail="objno 0 0\n",
):
    columns = len(values) if columns is None else columns
    numbers_before = [len(options), *options, rows, duals, columns, len(values)]
    lines = [message, "", "Options", *numbers_before, *[7] * duals, *values]
    return ("\n".join(map(str, lines)) + "\n" + tail).encode()


# what real solvers write


@for_each(
    "file, reader, status, values, rows",
    [
        ("highs-1.15.1_optimal_style0", "highs", "optimal-in-gap", OPTIMUM, 2),
        ("highs-1.15.1_optimal_style4", "highs", "optimal-in-gap", [10, -9.7, 1, 1], None),
        ("highs-1.15.1_qp_style0", "highs", "optimal-in-gap", [0.3499999875, -0.0499999975], 1),
        ("highs-1.15.1_qp_style4", "highs", "optimal-in-gap", [0.3499999875, -0.0499999975], None),
        ("highs-1.15.1_infeasible_style0", "highs", "infeasible", [], None),
        ("highs-1.15.1_infeasible_style4", "highs", "infeasible", [], None),
        ("highs-1.15.1_unbounded_style0", "highs", "unbounded", [0, 3], 1),
        ("highs-1.15.1_time_with_point_style0", "highs", "limit-with-point", [0.5, 1.25, 0, 0, 1], 2),
        ("highs-1.15.1_time_with_point_style4", "highs", "limit-with-point", [0.5, 1.25, 1], None),
        ("highs-1.15.1_time_without_point_style0", "highs", "limit-without-point", [], None),
        ("highs-1.16.0_optimal_style0", "highs", "optimal-in-gap", [10, -9.7, 1, 1, 0], 2),
        ("highs-1.16.0_optimal_style4", "highs", "optimal-in-gap", [10, -9.7, 1, 1], None),
        ("scip-10.0_optimal", "ampl-text", "optimal-global", OPTIMUM, 2),
        ("scip-10.0_infeasible", "ampl-text", "infeasible", [], 3),
        ("scip-10.0_unbounded", "ampl-text", "unbounded", [0, -100000, 1, 0, 0], 1),
        ("scip-10.0_limit_with_point", "ampl-text", "limit-with-point", [5, 100000, 1, 0, 0], 2),
        ("scip-10.0_limit_without_point", "ampl-text", "limit-without-point", [], 2),
        ("asl-20190605_text", "ampl-text", "feasible", [0.1] * 5, 2),
        ("asl-20190605_binary", "ampl-binary", "feasible", [0.1] * 5, 2),
    ],
)
def test_files_of_real_solvers_are_read(file, reader, status, values, rows):
    raw = read_raw(HERE / f"{file}.sol")
    assert (raw.reader, raw.status, raw.values.tolist(), raw.rows) == (reader, status, values, rows)
    assert raw.has_point == bool(values)
    assert (raw.names is None) == reader.startswith("ampl")
    assert raw.omits_zeros == (reader == "highs" and "style4" in file and bool(values))


def test_files_are_told_by_content_and_may_be_packed(tmp_path):
    for path in GOOD:
        plain = read_raw(path)
        for name, data in (("a.txt", path.read_bytes()), ("b.sol", gzip.compress(path.read_bytes()))):
            (tmp_path / name).write_bytes(data)
            raw = read_raw(tmp_path / name)
            assert (raw.reader, raw.status, raw.message, raw.objective) == (
                plain.reader,
                plain.status,
                plain.message,
                plain.objective,
            )
            np.testing.assert_array_equal(raw.values, plain.values)


# what they claim


@pytest.mark.parametrize(
    "words, primal, status",
    [
        ("Optimal", "Feasible", "optimal-in-gap"),
        ("Optimal", "Infeasible", "error"),
        ("Solution limit reached", "Feasible", "limit-with-point"),
        ("Interrupted by user", "Infeasible", "limit-without-point"),
        ("Infeasible", "Infeasible", "infeasible"),
        ("Solve error", "Feasible", "error"),
        ("Words of a later version", "Feasible", "error"),
    ],
)
def test_claims_of_highs_are_statuses(words, primal, status):
    raw = parse_raw(highs(["a 1"], status=words, primal=primal))
    assert (raw.status, raw.message, raw.values.tolist()) == (status, words, [1])


@for_each(
    "code, with_point, without_point",
    [
        (0, "optimal-local", None),
        (99, "optimal-local", None),
        (100, "feasible", "error"),
        (199, "feasible", "error"),
        (200, "infeasible", "infeasible"),
        (299, "infeasible", "infeasible"),
        (300, "unbounded", "unbounded"),
        (399, "unbounded", "unbounded"),
        (400, "limit-with-point", "limit-without-point"),
        (449, "limit-with-point", "limit-without-point"),
        (450, "limit-with-point", "limit-without-point"),
        (470, "limit-without-point", "limit-without-point"),
        (499, "limit-without-point", "limit-without-point"),
        (500, "error", "error"),
        (-1, "error", "error"),
    ],
)
def test_solve_codes_are_statuses(code, with_point, without_point):
    tail = f"objno 0 {code}\n"
    assert parse_raw(ampl(tail=tail)).status == with_point
    if without_point:
        raw = parse_raw(ampl(tail=tail, values=(), columns=2))
        assert (raw.status, raw.has_point) == (without_point, False)


@for_each(
    "message, status",
    [
        ("optimal solution found", "optimal-global"),
        ("Ipopt 3.14.16: Optimal Solution Found", "optimal-local"),
        ("\nbonmin: Optimal", "optimal-local"),
        ("\n couenne: Optimal", "optimal-local"),
        ("Knitro 13: Locally optimal or satisfactory solution.", "optimal-local"),
        ("BARON 24.1: 1 iterations, optimal within tolerances.\nObjective 3", "optimal-in-gap"),
        ("CPLEX 22.1: locally optimal solution; optimal target 2", "optimal-local"),
        ("Gurobi 11.0.0: optimal solution; objective 4", "optimal-in-gap"),
        ("Gurobi 11.0.0: solved; objective 4", "optimal-local"),
        ("", "optimal-local"),
    ],
)
def test_solved_is_a_proof_only_from_solvers_that_prove(message, status):
    raw = parse_raw(ampl(message))
    assert raw.status == status
    assert raw.message == " ".join(message.split())


def test_infeasible_or_unbounded_is_believed_from_its_words_alone():
    text = {"tail": "objno 0 450\n", "values": (), "columns": 1}
    assert parse_raw(ampl("infeasible or unbounded", **text)).status == "infeasible"
    assert parse_raw(ampl("user interrupt", **text)).status == "limit-without-point"


# layouts of AMPL files


@for_each(
    "tail", ["", "objno 0\n", "objno 0 403\n", "objno 0 403\nsuffix 0 1 4 0 0\nrc\n0 1\nkestrel_option x\n"]
)
@for_each("duals", [0, 2])
@for_each("options", [(1, 1, 0), (), (1, 1, 0, 20020401)])
def test_every_layout_of_ampl_text_is_read(options, duals, tail):
    raw = parse_raw(ampl(options=options, duals=duals, tail=tail))
    assert (raw.values.tolist(), raw.rows) == ([1.5, -2], 2)
    assert raw.status == ("limit-with-point" if "403" in tail else "feasible")


def test_text_right_up_to_options_and_no_message_at_all():
    text = ampl("one\ntwo").replace(b"two\n\n", b"two\n")
    assert parse_raw(text).message == "one two"
    assert parse_raw(text[text.index(b"Options") :]).values.tolist() == [1.5, -2]


def test_values_in_order_belong_to_a_problem_of_the_same_size():
    raw = read_raw(HERE / "scip-10.0_optimal.sol")
    assert values_in_order(5, 2, raw).tolist() == OPTIMUM
    for columns, rows in ((4, 2), (5, 3), (3, 2)):
        with pytest.raises(
            SolutionError, match=f"of 5 columns and 2 rows, the problem has {columns} columns and {rows} rows"
        ):
            values_in_order(columns, rows, raw)
    with pytest.raises(SolutionError, match=r"no point in it .*infeasible"):
        values_in_order(5, 3, read_raw(HERE / "scip-10.0_infeasible.sol"))


# numbers


@for_each(
    "text, value",
    [
        ("0.9999999", 0.9999999),
        ("-1e-12", -1e-12),
        ("1e-17", 1e-17),
        ("-0", 0.0),
        ("-9.6999999999999993", -9.7),
        ("1e+20", 1e20),
        ("inf", np.inf),
        ("Infinity", np.inf),
        ("+inf", np.inf),
        ("-infinity", -np.inf),
        ("1.#INF", np.inf),
        ("-1.#INF00", -np.inf),
        ("1.0D+00", 1.0),
        ("-2.5d-3", -0.0025),
        (".5", 0.5),
        ("5.", 5.0),
        ("1.7976931348623157e308", 1.7976931348623157e308),
        ("4.9e-324", 5e-324),
    ],
)
def test_every_spelling_of_a_number_is_read(text, value):
    assert parse_raw(ampl(values=(1, text))).values.tolist() == [1, value]
    for data in (
        highs([f"x {text}", "y 1"]).decode().replace("Objective 1", f"Objective {text}"),
        f"# Objective value = {text}\nx {text}\ny 1\n",
        f"objective value: {text}\nx {text} \t(obj:0)\ny 1 \t(obj:{text})\n",
        f"Optimal - objective value {text}\n  0 x {text} 0\n  1 y 1 {text}\n",
        f"s mip 1 2 o {text}\ni 1 {text}\nj 1 {text}\nj 2 1\ne o f\n",
        f"NAME a\n  C x {text}\n  C y 1\nENDATA\n",
        f"model_status,1\nsolver_status,1\nobjective,{text}\nx,{text}\ny, 1\n",
        f"=obj= {text}\nx {text}\ny 1\n",
        (
            '<CPLEXSolution><header solutionStatusValue="1"/>'
            f'<variable name="x" value="{text}"/><variable name="y" value="1"/></CPLEXSolution>'
        ),
    ):
        raw = parse_raw(data.encode())
        assert raw.values.tolist() == [value, 1]
        assert raw.objective in {value, None}


@for_each(
    "text", ["nan", "1_0", "0x10", "1,5", "--1", "1e", "1.5.3", "e5", "-", "1.#IND", "x" * 64, "1" * 64]
)
def test_what_is_not_a_number_is_refused(text):
    with pytest.raises(SolutionError, match=r"line 9: "):
        parse_raw(highs(["a 1", f"b {text}", "c 1"]))
    with pytest.raises(SolutionError, match=r"line 13: "):
        parse_raw(ampl(values=(1, 2, text)).replace(b"done\n", b""))


def test_two_faults_on_neighbouring_lines_do_not_make_up_for_each_other():
    with pytest.raises(SolutionError, match="line 9: 3 words stand where 2 should"):
        parse_raw(highs(["a 1", "b 2 c", "3"]))
    with pytest.raises(SolutionError, match="line 12: 2 words stand where 1 should"):
        parse_raw(ampl(values=("1 2", "")))


def test_columns_of_text_larger_than_a_piece(monkeypatch):
    rng = random.Random(5)
    rows = [
        ("n" * rng.randint(1, 15) + str(i), repr(rng.gauss(0, 1) * 10 ** rng.randint(-20, 20)))
        for i in range(2000)
    ]
    data = "".join(f"{name} {value}\n" for name, value in rows).encode()
    for size in (1, 30, 64, 1000, 4096, len(data) - 1, len(data), len(data) + 1):
        monkeypatch.setattr(grammar, "PIECE", size)
        names, values = read_entries(data, 0, EntryForm("name value"))[:2]
        assert names.tolist() == [name.encode() for name, _ in rows]
        assert values.tolist() == [float(value) for _, value in rows]
        column = "".join(f"{value}\n" for _, value in rows).encode()
        assert read_entries(b"7\n" + column, 2, EntryForm("value")).values.tolist() == values.tolist()


@settings(deadline=None)
@given(st.lists(st.floats(allow_nan=False)))
def test_numbers_come_back_bit_by_bit(values):
    text = "".join(f"{value!r}\n" for value in values).encode()
    assert (
        read_entries(text, 0, EntryForm("value")).values.tobytes() == np.array(values, dtype=float).tobytes()
    )


# by name


def test_missing_names_are_zero_only_where_zeros_are_omitted():
    dense, sparse = (parse_raw(data) for data in (highs(["x 1", "y 2"]), highs(["x 1 0", "y 2 1"], count=-2)))
    values, missing, _ = values_by_name(NAMES, dense)
    assert np.isnan(values).tolist() == [False, False, True, True, True]
    assert missing == 3
    values, missing, _ = values_by_name(NAMES, sparse)
    assert values.tolist() == [1, 2, 0, 0, 0]
    assert missing == 0


def test_a_sparse_file_without_values_is_the_point_zero():
    raw = parse_raw(highs([]))
    assert raw.has_point
    assert values_by_name(NAMES, raw) == (pytest.approx(np.zeros(5)), 0, 0)


def test_columns_that_readers_of_models_add_are_no_strangers():
    added = [
        "ONE",
        "Constant",
        "Rgc1",
        "MPS_Rgc1",
        "nlobjvar",
        "quadobjvar",
        "qmatrixvar",
        "objvar",
        "GAMS_OBJECTIVE",
    ]
    raw = parse_raw(highs([f"{name} 1" for name in [*added, "x", "One", "objvars", "aRg"]]))
    values, missing, unknown = values_by_name(np.array([b"x"]), raw)
    assert (values.tolist(), missing, unknown) == ([1], 0, 2)


def test_a_column_of_the_problem_may_bear_the_name_of_an_added_one():
    raw = parse_raw(highs(["x 2", "ONE 1"]))
    assert values_by_name(np.array([b"ONE", b"x"]), raw).values.tolist() == [1, 2]


def test_a_name_with_two_values_is_refused():
    same, other = (parse_raw(highs(["x 1", "y 2", f"x {again}"])) for again in ("1.0", "3"))
    assert values_by_name(np.array([b"y", b"x"]), same).values.tolist() == [2, 1]
    with pytest.raises(SolutionError, match=r"x has two values, 1\.0 and 3\.0"):
        values_by_name(np.array([b"y", b"x"]), other)


# writing


floats = st.floats(allow_nan=False, allow_infinity=False)


@settings(deadline=None, max_examples=50)
@given(
    values=st.lists(floats, min_size=1),
    message=st.text(max_size=60),
    rows=st.integers(0, 9),
    code=st.integers(0, 600),
)
def test_what_is_written_is_read_back(tmp_path_factory, values, message, rows, code):
    path = tmp_path_factory.getbasetemp() / "written.sol"
    assert write_ampl_sol(path, message, np.array(values), rows, code) == path
    raw = read_raw(path)
    assert raw.values.tobytes() == np.array(values).tobytes()
    assert (raw.rows, raw.reader) == (rows, "ampl-text")
    if code > 99:
        assert raw.status == parse_raw(ampl(tail=f"objno 0 {code}\n")).status


def test_pyomo_reads_what_is_written(tmp_path):
    other = pytest.importorskip(
        "pyomo.contrib.solver.solvers.asl_sol_reader", reason="this Pyomo has no reader to compare with"
    )
    values = np.random.default_rng(3).normal(size=200_000) * 10.0 ** np.arange(-20, 20).repeat(5000)
    values[:4] = 0, -0.0, 1, 1e17
    path = write_ampl_sol(tmp_path / "a.sol", "Options\n\n two  lines", values, 12, 403)
    with path.open() as stream:
        theirs = other.parse_asl_sol_file(stream)
    assert np.array(theirs.primals).tobytes() == values.tobytes()
    assert (theirs.solve_code, theirs.duals, theirs.ampl_options) == (403, [], [1, 1, 0])
    assert theirs.message.split() == ["Options.", "two", "lines"]
    assert path.read_bytes().count(b".0\n") == 0


def test_values_that_are_not_finite_are_not_written(tmp_path):
    for value in (np.nan, np.inf):
        with pytest.raises(SolutionError, match=r"a\.sol: .*not finite"):
            write_ampl_sol(tmp_path / "a.sol", "m", np.array([0, value]), 1, 0)
    with pytest.raises(OutputError):
        write_ampl_sol(tmp_path / "none" / "a.sol", "m", np.zeros(1), 1, 0)
    assert not list(tmp_path.iterdir())


def test_solve_codes_of_binary_files_are_statuses():
    data = (HERE / "asl-20190605_binary.sol").read_bytes()
    assert parse_raw(data + struct.pack("<4i", 8, 0, 403, 8)).status == "limit-with-point"
    assert parse_raw(data + struct.pack("<3i", 4, 1, 4)).status == "feasible"
    with pytest.raises(SolutionError, match="a record of 12 bytes stands where the solve code should"):
        parse_raw(data + struct.pack("<5i", 12, 0, 0, 0, 12))


def test_huge_announced_counts_take_no_memory():
    huge = [
        highs(["a 1"], count=999_999_999_999),
        highs(["a 1 0"], count=-999_999_999_999),
        ampl().replace(b"2\n0\n2\n2\n", b"2\n0\n999999999999\n999999999999\n"),
        ampl().replace(b"Options\n3\n", b"Options\n999999999999\n"),
        (HERE / "asl-20190605_binary.sol")
        .read_bytes()
        .replace(struct.pack("<2i", 5, 5), struct.pack("<2i", 2**31 - 1, 2**31 - 1)),
        (HERE / "asl-20190605_binary.sol")
        .read_bytes()
        .replace(b"Options\x03\0\0\0", b"Options\xff\xff\xff\x7f"),
    ]
    tracemalloc.start()
    for data in huge:
        with pytest.raises(SolutionError):
            parse_raw(data)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 1 << 20
