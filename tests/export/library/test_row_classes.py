"""Classes of rows, on rows whose class follows from its definition (MIPLIB 2017)."""

import numpy as np
import pytest
from cases import make_instance
from crossfield.export.library.documents.statistics import classes_of_rows, row_classes
from crossfield.models.formulations.arrays import ProblemArrays
from crossfield.models.formulations.problem import formulate
from scipy import sparse

INFINITY = np.inf
# Columns: three binary ones, two whole ones, two continuous ones.
ROWS = {
    "singleton": ([0, 0, 0, 0, 0, 2, 0], -INFINITY, 3),
    "aggregation": ([0, 0, 0, 0, 0, 2, 1], 3, 3),
    "precedence": ([0, 0, 0, 2, -2, 0, 0], -INFINITY, 3),
    "variable bound": ([5, 0, 0, 0, 0, -1, 0], 0, INFINITY),
    "set partitioning": ([1, 1, 1, 0, 0, 0, 0], 1, 1),
    "set packing": ([1, -1, 1, 0, 0, 0, 0], -INFINITY, 0),
    "set covering": ([1, 1, 1, 0, 0, 0, 0], 1, INFINITY),
    "cardinality": ([1, 1, 1, 0, 0, 0, 0], 2, 2),
    "equation knapsack": ([3, 1, 2, 0, 0, 0, 0], 4, 4),
    "bin packing": ([3, 2, 5, 0, 0, 0, 0], -INFINITY, 5),
    "knapsack": ([3, 2, 5, 0, 0, 0, 0], -INFINITY, 7),
    "integer knapsack": ([3, 0, 0, 2, 1, 0, 0], -INFINITY, 7),
    "mixed binary": ([3, 2, 0, 0, 0, 0.5, 0], 0, 0),
    "general linear": ([0, 2, 0, 1, 0, 0.5, 0], 0, 0),
}


def test_each_class_is_recognised():
    matrix, lower, upper = (np.array(part) for part in zip(*ROWS.values(), strict=True))
    columns, rows = matrix.shape[1], len(matrix)
    arrays = ProblemArrays(
        c=np.zeros(columns), constant=0.0, q=sparse.csr_array((columns, columns)), a=sparse.csr_array(matrix),
        row_lower=lower.astype(float), row_upper=upper.astype(float),
        row_products=np.zeros((0, 3), np.int64), row_factors=np.zeros(0),
        lower=np.array([0.0] * 5 + [-9.0] * 2), upper=np.array([1.0] * 3 + [4.0] * 2 + [9.0] * 2),
        integer=np.arange(columns) < 5, column_names=None, row_names=None, nonlinear=(),
        family_rows={"all": slice(0, rows)},
    )  # fmt: skip
    assert classes_of_rows(arrays).tolist() == list(ROWS)


@pytest.mark.parametrize("name", ["milp-mccormick", "miqcp-bilinear", "minlp-quartic", "minlp-parity"])
def test_the_classes_count_every_linear_row_once(name):
    problem = formulate(make_instance(), name)
    linear = sum(family.count for family in problem.rows if family.degree <= 1)
    assert sum(row_classes(problem).values()) == linear
