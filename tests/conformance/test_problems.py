"""Every formulation of every kind of instance: its objective at a field, its files, answers of solvers."""

import json
import re

import crossfield as cf
import pytest
from crossfield.export.formats.registry import FORMATS
from crossfield.export.solvers_table import SOLVERS, suitability_in_format
from crossfield.models.formulations.catalogue import FORMULATIONS
from folders import contents
from independent_energy import Formulas
from instance_kinds import SMALL, TINY, crossed, kind

LEAST = 1e-9
"""Least size of a number in a file: readers of files drop smaller ones."""
WRITTEN = [*SMALL, "1155-pixels-weighted"]
FEW = [name for name in TINY if len(kind(name).domain.first) <= 1 and name != "two-triangles-skewed"]
"""Kinds that SCIP solves in 20,000 nodes; non-convex models of the other one, of optimum 0, take more."""


def problem_of(name, formulation, **options):
    """The problem, and the greedy field of the instance; None where the instance cannot have it."""
    instance, field = kind(name), cf.greedy_field(kind(name))
    jumps = {"p": field.p} if formulation == "qp-fixed" else {}
    is_right, is_cycle = (word in formulation for word in ("-orthogonal", "-cycle"))
    if (is_right or is_cycle) and (not instance.orthogonal or (is_cycle and instance.gauge == "box")):
        with pytest.raises(cf.FormulationError):
            cf.formulate(instance, formulation, **jumps)
        return None, field
    return cf.formulate(instance, formulation, **jumps, **options), field


def energy_of(problem, field):
    """The energy that a problem minimises, by the formulas, in the norms that its declaration states."""
    squares, smooth = Formulas(field.instance).energy(field, 2), Formulas(field.instance).energy(field, 1)
    options, declared = problem.formulation.options, problem.formulation.declaration
    if "2-norm" in declared.minimises:
        return sum(squares)
    terms = (None, smooth, squares)
    return smooth[0] + terms[options.stroke_norm][1] + terms[options.beta_norm][2]


def least_weight(instance):
    """The least weight above 0 of a term."""
    strokes = instance.stroke_coefficient * instance.w
    pairs = [] if instance.pair_weights is None else instance.pair_weights
    return min(x for x in (*strokes, instance.skew_coefficient, *pairs, 1.0) if x > 0)


@pytest.mark.parametrize("name, formulation", crossed(WRITTEN, FORMULATIONS, every=8))
def test_a_field_is_a_point_with_its_energy(name, formulation):
    problem, field = problem_of(name, formulation)
    if problem is None:
        return
    point, energy = problem.point(field), energy_of(problem, field)
    close = 1e-9 * (1 + energy) + 1e-11 * sum(Formulas(field.instance).omega)
    assert problem.objective_value(point) == pytest.approx(energy, abs=close)
    assert problem.violation(point).worst <= 1e-9
    same = problem.field(point)
    assert energy_of(problem, same) == pytest.approx(energy, abs=close)
    assert same.cross_error(field.u_angle, field.v_angle).max() <= 1e-7


@pytest.mark.parametrize("name, formulation", crossed(WRITTEN, FORMULATIONS, every=9))
def test_a_problem_is_written_in_every_format(name, formulation, tmp_path):
    problem, field = problem_of(name, formulation)
    if problem is None:
        return
    is_light = least_weight(field.instance) < 10 * LEAST
    refusals = "holds nothing beyond .*; write |" + "drop or refuse" * bool(is_light)
    for file_format in FORMATS:
        for folder in ("one", "two"):
            path = tmp_path / folder / f"{file_format}.{file_format}"
            path.parent.mkdir(exist_ok=True)
            try:
                cf.write(problem, path)
            except cf.UnsupportedByFormatError as error:
                if not re.search(refusals.rstrip("|"), str(error)):
                    raise
        assert contents(tmp_path / "one") == contents(tmp_path / "two")


