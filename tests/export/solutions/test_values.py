"""From values in files to checked points: numbers, names, positions, products, rounding."""

import struct
import tracemalloc
from itertools import product

import crossfield as cf
import numpy as np
import places
import pytest
from crossfield.export.solutions.readers.ampl import write_ampl_sol
from crossfield.export.solutions.readers.registry import parse_raw, read_raw
from hypothesis import given, settings
from hypothesis import strategies as st
from instance_kinds import kind
from loops import for_each

BINARY = places.SOLUTIONS / "asl-20190605_binary.sol"


def highs(lines, *, status="Optimal", count=None):
    text = "".join(f"{line}\n" for line in lines)
    head = f"Model status\n{status}\n\n# Primal solution values\nFeasible\nObjective 1\n"
    return f"{head}# Columns {len(lines) if count is None else count}\n{text}# Rows 0\n".encode()


def ampl(message="done", *, options=(1, 1, 0), duals=0, values=(1.5, -2), tail="objno 0 0\n"):
    numbers = [len(options), *options, 2, duals, len(values), len(values), *[7] * duals, *values]
    return ("\n".join(map(str, [message, "", "Options", *numbers])) + "\n" + tail).encode()


# numbers


@for_each(
    "text, value",
    [
        ("0.9999999", 0.9999999), ("-1e-12", -1e-12), ("-0", 0.0), ("-9.6999999999999993", -9.7),
        ("1e+20", 1e20), ("inf", np.inf), ("Infinity", np.inf), ("+inf", np.inf), ("-infinity", -np.inf),
        ("1.#INF", np.inf), ("-1.#INF00", -np.inf), ("1.0D+00", 1.0), ("-2.5d-3", -0.0025), (".5", 0.5),
        ("5.", 5.0), ("1.7976931348623157e308", 1.7976931348623157e308), ("4.9e-324", 5e-324),
    ],
)  # fmt: skip
def test_every_spelling_of_a_number_is_read(text, value):
    for data in (
        ampl(values=(text, 1)).decode(),
        highs([f"x {text}", "y 1"]).decode().replace("Objective 1", f"Objective {text}"),
        f"# Objective value = {text}\nx {text}\ny 1\n",
        f"objective value: {text}\nx {text} \t(obj:0)\ny 1 \t(obj:{text})\n",
        f"Optimal - objective value {text}\n  0 x {text} 0\n  1 y 1 {text}\n",
        f"s mip 1 2 o {text}\ni 1 {text}\nj 1 {text}\nj 2 1\ne o f\n",
        f"NAME a\n  C x {text}\n  C y 1\nENDATA\n",
        f"model_status,1\nsolver_status,1\nobjective,{text}\nx,{text}\ny, 1\n",
        f"=obj= {text}\nx {text}\ny 1\n",
        (
            '<CPLEXSolution><header solutionStatusValue="1"/><variables>'
            f'<variable name="x" value="{text}"/><variable name="y" value="1"/></variables></CPLEXSolution>'
        ),
    ):
        raw = parse_raw(data.encode())
        assert raw.values.tolist() == [value, 1]
        assert raw.objective in {value, None}


@for_each(
    "text", ["nan", "1_0", "0x10", "1,5", "--1", "1e", "1.5.3", "e5", "-", "1.#IND", "x" * 64, "1" * 64]
)
def test_what_is_not_a_number_is_refused(text):
    with pytest.raises(cf.SolutionError, match=r"line 9: "):
        parse_raw(highs(["a 1", f"b {text}", "c 1"]))
    with pytest.raises(cf.SolutionError, match=r"line 13: "):
        parse_raw(ampl(values=(1, 2, text)).replace(b"done\n", b""))


def test_two_faults_on_neighbouring_lines_do_not_make_up_for_each_other():
    with pytest.raises(cf.SolutionError, match="line 9: 3 words stand where 2 should"):
        parse_raw(highs(["a 1", "b 2 c", "3"]))
    with pytest.raises(cf.SolutionError, match="line 12: 2 words stand where 1 should"):
        parse_raw(ampl(values=("1 2", "")))


