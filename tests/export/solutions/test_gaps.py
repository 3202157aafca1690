"""What programs call optimal at several gaps: an answer claims no more than its file proves."""

import json
import subprocess
from functools import cache

import crossfield as cf
import highspy
import numpy as np
import places
import pytest
from cases import names_of
from crossfield.export.cli.app import invoke
from crossfield.export.solutions.solution import read_solution
from crossfield.models.errors import SolutionError
from crossfield.models.formulations.names import column_names

MILP = "milp-mccormick"
GAPS = (0.0, 1e-4, 0.9)
GLOBAL, IN_GAP, LIMIT, FEASIBLE = "optimal-global", "optimal-in-gap", "limit-with-point", "feasible"
OPTIMA = {"mouse": 3.44082891, "skew": 0.69883211}
"""Optima at 3 and 4 pixels, on which HiGHS, SCIP, CBC, Gurobi and CPLEX agree."""


@cache
def problem(name):
    return cf.formulate(cf.sample(name, 3 + (name == "skew")), MILP)


def by_highs(model, gap, answer, **options):
    highs = highspy.Highs()
    highs.setOptionValue("output_flag", False)
    highs.readModel(model)
    highs.setOptionValue("mip_rel_gap", gap)
    for name, value in {"threads": 1, **options}.items():
        highs.setOptionValue(name, value)
    highs.run()
    highs.writeSolution(answer, 0)


def by_cbc(model, gap, answer):
    command = ["cbc", model, "ratio", str(gap), "solve", "solution", answer]
    subprocess.run(command, check=True, capture_output=True)


def by_glpk(model, gap, answer):
    command = ["glpsol", "--freemps", model, "--mipgap", str(gap), "-w", answer]
    subprocess.run(command, check=True, capture_output=True)


def by_scip(model, gap, answer):
    import pyscipopt

    scip = pyscipopt.Model()
    scip.hideOutput()
    scip.readProblem(model)
    scip.setParam("limits/gap", gap)
    scip.optimize()
    scip.writeBestSol(answer, write_zeros=True)


def by_cplex(model, gap, answer):
    import cplex

    solver = cplex.Cplex()
    for stream in ("log", "results", "warning", "error"):
        getattr(solver, f"set_{stream}_stream")(None)
    solver.read(model)
    solver.parameters.mip.tolerances.mipgap.set(gap)
    solver.parameters.threads.set(1)
    solver.solve()
    solver.solution.write(answer)


def by_gurobi(model, gap, answer):
    import gurobipy

    with gurobipy.Env(params={"OutputFlag": 0}) as environment, gurobipy.read(model, environment) as solver:
        solver.setParam("MIPGap", gap)
        solver.setParam("Threads", 1)
        solver.optimize()
        solver.write(answer)


def by_xpress(model, gap, answer):
    import xpress

    solver = xpress.problem()
    solver.setControl("outputlog", 0)
    solver.readProb(model)
    solver.setControl("miprelstop", gap)
    solver.setControl("threads", 1)
    solver.optimize()
    solver.writeSlxSol(answer)


WAYS = [
    ("highs", "mouse", by_highs, ".sol", [IN_GAP, IN_GAP, IN_GAP]),
    ("cbc", "mouse", by_cbc, ".sol", [IN_GAP, IN_GAP, IN_GAP]),
    ("glpk", "mouse", by_glpk, ".sol", [GLOBAL, LIMIT, LIMIT]),
    ("scip", "mouse", by_scip, ".sol", [FEASIBLE, FEASIBLE, FEASIBLE]),
    ("cplex", "skew", by_cplex, ".sol", [GLOBAL, GLOBAL, IN_GAP]),
    ("gurobi", "mouse", by_gurobi, ".sol", [FEASIBLE, FEASIBLE, FEASIBLE]),
    ("gurobi", "mouse", by_gurobi, ".json", [GLOBAL, GLOBAL, LIMIT]),
    ("xpress", "mouse", by_xpress, ".slx", [FEASIBLE, FEASIBLE, FEASIBLE]),
]
"""Programs, a sample on which a gap of 0.9 ends their search early, how each is asked, suffix of its layout,
and status of its answer at each gap. SCIP finds the optimum before it can stop.
"""
SLOW = {"scip", "xpress", "cbc", "highs"}


