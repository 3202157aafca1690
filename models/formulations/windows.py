"""Windows of alpha and beta and ranges of jumps that a proof has made narrower than the gauge's."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from ..arguments import whole_numbers
from ..errors import InstanceError
from ..field.field import Norm
from ..instance.angles import QUARTER, SLACK
from ..instance.domain import Bools, Floats, Ints
from ..instance.instance import Instance

_ARRAYS = ("alpha_lower", "alpha_upper", "beta_lower", "beta_upper", "p_min", "p_max")
_SYMBOLS = ("alpha_lo", "alpha_up", "beta_lo", "beta_up", "p_min", "p_max")


@dataclass(frozen=True, eq=False)
class Windows:
    """Windows that hold the angles (n,) and jumps (m,) of every field with an energy up to `energy`.

    alpha_lower, alpha_upper, beta_lower, beta_upper: radians. p_min, p_max: whole numbers. Every end is
    within the gauge's. proof: the source of the windows, one line of text. norm: of the energy. `check`
    raises InstanceError for windows that do not fit an instance.
    """

    alpha_lower: Floats
    alpha_upper: Floats
    beta_lower: Floats
    beta_upper: Floats
    p_min: Ints
    p_max: Ints
    energy: float
    proof: str
    norm: Norm = 2

    def check(self, instance: Instance) -> None:
        """Raise InstanceError unless these windows lie within the instance's windows."""
        quarter = np.full(instance.domain.size, QUARTER)
        for name, low, high, least, most in (
            ("alpha", self.alpha_lower, self.alpha_upper, instance.alpha_lower, instance.alpha_upper),
            ("beta", self.beta_lower, self.beta_upper, -quarter, quarter),
            ("p", self.p_min, self.p_max, instance.p_min, instance.p_max),
        ):
            if low.shape != least.shape or high.shape != least.shape:
                raise InstanceError(f"the windows of {name} do not fit the grid of {instance.name}")
            wrong: Bools = ~((low >= least - SLACK) & (low <= high) & (high <= most + SLACK))
            if wrong.any():
                raise InstanceError(
                    f"the window of {name} number {int(np.argmax(wrong))} is empty or beyond the gauge's"
                )

    @property
    def summary(self) -> str:
        """How the windows were narrowed, one line."""
        return (
            "alpha, beta and jumps narrowed to what a proof leaves of all fields with a "
            f"{self.norm}-norm energy up to {self.energy:.12g} ({self.proof})"
        )

    @property
    def data(self) -> dict[str, Any]:
        """The arrays by the names of symbols."""
        return {symbol: getattr(self, name) for symbol, name in zip(_SYMBOLS, _ARRAYS, strict=True)}

    @property
    def bytes(self) -> bytes:
        """All arrays as bytes, for a hash."""
        angles = np.concatenate([self.alpha_lower, self.alpha_upper, self.beta_lower, self.beta_upper])
        jumps = np.concatenate([self.p_min, self.p_max])
        text = f"{self.energy!r} {self.proof}" + ("" if self.norm == 2 else f" {self.norm}")
        return angles.astype("<f8").tobytes() + jumps.astype("<i4").tobytes() + text.encode()

    def document(self) -> dict[str, Any]:
        """The windows as a manifest records them."""
        entries = ((field.name, getattr(self, field.name)) for field in fields(self))
        return {name: value.tolist() if isinstance(value, np.ndarray) else value for name, value in entries}

    @classmethod
    def of_document(cls, document: dict[str, Any]) -> Windows:
        """The windows that `document` wrote."""
        arrays = (np.array(document[name], dtype=np.float64) for name in _ARRAYS)
        alpha_lower, alpha_upper, beta_lower, beta_upper, p_min, p_max = arrays
        jumps = whole_numbers(p_min, "p_min"), whole_numbers(p_max, "p_max")
        energy, proof, norm = float(document["energy"]), str(document["proof"]), document.get("norm", 2)
        return cls(alpha_lower, alpha_upper, beta_lower, beta_upper, *jumps, energy, proof, norm)