# layouts of AMPL


@for_each(
    "tail", ["", "objno 0\n", "objno 0 403\n", "objno 0 403\nsuffix 0 1 4 0 0\nrc\n0 1\nkestrel_option x\n"]
)
def test_every_layout_of_ampl_text_is_read(tail):
    for options, duals in product([(1, 1, 0), (), (1, 1, 0, 20020401)], [0, 2]):
        raw = parse_raw(ampl(options=options, duals=duals, tail=tail))
        assert (raw.values.tolist(), raw.rows) == ([1.5, -2], 2)
        assert raw.status == ("limit-with-point" if "403" in tail else "feasible")
    text = ampl("one\ntwo", tail=tail).replace(b"two\n\n", b"two\n")
    assert parse_raw(text).message == "one two"
    assert parse_raw(text[text.index(b"Options") :]).values.tolist() == [1.5, -2]
    assert parse_raw(ampl("{SOLVER}: done", tail=tail)).message == "{SOLVER}: done"  # no JSON


def test_solve_codes_of_binary_files_are_statuses():
    data = BINARY.read_bytes()
    assert parse_raw(data + struct.pack("<4i", 8, 0, 403, 8)).status == "limit-with-point"
    assert parse_raw(data + struct.pack("<3i", 4, 1, 4)).status == "feasible"
    with pytest.raises(cf.SolutionError, match="a record of 12 bytes stands where the solve code should"):
        parse_raw(data + struct.pack("<5i", 12, 0, 0, 0, 12))


def test_huge_announced_counts_take_no_memory():
    binary, counts = BINARY.read_bytes(), struct.pack("<2i", 5, 5)
    huge = [
        highs(["a 1"], count=999_999_999_999),
        highs(["a 1 0"], count=-999_999_999_999),
        ampl().replace(b"2\n0\n2\n2\n", b"2\n0\n999999999999\n999999999999\n"),
        ampl().replace(b"Options\n3\n", b"Options\n999999999999\n"),
        binary.replace(counts, struct.pack("<2i", 2**31 - 1, 2**31 - 1)),
        binary.replace(b"Options\x03\0\0\0", b"Options\xff\xff\xff\x7f"),
    ]
    tracemalloc.start()
    for data in huge:
        with pytest.raises(cf.SolutionError):
            parse_raw(data)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 1 << 20


@settings(max_examples=8)
@given(
    values=st.lists(st.floats(allow_nan=False, allow_infinity=False), min_size=1),
    message=st.text(max_size=60).map("Solver: {}".format),
    rows=st.integers(0, 9),
    code=st.integers(100, 600),
)
def test_what_is_written_is_read_back(tmp_path_factory, values, message, rows, code):
    path = tmp_path_factory.getbasetemp() / "written.sol"
    assert write_ampl_sol(path, message, np.array(values), rows, code) == path
    raw = read_raw(path)
    assert raw.values.tobytes() == np.array(values).tobytes()
    assert (raw.rows, raw.reader) == (rows, "ampl-text")
    assert raw.status == parse_raw(ampl(tail=f"objno 0 {code}\n")).status


def test_pyomo_reads_what_is_written(tmp_path):
    other = pytest.importorskip(
        "pyomo.contrib.solver.solvers.asl_sol_reader", reason="this Pyomo has no reader to compare with"
    )
    values = np.random.default_rng(3).normal(size=2000) * 10.0 ** np.arange(-20, 20).repeat(50)
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
        with pytest.raises(cf.SolutionError, match=r"a\.sol: .*not finite"):
            write_ampl_sol(tmp_path / "a.sol", "m", np.array([0, value]), 1, 0)
    with pytest.raises(cf.OutputError):
        write_ampl_sol(tmp_path / "none" / "a.sol", "m", np.zeros(1), 1, 0)
    assert not list(tmp_path.iterdir())


# points


FIELD = cf.power_field(kind("full"))
MILP = cf.formulate(FIELD.instance, "milp-mccormick")
POINT = MILP.point(FIELD)
NAMES = MILP.to_arrays().column_names.tolist()


