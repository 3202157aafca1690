"""Every kind of problem in every format, as programs and readers of the tests read it: the same problem."""

import io
import math
import re
from dataclasses import replace
from functools import cache
from importlib import import_module

import ampl_by_glpk
import crossfield as cf
import gams_reader
import numpy as np
import pytest
from cases import OPTIONS
from crossfield.export.formats.gams import MODEL_TYPES
from crossfield.export.formats.registry import FORMATS
from crossfield.export.programs.casadi import read_nl
from crossfield.export.programs.comparison import algebra_difference, behaviour_difference, values_at
from crossfield.export.programs.model_content import Points
from crossfield.export.programs.protocol import NotReportedError
from crossfield.export.solvers_table import PROGRAMS, SOLVERS
from crossfield.export.writing.nl_order import NlOrder
from crossfield.models.formulations.catalogue import FORMULATIONS
from crossfield.models.formulations.windows import Windows
from folders import contents
from instance_kinds import SMALL, first_field, grid, kind
from oracles import by_asl
from places import GOLDEN

VALUES = OPTIONS | {"change": ["jumps fixed", "windows narrowed"]}
"""Values of each option; `change` is one of the problem."""
PLACES = [
    name
    for name in SMALL
    if kind(name).domain.size <= 12
    and name not in {"reliabilities", "light", "full-box", "pixel-orthogonal-weightless"}
]
"""Kinds of at most 12 points whose coefficients all programs read."""


def variants():
    """Every formulation, and each with one option changed."""
    for name, recipe in FORMULATIONS.items():
        yield name, {}
        for option, values in VALUES.items():
            if option in recipe.option_names or option == "change":
                others = [value for value in values if value != getattr(recipe.defaults, option, 0)]
                yield from ((name, {option: value}) for value in others)
    yield "milp-mccormick", {"stroke_norm": 2, "beta_norm": 2, "facet": "printed", "relax": True}


def problems():
    """Each variant on four of the kinds that it takes."""
    for number, (name, options) in enumerate(variants()):
        places = [place for place in PLACES if is_taken(kind(place), name, **options)]
        for turn in range(4 if places else 0):
            yield places[(number + 7 + 11 * turn) % len(places)], name, options


def is_taken(instance, formulation, change="", limits=False, **_):
    """Whether an instance can have a formulation, and the change."""
    is_cycle, is_fixed = "-cycle" in formulation, bool(FORMULATIONS[formulation].fixed)
    if (change == "jumps fixed" and is_fixed) or (change == "windows narrowed" and is_cycle):
        return False
    if instance.indices is not None and (limits or not is_cycle):
        return False
    is_right = FORMULATIONS[formulation].orthogonal
    return (instance.orthogonal or not is_right) and not ((is_cycle or limits) and instance.gauge == "box")


PROBLEMS = [*problems()]


@cache
def field_of(place):
    """The greedy field of a kind, whose jumps no single change improves."""
    return first_field(kind(place))


def problem_of(place, formulation, options):
    """The problem of a row of PROBLEMS."""
    instance, field = kind(place), field_of(place)
    options, change = dict(options), options.get("change")
    options.pop("change", None)
    problem = cf.formulate(instance, formulation, p=field.p if formulation == "qp-fixed" else None, **options)
    if change == "jumps fixed" and problem.integer.any():
        return problem.with_integers_fixed(field)
    return replace(problem, windows=around(field)) if change == "windows narrowed" else problem


def around(field):
    """Windows around a field, half as wide as those of its gauge; jumps may be one below the field's."""
    instance, quarter = field.instance, np.full_like(field.beta, np.pi / 4)
    ends = (instance.alpha_lower, instance.alpha_upper), (-quarter, quarter)
    angles = zip((field.alpha, field.beta), ends, strict=True)
    bounds = [(value + end) / 2 for value, pair in angles for end in pair]
    return Windows(*bounds, np.maximum(field.p - 1, instance.p_min), field.p, 1.0, "none")


def refusal(problem, suffix):
    """How a format refuses a problem; empty where it must not."""
    degree = max(problem.objective_degree, problem.row_degree)
    if degree > 4 and FORMATS[suffix].degree <= 4:
        return (
            "choose nl or gms"
            if problem.formulation.options.relax
            else "write minlp-quartic, which is the same"
        )
    return "columns fixed one by one; write nl, lp or mps" if suffix == "mod" and problem.pinned else ""


def points_of(held, field):
    """Random points, with no regard to bounds, rows and integrality, and that of a field."""
    values = np.random.default_rng(3).normal(size=(3, held.n_columns))
    values = np.stack([*values, held.point(field)])
    return Points(held.to_arrays().column_names.tolist(), values, values_at(held, values)[0], 3)


