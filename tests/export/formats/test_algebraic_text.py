"""GAMS and BARON files against their problems, through readers of the tests that follow the manuals.

GAMS and BARON need licences that end; these tests need none.
"""

from __future__ import annotations

import re
from itertools import product
from pathlib import Path
from typing import Any

import baron_reader
import gams_reader
import numpy as np
import pytest
from algebraic import WrongTextError, difference
from cases import CASES, make_field, make_instance, make_problem, names_of, problem_of
from crossfield.export.formats.gams import MODEL_TYPES
from crossfield.export.formats.registry import write
from crossfield.export.writing.canonical import Canonical
from crossfield.models.field.field import CrossField
from crossfield.models.formulations.catalogue import FORMULATIONS
from crossfield.models.formulations.names import column_names
from crossfield.models.formulations.problem import Problem, tightened, with_integers_fixed
from crossfield.models.formulations.windows import Windows
from crossfield.models.instance.instance import QUARTER, Instance
from loops import for_each

READERS = {"gms": gams_reader.read, "bar": baron_reader.read}
OPTIONS = {"facet": ("hull", "printed"), "stroke_norm": (1, 2), "beta_norm": (1, 2), "relax": (False, True)}
CHANGES = ("", "jumps fixed", "windows narrowed")
STARTS = (False, True)

CORNER = [[True, True], [True, False]]


def corner(gauge: str = "strokes") -> Instance:
    return Instance("corner", CORNER, [[0, 1], [1, 0]], [2.5, 1.2], [0.5, 0.7], gauge=gauge)


PAIR = Instance("pair", [[True, True]], [[0, 0]], [2.5], [0.75], stroke_coefficient=0.5)

INSTANCES = {
    "extreme": Instance(
        "extreme", CORNER, [[0, 0], [1, 0]], [0.0, 3.1], [1e-6, 1.0],
        stroke_coefficient=3e5, skew_coefficient=2e-7,
    ),
    "no skew": make_instance("row", skew_coefficient=0.0),
    "no pairs": Instance("alone", [[True, False, True]], [[0, 0]], [1.2], [0.7], gauge="box"),
    "one pixel": make_instance("pixel"),
}  # fmt: skip
"""Instances whose numbers or shapes are odd."""


def combinations() -> list[tuple[str, str, dict[str, Any]]]:
    """Every formulation in both gauges with every value of its options."""
    return [
        (name, gauge, dict(zip(options, values, strict=True)))
        for name, declaration in FORMULATIONS.items()
        for options in [[option for option in OPTIONS if option in declaration.settable]]
        for gauge in ("strokes", "box")
        for values in product(*(OPTIONS[option] for option in options))
    ]


def changed(problem: Problem, field: CrossField, change: str) -> Problem:
    if change == "jumps fixed" and problem.integer.any():
        return with_integers_fixed(problem, field)
    return tightened(problem, narrow_windows(field)) if change == "windows narrowed" else problem


def narrow_windows(field: CrossField) -> Windows:
    """Windows around a field, half as wide as those of its gauge; jumps may be one below the field's."""
    instance = field.instance
    bounds = []
    for value, low, high in (
        (field.alpha, instance.alpha_lower, instance.alpha_upper),
        (field.beta, np.full_like(field.beta, -QUARTER), np.full_like(field.beta, QUARTER)),
    ):
        bounds += [(value + low) / 2, (value + high) / 2]
    return Windows(*bounds, np.maximum(field.p - 1, instance.p_min), field.p, 1.0, "none")


def one_of(problem: Problem, suffix: str) -> str:
    """The column that is fixed to 1, which .bar has and GAMS has not."""
    return Canonical(problem).one.decode() if suffix == "bar" else ""


def assert_text(problem: Problem, folder: Path, start: CrossField | None = None) -> None:
    """Write the formats that hold the problem, and compare what they say with it."""
    degree = max(problem.objective_degree, problem.row_degree)
    point = None if start is None else problem.point(start)
    for suffix, read in READERS.items():
        if suffix == "bar" and degree > 4:
            continue
        path = folder / f"model.{suffix}"
        write(problem, path, start=start)
        model = read(path.read_text("ascii"))
        assert difference(model, problem, point, one=one_of(problem, suffix)) == "", suffix
        if suffix == "gms":
            assert model.type == MODEL_TYPES[problem.problem_class]
            assert model.unstated == set()
            assert model.start == (None if point is None else problem.objective_value(point))


