"""An instance: the data of a sketch that formulations need. Frozen and validated."""

from __future__ import annotations

import hashlib
import re
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Final, Literal, get_args

import numpy as np

from ..arguments import check_fields, check_kind, float_array
from ..errors import CrossfieldError, InstanceError, NoStrokeError
from ..previews import Pictured
from .angles import HALF, MOST_ANGLE, QUARTER, wrap
from .grid import Bools, Floats, Grid, Ints
from .terms import PairTerms, StrokeTerms

Gauge = Literal["strokes", "box"]
GAUGES: Final[tuple[Gauge, ...]] = get_args(Gauge)

_FLAT = 1e-8  # directions closer to the horizontal than this are horizontal
_DECIMALS = 12  # of theta and w
_FINE = 1e-3  # reliabilities up to here would lose digits that count
_FARTHEST = 1e100  # coordinates whose squares are finite numbers
_SLACK = 1e-9  # tolerance for rounding at floor and ceil of jump bounds and at the ends of ranges

MOST_WEIGHT: Final = 1e6  # greatest weight of a term of the energy
NAME = re.compile(r"[a-z][a-z0-9_]{0,31}")
"""Instance names that instance libraries allow: at most 32 lower-case letters, digits and `_`."""
REFERENCE: Final = 24  # pixels of the longer side of the grid on which weights are coefficients
STROKE_WEIGHT: Final = 20.0  # see docs/evidence.md
SKEW_WEIGHT: Final = 1e-6
# On a finer grid the smoothness keeps its value, strokes have more pixels, and areas the square of that.
_POWERS: Final = {"stroke": 1, "skew": 2}
_NOT_TEXT = re.compile(r"[\x00-\x1f\x7f\ud800-\udfff]")  # would break a comment line, or have no UTF-8


@dataclass(frozen=True)
class Reading:
    """How an instance was read from a drawing; not part of its content, files or hash.

    page: x, y, width and height of the page in the drawing's units, y down, None without one. warnings:
    possible misreadings, one line each. openings: both ends of each gap in the outline that was bridged.
    """

    page: tuple[float, float, float, float] | None
    warnings: tuple[str, ...] = ()
    openings: tuple[tuple[tuple[float, float], tuple[float, float]], ...] = ()


def whole_numbers(values: Any, name: str, error: type[CrossfieldError] = InstanceError) -> Ints:
    """The values as int32. Raises the error, with their name, for fractions and for numbers beyond int32."""
    array = values if getattr(values, "dtype", None) == np.int32 else float_array(values, name, error)
    if not ((array >= -(2**31)) & (array < 2**31)).all() or (array != np.floor(array)).any():
        raise error(f"{name} holds something other than whole numbers of 32 bits")
    return array.astype(np.int32)


def _boolean_array(values: Any) -> Bools:
    """The values as booleans. Raises InstanceError unless they are True and False, or 1 and 0."""
    booleans = isinstance(values, np.ndarray) and values.dtype.kind == "b"
    array = values if booleans else float_array(values, "mask", InstanceError)
    mask: Bools = array != 0
    if (array != mask).any():
        raise InstanceError("mask holds something other than True and False")
    return mask


def round_to_digits(value: float) -> float:
    """The number to 12 significant digits, equal on processors that differ in the last digit."""
    return float(f"{value:.12g}") + 0.0  # no -0.0


def _check_weight(name: str, value: float) -> None:
    check_kind(name, value, "float", InstanceError)
    if not 0 <= value <= MOST_WEIGHT:
        raise InstanceError(f"{name} is {value}; it must be between 0 and {MOST_WEIGHT:g}")


def _check_lines(at: Ints, theta: Floats, w: Floats, outside: Bools) -> None:
    for label, wrong in (
        ("theta is not a finite number", ~np.isfinite(theta)),
        (f"theta is beyond {MOST_ANGLE:g} radians", ~(np.abs(theta) <= MOST_ANGLE)),
        ("w is not in (0, 1]", ~((w > 0) & (w <= 1))),
        ("is outside the mask", outside),
    ):
        if wrong.any():
            row, column = at[int(np.argmax(wrong))]
            raise InstanceError(f"stroke pixel [{row}, {column}]: {label} ({int(wrong.sum())} in all)")


