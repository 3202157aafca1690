"""What an answer claims: checked against its point, its problem, its gap; nothing else is passed on."""

import inspect
import json
import re
import subprocess
from dataclasses import replace

import crossfield as cf
import numpy as np
import places
import pytest
from answers import HIGHS_STATES_BOUNDS, by_highs
from crossfield.export.cli.app import invoke, read_command
from crossfield.export.solutions.readers.ampl import write_ampl_sol
from crossfield.export.solutions.readers.grammar import AGREEMENT
from crossfield.export.solutions.readers.registry import read_raw
from crossfield.export.solutions.solution import TRUSTED, Solution
from crossfield.export.solvers_table import SOLVERS
from crossfield.export.solving.local import SolveFiles, Solvers
from crossfield.export.statuses import Status
from crossfield.export.writing.nl_order import NlOrder
from crossfield.models.formulations.windows import Windows
from crossfield.models.processes.deadline import Deadline
from instance_kinds import grid, kind

MILP = "milp-mccormick"
GLOBAL, IN_GAP, LIMIT, FEASIBLE = "optimal-global", "optimal-in-gap", "limit-with-point", "feasible"


@pytest.fixture(scope="module")
def skew(tmp_path_factory):
    """A folder with the MILP of a sample in LP, MPS and as an AMPL model, its instance and manifest."""
    folder = tmp_path_factory.mktemp("skew")
    instance = cf.write_instance(
        cf.sample("skew", 4, stroke_weight=0.17, skew_weight=2.8e-8), folder / "skew.json"
    )
    formats = ["--format", "lp", "--format", "mps", "--format", "mod"]
    assert invoke(["export", str(instance), "-f", MILP, *formats, "-o", str(folder)]) == 0
    return folder


@pytest.fixture
def reading(skew, tmp_path, capsys):
    """Run `read` on a file: exit code, facts, complaint, and whether a field was written."""

    def run(solution, *options, manifest=skew / f"skew.{MILP}.manifest.json"):
        output = tmp_path / "field.npz"
        output.unlink(missing_ok=True)
        arguments = ["read", str(solution), "--manifest", str(manifest), "-o", str(output), "--json"]
        code = invoke([*arguments, *options])
        out, err = capsys.readouterr()
        assert "internal error" not in err
        assert err.count("\n") <= 1
        return code, json.loads(out) if out else {}, err, output.exists()

    return run


# against the point


def test_the_answer_of_a_relaxation_is_not_passed_on(skew, reading, tmp_path):
    assert inspect.signature(read_command).parameters["tolerance"].default == TRUSTED
    path = by_highs(skew / f"skew.{MILP}.mps", tmp_path / "relaxed.sol", solve_relaxation=True)
    assert read_raw(path).status == "optimal-in-gap"
    code, facts, complaint, written = reading(path)
    assert (code, written) == (1, False)
    assert (facts["status"], facts["claimed"]) == ("unknown", "optimal-in-gap")
    assert facts["worst_violation"] > 0.3
    words = r"relaxed\.sol: claims optimal-in-gap, but its point breaks integrality by 0\.3"
    assert re.search(words, complaint)
    assert "--tolerance" not in complaint
    code, facts, complaint, written = reading(path, "--tolerance", "0.5")
    assert (code, written, complaint) == (0, True, "")
    assert (facts["status"], facts["contradictions"]) == ("feasible", [])
    assert facts["claims"] == "not kept (optimal-in-gap): the point is feasible only within 0.5"


@pytest.mark.needs("glpk")
def test_glpk_answers_relaxations_and_models_in_its_own_order(skew, reading, tmp_path):
    relaxed, whole = tmp_path / "relaxed.sol", tmp_path / "whole.sol"
    stem = f"skew.{MILP}"
    of_lp = ["--lp", f"{stem}.lp", "--nomip", "-w", relaxed]
    of_mod = ["-m", f"{stem}.mod", "-d", f"{stem}.dat", "-w", whole]
    for arguments in (of_lp, of_mod):
        subprocess.run(["glpsol", *map(str, arguments)], cwd=skew, check=True, capture_output=True)
    code, facts, _, written = reading(relaxed)
    assert (code, facts["status"], written) == (1, "unknown", False)
    code, facts, complaint, written = reading(whole)
    assert (code, complaint, written) == (0, "", True)
    assert (facts["status"], facts["claimed"]) == ("feasible", "optimal-global")
    assert facts["claims"].endswith("the file is of an unidentified problem")
    assert facts["worst_violation"] < 1e-9
    assert facts["objective_of_field"] == pytest.approx(facts["objective_recomputed"], abs=1e-8)
    assert facts["objective_recomputed"] == pytest.approx(facts["objective_reported"], abs=1e-9)


