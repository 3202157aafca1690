"""The page of proofs equals its command's output for the measured rows, which agree with it."""

from __future__ import annotations

import places
import pytest


@pytest.fixture(scope="module")
def proofs(docs_module):
    """The program that makes the page."""
    return docs_module("proofs")


def test_the_page_and_its_tables_are_made_from_the_rows_beside_it(proofs):
    for path, text in proofs.files(proofs.read()).items():
        assert (places.ROOT / "docs" / path).read_text(encoding="utf-8") == text, path


def test_no_bound_is_above_an_energy_and_every_optimum_is_that_of_other_solvers(proofs):
    kept = proofs.read()
    for part in ("samples", "fine", "sketches", "collections", "optima"):
        for name, row in kept.get(part, {}).items():
            assert row["bound"] <= row["energy"] * (1 + 1e-12), (part, name)
    known = {name: row for name, row in kept["optima"].items() if row["other"] is not None}
    assert len(known) >= 8
    assert {name for name, row in known.items() if proofs.difference(row) > proofs.AGREE} == set()


def test_no_solver_contradicts_what_is_proven(proofs):
    for name, row in proofs.read()["solvers"].items():
        for windows in ("cold", "tightened") if row["formulation"] == "miqp-exact" else ():
            objective, bound = row[windows]["objective"], row[windows]["bound"]
            assert objective is None or objective >= row["proof"] - proofs.WITHIN, (name, windows)
            assert bound is None or bound <= row["energy"] + proofs.WITHIN, (name, windows)