@for_each("number", range(len(combinations())))
def test_text_says_what_the_problem_is(number: int, tmp_path: Path):
    """One change and start of each combination; all of them are in the slow test."""
    name, gauge, options = combinations()[number]
    instance = corner(gauge)
    field = make_field(instance)
    problem = changed(make_problem(name, instance, **options), field, CHANGES[number % 3])
    assert_text(problem, tmp_path, field if number % 2 else None)


@for_each("name", FORMULATIONS)
@for_each("instance", INSTANCES.values())
def test_text_of_odd_instances(name: str, instance: Instance, tmp_path: Path):
    field = make_field(instance)
    assert_text(make_problem(name, instance), tmp_path, field)


@for_each("count", (11, 12, 13, 14, 24, 25))
def test_lists_of_names_that_fill_a_line(count: int, tmp_path: Path):
    """12 names of alpha and 13 of beta fill a line."""
    instance = Instance("line", np.ones((1, count), bool), [[0, 0]], [0.3], [0.5])
    assert_text(make_problem("miqp-mccormick", instance), tmp_path)


@pytest.mark.slow
@for_each("start", STARTS)
@for_each("change", CHANGES)
@for_each("name, gauge, options", combinations())
def test_text_with_everything(
    name: str, gauge: str, options: dict[str, Any], change: str, start: bool, tmp_path: Path
):
    instance = corner(gauge)
    field = make_field(instance)
    problem = changed(make_problem(name, instance, **options), field, change)
    assert_text(problem, tmp_path, field if start else None)


@pytest.mark.slow
@for_each("label", CASES)
def test_text_of_other_shapes(label: str, tmp_path: Path):
    assert_text(problem_of(label), tmp_path)


def test_options_of_gams_ask_for_an_optimum_and_a_short_listing(tmp_path: Path):
    write(make_problem("milp-mccormick", corner()), tmp_path / "model.gms")
    options = gams_reader.read((tmp_path / "model.gms").read_text("ascii")).options
    gaps = {name: float(options.pop(name)) for name in ("optca", "optcr")}
    assert gaps == {"optca": 0.0, "optcr": 1e-6}
    assert options == {"limrow": "0", "limcol": "0", "solprint": "off", "sysout": "off"}


def test_results_of_gams_are_columns_in_order(tmp_path: Path):
    """The lines of the file that `--RESULTS` names, with 15 decimals in E format."""
    problem = make_problem("milp-mccormick", corner())
    write(problem, tmp_path / "model.gms")
    text = (tmp_path / "model.gms").read_text("ascii")
    digits = " nd=15 nr=2 nw=24"
    assert gams_reader.read(text).results == []
    assert gams_reader.read(text, RESULTS="values.csv").results == [
        "model_status,<m.modelstat:0:0>",
        "solver_status,<m.solvestat:0:0>",
        f"problem,{problem.stamp}",
        f"objective,<objvar.l:0{digits}>",
        *(f"{name},<{name}.l:0{digits}>" for name in names_of(column_names(problem))),
    ]


# What the tests above would notice.

TOKEN = re.compile(
    r"(?P<number>(?<!\w)\d+\.?\d*(?:e[+-]?\d+)?)|(?P<relation>=[gle]=|[<>=]=)|(?P<operator>[-+*^])"
    r"|(?P<attribute>\.(?:lo|up|fx|l)\b)|(?P<name>[a-z]\w*)"
)
OTHER = {
    "=g=": "=l=", "=l=": "=g=", "=e=": "=g=", ">=": "<=", "<=": ">=", "==": ">=",
    "+": "-", "-": "+", "*": "+", "^": "*",
    ".lo": ".up", ".up": ".lo", ".fx": ".lo", ".l": ".lo",
}  # fmt: skip


PARTS = {"gms": ("Variables", "Model"), "bar": ("BINARY_", "}\n")}


def variants(text: str, columns: list[str]) -> dict[str, str]:
    """Texts with one number, relation, operator, attribute or column replaced, by a description."""
    replaced = {}
    for token in TOKEN.finditer(text):
        word = token.group()
        match token.lastgroup:
            case "number":
                other = repr(float(word) + 1)
            case "name":
                other = columns[columns.index(word) - 1] if word in columns else word
            case _:
                other = OTHER[word]
        if other != word:
            label = f"{other} for {word} in {text[token.start() - 30 : token.end() + 30]!r}"
            replaced[label] = f"{text[: token.start()]}{other}{text[token.end() :]}"
    return replaced


def is_noticed(problem: Problem, suffix: str, text: str, start: CrossField) -> bool:
    try:
        model = READERS[suffix](text)
    except WrongTextError:
        return True
    point = problem.point(start)
    if suffix == "gms" and (model.unstated or model.start != problem.objective_value(point)):
        return True
    return difference(model, problem, point, one=one_of(problem, suffix)) != ""