def marks(program):
    return [pytest.mark.needs(program), *([pytest.mark.slow] if program in SLOW else [])]


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize(
    "name, answer_by, suffix, statuses",
    [pytest.param(*way, marks=marks(program)) for program, *way in WAYS],
)
def test_an_optimum_is_global_only_if_the_file_proves_it(name, answer_by, suffix, statuses, tmp_path):
    model, of = str(tmp_path / "model.mps"), problem(name)
    cf.write(of, model)
    answers = {}
    for gap in GAPS:
        path = tmp_path / f"{gap}{suffix}"
        answer_by(model, gap, str(path))
        answers[gap] = read_solution(path, of)
        check_claim(answers[gap], name)
        check_stated_gap(path, of, gap, name)
    assert [answer.status for answer in answers.values()] == statuses
    if answer_by is not by_scip:
        assert answers[0.9].objective > 1.05 * OPTIMA[name]


def check_claim(answer, name):
    """A global optimum is one; what is open states the remedy."""
    if answer.status == GLOBAL:
        assert answer.objective == pytest.approx(OPTIMA[name], rel=1e-4)
    if answer.status in {IN_GAP, FEASIBLE}:
        assert answer.caveat
        assert answer.bound is None


def check_stated_gap(path, of, gap, name):
    """With the gap of the program, the answer has a bound below the optimum, which may close."""
    claimed = read_solution(path, of).claimed
    if claimed not in {GLOBAL, IN_GAP}:
        with pytest.raises(SolutionError, match="a gap proves nothing; --bound X states a dual bound"):
            read_solution(path, of, stated_gap=gap)
    else:
        stated = read_solution(path, of, stated_gap=gap)
        assert stated.status == (GLOBAL if gap < 0.9 else LIMIT)
        assert stated.bound is None or stated.bound <= OPTIMA[name] * (1 + 1e-6)
    bounded = read_solution(path, of, stated_bound=OPTIMA[name] * (1 - 5e-5))
    assert (bounded.status == GLOBAL) == (bounded.objective < OPTIMA[name] * 1.0001 and claimed != LIMIT)


@pytest.mark.parametrize("gap, status", [("0", GLOBAL), ("0.0001", GLOBAL), ("0.9", LIMIT)])
def test_highs_states_the_bound_since_1_16(gap, status):
    answer = read_solution(places.SOLUTIONS / "gaps" / f"highs-1.16.0_{gap}.sol", problem("mouse"))
    assert (answer.claimed, answer.status) == (IN_GAP, status)
    assert answer.bound <= OPTIMA["mouse"] * (1 + 1e-6)


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize(
    "solver, name",
    [
        pytest.param(program, name, marks=marks(program))
        for program, name in dict(way[:2] for way in WAYS).items()
    ],
)
def test_solve_knows_the_gap_that_it_gave(solver, name):
    for gap in GAPS:
        answer = cf.solve(problem(name), solver, limits=cf.Limits(60.0, gap, 1))
        assert answer.status == (GLOBAL if gap < 0.9 else LIMIT)
        assert answer.bound is None or answer.bound <= OPTIMA[name] * (1 + 1e-6)


@pytest.mark.slow
def test_bonmin_claims_a_local_optimum_at_any_gap(tmp_path):
    """Its file states no bound, and it is exact for convex problems only."""
    convex = cf.formulate(cf.sample("mouse", 3), "miqp-exact")
    for gap in (0.0, 0.9):
        folder = tmp_path / str(gap)
        answer = cf.solve(convex, "bonmin", folder=folder, limits=cf.Limits(60.0, gap, 1))
        (path,) = folder.glob("*.bonmin.sol")
        assert answer.status == read_solution(path, convex).status == "optimal-local"
        assert answer.bound is None
        with pytest.raises(SolutionError, match="a gap proves nothing"):
            read_solution(path, convex, stated_gap=gap)


