"""Names of answers: spelled differently, or of another problem, with the likely cause."""

import crossfield as cf
import numpy as np
import pytest
from cases import make_field, names_of, problem_of
from crossfield.export.solutions.solution import read_solution
from crossfield.models.errors import SolutionError
from crossfield.models.formulations.names import column_names
from crossfield.models.formulations.problem import formulate
from loops import for_each

INSTANCE, LARGER = (cf.sample("skew", size) for size in (4, 6))
FIELD = cf.greedy_field(INSTANCE)
MILP = formulate(INSTANCE, "milp-mccormick")


def entries_of(formulation, instance=INSTANCE):
    """Names and values of the point of a field."""
    problem = formulate(instance, formulation)
    point = problem.point(FIELD if instance is INSTANCE else cf.greedy_field(instance))
    return list(zip(names_of(column_names(problem.instance, problem.blocks)), point.tolist(), strict=True))


ENTRIES = entries_of("milp-mccormick")


def listed(entries):
    return "".join(f"{name} {value!r}\n" for name, value in entries)


def renamed(rename):
    return [(rename(name), value) for name, value in ENTRIES]


@for_each(
    "rename",
    [
        str.upper,
        str.title,
        lambda name: f"t_{name}",
        lambda name: f'"{name}"',
        lambda name: f"'T_{name.upper()}'",
    ],
)
def test_other_spellings_of_names_are_read(rename, tmp_path):
    path = tmp_path / "x.sol"
    path.write_text(listed(renamed(rename)))
    solution = read_solution(path, MILP)
    assert (solution.status, solution.unknown) == ("feasible", 0)
    assert solution.point.tolist() == [value for _, value in ENTRIES]


def test_two_spellings_of_a_name_are_refused_if_their_values_differ(tmp_path):
    name, value = ENTRIES[0]
    path = tmp_path / "x.sol"
    path.write_text(listed([*ENTRIES, (name.upper(), value)]))
    assert read_solution(path, MILP).status == "feasible"
    path.write_text(listed([*ENTRIES, (name.upper(), 7.0)]))
    with pytest.raises(SolutionError, match="has two values"):
        read_solution(path, MILP)


CAUSES = {
    "other instance": (
        entries_of("milp-mccormick", LARGER),
        r"86 of 148 columns .* 84 of its 146 names are unknown \(first 'alpha_01_04'\).* another instance",
    ),
    "other formulation": (
        entries_of("minlp-parity"),
        r"\(first 'p_00_01_r'\); it is probably of minlp-parity",
    ),
    "fewer blocks": (entries_of("minlp-quartic"), "probably of minlp-quartic or minlp-cubic"),
    "cut off": (
        ENTRIES[:-5],
        r"5 of 148 columns .* missing \(psi_02_02 is the first\); the file may be cut off",
    ),
    "cut off in a block": (ENTRIES[:60], "88 of 148 columns .* the file may be cut off"),
    "zeros left out": (
        [(name, value) for name, value in ENTRIES if value],
        "left out columns at 0, which this layout lists; .* `=obj= VALUE`",
    ),
    "lines missing": ([*ENTRIES[:7], *ENTRIES[9:]], "2 of 148 columns .* lines are missing in it"),
    "renamed x1": (
        [(f"x{at}", value) for at, (_, value) in enumerate(ENTRIES)],
        r"148 of its 148 names are unknown \(first 'x0'\); the program renamed the columns",
    ),
    "renamed C0001": ([(f"C{at:07d}", 1.0) for at in range(148)], "the program renamed the columns"),
    "other model": ([("foo", 1.0), ("bar", 2.0)], r"\(first 'foo'\); it is of another formulation or model"),
    "infinite": (
        [(ENTRIES[0][0], float("inf")), *ENTRIES[1:]],
        "alpha_00_01 has the value inf, .* not finite",
    ),
    "huge": ([(ENTRIES[0][0], 1e300), *ENTRIES[1:]], r"alpha_00_01 has the value 1e\+300, which no column"),
}


@for_each("name", CAUSES)
def test_names_that_do_not_fit_are_shown_with_the_likely_cause(name, tmp_path):
    entries, message = CAUSES[name]
    (tmp_path / "x.sol").write_text(listed(entries))
    with pytest.raises(SolutionError, match=message):
        read_solution(tmp_path / "x.sol", MILP)


# On a mesh


def entries_on(label):
    """A problem on a mesh, and names and values of the point of a field."""
    problem = problem_of(label)
    point = problem.point(make_field(problem.instance))
    names = names_of(column_names(problem.instance, problem.blocks))
    return problem, list(zip(names, point.tolist(), strict=True))


@for_each("head", ["", "Some words\nof a program\n"])
@for_each("text", ["{} {!r}\n", '"{}": {!r},\n', "{} = {!r}\n"])
def test_numbers_of_faces_and_pairs_are_names_in_any_list(tmp_path, text, head):
    problem, entries = entries_on("milp-mccormick shape=box gauge=box")
    path = tmp_path / "list.sol"
    if not head or text[0] == "{":
        path.write_text(head + "".join(text.format(*entry) for entry in entries))
        objective = problem.objective_value(np.array([value for _, value in entries]))
        assert read_solution(path, problem).objective == pytest.approx(objective)


def test_names_alone_and_those_of_another_mesh_are_refused(tmp_path):
    problem, entries = entries_on("milp-mccormick shape=box gauge=box")
    _, others = entries_on("milp-mccormick shape=tetrahedron orthogonal=True")
    for text, message in (
        ("".join(f"{name}\n" for name, _ in entries), "this is a list of the names in an .nl file"),
        (listed(others), "it is of another instance, at other faces"),
    ):
        (tmp_path / "list.sol").write_text(text)
        with pytest.raises(SolutionError, match=message):
            read_solution(tmp_path / "list.sol", problem)
