"""Answers of one problem read as answers of another: no claim is passed on.

The problems have the same columns and rows; they differ in a bound, a weight, the gauge, the facet or a norm.
"""

import importlib.util
import re
import subprocess
from dataclasses import replace
from pathlib import Path

import crossfield as cf
import highspy
import numpy as np
import pytest
from answers import FILES, GOOD, problem_of
from answers import problem as tiny
from crossfield.export.cli.app import invoke
from crossfield.export.solutions.readers.ampl import write_ampl_sol
from crossfield.export.solutions.readers.registry import read_raw
from crossfield.export.solutions.solution import read_solution
from crossfield.export.solving.local import SolveFiles, Solvers
from crossfield.export.writing.nl_order import NlOrder
from crossfield.models.errors import SolutionError
from crossfield.models.formulations.problem import formulate, with_windows
from crossfield.models.formulations.windows import Windows
from crossfield.models.processes.deadline import Deadline

MILP = "milp-mccormick"
KEPT = {"optimal-global", "optimal-in-gap", "optimal-local", "infeasible", "unbounded"}


def instance_of(**facts):
    values = {"theta": [0.2, 1.6, 2.6], "w": [1.0, 0.75, 0.5], "gauge": "strokes", **facts}
    strokes = np.array([[0, 0], [0, 1], [1, 1]])
    return cf.Instance.on_pixels(
        "two", np.ones((2, 2), bool), strokes, np.array(values["theta"]), np.array(values["w"]),
        stroke_coefficient=1.5, skew_coefficient=1e-3, gauge=values["gauge"],
    )  # fmt: skip


def with_another_bound(problem):
    """The problem with the upper bound of one alpha a little lower."""
    instance = problem.instance
    quarter = np.full(instance.grid.size, np.pi / 4)
    upper = instance.alpha_upper - np.array([0, 0, 1e-3, 0])
    ends = (instance.alpha_lower, upper, -quarter, quarter, instance.p_min, instance.p_max)
    return with_windows(problem, Windows(*ends, energy=9.0, proof="by hand", norm=1))


@pytest.fixture(scope="module")
def solved():
    return formulate(instance_of(), MILP)


OTHERS = {
    "bound": lambda: with_another_bound(formulate(instance_of(), MILP)),
    "weight": lambda: formulate(instance_of(w=[1.0, 0.75, 0.5000001]), MILP),
    "gauge": lambda: formulate(instance_of(gauge="box"), MILP),
    "facet": lambda: formulate(instance_of(), MILP, facet="printed"),
    "norm": lambda: formulate(instance_of(), MILP, stroke_norm=2),
    "relaxation": lambda: formulate(instance_of(), MILP, relax=True),
}


def highs_loaded(model):
    highs = highspy.Highs()
    highs.setOptionValue("output_flag", False)
    highs.readModel(str(model))
    return highs


def by_highs(model, answer, style):
    highs = highs_loaded(model)
    highs.run()
    highs.writeSolution(str(answer), style)


def by(solver):
    """A function that has a solver of the table answer a model file."""

    def write_answer(model, answer):
        files = SolveFiles.for_model(model, solver)._replace(solution=answer)
        with Solvers() as solvers:
            solvers.solve_file(
                formulate(instance_of(), MILP), solver, files, cf.Limits(60.0), Deadline.after(120.0)
            )

    return write_answer


def by_ampl_library(model, answer):
    """The AMPL Solver Library repeats the options of a real .nl; the values are those of HiGHS."""
    subprocess.run(["gjh_asl_json", "-s", str(model.with_suffix(""))], check=True, capture_output=True)
    options = re.search(r"Options\n(4\n1\n1\n0\n\d+\n)", model.with_suffix(".sol").read_text())[1]
    problem = formulate(instance_of(), MILP)
    mps = model.with_suffix(".mps")
    cf.write(problem, mps)
    by_highs(mps, answer, 0)
    point = read_solution(answer, problem).point
    answer.unlink()
    write_ampl_sol(answer, "optimal solution found", point[NlOrder(problem).order], problem.n_rows, 0)
    answer.write_text(re.sub(r"(?<=Options\n)3\n1\n1\n0\n", options, answer.read_text()))


TABLE = {"highs": "mps", "scip": "lp mps osil", "cbc": "lp mps", "glpk": "lp mps", "gurobi": "lp mps"}
TABLE |= {"cplex": "lp mps", "xpress": "mps"}
WRITERS = [
    *((by(solver), suffix, solver) for solver, suffixes in TABLE.items() for suffix in suffixes.split()),
    (lambda model, answer: by_highs(model, answer, 4), "lp", "highs"),  # without columns at 0
    (by_ampl_library, "nl", "asl"),
]