# Readers: the difference between a file and the problem, empty without one


def program(name):
    """What a program of the table reports: coefficients, or values at points."""

    def difference(path, held, field):
        module, entry = import_module(f"crossfield.export.programs.{name}"), PROGRAMS[name]
        if path.suffix[1:] in entry.algebra:
            try:
                content = module.read(path)
            except NotReportedError:  # CBC exports what its presolve leaves
                return ""
            return algebra_difference(content, held, entry.tolerance, one=path.suffix != ".mod")
        points = points_of(held, field)
        return behaviour_difference(module.evaluate(path, points), held, points)

    return difference


def solver_library(path, held, field):
    """AMPL's library at the starting point: objective and rows, and derivatives against differences."""
    order, point = NlOrder(held).order, held.point(field)
    statistics, objective, gradient, rows, jacobian = by_asl(path)
    families = NlOrder(held).rows

    def values(at):
        activities = [family.values(at) + family.limit for family in families]
        return np.concatenate([[held.objective_value(at)], *activities])

    steps = 1e-5 * np.eye(held.n_columns)[order]
    slopes = np.array([(values(point + step) - values(point - step)) / 2e-5 for step in steps])
    pairs = {
        "size": ([statistics["total no. of variables"], len(rows)], [held.n_columns, held.n_rows]),
        "values": ([objective, *rows], values(point)),
        "slopes": (np.vstack([gradient, jacobian]).T, slopes),
    }
    near = {"slopes": 1e-5}
    return ", ".join(
        name
        for name, (theirs, ours) in pairs.items()
        if not np.allclose(theirs, ours, rtol=near.get(name, 1e-9), atol=near.get(name, 1e-9))
    )


def start_of_nl(path, held, field):
    """Whether the start is the point of the field, to the bit."""
    return "" if (read_nl(path).start == held.point(field)[NlOrder(held).order]).all() else "the start"


OPTIONS_OF_GAMS = {
    "optca": "0", "optcr": "1e-6", "limrow": "0", "limcol": "0", "solprint": "off", "sysout": "off",
}  # fmt: skip
"""They ask for an optimum and a short listing."""


def gams_text(path, held, field):
    """A reader of the tests that follows the manual of GAMS; it needs no licence."""
    model, point = gams_reader.read(path.read_text("ascii")), held.point(field)
    facts = model.type, model.start, model.options
    expected = MODEL_TYPES[held.problem_class], held.objective_value(point), OPTIONS_OF_GAMS
    if facts != expected:
        return f"{facts} instead of {expected}"
    return gams_reader.difference(model, held, points_of(held, field), point)


def mod_by_glpk(path, held, field):
    """GLPK's own translator at a random point."""
    return ampl_by_glpk.difference(path, held, points_of(held, field).values[0])


def qplib(path, held, field):
    """pyqplib, which takes no names; and the start, which it ignores."""
    import pyqplib

    text = path.read_text("ascii")
    head = text[: text.rindex(" # names of variables")].rsplit("\n", 1)[0]
    path.with_suffix(".numbers").write_text(head + "\n0\n0\n")
    model, arrays, points = (
        pyqplib.read_problem(str(path.with_suffix(".numbers"))),
        held.to_arrays(),
        points_of(held, field),
    )
    objective, rows = values_at(held, points.values)
    exact = [
        (model.var_lb, held.lower), (model.var_ub, held.upper), (model.cons_lb, arrays.row_lower),
        (model.cons_ub, arrays.row_upper), (starts_of_qplib(text, held.n_columns), held.point(field)),
        ([kind.name != "CONTINUOUS" for kind in model.var_types], held.integer),
    ]  # fmt: skip
    near = [([model.obj_val(point) for point in points.values], objective)]
    near += [([model.cons_val(point) for point in points.values], rows)]
    wrong = [number for number, (theirs, ours) in enumerate(exact) if not np.array_equal(theirs, ours)]
    wrong += [
        name
        for name, pair in zip(("values", "rows"), near, strict=True)
        if not np.allclose(*pair, 1e-9, 1e-9)
    ]
    return ", ".join(map(str, wrong))


def starts_of_qplib(text, count):
    """The start that a file states: a usual value, and columns with others."""
    usual, listed = re.split("start of a (?:row|bound)'s dual", text)[0].split("# start, where not listed")
    lines = (usual.rsplit("\n", 1)[1] + listed).split("\n")
    values = np.full(count, float(lines[0]))
    for line in lines[2:-1]:
        values[int(line.split()[0]) - 1] = float(line.split()[1])
    return values