@pytest.mark.needs("glpk")
@pytest.mark.parametrize("name", ["parts", "hole", "pixel"])
def test_the_columns_of_a_model_have_glpks_order_also_with_pixels_apart(name, tmp_path):
    """`parts` has a pixel without neighbours: without a stroke, its alpha is not a column of GLPK's."""
    problem = cf.formulate(kind(name), MILP)
    cf.write(problem, tmp_path / "x.mod")
    command = ["glpsol", "-m", "x.mod", "-d", "x.dat", "-w", "answer"]
    subprocess.run(command, cwd=tmp_path, check=True, capture_output=True)
    solution = cf.read_solution(tmp_path / "answer", problem, identified=True)
    assert (solution.status, solution.contradictions) == ("optimal-global", ())


@pytest.fixture(scope="module")
def milp():
    field = cf.power_field(kind("full"))
    problem = cf.formulate(field.instance, MILP)
    return problem, problem.point(field)


def test_claims_fall_to_objective_bound_and_violation(milp):
    problem, point = milp
    objective = problem.objective_value(point)
    off = point.copy()
    off[problem.blocks["beta"].offset] += 3e-4

    def of(claimed=Status.OPTIMAL_GLOBAL, at=point, **claims):
        return Solution(problem, at, claimed, "", "by hand", **{"identified": True, **claims})

    assert of(reported=objective, claimed_bound=objective).status == "optimal-global"
    near = of(reported=objective * (1 + 0.5 * AGREEMENT), claimed_bound=objective * (1 - 1e-4))
    assert (near.status, near.bound, near.caveat) == ("optimal-global", objective * (1 - 1e-4), "")
    stopped = of(reported=objective, claimed_bound=0.6 * objective)
    assert (stopped.status, stopped.bound) == ("limit-with-point", 0.6 * objective)
    assert stopped.gap == pytest.approx(0.4)
    assert "leaves a gap" in stopped.caveat
    (why,) = of(reported=objective + 0.01).contradictions
    assert why.startswith("it states the objective")
    contradicted = of(claimed_bound=objective + 0.01)
    (why,) = contradicted.contradictions
    assert why.startswith("the dual bound")
    assert (contradicted.bound, contradicted.gap) == (None, None)
    loose = of(at=off, claimed_bound=0.0, tolerance=1e-3)
    assert loose.caveat.endswith("feasible only within 0.001")
    stranger = of(claimed_bound=0.0, identified=False)
    assert stranger.caveat.endswith("the file is of an unidentified problem")
    for weak in (loose, stranger):
        assert (weak.status, weak.bound, weak.gap, weak.doubt) == ("feasible", None, None, "")
    above = problem.objective_value(off) + 1
    for doubtful in (
        of(reported=np.inf),
        of(reported=np.nan),
        of(at=off),
        of(at=off, reported=objective + 0.01, tolerance=10.0),
        of(at=off, tolerance=10.0, claimed_bound=above),
        of(Status.INFEASIBLE, at=None, identified=False),
    ):
        assert doubtful.status == "unknown"
    assert of(Status.INFEASIBLE).contradictions == ("its point is feasible",)
    assert of(Status.INFEASIBLE, at=None).status == of(Status.INFEASIBLE, at=off).status == "infeasible"
    assert of(Status.LIMIT_WITHOUT_POINT, at=None, identified=False).status == "no-point"
    for silent in (Status.ERROR, Status.LIMIT_WITHOUT_POINT, Status.NO_POINT):
        assert of(silent).status == of(silent, reported=objective).status == "feasible"
        assert of(silent, reported=objective + 0.01).status != "feasible"
        assert not of(silent, at=off).status.needs_point


def test_a_point_that_breaks_rows_a_little_has_the_objective_of_its_field_beside(milp):
    """Slacks lowered by a solver's tolerance save an objective that no field has."""
    problem, point = milp
    index, cost = problem.merged_objective(1)
    lowered = point.copy()
    lowered[index[cost > 0, 0]] -= 1e-6
    answer = Solution(problem, lowered, Status.OPTIMAL_GLOBAL, "", "by hand", identified=True)
    assert answer.status == "optimal-global"
    assert answer.objective < problem.objective_value(point) - 1e-5
    assert answer.objective_of_field == pytest.approx(problem.objective_value(point), rel=1e-12)
    printed = cf.formulate(problem.instance, MILP, facet="printed")
    answer = Solution(printed, printed.point(answer.field), Status.FEASIBLE, "", "by hand", identified=True)
    assert answer.objective_of_field is None