@pytest.mark.parametrize(
    "write_answer, model",
    [pytest.param(*ways, marks=pytest.mark.needs(program)) for *ways, program in WRITERS],
)
@pytest.mark.filterwarnings("ignore")
def test_an_answer_proves_nothing_about_another_problem(write_answer, model, solved, tmp_path):
    files = tmp_path / f"model.{model}", tmp_path / "answer.sol"
    cf.write(solved, files[0])
    write_answer(*files)
    solution = read_solution(files[1], solved)
    assert solution.identified
    assert solution.status in {solution.claimed, "feasible"}
    assert not solution.caveat.startswith("not kept")
    for name, other in OTHERS.items():
        with pytest.raises(SolutionError, match=r"answer\.\w+: is of another problem: it states"):
            pytest.fail(f"{name}: {read_solution(files[1], other())}")


@pytest.mark.needs("baron")
def test_baron_repeats_the_stamp(tmp_path):
    """Its free size takes ten columns: two pixels."""
    package = importlib.util.find_spec("gamspy_baron")
    problem = tiny("pair")
    cf.write(problem, tmp_path / "model.bar")
    program = Path(package.submodule_search_locations[0]) / "baron"
    subprocess.run([program, "model.bar"], cwd=tmp_path, capture_output=True, check=False)
    solution = read_solution(tmp_path / "res.lst", problem)
    assert (solution.identified, solution.status, solution.unknown) == (True, "optimal-global", 0)
    heavier = replace(problem.instance, stroke_coefficient=1.5000001)
    with pytest.raises(SolutionError, match=r"res\.lst: is of another problem"):
        read_solution(tmp_path / "res.lst", formulate(heavier, problem.name))


def test_files_of_solvers_without_a_stamp_keep_no_claim():
    """Every file of a real solver in the collection that states no problem, of the right one and another."""
    for path in GOOD:
        name = problem_of(path) or "milp"
        if read_raw(path).stamps:
            continue
        other = tiny(name).instance
        changed = replace(other, stroke_coefficient=other.stroke_coefficient + 1e-7)
        for problem in (tiny(name), formulate(changed, tiny(name).name, p=tiny(name).jumps)):
            try:
                solution = read_solution(path, problem)
            except SolutionError:
                assert problem_of(path) is None
                continue
            assert solution.claimed == FILES[path.name][1]
            assert solution.status not in KEPT
            assert (solution.bound, solution.gap) == (None, None)


def test_names_of_a_transformed_problem_carry_the_stamp(solved, tmp_path):
    """SCIP prefixes the names of its presolved problem with `t_`."""
    cf.write(solved, tmp_path / "model.mps")
    by_highs(tmp_path / "model.mps", tmp_path / "answer.sol", 0)
    text = re.sub(r"(?m)^(\w+_\w+) (?=\S+$)", r"t_\1 ", (tmp_path / "answer.sol").read_text())
    (tmp_path / "answer.sol").write_text(text)
    assert "t_ONE_" in text
    assert read_solution(tmp_path / "answer.sol", solved).status == "optimal-in-gap"
    with pytest.raises(SolutionError, match="is of another problem"):
        read_solution(tmp_path / "answer.sol", OTHERS["weight"]())


def test_the_column_fixed_to_1_has_the_value_1(solved, tmp_path):
    """Otherwise the values belong to other names, as in a list that is shifted by a line."""
    cf.write(solved, tmp_path / "model.mps")
    by_highs(tmp_path / "model.mps", tmp_path / "answer.sol", 0)
    text = re.sub(r"(ONE_\w+) 1\n", r"\1 0.5\n", (tmp_path / "answer.sol").read_text())
    (tmp_path / "answer.sol").write_text(text)
    with pytest.raises(SolutionError, match=r"ONE_\w+ has the value 0\.5, but it is fixed to 1"):
        read_solution(tmp_path / "answer.sol", solved)


def test_read_passes_on_no_proof_of_another_gauge(tmp_path, capsys):
    """The optimum with the gauge `box` is 2.93, and 0.699 with the other: nothing else differs."""
    for gauge in ("box", "strokes"):
        instance = str(tmp_path / f"{gauge}.json")
        assert invoke(["instance", "skew", "--size", "4", "--gauge", gauge, "-o", instance]) == 0
        assert invoke(["export", instance, "-f", MILP, "-F", "mps", "-o", str(tmp_path / gauge), "-q"]) == 0
    (model,) = (tmp_path / "box").glob("*.mps")
    by_highs(model, tmp_path / "answer.sol", 0)
    capsys.readouterr()

    def read(gauge):
        (manifest,) = (tmp_path / gauge).glob("*.manifest.json")
        field = tmp_path / f"{gauge}.npz"
        arguments = [str(tmp_path / "answer.sol"), "--manifest", str(manifest), "-o", str(field), "--json"]
        return invoke(["read", *arguments]), field.exists(), capsys.readouterr()

    code, written, printed = read("strokes")
    assert (code, written, printed.out) == (1, False, "")
    assert "answer.sol: is of another problem" in printed.err
    code, written, printed = read("box")
    assert (code, written) == (0, True)
    assert '"status": "optimal-in-gap"' in printed.out