def start_of_baron(path, held, field):
    """The start of BARON's file by names; BARON itself solves such files in another test."""
    text = path.read_text("ascii")
    levels = dict(re.findall(r"(\w+): (\S+);", text[text.index("STARTING_POINT") :]))
    (one,) = levels.keys() - {*held.to_arrays().column_names.tolist()}
    point = dict(zip(held.to_arrays().column_names.tolist(), held.point(field).tolist(), strict=True)) | {
        one: 1.0
    }
    return "" if {name: float(value) for name, value in levels.items()} == point else "the start"


READERS = {
    **{f"{suffix} {name}": program(name) for name, entry in PROGRAMS.items() for suffix in entry.formats},
    "nl asl": solver_library,
    "nl start": start_of_nl,
    "gms text": gams_text,
    "mod glpk evaluated": mod_by_glpk,
    "qplib pyqplib": qplib,
    "bar start": start_of_baron,
}
NEEDS = {"start": "casadi", "text": "casadi"}
SLOW = {"cbc", "cplex", "xpress", "gams", "asl"}
"""Programs in processes of their own, and those that `verify` asks too."""


def readers():
    """Each reader of a format on every 16th problem; on three more of 16 in slow tests."""
    for name in READERS:
        suffix, who, *_ = name.split()
        needs = [pytest.mark.needs(who)] if who not in NEEDS else []
        is_slow = (
            [pytest.mark.slow] if who in SLOW or (suffix, who) in {("lp", "glpk"), ("mps", "glpk")} else []
        )
        yield pytest.param(name, 0, marks=[*needs, *is_slow], id=name)
        if not is_slow:
            yield pytest.param(name, 1, marks=[*needs, pytest.mark.slow], id=f"{name}, others")


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("reader, others", [*readers()])
def test_a_file_is_read_as_its_problem(reader, others, tmp_path, monkeypatch, subtests):
    monkeypatch.chdir(tmp_path)  # where programs put their files
    suffix, who, *_ = reader.split()
    for number, row in enumerate(PROBLEMS):
        if number % 16 not in ((4, 8, 12) if others else (0,)):
            continue
        with subtests.test(f"{number}: {row}"):
            problem, field = problem_of(*row), field_of(row[0])
            path = tmp_path / str(number) / f"model.{suffix}"
            path.parent.mkdir()
            start = {"start": field} if FORMATS[suffix].has_start else {}
            if words := refusal(problem, suffix):
                with pytest.raises(cf.UnsupportedByFormatError, match=words):
                    cf.write(problem, path, **start)
                assert contents(tmp_path / str(number)) == {}
                continue
            held = cf.write(problem, path, **start).problem
            is_linear = max(held.objective_degree, held.row_degree) < 2
            if who in SOLVERS and SOLVERS[who].refusal(held, "read"):
                continue
            if reader in {"nl scip", "nl asl"} and not held.n_columns:  # they read no such file
                continue
            if who == "glpk" and suffix == "mod" and reader.endswith("glpk") and not is_linear:
                continue
            assert READERS[reader](path, held, field) == ""


# The text itself: what programs read alike is less than what each reads

NUMBER = r"(?!-0(?: |$))-?\d+(?:\.\d+)?(?:e[+-]\d\d+)?"
NAME = r"[a-zA-Z]\w{0,14}"
SIGNED = rf"[+-] (?!-){NUMBER}"
LINES = {
    "lp": [
        r"\\ .*", r"Minimize|Subject To|Bounds|Generals|Binaries|End", r" obj_sha256_\w+:.*", r" \+ \[",
        rf" {SIGNED} {NAME}", rf" {SIGNED} {NAME} (?:\^2|\* {NAME})", r" \] / 2",
        rf" {NAME}:(?: {SIGNED} {NAME})+(?: \+ \[(?: {SIGNED} {NAME} \* {NAME})+ \])? [<>]?= {NUMBER}",
        rf" (?:-inf|{NUMBER}) <= {NAME} <= (?:\+inf|{NUMBER})", rf" {NAME}",
    ],
    "mps": [
        r"\* .*", r"NAME kind_sha256_\w{11} FREE", r"ROWS|COLUMNS|RHS|BOUNDS|QUADOBJ|ENDATA", r" N obj",
        rf"(?: [GLE]|QCMATRIX) {NAME}", rf" (?:{NAME}|RHS1) {NAME} {NUMBER}",
        r" MARKER\d+ 'MARKER' 'INT(?:ORG|END)'", rf" (?:FX|LO|UP) BND1 {NAME} {NUMBER}",
        rf" (?:FR|MI|PL) BND1 {NAME}",
    ],
    "nl": [
        r"g4 1 1 0 \d+", rf" ?{NUMBER}(?: {NUMBER})*", r"[CJGSk]\d+(?: \d+)?", r"[OVLF]\d+ \d+", r"[xrb]\d*",
        rf"o(?:0|2|5|16|46|54)|v\d+|n{NUMBER}",
    ],
    "gms": [r"\* [^%$]*|(?!\*)[^\t\0]*"],
}  # fmt: skip
"""Patterns of the lines of each format."""
ORDER = {
    "lp": ["Minimize", "Subject To", "Bounds", "Generals", "Binaries", "End"],
    "mps": ["NAME", "ROWS", "COLUMNS", "RHS", "BOUNDS", "QUADOBJ", "QCMATRIX", "ENDATA"],
    "nl": ["C", "O", "x", "r", "b", "k", "J", "G"],
}
"""Heads of the sections, in the order that all programs take."""
HEADS = {"lp": r"[A-Z][\w ]+$", "mps": r"[A-Z]+", "nl": r"[COxrbkJG](?=\d|$)"}