@pytest.mark.parametrize("name, formulation", crossed(TINY, FORMULATIONS, every=8))
def test_the_start_files_of_all_solvers_are_read_as_the_same_point(name, formulation, tmp_path):
    problem, field = problem_of(name, formulation)
    if problem is None or least_weight(field.instance) < 10 * LEAST:
        return
    manifest = cf.write_problem(problem, tmp_path, formats=["nl", "gms", "lp", "mps"], start=field)
    held = manifest.problems_by_format(problem)
    for path in (*tmp_path.glob("*.sol"), *tmp_path.glob("*.slx")):
        assert_same_point(cf.read_solution(path, problem, held=held), field)
    names = held["nl"].to_arrays().column_names.tolist()
    values = dict(zip(names, held["nl"].point(field).tolist(), strict=True))
    texts = [
        json.dumps(values),
        *("".join(f"{name}{between}{value!r}\n" for name, value in values.items()) for between in ",=\t"),
    ]
    for text in texts if values else ():  # without columns there is no text
        (tmp_path / "answer").write_text(text)
        assert_same_point(cf.read_solution(tmp_path / "answer", problem, held=held), field)


def assert_same_point(solution, field):
    """The point of an answer is that of the field, and keeps all rows."""
    held = solution.problem
    assert solution.point == pytest.approx(held.point(field), abs=1e-12)
    assert solution.contradictions == ()
    assert str(solution.status) in {"feasible", "limit-with-point"}
    assert solution.objective == pytest.approx(energy_of(held, field), rel=1e-9, abs=1e-9)


def solve_by_highs(model, answer):
    """The optimum that HiGHS finds, which it writes."""
    import highspy

    highs = highspy.Highs()
    highs.silent()
    for option, value in {"mip_rel_gap": 0.0, "mip_abs_gap": 0.0, "threads": 1}.items():
        highs.setOptionValue(option, value)
    assert highs.readModel(str(model)) == highspy.HighsStatus.kOk
    highs.run()
    assert highs.getModelStatus() == highspy.HighsModelStatus.kOptimal
    highs.writeSolution(str(answer), 0)
    return highs.getInfo().objective_function_value


def solve_by_scip(model, answer):
    """The optimum that SCIP finds, which it writes."""
    import pyscipopt

    scip = pyscipopt.Model()
    scip.hideOutput()
    scip.setParam("limits/gap", 0.0)
    scip.setParam("limits/nodes", 20_000)
    scip.readProblem(str(model))
    scip.optimize()
    assert scip.getStatus() == "optimal"
    scip.writeBestSol(str(answer))
    return scip.getObjVal()


SOLVING = {"highs": (solve_by_highs, TINY), "scip": (solve_by_scip, FEW)}
"""Functions that solve a file in this process, and the kinds that they solve at once."""


@pytest.mark.parametrize("solver, name, formulation", crossed(SOLVING, TINY, FORMULATIONS, every=14))
def test_a_solver_finds_the_least_energy_and_its_answer_is_read(solver, name, formulation, tmp_path):
    problem, field = problem_of(name, formulation)
    solve, names = SOLVING[solver]
    if problem is None or name not in names or least_weight(field.instance) < 1e-7:
        return
    if not problem.n_columns:
        return  # SCIP reads no .nl without columns
    formulas = Formulas(field.instance)
    for file_format in SOLVERS[solver].formats:
        if suitability_in_format(problem, solver, file_format).answer != "yes":
            continue
        held = cf.write(problem, tmp_path / f"model.{file_format}").problem
        optimum = solve(tmp_path / f"model.{file_format}", tmp_path / "answer.sol")
        solution = cf.read_solution(tmp_path / "answer.sol", held, identified=True)
        close = 1e-5 * (1 + optimum)
        assert solution.contradictions == ()
        assert str(solution.status).startswith(("optimal", "feasible"))  # SCIP's file states none
        assert solution.objective == pytest.approx(optimum, abs=close)
        assert energy_of(problem, solution.field) == pytest.approx(optimum, abs=close)
        assert optimum <= energy_of(problem, field) + close
        if formulation == "qp-fixed":
            assert formulas.least_at(tuple(field.p.tolist()), 2) == pytest.approx(optimum, abs=close)
        elif (norm := norm_of(problem)) in (1, 2) and (least := formulas.least(norm)) is not None:
            assert least == pytest.approx(optimum, abs=close)


def norm_of(problem):
    """The norm 1 or 2 of all terms, None where they differ."""
    options = problem.formulation.options
    norms = {2 if "2-norm" in problem.formulation.declaration.minimises else 1}
    norms |= set() if norms == {2} else {options.stroke_norm, options.beta_norm}
    return norms.pop() if len(norms) == 1 else None