def read_list(folder, names, values, problem=MILP):
    """The answer of a list of names and values."""
    lines = (f"{name} {float(value)!r}\n" for name, value in zip(names, values, strict=True))
    (folder / "x.sol").write_text("".join(lines))
    return cf.read_solution(folder / "x.sol", problem)


def test_integers_near_a_whole_number_are_rounded_and_other_values_kept(tmp_path):
    at, beta = MILP.blocks["p1"].offset, MILP.blocks["beta"].offset
    for column, moved, rounded in ((at, 4e-6, True), (at, 2e-5, False), (beta, 4e-6, False)):
        point = POINT.copy()
        point[column] += moved
        solution = read_list(tmp_path, NAMES, point)
        assert solution.point[column] == (POINT if rounded else point)[column]
        assert solution.rounded == pytest.approx(moved * rounded, rel=1e-6)
        assert solution.violation.integrality == pytest.approx(moved * (column == at and not rounded))
        assert solution.field.p.tolist() == FIELD.p.tolist()


def test_with_the_printed_facet_p_is_believed_and_z_is_not(tmp_path):
    """z may not fit p1 beta there: the objective of the file is lower than the energy of its field."""
    problem = cf.formulate(FIELD.instance, "milp-mccormick", facet="printed")
    rng = np.random.default_rng(1)
    field = cf.CrossField(FIELD.instance, FIELD.alpha, rng.uniform(-0.7, 0.7, len(FIELD.alpha)), FIELD.p)
    point, even, domain = problem.point(field), (field.p & 1) == 0, field.instance.domain
    first, second = field.beta[domain.first], field.beta[domain.second]
    z = np.clip((first - second) / 2, -np.pi / 4, 0)
    point[problem.blocks["z"].slice][even] = z[even]
    point[problem.blocks["t"].slice][even] = np.abs(first - 2 * z - second)[even]
    solution = read_list(tmp_path, problem.to_arrays().column_names, point, problem)
    assert solution.violation.worst < 1e-12
    assert solution.field.p.tolist() == field.p.tolist()
    assert solution.objective < solution.field.energy(1).total - 0.1


def test_a_file_without_a_point_has_no_field(tmp_path):
    facts = {"columns": MILP.n_columns, "stamp": MILP.stamp}
    write_ampl_sol(tmp_path / "x.sol", "no room", np.zeros(0), MILP.n_rows, 220, **facts)
    solution = cf.read_solution(tmp_path / "x.sol", MILP)
    assert (solution.point, solution.objective, solution.violation) == (None, None, None)
    assert solution.status == "infeasible"
    with pytest.raises(cf.SolutionError, match=r"no point in the solution \(infeasible\): no room"):
        _ = solution.field


# names that differ


SPELLINGS = [
    str.upper,
    str.title,
    lambda name: f"t_{name}",
    lambda name: f'"{name}"',
    lambda name: f"'T_{name}'",
]


@for_each("rename", SPELLINGS)
def test_other_spellings_of_names_are_read(rename, tmp_path):
    solution = read_list(tmp_path, map(rename, NAMES), POINT)
    assert (solution.status, solution.unknown) == ("feasible", 0)
    assert solution.point.tolist() == POINT.tolist()


def test_columns_that_readers_of_models_add_are_no_strangers(tmp_path):
    added = ["ONE", "Constant", "Rgc1", "MPS_Rgc1", "nlobjvar", "quadobjvar", "qmatrixvar", "objvar"]
    more = [*added, "One", "objvars", "aRg"]
    solution = read_list(tmp_path, [*more, *NAMES], [*np.ones(len(more)), *POINT])
    assert (solution.unknown, solution.point.tolist()) == (2, POINT.tolist())


def test_two_spellings_of_a_name_are_refused_if_their_values_differ(tmp_path):
    twice = [*NAMES, NAMES[0].upper()]
    assert read_list(tmp_path, twice, [*POINT, POINT[0]]).status == "feasible"
    with pytest.raises(cf.SolutionError, match="has two values"):
        read_list(tmp_path, twice, [*POINT, 7.0])


