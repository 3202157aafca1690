"""The ledger: records that count, and reports of those that do not."""

from dataclasses import replace

import pytest
from crossfield.export.cli.app import invoke
from crossfield.export.library.documents.documents import read_library
from crossfield.export.library.ledger.known_points import read_points
from crossfield.export.library.ledger.ledger import Record, read_ledger, write_ledger
from crossfield.export.library.ledger.points import complete_point
from crossfield.export.library.plan.instances import make_instance
from crossfield.export.library.plan.recipe import plan_library
from crossfield.export.library.plan.spec import default_spec
from crossfield.models.formulations.catalogue import FORMULATIONS
from crossfield.models.formulations.problem import formulate
from libraries import HEAD

SPEC = """formulations = ["qp-fixed"]
ledger = "ledger.json"

[rungs.tiny]
sizes = [3]
formats = ["lp"]

[[sketches]]
name = "wave"
sample = "wave_sheet"
sizes = { tiny = [6] }
"""


@pytest.mark.usefixtures("short_searches")
@pytest.mark.parametrize("sha256, reported", [(None, False), ("0" * 64, True)])
def test_a_build_reports_records_that_do_not_count(tmp_path, capsys, sha256, reported):
    (tmp_path / "spec.toml").write_text(HEAD + SPEC)
    command = ["library", "build", str(tmp_path / "spec.toml"), "-o", str(tmp_path / "out"), "--quiet"]
    write_ledger(read_ledger(tmp_path))
    assert invoke(command) == 0
    (sidecar,) = read_library(tmp_path / "out").entries
    record = Record(sidecar["name"], sha256 or sidecar["problem_sha256"], "HiGHS", "1", "limit")
    write_ledger(replace(read_ledger(tmp_path), records=(record,)))
    assert invoke(command) == 0
    errors = capsys.readouterr().err
    assert (
        f"records of 1 entries do not count, for their problems have changed since: {record.entry}" in errors
    ) == reported


@pytest.mark.slow
def test_every_shipped_record_counts_and_contradicts_nothing():
    """Each record is about a problem of today, its bound lies below its point, and its field is as stated."""
    spec = default_spec()
    ledger, points = read_ledger(spec.ledger.parent, spec.ledger.name), read_points(spec.points)
    recipes = {
        entry.name: (planned.recipe, entry) for planned in plan_library(spec) for entry in planned.entries
    }
    instances = {}
    for record in ledger.records:
        recipe, entry = recipes[record.entry]
        instance = instances.setdefault(recipe.name, make_instance(recipe))
        declared = FORMULATIONS[entry.formulation]
        options = {"facet": entry.facet} if "facet" in declared.option_names else {}
        if declared.fixed:
            options["p"] = points(recipe.name).field("baseline").field.p
        problem = formulate(instance, entry.formulation, **options)
        assert problem.sha256 == record.problem_sha256, record.entry
        assert record.bound is None or record.bound <= record.primal * (1 + 1e-6) + 1e-9
        if record.point is not None:
            point = complete_point(problem, ledger.read_field(record))
            assert problem.violation(point).worst <= 1e-12
            assert problem.objective_value(point) == pytest.approx(record.primal, rel=1e-12)
    named = {record.point for record in ledger.records if record.point is not None}
    assert {path.name for path in spec.ledger.parent.iterdir()} == named | {"ledger.json", "points"}
