"""Problems that are valid and nearly empty: no pair, no row, no column; every format holds them."""

import crossfield as cf
import numpy as np
import pytest
from crossfield.export.formats.registry import FORMATS
from crossfield.models.errors import UnsupportedByFormatError
from crossfield.models.formulations.catalogue import list_formulations

CORNERS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0.0]])
APART = cf.Mesh(np.concatenate([CORNERS, CORNERS + 5]), [[0, 1, 2], [3, 4, 5]])


def on_faces(mesh, *strokes, **more):
    return cf.Instance.on_faces("faces", mesh, *strokes or ([], [], []), **more)


def on_a_pixel(**more):
    return cf.Instance.on_pixels("pixel", [[True]], [[0, 0]], [0.3], [1.0], **more)


KINDS = {
    "one triangle": on_faces(cf.Mesh(CORNERS, [[0, 1, 2]])),
    "one triangle with a skew": on_faces(cf.Mesh(CORNERS, [[0, 1, 2]]), orthogonal=False),
    "two triangles apart": on_faces(APART),
    "two triangles apart, one stroke": on_faces(APART, [1], [0.3], [1.0]),
    "a pixel": on_a_pixel(),
    "an orthogonal pixel": on_a_pixel(orthogonal=True),
    "an orthogonal pixel of weight 0": on_a_pixel(orthogonal=True, stroke_coefficient=0.0),
    "a pixel of weight 0 in a box": on_a_pixel(stroke_coefficient=0.0, gauge="box"),
}


@pytest.mark.parametrize("kind", KINDS)
def test_every_formulation_is_written_in_every_format(kind, tmp_path):
    """Energies of so few terms can be 0, and the field of the greedy search has that energy."""
    field = cf.greedy_field(KINDS[kind])
    written = set()
    for name in list_formulations(KINDS[kind]):
        problem = cf.formulate(KINDS[kind], name, p=field.p if name == "qp-fixed" else None)
        point = problem.point(field)
        assert problem.violation(point).worst < 1e-9
        assert problem.objective_value(point) == pytest.approx(0.0, abs=1e-9)
        for form in FORMATS.values():
            try:
                cf.write(problem, tmp_path / f"{name}{form.suffix}")
                written.add(form.suffix)
            except UnsupportedByFormatError:
                assert form.suffix != ".nl"
    assert written == {form.suffix for form in FORMATS.values()}


def test_a_problem_without_columns_is_solved():
    problem = cf.formulate(KINDS["one triangle"], "miqp-cycle")
    assert problem.n_columns == 0
    solution = cf.solve(problem, limits=cf.Limits(5.0))
    assert solution.objective == 0
    assert solution.field.energy().total == 0
