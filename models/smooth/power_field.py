"""The power field: crosses by smoothing exp(4 i theta), which needs no jumps.

The usual fast cross field of geometry processing (Knoppel et al., ACM Trans. Graph. 32, 2013): right angles
everywhere.
"""

from __future__ import annotations

import numpy as np
from scipy import sparse

from ..field.field import CrossField, relabelled
from ..field.jumps import free_jumps
from ..instance.instance import Instance
from .systems import factored, one_thread, smoothness, stroke_weight


@one_thread()
def power_field(instance: Instance) -> CrossField:
    """Field of orthogonal crosses from the harmonic extension of exp(4 i theta), with the best jumps.

    The complex numbers z minimise the sum of 2 abs(z_i - z_j)^2 over pairs and of w abs(z - exp(4 i theta))^2
    over strokes. Then alpha = arg(z) / 4 and beta = 0; parts without a stroke get alpha = 0. Labels are moved
    into the windows of the instance (docs/mathematics.md, 10).

    Parameters
    ----------
    instance
        The instance.

    Returns
    -------
    CrossField
        The field.

    """
    grid = instance.grid
    strokes, theta = instance.stroke_terms, instance.theta
    goal = np.stack(
        [strokes.at_pixels(strokes.weight * f(4 * theta), grid.size) for f in (np.cos, np.sin)], axis=-1
    )
    z = factored(smoothness(instance) + sparse.diags_array(stroke_weight(instance)))(goal)
    alpha, beta = np.arctan2(z[:, 1], z[:, 0]) / 4, np.zeros(grid.size)
    start = relabelled(instance, alpha, beta, free_jumps(grid, alpha, beta)[0])
    return start.with_best_jumps()