@pytest.mark.parametrize(
    "code, status", [(200, "infeasible"), (300, "unbounded"), (470, "limit-without-point"), (500, "error")]
)
def test_values_of_an_ampl_file_without_a_claim_count_if_they_are_feasible(
    code, status, skew, reading, tmp_path
):
    instance = cf.read_instance(skew / "skew.instance.json")
    held = cf.formulate(instance, MILP)
    point = held.point(cf.greedy_field(instance))
    bad = point.copy()
    bad[: len(instance.theta)] += 1
    for values in (point, bad):
        path = tmp_path / "x.sol"
        write_ampl_sol(path, "some words", values[NlOrder(held).order], held.n_rows, code, stamp=held.stamp)
        exit_code, facts, complaint, written = reading(path)
        if code in {470, 500} and values is point:
            assert (exit_code, written, facts["status"], facts["claimed"]) == (0, True, "feasible", status)
            continue
        assert (exit_code, written) == (1, False)
        assert facts["claimed"] == status
        wrong = {200: values is point and "its point is feasible", 300: "is bounded below"}.get(code)
        assert facts["status"] == ("unknown" if wrong else status)
        assert (wrong or "not a solution") in complaint


# against the gap


GAPS = (0.0, 1e-4, 0.9)
OPTIMA = {"mouse": 3.44082891, "skew": 0.69883211}
"""Optima at 3 and 4 pixels, on which HiGHS, SCIP, CBC, Gurobi and CPLEX agree."""
WAYS = [
    ("highs", "mouse", [GLOBAL, GLOBAL, LIMIT] if HIGHS_STATES_BOUNDS else [IN_GAP, IN_GAP, IN_GAP]),
    ("cbc", "mouse", [IN_GAP, IN_GAP, IN_GAP]),
    ("glpk", "mouse", [GLOBAL, LIMIT, LIMIT]),
    ("scip", "mouse", [FEASIBLE, FEASIBLE, FEASIBLE]),
    ("cplex", "skew", [GLOBAL, GLOBAL, IN_GAP]),
    ("gurobi", "mouse", [GLOBAL, GLOBAL, LIMIT]),
    ("xpress", "mouse", [FEASIBLE, FEASIBLE, FEASIBLE]),
]
"""Programs, a sample on which a gap of 0.9 ends their search early, and the status of the file per gap."""


def sample_milp(name):
    return cf.formulate(cf.sample(name, 3 + (name == "skew")), MILP)


@pytest.fixture(scope="module")
def solvers():
    with Solvers() as solvers:
        yield solvers


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize(
    "solver, name, statuses",
    [
        pytest.param(
            *way, marks=[pytest.mark.needs(way[0]), *([pytest.mark.slow] if way[0] != "gurobi" else [])]
        )
        for way in WAYS
    ],
)
def test_an_optimum_is_global_only_if_the_file_or_the_given_gap_proves_it(
    solver, name, statuses, solvers, tmp_path
):
    """A solve knows the gap that it gave; its file may not state it."""
    of, least = sample_milp(name), OPTIMA[name]
    for gap, status in zip(GAPS, statuses, strict=True):
        solved = solvers.solve(of, solver, folder=tmp_path / str(gap), limits=cf.Limits(60.0, gap, 1))
        assert solved.status == (GLOBAL if gap < 0.9 else LIMIT)
        assert solved.bound is None or solved.bound <= least * (1 + 1e-6)
        (path,) = (tmp_path / str(gap)).glob(f"*.{solver}{SOLVERS[solver].answers}")
        answer = cf.read_solution(path, of, identified=True)
        assert answer.status == status
        assert status != GLOBAL or answer.objective == pytest.approx(least, rel=1e-4)
        assert status not in {IN_GAP, FEASIBLE} or (answer.caveat and answer.bound is None)
        if answer.claimed in {GLOBAL, IN_GAP}:
            stated = cf.read_solution(path, of, identified=True, stated_gap=gap)
            assert stated.status == (GLOBAL if gap < 0.9 else LIMIT)
            assert stated.bound is None or stated.bound <= least * (1 + 1e-6)
        else:
            with pytest.raises(cf.SolutionError, match="a gap proves nothing; --bound X states a dual bound"):
                cf.read_solution(path, of, identified=True, stated_gap=gap)
        bounded = cf.read_solution(path, of, identified=True, stated_bound=least * (1 - 5e-5))
        is_closed = bounded.objective < least * 1.0001 and answer.claimed != LIMIT
        assert (bounded.status == GLOBAL) == is_closed