@pytest.mark.parametrize("suffix", LINES)
def test_a_file_keeps_to_what_all_programs_read(suffix, tmp_path, subtests):
    for row in PROBLEMS[::8]:
        problem = problem_of(*row)
        if refusal(problem, suffix):
            continue
        with subtests.test(str(row)):
            held = cf.write(problem, tmp_path / f"x.{suffix}", force=True).problem
            text = (tmp_path / f"x.{suffix}").read_bytes().decode("ascii")
            lines = text.splitlines()
            assert text.endswith("\n")
            assert "\r" not in text
            assert max(map(len, lines)) <= 250
            wrong = [line for line in lines if not any(re.fullmatch(form, line) for form in LINES[suffix])]
            assert wrong == []
            if suffix in ORDER:
                heads = [match[0] for line in lines if (match := re.match(HEADS[suffix], line))]
                assert list(dict.fromkeys(heads)) == [head for head in ORDER[suffix] if head in heads]
            if suffix == "mps":
                assert_bounds(lines, held)


def assert_bounds(lines, held):
    """Every column of an .mps has both bounds; without them, the defaults of programs differ."""
    bounds = {}
    for line in lines:
        if match := re.match(r" (\w\w) BND1 (\w+)", line):
            bounds.setdefault(match[2], []).append(match[1])
    (one,) = bounds.keys() - {*held.to_arrays().column_names.tolist()}
    assert re.fullmatch("ONE_[0-9a-f]{11}", one)
    assert len(bounds) == held.n_columns + 1
    kinds = (["FX"], ["FR"], ["LO", "UP"], ["LO", "PL"], ["MI", "UP"])
    assert all(kind in kinds for kind in bounds.values())


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_names_suit_every_reader(formulation):
    """Also in small letters, and on the largest grid; none is a number or a word of a language."""
    is_right = FORMULATIONS[formulation].orthogonal
    largest = grid("." * 9999 + " " + "." * 9997 + "//", orthogonal=is_right)
    jumps = {"p": [0]} if formulation == "qp-fixed" else {}
    arrays = cf.formulate(largest, formulation, **jumps).to_arrays()
    names = [*arrays.column_names.tolist(), *arrays.row_names.tolist()]
    assert max(map(len, names)) <= 15
    assert any(name.endswith("0001_9998") for name in names)
    assert len({name.lower() for name in [*names, "obj", "c_one"]}) == len(names) + 2
    assert all(re.fullmatch(r"[a-df-hj-mo-z][a-z0-9_]{0,14}", name) for name in names)


@pytest.mark.parametrize(
    "file, pixels",
    [
        ("milp-mccormick.lp", 3), ("miqcp-bilinear.lp", 3), ("milp-mccormick.mps", 2), ("minlp-cubic.nl", 2),
        ("minlp-quartic.gms", 3),
    ],
)  # fmt: skip
def test_small_models_have_the_bytes_of_their_golden_files(file, pixels, tmp_path):
    """Small models that people can read, one stroke at 2.5 radians of weight 0.5 on two or three pixels.

    Each was compared with the formulas by hand: signs of (14)-(17) and (22)-(29), pi/2 and pi before p1 and
    p2, twice the stroke's square in the brackets, jumps 0..3 towards the stroke and -1..1 away from it.
    """
    mask = np.array([[True, True], [True, False]])[: pixels - 1]
    instance = cf.Instance.on_pixels("golden", mask, [[0, 1]], [2.5], [0.5])
    cf.write(cf.formulate(instance, file.split(".")[0]), tmp_path / file)
    written, golden = ((folder / file).read_bytes() for folder in (tmp_path, GOLDEN))
    comment = rb"(?m)\A(?:[\\*] .*\n)+"
    assert re.sub(comment, b"", written) == re.sub(comment, b"", golden)
    if file.endswith(".nl"):
        names = ["alpha_00_00", "alpha_00_01", "beta_00_00", "beta_00_01", "p1_00_00_r", "p2_00_00_r"]
        assert (tmp_path / "minlp-cubic.col").read_text().split() == names
        assert (tmp_path / "minlp-cubic.row").read_text() == "obj\n"


