"""Every formulation of every kind of instance: its objective at a field, its files, answers of solvers."""

import json
import re
from dataclasses import replace

import crossfield as cf
import numpy as np
import pytest
from cases import OPTIONS
from crossfield.export.formats.registry import FORMATS
from crossfield.export.solutions.readers.ampl import write_ampl_sol
from crossfield.export.solvers_table import SOLVERS, suitability_in_format
from crossfield.export.solving.local import SolveFiles, Solvers, choose_format
from crossfield.export.verify.verify import attained_objective
from crossfield.export.writing.nl_order import NlOrder
from crossfield.models.formulations.catalogue import FORMULATIONS
from crossfield.models.processes.deadline import Deadline
from folders import contents
from hypothesis import given, settings
from hypothesis import strategies as st
from independent_energy import Formulas
from instance_kinds import SMALL, TINY, crossed, first_field, instances, kind

LEAST = 1e-9
"""Least size of a number in a file: readers of files drop smaller ones."""
WRITTEN = [*SMALL, "1155-pixels-weighted"]
FEW = [name for name in TINY if len(kind(name).domain.first) <= 1 and name != "two-triangles-skewed"]
"""Kinds that SCIP solves in 20,000 nodes; non-convex models of the other one, of optimum 0, take more."""


def problem_of(name, formulation, *, field=None, **options):
    """The problem, and the first field of the instance; None where the instance cannot have it.

    field: with the jumps of `qp-fixed`, another one than the first field.
    """
    instance, field = kind(name), field or first_field(kind(name))
    jumps = {"p": field.p} if formulation == "qp-fixed" else {}
    is_right, is_cycle = (word in formulation for word in ("-orthogonal", "-cycle"))
    is_refused = (is_right or is_cycle) and (
        not instance.orthogonal or (is_cycle and instance.gauge == "box")
    )
    if is_refused or (instance.indices is not None and not is_cycle):
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


def field_with_any_jumps(instance):
    """Angles anywhere in their windows, and any useful jumps."""
    formulas, rng = Formulas(instance), np.random.default_rng(2)
    alpha = rng.uniform(formulas.lower, formulas.upper)
    beta = rng.uniform(-np.pi / 4, np.pi / 4, formulas.size) * (not instance.orthogonal)
    return cf.CrossField(instance, alpha, beta, [rng.choice(jumps) for jumps in formulas.jumps])


def with_indices_of(field, formulation):
    """The problem whose rings have the indices of a field."""
    indices = dict.fromkeys(field.instance.domain.ring_vertices.tolist(), 0)
    spots = field.singularities
    indices |= dict(zip(spots.vertex.tolist(), np.round(4 * spots.index).astype(int).tolist(), strict=True))
    return cf.formulate(replace(field.instance, indices=[*indices.items()]), formulation)


def variants(name, formulation):
    """The problems of a formulation with its default options, with each other value of each option, and with
    prescribed indices; and the field of the instance.
    """
    problem, field = problem_of(name, formulation)
    if problem is None:
        return [], field
    if not FORMULATIONS[formulation].orthogonal:
        field = field_with_any_jumps(kind(name))
        problem, _ = problem_of(name, formulation, field=field)
    problems = [problem]
    for option in sorted(FORMULATIONS[formulation].option_names):
        if option == "limits":
            if kind(name).gauge == "box" or kind(name).indices is not None:
                words = "gauge" if kind(name).gauge == "box" else "leave limits out"
                with pytest.raises(cf.FormulationError, match=words):
                    cf.formulate(kind(name), formulation, limits=True)
                continue
            field = cf.improved_field(field)  # limits cut off fields that one jump improves
        problems += [problem_of(name, formulation, **{option: value})[0] for value in OPTIONS[option]]
    if "cycle" in formulation and len(field.instance.domain.ring_vertices):
        problems.append(with_indices_of(field, formulation))
    return problems, field


@pytest.mark.parametrize("name, formulation", crossed(WRITTEN, FORMULATIONS, every=8))
def test_a_field_is_a_point_with_its_energy(name, formulation):
    problems, field = variants(name, formulation)
    for problem in problems:
        field = replace(field, instance=problem.instance)
        point, energy = problem.point(field), energy_of(problem, field)
        close = 1e-9 * (1 + energy) + 1e-11 * sum(Formulas(field.instance).omega)
        fixed = problem.with_integers_fixed(field)
        lifted = [problem.lifted] if problem.objective_degree in {3, 4} else []  # as LP and MPS hold it
        for form in (problem, fixed, *lifted):
            assert form.objective_value(form.point(field)) == pytest.approx(energy, abs=close)
            assert form.violation(form.point(field)).worst <= 1e-9
            assert_same_arrays(form, close)
        same = problem.field(point)
        assert energy_of(problem, same) == pytest.approx(energy, abs=close)
        assert same.cross_error(field.u_angle, field.v_angle).max() <= 1e-7
        noise = np.random.default_rng(0).uniform(-0.1, 0.1, len(point)) * problem.integer
        if "k" not in problem.blocks:
            assert (problem.field(point + noise).p == same.p).all()
        assert not fixed.integer.any()
        assert (fixed.lower == fixed.upper)[problem.integer].all()