@pytest.mark.parametrize("gap, status", [("0", GLOBAL), ("0.0001", GLOBAL), ("0.9", LIMIT)])
def test_highs_states_the_bound_since_1_16(gap, status):
    answer = cf.read_solution(places.SOLUTIONS / "gaps" / f"highs-1.16.0_{gap}.sol", sample_milp("mouse"))
    assert (answer.claimed, answer.status) == (IN_GAP, status)
    assert answer.bound <= OPTIMA["mouse"] * (1 + 1e-6)


@pytest.mark.slow
def test_bonmin_claims_a_local_optimum_at_any_gap(tmp_path):
    """Its file states no bound, and it is exact for convex problems only."""
    convex = cf.formulate(kind("row"), "miqp-exact")
    answer = cf.solve(convex, "bonmin", folder=tmp_path, limits=cf.Limits(60.0, 0.9, 1))
    (path,) = tmp_path.glob("*.bonmin.sol")
    assert answer.status == cf.read_solution(path, convex).status == "optimal-local"
    assert answer.bound is None
    with pytest.raises(cf.SolutionError, match="a gap proves nothing"):
        cf.read_solution(path, convex, stated_gap=0.9)


def test_read_takes_the_gap_and_the_bound(reading, tmp_path):
    (manifest,) = cf.write_all(cf.sample("mouse", 3), tmp_path, formulations=[MILP], formats=["mps"])
    answer = by_highs(tmp_path / f"mouse.{MILP}.mps", tmp_path / "answer.sol", 0.9)
    stated = re.compile(r"(?m)^(?:Objective_bound|MIP_rel_gap) .*\n")  # by HiGHS from 1.16 on
    answer.write_text(stated.sub("", answer.read_text()))

    def status(*options):
        code, facts, error, _ = reading(answer, *options, manifest=manifest.path)
        return facts if code == 0 else error

    facts = status()
    assert (facts["status"], facts["dual_bound"]) == (IN_GAP, None)
    assert "--gap X" in facts["claims"]
    facts = status("--gap", "0.9")
    assert (facts["status"], facts["gap"]) == (LIMIT, pytest.approx(0.9))
    assert status("--gap", "0")["status"] == GLOBAL
    assert status("--bound", "0.5")["dual_bound"] == 0.5
    assert "lies above the objective" in status("--bound", "50")
    assert "is out of range" in status("--bound", "nan")


def test_a_convex_problem_without_integers_has_no_gap(tmp_path):
    """HiGHS solves an LP to its optimality conditions: the gap, here 0.9, is of integers alone."""
    relaxed = cf.formulate(cf.sample("mouse", 3), MILP, relax=True)
    cf.write(relaxed, tmp_path / "model.mps")
    path = by_highs(tmp_path / "model.mps", tmp_path / "answer.sol", 0.9)
    answer = cf.read_solution(path, relaxed)
    assert (answer.claimed, answer.status, answer.caveat) == (IN_GAP, GLOBAL, "")
    assert cf.read_solution(path, relaxed, stated_gap=0.9).status == GLOBAL


def test_highs_proves_nothing_about_a_problem_that_is_not_convex(tmp_path):
    """It may call a stationary point of a non-convex QP optimal."""
    products = cf.formulate(cf.sample("mouse", 3), "minlp-cubic", relax=True)
    held = products.lifted
    assert not held.is_convex
    point = held.point(cf.greedy_field(products.instance))
    objective, names = held.objective_value(point), held.to_arrays().column_names
    lines = [f"{name} {value!r}" for name, value in zip(names, point.tolist(), strict=True)]
    text = f"Model status\nOptimal\n\n# Primal solution values\nFeasible\nObjective {objective!r}\n"
    path = tmp_path / "answer.sol"
    path.write_text("\n".join([f"{text}# Columns {len(lines)}", *lines, "# Rows 0\n"]))
    assert cf.read_solution(path, products, identified=True).status == "optimal-local"
    with pytest.raises(cf.SolutionError, match="a gap proves nothing"):
        cf.read_solution(path, products, identified=True, stated_gap=0.0)


# against the problem


STROKES = {"theta": [0.2, 1.6, 2.6], "w": [1.0, 0.75, 0.5]}


