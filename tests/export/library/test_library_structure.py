"""Entries of matrices and Hessians, compared with CasADi on the written file."""

import re
import xml.etree.ElementTree as ET

import casadi as ca
import crossfield as cf
import numpy as np
from cases import CASES, make_instance, make_problem, problem_of
from crossfield.export.library.documents.statistics import problem_counts
from crossfield.export.library.site.study import hessian_blocks, hessian_pattern, jacobian_pattern
from crossfield.export.pictures.marks import FAMILIES, STROKE
from crossfield.export.pictures.sparsity import CELLS, MatrixParts, SparsityPattern, sparsity_picture
from crossfield.export.writing.canonical import CanonicalForm
from loops import for_each
from oracles import by_casadi

PLAIN = [label for label in CASES if not {"pinned", "relax", "shape"} & set(label.replace("=", " ").split())]
"""Every formulation in both gauges, both facets and both norms."""

SVG = "{http://www.w3.org/2000/svg}"


def differentiated(problem, path):
    """Jacobian and Hessian of the Lagrangian at a random place, as CasADi finds them, in our order."""
    cf.write(problem, path)
    model = by_casadi(path)
    x, f, g = (model.problem[key] for key in "xfg")
    weights = type(x).sym("weights", g.shape[0])
    second, _ = ca.hessian(f + ca.dot(weights, g), x)
    both = ca.Function("both", [x, weights], [ca.jacobian(g, x), second])
    rng = np.random.default_rng(4)
    found = both(rng.normal(size=x.shape[0]), rng.normal(size=g.shape[0]))
    jacobian, second = (np.array(ca.DM(part)) for part in found)
    layout = CanonicalForm(problem).nl_order
    starts = dict(zip(layout.rows, np.cumsum([0, *(family.count for family in layout.rows)]), strict=False))
    rows = [starts[family] + at for family in problem.rows for at in range(family.count)]
    return jacobian[rows][:, layout.place], second[layout.place][:, layout.place]


def dense(pattern):
    found = np.zeros((pattern.down.total, pattern.across.total), bool)
    found[pattern.rows, pattern.columns] = True
    return found


@for_each("label", PLAIN)
def test_the_patterns_are_where_derivatives_are(label, tmp_path):
    problem = problem_of(label)
    jacobian, second = differentiated(problem, tmp_path / "tiny.nl")
    assert (dense(jacobian_pattern(problem)) == (np.abs(jacobian) > 1e-12)).all()
    assert (dense(hessian_pattern(problem)) == (np.abs(second) > 1e-9)).all()


def test_blocks_are_the_columns_that_no_entry_joins():
    problem = make_problem("miqcp-bilinear", make_instance("parts"))
    held = dense(hessian_pattern(problem))
    joined = np.linalg.matrix_power(np.eye(len(held)) + held, len(held)) > 0
    sizes = sorted(
        len(set(rows)) for rows in {tuple(np.flatnonzero(row)) for row in joined[held.any(axis=1)]}
    )
    blocks = hessian_blocks(hessian_pattern(problem))
    assert blocks["average"] == sum(sizes) / len(sizes)
    assert (blocks["count"], blocks["least"], blocks["greatest"]) == (len(sizes), sizes[0], sizes[-1])
    assert problem_counts(problem)["nonlinear_variables"] == sum(sizes)


def cells_of(picture, pattern):
    """Cells drawn, by kind, and the names of parts."""
    root = ET.fromstring(picture)
    cell = 320 / max(-(-parts.total // pattern.bin) for parts in (pattern.down, pattern.across))
    drawn = dict.fromkeys(("linear", "curved"), 0)
    for kind, colour in zip(drawn, (FAMILIES[0], STROKE), strict=True):
        for path in root.findall(f"{SVG}path[@fill='{colour}']"):
            widths = np.array(re.findall(r"h(\d[\d.]*)v", path.get("d")), float) / cell
            drawn[kind] += int(np.round(widths).sum())
    return drawn, [each.text for each in root.iter(f"{SVG}text")]


def test_a_small_matrix_is_drawn_entry_by_entry_with_the_names_of_its_parts():
    problem = make_problem("miqcp-bilinear", make_instance())
    pattern = jacobian_pattern(problem)
    assert pattern.bin == 1
    drawn, names = cells_of(sparsity_picture(pattern), pattern)
    assert drawn == {"linear": int((~pattern.curved).sum()), "curved": int(pattern.curved.sum())}
    assert pattern.entries == problem_counts(problem)["nonzeros"]
    assert pattern.curved.sum() == problem_counts(problem)["nonlinear_nonzeros"]
    assert set(names) <= {*pattern.down.names, *pattern.across.names}
    assert "alpha" in names


def test_a_large_matrix_is_binned_and_its_picture_stays_small():
    side, rng = 200_000, np.random.default_rng(1)
    rows, columns = (np.sort(rng.integers(0, side, 1_000_000)) for _ in "ij")
    parts = MatrixParts(("one", "other"), (side // 2, side // 2))
    pattern = SparsityPattern(parts, parts, rows, columns, np.zeros(len(rows), bool))
    picture = sparsity_picture(pattern)
    drawn, names = cells_of(picture, pattern)
    assert CELLS <= drawn["linear"] <= CELLS**2
    assert drawn["curved"] == 0
    assert names == ["one", "other", "one", "other"]
    assert len(picture) < 50_000
    assert sparsity_picture(pattern) == picture
