"""The table of entries as data that tools load: CSV and Croissant metadata."""

import csv
import hashlib
import io
import json
from dataclasses import replace

import pytest
from crossfield.export.library.building.build import build
from crossfield.export.library.building.dataset import CROISSANT, croissant
from crossfield.export.library.building.table import COLUMNS, TABLE, parse_table
from crossfield.export.library.plan.spec import default_spec, read_spec

SPEC = """format = "crossfield-library-spec"
version = 1
title = "Data for tests"
formulations = ["exact", "qp"]

[release]
version = "1.0"
date = "2026-11-22"
authors = ["A. Name"]

[rungs.tiny]
sizes = [3]
formats = ["mps"]

[[sketches]]
name = "fam"
random = "full"
seeds = [1, 2]
points = "greedy"
license = "CC-BY-4.0"
split = { train = [1], test = [2] }
"""


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """A library with its table; not to be changed."""
    folder = tmp_path_factory.mktemp("data")
    (folder / "spec.toml").write_text(SPEC)
    return build(read_spec(folder / "spec.toml"), folder / "library")


def test_the_table_has_features_labels_and_the_split(built):
    rows = list(csv.DictReader(io.StringIO((built.folder / TABLE).read_text())))
    assert [row["name"] for row in rows] == built.document["entries"]
    assert [row["split"] for row in rows] == ["train", "train", "test", "test"]
    assert {row["optimum"] != "" for row in rows if row["formulation"] == "qp-fixed"} == {True}
    assert {row["convex"] for row in rows} == {"true"}


def test_a_table_is_read_as_it_was_written(built):
    data = (built.folder / TABLE).read_bytes()
    for row, sidecar in zip(parse_table(data), built.entries, strict=True):
        assert {key for key, value in row.items() if value is not None} <= COLUMNS.keys()
        assert row["objective"] == sidecar["best"]["objective"]
        assert (row["seed"], row["bound"]) == (sidecar["source"]["seed"], sidecar["bound"])
        for name, column in COLUMNS.items():
            assert row[name] is None or type(row[name]) is column.kind


def test_the_metadata_describe_the_table(built):
    document = json.loads((built.folder / CROISSANT).read_text())
    (file,) = document["distribution"]
    (records,) = document["recordSet"]
    assert document["conformsTo"] == "http://mlcommons.org/croissant/1.1"
    assert document["datePublished"] == "2026-11-22"
    assert document["license"] == ["https://spdx.org/licenses/CC-BY-4.0.html"]
    assert file["sha256"] == hashlib.sha256((built.folder / TABLE).read_bytes()).hexdigest()
    assert [each["source"]["extract"]["column"] for each in records["field"]] == list(COLUMNS)


def test_a_library_without_a_release_states_no_version():
    document = json.loads(croissant(replace(default_spec(), release=None), b""))
    assert not document.keys() & {"version", "datePublished", "creator"}


@pytest.mark.needs("mlcroissant")
@pytest.mark.filterwarnings("ignore")
def test_mlcroissant_validates_and_loads_the_table(built):
    import mlcroissant

    found = mlcroissant.Dataset(built.folder / CROISSANT)
    assert (found.metadata.issues.errors, found.metadata.issues.warnings) == (set(), set())
    wanted = parse_table((built.folder / TABLE).read_bytes())
    for record, row in zip(found.records("entries"), wanted, strict=True):
        plain = {
            key.removeprefix("entries/"): value.decode() if isinstance(value, bytes) else value
            for key, value in record.items()
        }
        assert plain == row