def changed(*, weight=0.5, gauge="strokes", **options):
    """A problem, or another one with the same columns and rows."""
    instance = grid("// #/", STROKES["theta"], [1.0, 0.75, weight], gauge=gauge)
    return cf.formulate(instance, MILP, **options)


def with_another_bound():
    """The problem with the upper bound of one alpha a little lower."""
    problem, quarter = changed(), np.full(4, np.pi / 4)
    instance = problem.instance
    upper = instance.alpha_upper - np.array([0, 0, 1e-3, 0])
    ends = (instance.alpha_lower, upper, -quarter, quarter, instance.p_min, instance.p_max)
    return replace(problem, windows=Windows(*ends, energy=9.0, proof="by hand", norm=1))


OTHERS = {
    "bound": with_another_bound,
    "weight": lambda: changed(weight=0.5000001),
    "gauge": lambda: changed(gauge="box"),
    "facet": lambda: changed(facet="printed"),
    "norm": lambda: changed(stroke_norm=2),
    "relaxation": lambda: changed(relax=True),
}


def by_ampl_library(model, answer):
    """The AMPL Solver Library repeats the options of a real .nl; the values are those of HiGHS."""
    subprocess.run(["gjh_asl_json", "-s", str(model.with_suffix(""))], check=True, capture_output=True)
    options = re.search(r"Options\n(4\n1\n1\n0\n\d+\n)", model.with_suffix(".sol").read_text())[1]
    problem, mps = changed(), model.with_suffix(".mps")
    cf.write(problem, mps)
    point = cf.read_solution(by_highs(mps, answer), problem).point
    answer.unlink()
    write_ampl_sol(answer, "optimal solution found", point[NlOrder(problem).order], problem.n_rows, 0)
    answer.write_text(re.sub(r"(?<=Options\n)3\n1\n1\n0\n", options, answer.read_text()))


WRITERS = [("highs", "lp"), ("highs sparse", "mps"), ("scip", "lp"), ("scip", "osil"), ("cbc", "mps")]
WRITERS += [
    ("glpk", "lp"),
    ("glpk", "mps"),
    ("gurobi", "lp"),
    ("cplex", "mps"),
    ("xpress", "mps"),
    ("asl", "nl"),
]


@pytest.mark.parametrize(
    "writer, suffix", [pytest.param(*way, marks=pytest.mark.needs(way[0].split()[0])) for way in WRITERS]
)
@pytest.mark.filterwarnings("ignore")
def test_an_answer_proves_nothing_about_another_problem(writer, suffix, solvers, tmp_path):
    solved, model, answer = changed(), tmp_path / f"model.{suffix}", tmp_path / "answer.sol"
    cf.write(solved, model)
    if writer == "asl":
        by_ampl_library(model, answer)
    elif writer == "highs sparse":
        by_highs(model, answer, style=4)
    else:
        files = SolveFiles.for_model(model, writer)._replace(solution=answer)
        solvers.solve_file(solved, writer, files, cf.Limits(60.0), Deadline.after(120.0))
    solution = cf.read_solution(answer, solved)
    assert solution.identified
    proven = {GLOBAL} if solution.bound is not None else set()
    assert solution.status in {solution.claimed, "feasible", *proven}
    assert not solution.caveat.startswith("not kept")
    for name, other in OTHERS.items():
        with pytest.raises(cf.SolutionError, match=r"answer\.\w+: is of another problem: it states"):
            pytest.fail(f"{name}: {cf.read_solution(answer, other())}")


def test_names_of_the_answer_carry_the_stamp_and_the_column_fixed_to_1_has_that_value(tmp_path):
    """SCIP prefixes the names of its presolved problem with `t_`; shifted lines belong to other names."""
    solved = changed()
    cf.write(solved, tmp_path / "model.mps")
    text = by_highs(tmp_path / "model.mps", tmp_path / "answer.sol").read_text()
    renamed, shifted = tmp_path / "renamed.sol", tmp_path / "shifted.sol"
    renamed.write_text(re.sub(r"(?m)^(\w+_\w+) (?=\S+$)", r"t_\1 ", text))
    assert "t_ONE_" in renamed.read_text()
    assert cf.read_solution(renamed, solved).status == "optimal-in-gap"
    with pytest.raises(cf.SolutionError, match="is of another problem"):
        cf.read_solution(renamed, OTHERS["weight"]())
    shifted.write_text(re.sub(r"(ONE_\w+) 1\n", r"\1 0.5\n", text))
    with pytest.raises(cf.SolutionError, match=r"ONE_\w+ has the value 0\.5, but it is fixed to 1"):
        cf.read_solution(shifted, solved)
