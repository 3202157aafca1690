"""Least squares within bounds, by SciPy."""

import numpy as np
from scipy.optimize import lsq_linear


def least_in_bounds(rows, goal, weight, bounds):
    """The x within bounds that minimises sum of weight (rows x - goal)^2, and that minimum."""
    root = np.sqrt(weight)
    with np.errstate(divide="ignore", invalid="ignore"):  # SciPy divides by steps of length 0
        x = lsq_linear(rows * root[:, None], goal * root, bounds, method="bvls", tol=1e-15).x
    return x, float(weight @ (rows @ x - goal) ** 2)
