"""Bounds tightening: the windows of all variables that a certificate leaves, in the instance's gauge."""

from __future__ import annotations

import numpy as np

from ..errors import InputError
from ..formulations.windows import Windows
from ..instance.angles import HALF, QUARTER
from ..instance.domain import Bools
from ..instance.terms import parity_sign
from .descent.record import Claim

_MARGIN = 1e-9  # radians by which windows are wider than the boxes, to allow for rounding in solvers


def remaining_windows(certificate: Claim) -> Windows:
    """Windows of the angles, and ranges of the jumps, of every field of at most the certificate's energy.

    Each box of the certificate is moved to the label that its field has in the gauge. If it exceeds the
    window of the gauge, crosses in it have labels at both ends. Then alpha keeps its whole window, and beta
    lies between plus and minus its greatest size. A jump that is forced between two boxes within their
    windows is fixed; other ranges follow from the windows, as in the gauge. Raises InputError for a
    certificate of orthogonal crosses.
    """
    field, proven = certificate.field, certificate.proven
    if proven is None or proven.boxes is None:
        raise InputError("certificates of orthogonal crosses hold no windows; export without one")
    instance, grid = field.instance, field.instance.grid
    steps = np.round((field.alpha - proven.boxes[:, :2].mean(axis=1)) / HALF).astype(np.int32)
    alpha, beta = (
        proven.boxes[:, :2] + HALF * steps[:, None],
        proven.boxes[:, 2:] * parity_sign(steps)[:, None],
    )
    box = np.concatenate([alpha, np.sort(beta, axis=1)], axis=1)
    box += np.array([-_MARGIN, _MARGIN, -_MARGIN, _MARGIN])
    inside: Bools = (box[:, 0] >= instance.alpha_lower) & (box[:, 1] <= instance.alpha_upper)
    reach = np.abs(box[:, 2:]).max(axis=1)
    alpha_lower = np.where(inside, box[:, 0], instance.alpha_lower)
    alpha_upper = np.where(inside, box[:, 1], instance.alpha_upper)
    beta_lower = np.maximum(np.where(inside, box[:, 2], -reach), -QUARTER)
    beta_upper = np.minimum(np.where(inside, box[:, 3], reach), QUARTER)
    least, most = instance.pair_terms.jump_range(alpha_lower, alpha_upper)
    fixed = proven.forced_pairs & inside[grid.first] & inside[grid.second]
    return Windows(
        alpha_lower,
        alpha_upper,
        beta_lower,
        beta_upper,
        np.where(fixed, field.p, np.maximum(least, instance.p_min)).astype(np.int32),
        np.where(fixed, field.p, np.minimum(most, instance.p_max)).astype(np.int32),
        certificate.energy,
        f"certificate of {instance.name}, status {certificate.status}",
        certificate.norm,
    )
