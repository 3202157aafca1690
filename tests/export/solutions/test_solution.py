"""From solution files to checked points: names, positions, products, rounding, true claims."""

import numpy as np
import pytest
from cases import SKEWED, make_field, make_instance
from crossfield.export.solutions.readers.ampl import write_ampl_sol
from crossfield.export.solutions.solution import ROUND, read_solution
from crossfield.export.statuses import Status
from crossfield.export.writing.nl_order import NlOrder
from crossfield.models.errors import SolutionError
from crossfield.models.formulations.catalogue import FORMULATIONS
from crossfield.models.formulations.names import column_names
from crossfield.models.formulations.problem import formulate
from loops import for_each

LIFTED = ("minlp-quartic", "minlp-cubic")


@pytest.fixture
def field():
    return make_field(make_instance("full"))


def problem_of(field, name, **options):
    return formulate(field.instance, name, p=field.p if FORMULATIONS[name].fixed else None, **options)


def names_of(problem):
    return [bytes(row).rstrip(b"\0").decode() for row in column_names(problem.instance, problem.blocks)]


def by_name(path, names, values, *, objective=1.0, status="Optimal"):
    """A HiGHS solution file with these columns."""
    lines = "".join(f"{name} {value!r}\n" for name, value in zip(names, map(float, values), strict=True))
    path.write_text(
        f"Model status\n{status}\n\n# Primal solution values\nFeasible\nObjective {objective!r}\n"
        f"# Columns {len(names)}\n{lines}# Rows 0\n"
    )
    return path


def by_position(path, problem, point):
    return write_ampl_sol(path, "solved", point[NlOrder(problem).order], problem.n_rows, 0)


@for_each("name", SKEWED)
@for_each("kind", ["names", "positions"])
def test_a_point_comes_back_as_it_was(tmp_path, field, name, kind):
    problem = problem_of(field, name)
    point = problem.point(field)
    path = tmp_path / "x.sol"
    if kind == "names":
        shuffled = np.random.default_rng(1).permutation(len(point))
        by_name(path, np.array(names_of(problem))[shuffled], point[shuffled])
    else:
        by_position(path, problem, point)
    solution = read_solution(path, problem)
    assert solution.point.tolist() == point.tolist()
    assert solution.objective == problem.objective_value(point)
    assert solution.violation.worst < 1e-12
    assert (solution.rounded, solution.unknown) == (0.0, 0)
    assert solution.field.p.tolist() == field.p.tolist()
    assert solution.field.alpha.tolist() == field.alpha.tolist()


@pytest.mark.parametrize("name", LIFTED)
def test_a_file_with_lifted_products_is_mapped_onto_the_lifted_problem(tmp_path, field, name):
    problem = problem_of(field, name)
    held = problem.lifted
    path = by_name(tmp_path / "x.sol", names_of(held), held.point(field))
    solution = read_solution(path, problem)
    assert solution.problem.n_columns == held.n_columns == problem.n_columns + len(field.p)
    assert solution.unknown == 0
    assert solution.objective == pytest.approx(problem.objective_value(problem.point(field)), rel=1e-12)
    assert solution.field.p.tolist() == field.p.tolist()


def test_a_cheated_product_shows_as_a_violation(tmp_path, field):
    held = problem_of(field, "minlp-quartic").lifted
    point = held.point(field)
    cheated = held.blocks["z"].slice
    point[cheated] += 0.25
    solution = read_solution(
        by_name(tmp_path / "x.sol", names_of(held), point), problem_of(field, "minlp-quartic")
    )
    assert solution.violation.rows == pytest.approx(0.25)
    assert solution.violation.worst_family in {"c27", "c28"}


def test_integers_near_a_whole_number_are_rounded_and_others_kept(tmp_path, field):
    problem = problem_of(field, "milp-mccormick")
    point = problem.point(field)
    first = problem.blocks["p1"].offset
    near, far = point.copy(), point.copy()
    near[first] += 0.4 * ROUND
    far[first] += 0.125
    rounded = read_solution(by_name(tmp_path / "near.sol", names_of(problem), near), problem)
    assert rounded.point[first] == point[first]
    assert rounded.rounded == pytest.approx(0.4 * ROUND, rel=1e-6)
    assert rounded.violation.integrality == 0
    solution = read_solution(by_name(tmp_path / "far.sol", names_of(problem), far), problem)
    assert solution.point[first] == far[first]
    assert solution.violation.integrality == pytest.approx(0.125)
    assert solution.field.p.tolist() == field.p.tolist()


def test_continuous_columns_are_never_rounded(tmp_path, field):
    problem = problem_of(field, "milp-mccormick")
    point = problem.point(field)
    at = problem.blocks["beta"].offset
    point[at] = 0.4 * ROUND
    solution = read_solution(by_name(tmp_path / "x.sol", names_of(problem), point), problem)
    assert solution.point[at] == 0.4 * ROUND


def test_with_the_printed_facet_p_is_believed_and_z_is_not(tmp_path):
    """z may not fit p1 beta there: the objective of the file is lower than the energy of its field."""
    field = make_field(make_instance("full"))
    problem = problem_of(field, "milp-mccormick", facet="printed")
    point = problem.point(field)
    even = (field.p & 1) == 0
    beta = field.beta
    grid = field.instance.grid
    z = np.clip((beta[grid.first] - beta[grid.second]) / 2, -np.pi / 4, 0)
    blocks = problem.blocks
    point[blocks["z"].slice][even] = z[even]
    point[blocks["t"].slice][even] = np.abs(beta[grid.first] - 2 * z - beta[grid.second])[even]
    solution = read_solution(by_name(tmp_path / "x.sol", names_of(problem), point), problem)
    assert solution.violation.worst < 1e-12
    assert solution.field.p.tolist() == field.p.tolist()
    assert solution.objective < solution.field.energy(1).total - 0.1


def test_a_file_without_a_point_has_no_field(tmp_path, field):
    problem = problem_of(field, "milp-mccormick")
    path = tmp_path / "x.sol"
    facts = {"columns": problem.n_columns, "stamp": problem.stamp}
    write_ampl_sol(path, "no room", np.zeros(0), problem.n_rows, 220, **facts)
    solution = read_solution(path, problem)
    assert (solution.point, solution.objective, solution.violation) == (None, None, None)
    assert solution.status == Status.INFEASIBLE
    with pytest.raises(SolutionError, match=r"no point in the solution \(infeasible\): no room"):
        _ = solution.field