@dataclass(frozen=True, eq=False)
class Instance(Pictured):
    """A mask with stroke directions on some of its pixels, and the weights of the energy.

    It is frozen and validated. Rounding makes instances, and so their hashes, equal on processors that differ
    in the last digit. Rounding is idempotent. See docs/mathematics.md, 1 and 4.

    Parameters
    ----------
    name
        At most 32 lower-case letters, digits and underscores, a letter first.
    mask
        Pixels to solve for, bool (height, width), row 0 at the top.
    stroke_pixels
        Row and column of each stroke pixel, int (s, 2), inside the mask, sorted, each once.
    theta
        Stroke directions, float (s,), in radians counter-clockwise from +x with y up. Stored modulo pi,
        rounded to 12 decimals, and as 0 within 1e-8 of the horizontal, because readers of files drop such
        small costs.
    w
        Reliability of each direction, float (s,), in (0, 1]; above 1e-3 rounded to 12 decimals.
    stroke_coefficient, skew_coefficient
        Coefficients w_strokes and w_beta of the energy per pixel, 0 to 1e6. `with_weights` takes weights that
        mean the same on every grid.
    gauge
        Window of length pi/2 that contains alpha: `strokes` (exact), or `box` as printed in (1).
    source
        Origin of the sketch, one line of text.
    pixel_size
        Side of a pixel in units of the sketch, 1e-100 to 1e100, rounded to 12 digits.
    origin
        Sketch coordinates (x, y) of the top left corner of pixel [0, 0], y downwards, rounded to 12 digits.
    view
        Viewpoint from which a drawing in space was seen, as in `read_sketch`; None without a choice.
    reading
        Messages from the reader of its drawing, such as warnings; None for other origins.

    Raises
    ------
    NoStrokeError
        For a mask without pixels, and for no stroke pixel.
    InstanceError
        For a value that breaks a rule.

    """

    name: str
    mask: Bools
    stroke_pixels: Ints
    theta: Floats
    w: Floats
    stroke_coefficient: float = 1.0
    skew_coefficient: float = 1e-6
    gauge: Gauge = "strokes"
    source: str = ""
    pixel_size: float = 1.0
    origin: tuple[float, float] = field(default=(0.0, 0.0))
    view: str | None = None
    reading: Reading | None = None

    def __post_init__(self) -> None:
        """Store read-only copies in the documented types, then check every rule."""
        check_fields(self, InstanceError)
        self._freeze("mask", _boolean_array(self.mask))
        self._freeze("stroke_pixels", whole_numbers(self.stroke_pixels, "stroke_pixels"))
        for name in ("theta", "w"):
            self._freeze(name, float_array(getattr(self, name), name, InstanceError))
        origin = float_array(self.origin, "origin", InstanceError)
        if origin.shape != (2,):
            raise InstanceError(f"origin has shape {origin.shape}; give two numbers, x and y")
        object.__setattr__(self, "origin", (round_to_digits(origin[0]), round_to_digits(origin[1])))
        for name in ("stroke_coefficient", "skew_coefficient"):
            object.__setattr__(self, name, float(getattr(self, name)))
        object.__setattr__(self, "pixel_size", round_to_digits(self.pixel_size))
        self._check_scalars()
        self._check_strokes()
        theta = np.round(wrap(self.theta, 0.0, np.pi), _DECIMALS)
        self._freeze("theta", np.where((theta < _FLAT) | (theta > np.pi - _FLAT), 0.0, theta))
        self._freeze("w", np.where(self.w > _FINE, np.round(self.w, _DECIMALS), self.w))

    def __repr__(self) -> str:
        return f"<Instance {self.summary}>"

    def _freeze(self, name: str, value: Any) -> None:
        value = value.copy()
        value.setflags(write=False)
        object.__setattr__(self, name, value)

    def _check_scalars(self) -> None:
        if not NAME.fullmatch(self.name):
            raise InstanceError(
                f"the name {self.name[:40]!r} is not allowed; use a lower-case letter, "
                "then at most 31 lower-case letters, digits and underscores"
            )
        if not isinstance(self.gauge, str) or self.gauge not in GAUGES:
            raise InstanceError(f"there is no gauge {self.gauge!r}; choose one of {', '.join(GAUGES)}")
        for name in ("stroke_coefficient", "skew_coefficient"):
            _check_weight(name, getattr(self, name))
        if not 1 / _FARTHEST <= self.pixel_size <= _FARTHEST:
            raise InstanceError(
                f"pixel_size is {self.pixel_size}; it must be between {1 / _FARTHEST:g} and {_FARTHEST:g}"
            )
        if not all(abs(value) <= _FARTHEST for value in self.origin):
            raise InstanceError(
                f"origin is {self.origin}; it must be two numbers between {-_FARTHEST:g} and {_FARTHEST:g}"
            )
        for name, text in (("source", self.source), ("view", self.view or "")):
            if _NOT_TEXT.search(text):
                raise InstanceError(f"{name} holds a line break or a control character; give one line")

    def _check_strokes(self) -> None:
        if self.mask.ndim != 2 or not self.mask.any():
            raise NoStrokeError("the mask has no pixel to solve for; draw something white in it")
        if max(self.mask.shape) > 9999:
            height, width = self.mask.shape
            raise InstanceError(f"the grid is {width} x {height}; at most 9999 pixels per side are allowed")
        if self.stroke_pixels.size == 0:
            raise NoStrokeError("no stroke lies inside the mask; move the mask or draw a curvature line")
        if self.stroke_pixels.ndim != 2 or self.stroke_pixels.shape[1] != 2:
            shape = self.stroke_pixels.shape
            raise InstanceError(f"stroke_pixels has shape {shape}; give [row, column] for each stroke pixel")
        count = len(self.stroke_pixels)
        if self.theta.shape != (count,) or self.w.shape != (count,):
            sizes = f"{self.theta.size} and {self.w.size}"
            raise InstanceError(f"{count} stroke pixels need as many theta and w, but there are {sizes}")
        row, column = self.stroke_pixels.T
        height, width = self.mask.shape
        on_grid = (row >= 0) & (column >= 0) & (row < height) & (column < width)
        inside = on_grid & self.mask[np.where(on_grid, row, 0), np.where(on_grid, column, 0)]
        _check_lines(self.stroke_pixels, self.theta, self.w, ~inside)
        key = self.stroke_pixels[:, 0].astype(np.int64) * self.mask.shape[1] + self.stroke_pixels[:, 1]
        if (np.diff(key) <= 0).any():
            row, column = self.stroke_pixels[int(np.argmax(np.diff(key) <= 0)) + 1]
            raise InstanceError(f"stroke pixel [{row}, {column}] is out of order or listed twice; sort them")

    @cached_property
    def grid(self) -> Grid:
        """The pixels, numbered, with their neighbour pairs."""
        return Grid(self.mask)

    @cached_property
    def stroke_index(self) -> Ints:
        """Pixel number of each stroke pixel, shape (s,)."""
        row, column = self.stroke_pixels.T
        return np.asarray(self.grid.number[row, column])

    @cached_property
    def target(self) -> Floats:
        """Theta in the gauge's own range: [-pi/4, 3 pi/4) for `box`, [0, pi) for `strokes`; shape (s,)."""
        if self.gauge == "strokes":
            return self.theta
        # 3 pi/4 has lost some digits.
        beyond = self.theta >= 3 * QUARTER - _SLACK
        return np.where(beyond, np.maximum(self.theta - np.pi, -QUARTER), self.theta)

    @cached_property
    def pair_terms(self) -> PairTerms:
        """The residuals of all pairs of neighbours."""
        return PairTerms(self.grid.first, self.grid.second)

    @cached_property
    def stroke_terms(self) -> StrokeTerms:
        """The residuals of all strokes."""
        return StrokeTerms(self.stroke_index, self.target, self.stroke_coefficient * self.w)

    @cached_property
    def alpha_lower(self) -> Floats:
        """Lower end of each pixel's window of alpha, shape (n,). The upper end is pi/2 above."""
        lower = np.zeros(self.grid.size)
        if self.gauge == "strokes":
            lower[self.stroke_index] = self.target - QUARTER
        return lower

    @cached_property
    def alpha_upper(self) -> Floats:
        """Upper end of each pixel's window of alpha, shape (n,)."""
        upper = np.full(self.grid.size, HALF)
        if self.gauge == "strokes":
            upper[self.stroke_index] = self.target + QUARTER
        return upper

    @cached_property
    def _jump_range(self) -> tuple[Ints, Ints]:
        return self.pair_terms.jump_range(self.alpha_lower, self.alpha_upper)

    @property
    def p_min(self) -> Ints:
        """Smallest useful jump of each pair, shape (m,)."""
        return self._jump_range[0]

    @property
    def p_max(self) -> Ints:
        """Greatest useful jump of each pair, shape (m,)."""
        return self._jump_range[1]

    def with_gauge(self, gauge: Gauge) -> Instance:
        """Return the same instance under another gauge. Raises InstanceError for an unknown one."""
        return replace(self, gauge=gauge)

    def with_weights(
        self, *, stroke_weight: float | None = None, skew_weight: float | None = None
    ) -> Instance:
        """Return the same instance under other weights, which mean the same on every grid.

        Parameters
        ----------
        stroke_weight, skew_weight
            The coefficients on a grid of 24 pixels on its longer side, 0 to 1e6. On another grid they are
            stroke_weight 24 / side and skew_weight (24 / side)^2. None keeps a weight.

        Returns
        -------
        Instance
            The instance.

        Raises
        ------
        InstanceError
            For a weight or coefficient out of range.

        """
        changed: dict[str, Any] = {}
        for term, weight in (("stroke", stroke_weight), ("skew", skew_weight)):
            if weight is not None:
                _check_weight(f"{term}_weight", weight)
                power = _POWERS[term]
                changed[f"{term}_coefficient"] = weight * REFERENCE**power / max(self.mask.shape) ** power
        return replace(self, **changed) if changed else self

    @property
    def stroke_weight(self) -> float:
        """Weight of the strokes that means the same on every grid; the coefficient on a grid of 24 pixels."""
        return self._weight("stroke")

    @property
    def skew_weight(self) -> float:
        """Weight of the skew that means the same on every grid; the coefficient on a grid of 24 pixels."""
        return self._weight("skew")

    def _weight(self, term: str) -> float:
        side, power = max(self.mask.shape), _POWERS[term]
        return round_to_digits(getattr(self, f"{term}_coefficient") * side**power / REFERENCE**power)

    def facts(self) -> dict[str, Any]:
        """Name, origin, sizes and weights, as reports list them."""
        return {
            "name": self.name,
            "source": self.source,
            "gauge": self.gauge,
            "sha256": self.sha256,
            "height": self.grid.height,
            "width": self.grid.width,
            "pixels": self.grid.size,
            "pairs": len(self.grid.first),
            "stroke_pixels": len(self.theta),
            "parts": self.grid.parts,
            "pixel_size": self.pixel_size,
            "w_strokes": self.stroke_coefficient,
            "w_beta": self.skew_coefficient,
            "stroke_weight": self.stroke_weight,
            "skew_weight": self.skew_weight,
        }

    @property
    def summary(self) -> str:
        """Name, grid, pixels, strokes, parts of the mask, gauge, and weights unless they are defaults."""
        grid = self.grid
        parts = f" in {grid.parts} separate parts" if grid.parts > 1 else ""
        return (
            f"{self.name}: {grid.width} x {grid.height}, {grid.size} pixels{parts}, "
            f"{len(self.theta)} with strokes, gauge {self.gauge}{self._other_weights}"
        )

    @property
    def _other_weights(self) -> str:
        weights = {"stroke": (self.stroke_weight, STROKE_WEIGHT), "skew": (self.skew_weight, SKEW_WEIGHT)}
        return "".join(
            f", {term} weight {weight:g}"
            for term, (weight, of_sketches) in weights.items()
            if weight != of_sketches
            and getattr(self, f"{term}_coefficient") != getattr(Instance, f"{term}_coefficient")
        )

    @cached_property
    def sha256(self) -> str:
        """64 hexadecimal digits of the whole content; equal only for equal instances."""
        digest = hashlib.sha256(b"crossfield-instance 1\n")
        for text in (self.name, self.gauge, self.source, self.view):
            if text is not None:
                digest.update(text.encode() + b"\0")
        scalars = np.array(
            [*self.mask.shape, self.stroke_coefficient, self.skew_coefficient, self.pixel_size, *self.origin],
            dtype="<f8",
        )
        for array in (
            scalars,
            np.packbits(self.mask),
            self.stroke_pixels.astype("<i4"),
            self.theta.astype("<f8"),
            self.w.astype("<f8"),
        ):
            digest.update(array.tobytes())
        return digest.hexdigest()
