"""Files that their own program runs: AMPL models by GLPK, .bar by BARON, GAMS; and the types of QPLIB."""

import importlib.util
import re
import subprocess
from dataclasses import replace
from pathlib import Path

import crossfield as cf
import numpy as np
import pytest
from ampl_by_glpk import glpsol
from instance_kinds import grid, kind


@pytest.mark.needs("glpk")
def test_an_answer_of_the_ampl_model_is_read_back(tmp_path):
    """With the lines that the model holds as comments; numbers of pixels and of faces are names."""
    for number, name in enumerate(("square", "tetrahedron-skewed")):
        problem = cf.formulate(kind(name), "milp-mccormick")
        model, answer = tmp_path / f"{number}.mod", tmp_path / f"{number}.sol"
        cf.write(problem, model)
        text = model.read_text()
        printed = text[text.index("# printf") :].replace("# printf", "printf")
        solved = f"{text}\nsolve;\n{printed.replace('this.sol', str(answer))}end;\n"
        (tmp_path / "solved.mod").write_text(solved)
        out = glpsol("-m", tmp_path / "solved.mod", "-d", model.with_suffix(".dat"))
        assert "INTEGER OPTIMAL SOLUTION FOUND" in out
        solution = cf.read_solution(answer, problem)
        (claim,) = re.findall(r"^=obj= (\S+)$", answer.read_text(), re.MULTILINE)
        assert solution.violation.worst < 1e-6
        assert solution.objective == pytest.approx(float(claim), abs=1e-9)


QUARTIC = pytest.param("minlp-quartic", 2, marks=pytest.mark.slow)


@pytest.mark.needs("baron")
@pytest.mark.parametrize("formulation, width", [QUARTIC, ("miqcp-bilinear", 2), ("milp-mccormick", 1)])
def test_baron_solves_its_file_to_the_optimum(formulation, width, tmp_path):
    """Its free edition takes 10 columns and 10 rows: two pixels at most."""
    window = {"stroke_coefficient": 1.0, "skew_coefficient": 1e-2, "gauge": "box"}
    # No field follows both strokes without loss.
    problem = cf.formulate(grid("/" * width, [2.2, 1.3], [1.0, 0.7], **window), formulation)
    cf.write(problem, tmp_path / "model.bar")
    program = Path(*importlib.util.find_spec("gamspy_baron").submodule_search_locations, "baron")
    command = [program, "model.bar"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert "Normal completion" in done.stdout, done.stdout
    solution = cf.read_solution(tmp_path / "res.lst", problem)
    assert (solution.identified, solution.unknown) == (True, 0)
    assert solution.violation.worst < 1e-5
    heavier = replace(problem, instance=replace(problem.instance, stroke_coefficient=1.0000001))
    with pytest.raises(cf.SolutionError, match=r"res\.lst: is of another problem"):
        cf.read_solution(tmp_path / "res.lst", heavier)
    optimum = cf.solve(problem, "scip", limits=cf.Limits(60.0)).objective
    assert solution.objective == pytest.approx(optimum, rel=2e-4, abs=1e-6)


TYPES = {
    "minlp-quartic": "CGL", "minlp-cubic": "QGL", "miqcp-bilinear": "CGQ", "miqcp-bilinear-l1": "LGQ",
    "miqp-mccormick": "CGL", "milp-mccormick": "LGL", "qp-fixed": "CCB", "miqp-exact": "CGL",
}  # fmt: skip


@pytest.mark.parametrize("formulation", TYPES)
def test_every_formulation_has_its_type_of_qplib(formulation, tmp_path):
    jumps = {"p": cf.greedy_field(kind("full")).p} if formulation == "qp-fixed" else {}
    cf.write(cf.formulate(kind("full"), formulation, **jumps), tmp_path / "x.qplib")
    assert (tmp_path / "x.qplib").read_text().split("\n")[1][:3] == TYPES[formulation]


@pytest.mark.needs("gams")
def test_a_start_comes_back_under_our_names(tmp_path):
    """CONVERT solves nothing, so the results are the start; one pixel has a column in no term."""
    field = cf.greedy_field(kind("parts"))
    problem = cf.formulate(field.instance, "milp-mccormick")
    cf.write(problem, tmp_path / "x.gms", start=field)
    program = Path(importlib.util.find_spec("gamspy_base").origin).parent / "gams"
    command = [program, "x.gms", "lo=0", "--RESULTS=a result.csv", "lp=convert", "mip=convert"]
    subprocess.run(command, cwd=tmp_path, check=True, capture_output=True)
    lines = (line.split(",") for line in (tmp_path / "a result.csv").read_text().splitlines())
    facts = dict(lines)
    assert list(facts)[:4] == ["model_status", "solver_status", "problem", "objective"]
    assert list(facts)[4:] == problem.to_arrays().column_names.tolist()
    values = np.array([float(facts[name]) for name in list(facts)[3:]])
    expected = [problem.objective_value(problem.point(field)), *problem.point(field)]
    np.testing.assert_allclose(values, expected, rtol=1e-14, atol=0)
