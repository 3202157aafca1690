"""The page of proofs equals its command's output for the measured rows, which agree with it."""

from __future__ import annotations

import places
import pytest


@pytest.fixture(scope="module")
def proofs(docs_module):
    """The program that makes the page."""
    return docs_module("proofs")


def test_the_page_is_made_from_the_rows_beside_it(proofs):
    assert (places.ROOT / "docs" / "proofs.md").read_text() == proofs.page(proofs.read())


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
        for what in ("cold", "tightened") if row["formulation"] == "miqp-exact" else ():
            found, bound = row[what]["objective"], row[what]["bound"]
            assert found is None or found >= row["proof"] - proofs.WITHIN, (name, what)
            assert bound is None or bound <= row["energy"] + proofs.WITHIN, (name, what)


def test_layers_of_a_drawing_are_named_by_it_and_masks_by_their_layer(docs_module, proofs, tmp_path):
    public = docs_module("public_drawings")
    root = tmp_path / "emmanueliarussi.github.io" / "papers" / "supplemental_material" / "Sketches"
    layers = ("bag/input_layers/l1", "bag/input_layers/l1_mask", "bag/normals/normals_l1")
    whole = ("jug/clean/input_layers/input_all", "jug/clean/input_layers/mask_all")
    for path in (f"{each}.png" for each in (*layers, *whole)):
        (root / path).parent.mkdir(parents=True, exist_ok=True)
        (root / path).write_text(path)
    public.collect(tmp_path, tmp_path / "drawings")
    folder = tmp_path / "drawings" / "BendFields"
    assert {path.name: path.read_text() for path in folder.iterdir()} == {
        "bag_l1.png": "bag/input_layers/l1.png",
        "bag_l1_mask.png": "bag/input_layers/l1_mask.png",
        "jug_all.png": "jug/clean/input_layers/input_all.png",
        "jug_all_mask.png": "jug/clean/input_layers/mask_all.png",
    }
    (drawing, other) = proofs.drawings_of(folder)
    assert (drawing.name, drawing.mask) == ("bag_l1.png", folder / "bag_l1_mask.png")
    assert other.mask == folder / "jug_all_mask.png"
