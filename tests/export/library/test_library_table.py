"""The table of entries: features and labels as CSV."""

import csv
import io

import pytest
from crossfield.export.library.building.table import COLUMNS, TABLE, parse_table
from libraries import library_of

SPEC = """formulations = ["exact", "qp"]
[rungs.tiny]
sizes = [3]
formats = ["mps"]
[[sketches]]
name = "fam"
random = "full"
seeds = [1, 2]
points = "greedy"
"""


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """A library with its table; not to be changed."""
    return library_of(tmp_path_factory.mktemp("data"), SPEC)


def test_the_table_has_features_and_labels(built):
    rows = list(csv.DictReader(io.StringIO((built.folder / TABLE).read_text())))
    assert [row["name"] for row in rows] == built.document["entries"]
    assert [row["seed"] for row in rows] == ["1", "1", "2", "2"]
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