@for_each("suffix", READERS)
@for_each("name", ["miqcp-bilinear", "miqp-exact"])
def test_every_other_text_is_noticed(name: str, suffix: str, tmp_path: Path):
    problem, start = make_problem(name, PAIR), make_field(PAIR)
    path = tmp_path / f"model.{suffix}"
    write(problem, path, start=start)
    text = path.read_text("ascii")
    assert not is_noticed(problem, suffix, text, start)
    begin, end = text.index(PARTS[suffix][0]), text.rindex(PARTS[suffix][1])
    others = variants(text[begin:end], [*names_of(column_names(problem)), one_of(problem, suffix)])
    unseen = [
        label
        for label, part in others.items()
        if not is_noticed(problem, suffix, text[:begin] + part + text[end:], start)
    ]
    assert len(others) > 100
    assert unseen == []


GAMS = """
Variables y; Positive Variables x; Integer Variables n; Equations e, f;
e.. y =e= {objective}; f.. x + n =g= 1;
Model m / all /; solve m using {type} minimizing y;
"""


@for_each(
    "objective, kind, message",
    [
        ("x**3", "mip", "not of the type"),
        ("x*n", "mip", "not of the type"),
        ("sqr(x)*n", "miqcp", "not of the type"),
        ("sqr(x)", "nlp", "not of the type"),
        ("x", "rmip", "not of the type"),
        ("2 x", "minlp", "line 3"),
        ("2*-x", "minlp", "line 3"),
        ("x + - n", "minlp", "line 3"),
        ("power(x, n)", "minlp", "n where a number belongs"),
        ("abs(x)", "minlp", "the function abs"),
        ("z", "minlp", "z is not declared"),
        ("y + x", "minlp", "does not define"),
        ("x; e.. y =e= n", "minlp", "defined twice"),
        ("x; Variables X", "minlp", "declared twice"),
        ("x; Variables put", "minlp", "cannot be a name"),
        ("x; y.up = 5", "minlp", "is not free"),
        ("x; Equations g", "minlp", "g is not defined"),
        ("x; x.scale = 2", "minlp", "the attribute scale"),
        ("x;\n$include other.gms\n", "minlp", "line 4"),
        ("x; display x.l", "minlp", "line 3"),
    ],
)
def test_gams_that_is_wrong_is_refused(objective: str, kind: str, message: str):
    with pytest.raises(WrongTextError, match=message):
        gams_reader.read(GAMS.format(objective=objective, type=kind))


@for_each(
    "objective, value",
    [
        ("-x**2", -4.0),
        ("2**x**2", 16.0),
        ("-x*3 + 1", -5.0),
        ("(-x)**2", np.nan),
        ("power(-x, 3)", -8.0),
        ("X/2/2", 0.5),
        ("1 -\n* a comment\n x", -1.0),
        ("x\n* n\n - 1", 1.0),
    ],
)
def test_gams_says_what_its_manual_says(objective: str, value: float):
    model = gams_reader.read(GAMS.format(objective=objective, type="minlp"))
    np.testing.assert_equal(float(model.objective.value({"x": np.float64(2), "n": 3.0})), value)
    assert [vars(column) for column in model.columns.values()] == [
        {"kind": "continuous", "lower": 0.0, "upper": np.inf, "level": None},
        {"kind": "integer", "lower": 0.0, "upper": pytest.approx(np.nan, nan_ok=True), "level": None},
    ]


BAR = """
POSITIVE_VARIABLES x; VARIABLES y;
UPPER_BOUNDS{{ x: 3; }}
EQUATIONS e;
e: {row};
OBJ: minimize {objective};
"""


@for_each(
    "row, objective, message",
    [
        ("x >= 1", "-x^2", "line 6"),
        ("x >= 1", "x^2^3", "line 6"),
        ("x >= 1", "x^y", "line 6"),
        ("x >= 1", "cos(x)", "line 6"),
        ("x >= 1", "2*-x", "line 6"),
        ("x >= 1", "x + z", "z is not declared"),
        ("x + 1 >= 2", "x", "a constant on the left side"),
        ("x >= y", "x", "line 5"),
        ("x >= 1; f: y >= 1", "x", "not those declared"),
        ("x >= 1; LOWER_BOUNDS{ x: 1; }", "x", "line 5"),
    ],
)
def test_bar_that_is_wrong_is_refused(row: str, objective: str, message: str):
    assert baron_reader.read(BAR.format(row="x - y >= 1", objective="3*x^2 - y")).rows.keys() == {"e"}
    with pytest.raises(WrongTextError, match=message):
        baron_reader.read(BAR.format(row=row, objective=objective))