def test_read_takes_the_gap_and_the_bound(tmp_path, capsys):
    folder = tmp_path / "files"
    (manifest,) = cf.write_all(problem("mouse").instance, folder, formulations=[MILP], formats=["mps"])
    (model,) = folder.glob("*.mps")
    answer = tmp_path / "answer.sol"
    by_highs(str(model), 0.9, str(answer))

    def status(*options):
        arguments = ["--manifest", str(manifest.path), "-o", str(tmp_path / "field.npz"), "--json"]
        code = invoke(["read", str(answer), *arguments, *options])
        printed = capsys.readouterr()
        return json.loads(printed.out) if code == 0 else printed.err

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
    by_highs(str(tmp_path / "model.mps"), 0.9, str(tmp_path / "answer.sol"))
    answer = read_solution(tmp_path / "answer.sol", relaxed)
    assert (answer.claimed, answer.status, answer.caveat) == (IN_GAP, GLOBAL, "")
    assert read_solution(tmp_path / "answer.sol", relaxed, stated_gap=0.9).status == GLOBAL


def test_highs_proves_nothing_about_a_problem_that_is_not_convex(tmp_path):
    """It may call a stationary point of a non-convex QP optimal."""
    products = cf.formulate(cf.sample("mouse", 3), "minlp-cubic", relax=True)
    held = cf.write(products, tmp_path / "model.mps").problem
    assert not held.is_convex
    point = held.point(cf.greedy_field(products.instance))
    objective = held.objective_value(point)
    lines = [f"{name} {value!r}" for name, value in zip(names(held), point.tolist(), strict=True)]
    text = f"Model status\nOptimal\n\n# Primal solution values\nFeasible\nObjective {objective!r}\n"
    (tmp_path / "answer.sol").write_text("\n".join([f"{text}# Columns {len(lines)}", *lines, "# Rows 0\n"]))
    assert read_solution(tmp_path / "answer.sol", products, identified=True).status == "optimal-local"
    with pytest.raises(SolutionError, match="a gap proves nothing"):
        read_solution(tmp_path / "answer.sol", products, identified=True, stated_gap=0.0)


def names(problem):
    return names_of(column_names(problem.instance, problem.blocks))


def test_the_page_of_words_is_the_table_of_the_code():
    table = (places.ROOT / "export" / "statuses.csv").read_bytes()
    assert (places.ROOT / "docs" / "files" / "claims.csv").read_bytes() == table


# nothing is unbounded


def test_an_unbounded_problem_is_a_contradiction(tmp_path):
    """HiGHS 1.15.1 calls this convex QP with columns between bounds unbounded."""
    rng, width = np.random.default_rng(12), 8
    count = int(rng.integers(1, 5))
    pixels = np.stack([np.zeros(count, int), np.sort(rng.choice(width, count, replace=False))], 1)
    strokes = np.ones((1, width), bool), pixels, rng.uniform(0, np.pi, count), rng.uniform(0.1, 1, count)
    instance = cf.Instance.on_pixels("row", *strokes, skew_coefficient=1e-3, gauge="strokes")
    relaxed = cf.formulate(instance, MILP, stroke_norm=1, beta_norm=2, relax=True)
    cf.write(relaxed, tmp_path / "model.mps")
    by_highs(str(tmp_path / "model.mps"), 0.0, str(tmp_path / "answer.sol"), time_limit=2.0)
    answer = read_solution(tmp_path / "answer.sol", relaxed, identified=True)
    assert answer.status != "unbounded"
    if highspy.Highs().version() == "1.15.1":
        assert (answer.claimed, answer.status) == ("unbounded", "unknown")
        assert answer.doubt == "claims unbounded, but every objective of crossfield is bounded below"


@pytest.mark.parametrize(
    "file", ["cplex-22.2.0.1_other_unbounded.sol", "baron-26.5.27_other_unbounded_res.lst"]
)
def test_an_unbounded_answer_of_any_program_is_unknown(file):
    answer = read_solution(places.SOLUTIONS / "tiny" / file, problem("mouse"), identified=True)
    assert (answer.claimed, answer.status) == ("unbounded", "unknown")
    assert "bounded below" in answer.doubt