def assert_same_arrays(problem, close):
    """Arrays have the values of the problem anywhere; parts of a higher degree are named."""
    arrays = problem.to_arrays()
    names = [*arrays.column_names, *arrays.row_names]
    assert len({name.lower() for name in names}) == problem.n_columns + problem.n_rows
    assert max(map(len, names), default=0) <= 15
    assert bool(arrays.nonlinear) == (max(problem.objective_degree, problem.row_degree) > 2)
    if arrays.nonlinear:
        return
    for anywhere in np.random.default_rng(1).normal(size=(2, problem.n_columns)):
        value, violation = arrays.objective_value(anywhere), problem.violation(anywhere)
        rows = arrays.activities(anywhere)
        excess = np.maximum(arrays.row_lower - rows, rows - arrays.row_upper).max(initial=0)
        bounds = np.maximum(arrays.lower - anywhere, anywhere - arrays.upper).max(initial=0)
        assert value == pytest.approx(problem.objective_value(anywhere), rel=1e-9, abs=close)
        assert excess == pytest.approx(violation.rows, rel=1e-9, abs=1e-9)
        assert bounds == violation.bounds
    if problem.is_convex and 0 < problem.n_columns < 100:
        least = np.linalg.eigvalsh(arrays.q.toarray()).min(initial=0)
        assert least >= -1e-9 * (1 + abs(arrays.q).max())


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_a_hash_stands_for_everything_that_changes_a_file(formulation):
    name = "full-orthogonal" if "orthogonal" in formulation or "cycle" in formulation else "full"
    problems, field = variants(name, formulation)
    defaults = FORMULATIONS[formulation].defaults
    distinct = [problems[0], *(other for other in problems if other.formulation.options != defaults)]
    distinct += [other for other in problems if other.instance.indices is not None]
    if formulation != "qp-fixed":
        distinct.append(problems[0].with_integers_fixed(field))
        other = cf.CrossField(field.instance, field.alpha, field.beta, field.p + 1)
        distinct.append(problems[0].with_integers_fixed(other))
    else:
        distinct.append(cf.formulate(field.instance, formulation, p=1 - field.p))
    if "cycle" not in formulation:
        distinct.append(problem_of(f"{name}-box", formulation)[0])
    assert len({problem.sha256 for problem in distinct}) == len(distinct) > 1
    again = cf.formulate(field.instance, FORMULATIONS[formulation].short, p=problems[0].jumps)
    assert again.sha256 == problems[0].sha256


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
    manifest = cf.write(problem, tmp_path, formats=["nl", "gms", "lp", "mps"], start=field)
    held = manifest.problems_by_format(problem)
    paths = [*tmp_path.glob("*.sol"), *tmp_path.glob("*.slx")]
    assert bool(paths) == problem.integer.any()
    for path in paths:
        assert_same_point(cf.read_solution(path, problem, held=held), field)
    names = held["nl"].to_arrays().column_names.tolist()
    values = dict(zip(names, held["nl"].point(field).tolist(), strict=True))
    texts = [
        json.dumps(values),
        "".join(f"{name},{value!r}\n" for name, value in reversed(values.items())),
        *("".join(f"{name}{between}{value!r}\n" for name, value in values.items()) for between in "=\t"),
    ]
    for text in texts if values else ():  # without columns there is no text
        (tmp_path / "answer").write_text(text)
        assert_same_point(cf.read_solution(tmp_path / "answer", problem, held=held), field)
    order = NlOrder(held["nl"])  # without names, as solvers of AMPL write them
    point = held["nl"].point(field)[order.order]
    write_ampl_sol(tmp_path / "answer.sol", "solved", point, held["nl"].n_rows, 0)
    if values:
        assert_same_point(cf.read_solution(tmp_path / "answer.sol", problem, held=held), field)


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


BUNDLED = {"highs": ("lp", "mps"), "ipopt": ("nl",), "bonmin": ("nl",)}


@pytest.fixture(scope="module")
def solvers():
    with Solvers() as running:
        yield running


