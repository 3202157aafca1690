"""Arrays of a problem against HiGHS' reading of its file, and against its values at random points."""

from dataclasses import replace

import numpy as np
import pytest
from cases import CASES, make_field, make_instance, make_problem, points_of, problem_of
from crossfield.export.formats.registry import write
from crossfield.models.errors import SolverError, UnsupportedBySolverError
from crossfield.models.formulations.arrays import build_highs
from loops import for_each
from scipy import sparse

highspy = pytest.importorskip("highspy")

HIGHS_TAKES = {"LP", "MILP", "QP"}


def read(path):
    """The model that HiGHS reads from a file, without the column ONE."""
    highs = highspy.Highs()
    highs.setOptionValue("output_flag", False)
    assert highs.readModel(str(path)) == highspy.HighsStatus.kOk
    return highs.getLp(), highs.getModel().hessian_


def matrix_of(lp):
    parts = (lp.a_matrix_.value_, lp.a_matrix_.index_, lp.a_matrix_.start_)
    return sparse.csc_array(tuple(map(np.array, parts)), shape=(lp.num_row_, lp.num_col_)).tocsr()


def hessian_of(triangle, columns):
    if not triangle.dim_:
        return sparse.csr_array((columns, columns))
    parts = tuple(map(np.array, (triangle.value_, triangle.index_, triangle.start_)))
    half = sparse.csc_array(parts, shape=(triangle.dim_, triangle.dim_))
    full = half + half.T - sparse.diags_array(half.diagonal())
    return full.tocsr()[:columns, :columns]


@for_each("label", CASES)
def test_arrays_are_what_highs_reads_from_the_file(label, tmp_path):
    problem = problem_of(label)
    if problem.row_degree > 1 or problem.objective_degree > 2:
        return  # HiGHS reads no quadratic rows, and MPS holds no more than that
    write(problem, tmp_path / "model.mps")
    lp, hessian = read(tmp_path / "model.mps")
    arrays = problem.to_arrays()
    n, m = problem.n_columns, problem.n_rows
    assert lp.col_names_[:n] == arrays.column_names.tolist()
    assert lp.row_names_[:m] == arrays.row_names.tolist()
    for name, theirs in (
        ("c", lp.col_cost_), ("lower", lp.col_lower_), ("upper", lp.col_upper_),
        ("row_lower", lp.row_lower_), ("row_upper", lp.row_upper_),
    ):  # fmt: skip
        ours = getattr(arrays, name)
        np.testing.assert_array_equal(ours, np.array(theirs)[: len(ours)], err_msg=name)
    assert arrays.constant == (lp.col_cost_[n] if lp.num_col_ > n else 0)
    whole = [kind == highspy.HighsVarType.kInteger for kind in lp.integrality_] or [False] * n
    assert arrays.integer.tolist() == whole[:n]
    assert abs(matrix_of(lp)[:m, :n] - arrays.a).nnz == 0
    assert abs(hessian_of(hessian, n) - arrays.q).nnz == 0
    assert arrays.nonlinear == ()


@for_each("label", CASES)
def test_values_at_random_points_are_those_of_the_problem(label):
    problem = problem_of(label)
    arrays = problem.to_arrays(names=False)
    assert arrays.column_names is None
    assert arrays.row_names is None
    held = [family for family in problem.objective if family.family.tag not in arrays.nonlinear]
    for point in points_of(problem, 5):
        value = sum(float(np.sum(family.values(point))) for family in held)
        assert arrays.objective_value(point) == pytest.approx(value, rel=1e-9, abs=1e-9)
        if not arrays.nonlinear:
            assert value == pytest.approx(problem.objective_value(point), rel=1e-12)
        rows = arrays.activities(point)
        for family in problem.rows:
            at = arrays.family_rows[family.family.tag]
            if family.family.tag in arrays.nonlinear:
                assert np.isinf([arrays.row_lower[at], arrays.row_upper[at]]).all()
                continue
            excess = np.maximum(arrays.row_lower[at] - rows[at], rows[at] - arrays.row_upper[at])
            ours = family.excess(point)
            broken = ours > 0
            np.testing.assert_allclose(excess[broken], ours[broken], rtol=1e-9, atol=1e-9)
            assert (excess[~broken] <= 1e-9).all()


def test_what_is_beyond_degree_2_is_named():
    instance = make_instance("full")
    parity, quartic = (make_problem(name, instance) for name in ("minlp-parity", "minlp-quartic"))
    assert parity.to_arrays().nonlinear
    assert quartic.to_arrays().nonlinear
    assert not make_problem("miqcp-bilinear", instance).to_arrays().nonlinear
    assert len(make_problem("miqcp-bilinear", instance).to_arrays().row_products) > 0


@pytest.mark.parametrize("name", ["minlp-parity", "miqcp-bilinear", "miqp-exact"])
def test_highs_is_not_given_what_it_does_not_take(name):
    problem = make_problem(name, make_instance("full"))
    assert problem.problem_class not in HIGHS_TAKES
    with pytest.raises(UnsupportedBySolverError, match=f"HiGHS takes .* {problem.problem_class};"):
        problem.to_highs()


def test_arrays_that_highs_refuses_are_an_error():
    arrays = make_problem("milp-mccormick", make_instance("full")).to_arrays()
    with pytest.raises(SolverError, match="refuses the arrays of broken"):
        build_highs(replace(arrays, row_lower=np.full_like(arrays.row_lower, np.inf)), "broken")


def test_arrays_do_not_share_memory_with_the_problem():
    problem = make_problem("milp-mccormick", make_instance("full"))
    arrays = problem.to_arrays()
    arrays.lower[:] = 7
    assert not (problem.lower == 7).any()
    assert problem.violation(problem.point(make_field(problem.instance))).bounds == 0
