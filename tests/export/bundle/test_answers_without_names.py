"""Reading back by the manifest: lifting and the order of columns come from it."""

from __future__ import annotations

import json

import numpy as np
import pytest
from cases import make_field, make_instance, make_problem
from crossfield.export.bundle.manifest import read_manifest
from crossfield.export.bundle.problem_files import write_problem
from crossfield.export.solutions.solution import read_solution
from crossfield.export.writing.canonical import CanonicalForm
from crossfield.models.errors import InstanceError, SolutionError


def raw_of_glpk(path, form, file, point):
    """A file as from `glpsol -w` for an LP or MPS file: values in the order of its columns, no names."""
    values = np.append(point, 1.0)[form.order(file)]
    rows = [f"i {place + 1} 0" for place in range(form.row_count(file))]
    columns = [f"j {place + 1} {value!r}" for place, value in enumerate(values.tolist())]
    name = f"{form.problem.instance.name}_{form.problem.stamp}" if file == "mps" else ""
    head = [f"c Problem:    {name}", f"c Objective:  obj_{form.problem.stamp} = 0 (MINimum)"]
    sizes = f"s mip {len(rows)} {len(columns)} f 0"
    path.write_text("\n".join([*head, sizes, *rows, *columns, "e o f", ""]))
    return path


def test_values_without_names_follow_the_file_that_the_manifest_lists(tmp_path):
    problem = make_problem("minlp-cubic", make_instance())
    manifest = read_manifest(write_problem(problem, tmp_path).path)
    held = manifest.problems_by_format(problem)
    assert {name: form.sha256 == problem.sha256 for name, form in held.items()} == {
        "nl": True, "gms": True, "lp": False, "mps": False,
    }  # fmt: skip
    point = problem.lifted.point(make_field(problem.instance))
    for file in ("lp", "mps"):
        path = raw_of_glpk(tmp_path / "x.sol", CanonicalForm(problem.lifted), file, point)
        for solution in (read_solution(path, problem, held=held), read_solution(path, problem)):
            np.testing.assert_array_equal(solution.point, point)
        with pytest.raises(SolutionError, match="the problem has"):
            read_solution(path, problem, held={file: problem})


def test_values_without_names_of_a_file_that_cannot_hold_the_problem_are_refused(tmp_path):
    problem = make_problem("milp-mccormick", make_instance())
    path = raw_of_glpk(
        tmp_path / "x.sol", CanonicalForm(problem), "lp", problem.point(make_field(problem.instance))
    )
    parity = make_problem("minlp-parity", problem.instance)
    path.write_text(path.read_text().replace(problem.stamp, parity.stamp))
    with pytest.raises(SolutionError, match="lp holds nothing beyond quadratic"):
        read_solution(path, parity)


def test_columns_in_another_order_than_the_manifest_lists_are_refused(tmp_path):
    manifest = write_problem(make_problem("milp-mccormick", make_instance()), tmp_path)
    document = json.loads(manifest.path.read_text())
    document["columns"].reverse()
    manifest.path.write_text(json.dumps(document))
    with pytest.raises(InstanceError, match="columns in another order"):
        read_manifest(manifest.path).problem()