@pytest.mark.slow
@settings(max_examples=40)
@given(instances(), st.sampled_from([*FORMULATIONS]), st.booleans())
def test_bundled_solvers_agree_on_instances_of_any_kind(
    solvers, tmp_path_factory, instance, formulation, relax
):
    fixed = {"p": cf.greedy_field(instance).p} if formulation == "qp-fixed" else {}
    options = {"relax": True} if relax and "relax" in FORMULATIONS[formulation].option_names else {}
    try:
        problem = cf.formulate(instance, formulation, **fixed, **options)
    except cf.FormulationError:
        return
    folder, optima = tmp_path_factory.mktemp("solved"), []
    for solver in BUNDLED:
        if (taking := choose_format(problem, solver)).answer == "no":
            with pytest.raises(cf.SolverError, match=re.escape(taking.reason)):
                cf.solve(problem, solver, folder=folder / "refused")
            assert contents(folder) == {}
    for solver, file_format in ((solver, name) for solver, names in BUNDLED.items() for name in names):
        taking = suitability_in_format(problem, solver, file_format).answer
        if taking != "yes" and (taking, solver) != ("local", "ipopt"):
            continue
        try:
            answer = answer_of(problem, solver, folder / f"{solver}.{file_format}", solvers)
        except (cf.UnsupportedByFormatError, cf.SolverError, cf.SolutionError) as error:
            # A column that costs nothing may go to infinity; Bonmin fails with great weights.
            words = "drop or refuse values|ended with an error|no column"
            assert re.search(words, str(error)), error  # noqa: PT017
            continue
        if str(answer.status) in {"optimal-global", "optimal-local"}:
            optima.append((answer.objective, saved(answer)))
    least = None
    if formulation == "qp-fixed":
        least = Formulas(instance).least_at(tuple(fixed["p"].tolist()), 2)
    elif not options and norm_of(problem):
        least = Formulas(instance).least(norm_of(problem))
    expected = [(least, 0.0)] if least is not None else optima[:1]
    weight = max(instance.stroke_coefficient, instance.skew_coefficient)  # by which Ipopt scales
    for (value, low), (other, high) in ((one, two) for one in optima for two in expected):
        if problem.is_convex or not options:
            assert abs(value - other) <= 1e-4 * max(1.0, abs(other)) + 1e-9 * weight + low + high, optima


def answer_of(problem, solver, model, solvers):
    """An answer whose claims do not contradict its point; its file is read again as the same."""
    held = cf.write(problem, model).problem
    files, limits = SolveFiles.for_model(model, solver), cf.Limits(2.0, gap=0.0)
    answer = solvers.solve_file(held, solver, files, limits, Deadline.after(20.0))
    again = cf.read_solution(files.solution, held)
    if again.status == "optimal-in-gap":  # the file does not state the gap of the limits
        again = cf.read_solution(files.solution, held, stated_gap=0.0)
    assert (again.status, again.objective) == (answer.status, answer.objective)
    assert answer.identified
    assert str(answer.status) not in {"infeasible", "unbounded"}
    assert answer.contradictions == ()
    assert answer.point is not None or not str(answer.status).startswith("optimal")
    if answer.point is not None and answer.bound is not None:
        highest = answer.objective + saved(answer)
        assert answer.bound <= highest + 1e-4 * max(1.0, abs(answer.objective))
    return answer


def saved(answer):
    """What the objective of an answer may save by rows that its point breaks."""
    return max(attained_objective(answer, answer.objective, answer.violation) - answer.objective, 0.0)


def test_a_problem_without_columns_is_solved():
    solution = cf.solve(cf.formulate(kind("triangle"), "miqp-cycle"), limits=cf.Limits(5.0))
    assert (solution.problem.n_columns, solution.objective, solution.field.energy().total) == (0, 0, 0)


@pytest.mark.parametrize("name, formulation", crossed(TINY, FORMULATIONS, every=7))
def test_a_problem_goes_to_highs_in_memory_or_is_refused(name, formulation):
    problem, field = problem_of(name, formulation)
    if problem is None:
        return
    if problem.problem_class not in {"LP", "MILP"} and (
        problem.problem_class != "QP" or not problem.is_convex
    ):
        with pytest.raises(cf.UnsupportedBySolverError, match=f"HiGHS takes .* {problem.problem_class}"):
            problem.to_highs()
        return
    model = problem.to_highs()
    model.setOptionValue("mip_rel_gap", 0.0)
    model.run()
    close = 1e-5 * (1 + energy_of(problem, field))
    point = np.array(model.getSolution().col_value)
    optimum = model.getInfo().objective_function_value
    assert problem.objective_value(point) == pytest.approx(optimum, abs=close)
    assert problem.violation(point).worst <= 1e-5
    assert optimum <= energy_of(problem, field) + close


def norm_of(problem):
    """The norm 1 or 2 of all terms, None where they differ."""
    options = problem.formulation.options
    norms = {2 if "2-norm" in problem.formulation.declaration.minimises else 1}
    norms |= set() if norms == {2} else {options.stroke_norm, options.beta_norm}
    return norms.pop() if len(norms) == 1 else None