def names_in(name, formulation="milp-mccormick"):
    return cf.formulate(kind(name), formulation).to_arrays().column_names.tolist()


ZEROS = [name for name, value in zip(NAMES, POINT, strict=True) if value]
MISFITS = {
    "other instance": (names_in("far"), "names are unknown .* another formulation"),
    "other mesh": (names_in("tetrahedron-skewed"), "it is of another formulation, instance or model"),
    "other formulation": (names_in("full", "minlp-parity"), "it is of another formulation, instance"),
    "fewer blocks": (names_in("full", "minlp-quartic"), "the file may be cut off, or of another formulation"),
    "cut off": (NAMES[:-5], r"5 of \d+ columns .* missing \(psi_\w+ is the first\); the file may be cut off"),
    "cut off in a block": (NAMES[:60], "columns .* the file may be cut off"),
    "lines missing": ([*NAMES[:7], *NAMES[9:]], r"2 of \d+ columns .* the file may be cut off"),
    "zeros left out": (ZEROS, "left out columns at 0, which this layout lists; .* `=obj= VALUE`"),
    "renamed x1": (
        [f"x{at}" for at in range(len(NAMES))],
        r"\(first 'x0'\); the program renamed the columns",
    ),
    "renamed C0001": ([f"C{at:07d}" for at in range(len(NAMES))], "the program renamed the columns"),
    "other model": (["foo", "bar"], r"\(first 'foo'\); it is of another formulation, instance"),
}


@for_each("name", MISFITS)
def test_names_that_do_not_fit_are_shown_with_the_likely_cause(name, tmp_path):
    names, message = MISFITS[name]
    values = POINT[POINT != 0] if name == "zeros left out" else POINT
    with pytest.raises(cf.SolutionError, match=message):
        read_list(tmp_path, names, np.resize(values, len(names)))


@for_each("name", ["tetrahedron-skewed", "cube-skewed-box"])
def test_numbers_of_faces_and_pairs_are_names_in_any_list(name, tmp_path):
    field = cf.greedy_field(kind(name))
    problem = cf.formulate(field.instance, "milp-mccormick")
    point, names = problem.point(field), problem.to_arrays().column_names.tolist()
    for form, head in (
        ("{} {!r}\n", ""),
        ('"{}": {!r},\n', "Some words\nof a program\n"),
        ("{} = {!r}\n", ""),
    ):
        entries = (form.format(*entry) for entry in zip(names, point.tolist(), strict=True))
        (tmp_path / "list.sol").write_text(head + "".join(entries))
        solution = cf.read_solution(tmp_path / "list.sol", problem)
        assert solution.objective == pytest.approx(problem.objective_value(point))
    (tmp_path / "list.sol").write_text("".join(f"{name}\n" for name in names))
    with pytest.raises(cf.SolutionError, match="this is a list of the names in an"):
        cf.read_solution(tmp_path / "list.sol", problem)


@for_each("value, message", [
        (np.inf, "has the value inf, .* not finite"), (1e300, r"has the value 1e\+300, which no column"),
        (4294967296.0, "has the value 4.29497e"), (-1.1e8, "has the value -1.1e"),
    ])  # fmt: skip
def test_values_that_no_column_can_have_are_refused(value, message, tmp_path):
    """Under any tolerance; jumps do not wrap around."""
    for block in ("alpha", "p2", "s"):
        point = POINT.copy()
        point[MILP.blocks[block].offset] = value
        with pytest.raises(cf.SolutionError, match=rf"{block}_00_0\w* {message}"):
            read_list(tmp_path, NAMES, point)
    point[MILP.blocks["s"].offset] = 1e8
    assert read_list(tmp_path, NAMES, point).violation.worst < 1e-9
    point[MILP.blocks["p2"].offset] = 4294967296.0
    with pytest.raises(cf.InstanceError, match="32 bits"):
        MILP.field(point)
