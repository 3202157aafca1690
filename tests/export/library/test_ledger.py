"""The ledger: records that count, and reports of those that do not."""

from dataclasses import replace

import pytest
from crossfield.export.cli.app import invoke
from crossfield.export.library.documents.documents import read_library
from crossfield.export.library.ledger.given import read_points
from crossfield.export.library.ledger.ledger import Record, read_ledger, write_ledger
from crossfield.export.library.plan.recipe import plan
from crossfield.export.library.plan.sources import instance_from
from crossfield.export.library.plan.spec import default_spec
from crossfield.models.formulations.catalogue import FORMULATIONS
from crossfield.models.formulations.problem import formulate

SPEC = """format = "crossfield-library-spec"
version = 1
title = "a library for tests"
formulations = ["qp-fixed"]
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
    (tmp_path / "spec.toml").write_text(SPEC)
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


def test_every_record_that_ships_counts():
    spec = default_spec()
    ledger = read_ledger(spec.ledger.parent, spec.ledger.name)
    points = read_points(spec.points)
    shas = {record.entry: record.problem_sha256 for record in ledger.records}
    counted = 0
    for each in plan(spec):
        recorded = [entry for entry in each.entries if entry.name in shas]
        instance = instance_from(each.recipe) if recorded else None
        for entry in recorded:
            recipe = FORMULATIONS[entry.formulation]
            options = {"facet": entry.facet} if "facet" in recipe.settable else {}
            if recipe.fixed:
                options["p"] = points(each.recipe.name).field("baseline").field.p
            assert formulate(instance, entry.formulation, **options).sha256 == shas[entry.name], entry.name
            counted += 1
    assert counted == len(shas) > 50