def test_lists_of_names_in_gams_may_fill_a_line(tmp_path):
    """12 names of alpha and 13 of beta fill one."""
    for count in (12, 13, 14, 25):
        field = cf.greedy_field(grid("/" + "#" * (count - 1)))
        problem = cf.formulate(field.instance, "miqp-mccormick")
        cf.write(problem, tmp_path / f"{count}.gms", start=field)
        assert gams_text(tmp_path / f"{count}.gms", problem, field) == ""


# Pyomo


WEIGHTED = [
    row
    for row in PROBLEMS
    if min(kind(row[0]).stroke_coefficient, kind(row[0]).skew_coefficient) and row[0] != "far"
]
"""Problems whose terms Pyomo keeps, and whose indices have two digits."""


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_the_pyomo_model_is_the_problem(formulation, tmp_path):
    """Names, bounds, values; and Pyomo's own .nl announces the same counts as ours."""
    import pyomo.environ as pyo  # takes long, and one worker runs this

    row = next(row for row in WEIGHTED if row[1] == formulation)
    problem, field = problem_of(*row), field_of(row[0])
    model = problem.to_pyomo(start=field)
    columns = [v for block in problem.blocks.values() for v in model.component(block.name).values()]
    arrays = problem.to_arrays()
    assert [our_name(variable) for variable in columns] == arrays.column_names.tolist()
    assert [-math.inf if v.lb is None else v.lb for v in columns] == problem.lower.tolist()
    assert [math.inf if v.ub is None else v.ub for v in columns] == problem.upper.tolist()
    assert [v.is_integer() for v in columns] == problem.integer.tolist()
    assert [v.value for v in columns] == problem.point(field).tolist()
    for point in points_of(problem, field).values:
        for variable, value in zip(columns, point, strict=True):
            variable.set_value(value, skip_validation=True)
        assert pyo.value(model.obj) == pytest.approx(problem.objective_value(point), rel=1e-9, abs=1e-9)
        for family in problem.rows:
            slacks = [row.slack() for row in model.component(family.family.tag).values()]
            value = family.values(point)
            expected = {">=": value, "<=": -value, "==": -np.abs(value)}[family.family.sense]
            np.testing.assert_allclose(slacks, expected, rtol=1e-9, atol=1e-9)
    assert_counts(problem, model, tmp_path / "x.nl")


def our_name(component):
    """`p1[0,2,u]` as `p1_00_02_u`."""
    place = component.index() if isinstance(component.index(), tuple) else (component.index(),)
    parts = (f"{part:02}" if isinstance(part, int) else part for part in place)
    return "_".join([component.parent_component().name, *parts])


def assert_counts(problem, model, path):
    """The heads of both .nl files agree; Pyomo leaves out columns in no term."""
    from pyomo.repn.plugins.nl_writer import NLWriter

    stream = io.StringIO()
    NLWriter().write(model, stream, linear_presolve=False, scale_model=False)
    theirs = [line.partition("#")[0].split() for line in stream.getvalue().splitlines()[:10]]
    cf.write(problem, path)
    ours = [line.split() for line in path.read_text().splitlines()[:10]]
    domain = problem.instance.domain
    used = {*domain.first.tolist(), *domain.second.tolist(), *problem.instance.stroke_index.tolist()}
    alone = (domain.size - len(used)) * ("alpha" in problem.blocks)
    assert ours[1] == [str(int(theirs[1][0]) + alone), *theirs[1][1:5]]
    for line in (3, 4, 6, 7, 9):  # networks; nonlinear columns; integers; nonzeros; common expressions
        assert ours[line] == theirs[line], line


def test_a_start_of_another_instance_is_refused():
    with pytest.raises(cf.InstanceError, match="on another instance"):
        problem_of("row", "qp-fixed", {}).to_pyomo(start=field_of("square"))
