"""An instance: what a formulation needs to know of a sketch. Frozen and validated."""

from __future__ import annotations

import hashlib
import re
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Final, Literal, get_args

import numpy as np

from ..errors import InstanceError
from .angles import wrap
from .grid import Bools, Floats, Grid, Ints
from .reading import Reading

Gauge = Literal["strokes", "box"]
GAUGES: Final[tuple[Gauge, ...]] = get_args(Gauge)

QUARTER: Final = np.pi / 4
HALF: Final = np.pi / 2
_FLAT = 1e-8  # directions closer to the horizontal than this are horizontal
_DECIMALS = 12  # of theta and w
_FINE = 1e-3  # reliabilities up to here would lose digits that count
_FARTHEST = 1e100  # coordinates whose squares are finite numbers
_MOST_ANGLE = 1e6  # radians that leave enough digits modulo pi
_SLACK = 1e-9  # floor and ceil of jump bounds, and the ends of ranges, forgive this much rounding

MOST_WEIGHT: Final = 1e6
"""Greatest weight of a term of the energy."""

NAME = re.compile(r"[a-z][a-z0-9_]{0,31}")
"""Instance names, as instance libraries ask for: at most 32 lower-case letters, digits and `_`."""

_NOT_TEXT = re.compile(r"[\x00-\x1f\x7f\ud800-\udfff]")  # would break a comment line, or have no UTF-8


def whole_numbers(values: Any, name: str) -> Ints:
    """The values as int32 of the same shape.

    Raises InstanceError for fractions and for numbers beyond int32, which a plain cast would change silently.
    """
    given = np.asarray(values)
    if (
        given.dtype.kind not in "iuf"
        or not ((given >= -(2**31)) & (given < 2**31)).all()
        or (given != np.floor(given)).any()
    ):
        raise InstanceError(f"{name} holds something other than whole numbers of 32 bits")
    return given.astype(np.int32)


def _in_digits(value: float) -> float:
    """The number rounded to 12 significant decimal digits."""
    return float(f"{value:.12g}") + 0.0  # no -0.0


@dataclass(frozen=True, eq=False)
class Instance:
    """A mask with stroke directions on some of its pixels, and the weights of the energy.

    name: lower-case letters, digits and underscores, a letter first, at most 32 characters.
    mask: bool [height, width], row 0 at the top; True = solve for this pixel.
    stroke_pixels: int (s, 2), [row, column] of each stroke pixel, inside the mask, sorted, each once.
    theta: float (s,), stroke directions in radians, counter-clockwise from +x with y up; taken modulo pi,
    rounded to 12 decimals, and as 0 within 1e-8 of the horizontal: a cost that small would be dropped by
    readers of the files.
    w: float (s,), reliability of each direction in (0, 1]; above 1e-3 rounded to 12 decimals.
    w_strokes, w_beta: weights of the stroke and the skew term (1 and 1e-6), at most 1e6: beyond, an energy
    that rounding leaves in the one term hides the others.
    gauge: which window of length pi/2 holds alpha: `strokes` (exact) or `box` (as printed in (1)).
    source: where the sketch came from, one line of text.
    pixel_size: side of a pixel in units of the sketch; origin: sketch coordinates (x, y) of the top left
    corner of pixel [0, 0], with y downwards as sketches have it. Both are rounded to 12 digits; pixel_size is
    in [1e-100, 1e100], origin up to that.
    reading: what the reader of its drawing has to say, warnings among it; None where it comes from elsewhere.

    Rounding makes instances, and so their hashes, the same where the last digit differs between processors.
    It changes nothing twice.

    Raises InstanceError when a rule is broken. See docs/mathematics.md, 1 and 4.
    """

    name: str
    mask: Bools
    stroke_pixels: Ints
    theta: Floats
    w: Floats
    w_strokes: float = 1.0
    w_beta: float = 1e-6
    gauge: Gauge = "strokes"
    source: str = ""
    pixel_size: float = 1.0
    origin: tuple[float, float] = field(default=(0.0, 0.0))
    reading: Reading | None = None

    def __post_init__(self) -> None:
        """Take over read-only copies in the documented types, then check every rule."""
        self._freeze("mask", np.asarray(self.mask, dtype=bool))
        self._freeze("stroke_pixels", whole_numbers(self.stroke_pixels, "stroke_pixels"))
        self._freeze("theta", np.asarray(self.theta, dtype=np.float64))
        self._freeze("w", np.asarray(self.w, dtype=np.float64))
        object.__setattr__(self, "origin", (_in_digits(self.origin[0]), _in_digits(self.origin[1])))
        for name in ("w_strokes", "w_beta"):
            object.__setattr__(self, name, float(getattr(self, name)))
        object.__setattr__(self, "pixel_size", _in_digits(self.pixel_size))
        self._check_scalars()
        self._check_strokes()
        theta = np.round(wrap(self.theta, 0.0, np.pi), _DECIMALS)
        self._freeze("theta", np.where((theta < _FLAT) | (theta > np.pi - _FLAT), 0.0, theta))
        self._freeze("w", np.where(self.w > _FINE, np.round(self.w, _DECIMALS), self.w))

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
        if self.gauge not in GAUGES:
            raise InstanceError(f"there is no gauge {self.gauge!r}; choose one of {', '.join(GAUGES)}")
        for name in ("w_strokes", "w_beta"):
            value = getattr(self, name)
            if not 0 <= value <= MOST_WEIGHT:
                raise InstanceError(
                    f"{name} is {value}; it must be between 0 and {MOST_WEIGHT:g}, "
                    "beyond which rounding hides the other terms"
                )
        if not 1 / _FARTHEST <= self.pixel_size <= _FARTHEST:
            raise InstanceError(
                f"pixel_size is {self.pixel_size}; it must be between {1 / _FARTHEST:g} and {_FARTHEST:g}"
            )
        if not all(abs(value) <= _FARTHEST for value in self.origin):
            raise InstanceError(
                f"origin is {self.origin}; it must be two numbers between {-_FARTHEST:g} and {_FARTHEST:g}"
            )
        if not isinstance(self.source, str) or _NOT_TEXT.search(self.source):
            raise InstanceError("source holds a line break or what is no text; give one line of text")

    def _check_strokes(self) -> None:
        if self.mask.ndim != 2 or not self.mask.any():
            raise InstanceError("the mask has no pixel to solve for; draw something white in it")
        if max(self.mask.shape) > 9999:
            raise InstanceError(
                f"the grid is {self.mask.shape[1]} x {self.mask.shape[0]}; "
                "at most 9999 pixels a side are allowed"
            )
        if self.stroke_pixels.size == 0:
            raise InstanceError("no stroke lies inside the mask; move the mask or draw a curvature line")
        if self.stroke_pixels.ndim != 2 or self.stroke_pixels.shape[1] != 2:
            raise InstanceError(
                f"stroke_pixels has shape {self.stroke_pixels.shape}; give a row [row, "
                "column] for each stroke pixel"
            )
        count = len(self.stroke_pixels)
        if self.theta.shape != (count,) or self.w.shape != (count,):
            raise InstanceError(
                f"{count} stroke pixels need as many theta and w, "
                f"but there are {self.theta.size} and {self.w.size}"
            )
        for label, wrong in (
            ("theta is not a finite number", ~np.isfinite(self.theta)),
            (f"theta is beyond {_MOST_ANGLE:g} radians", ~(np.abs(self.theta) <= _MOST_ANGLE)),
            ("w is not in (0, 1]", ~((self.w > 0) & (self.w <= 1))),
            ("is outside the mask", ~self._inside()),
        ):
            if wrong.any():
                row, column = self.stroke_pixels[int(np.argmax(wrong))]
                raise InstanceError(f"stroke pixel [{row}, {column}]: {label} ({int(wrong.sum())} in all)")
        key = self.stroke_pixels[:, 0].astype(np.int64) * self.mask.shape[1] + self.stroke_pixels[:, 1]
        if (np.diff(key) <= 0).any():
            row, column = self.stroke_pixels[int(np.argmax(np.diff(key) <= 0)) + 1]
            raise InstanceError(
                f"stroke pixel [{row}, {column}] is out of order or listed twice; list each once, row by row"
            )

    def _inside(self) -> Bools:
        row, column = self.stroke_pixels.T
        height, width = self.mask.shape
        on_grid = (row >= 0) & (column >= 0) & (row < height) & (column < width)
        inside: Bools = on_grid & self.mask[np.where(on_grid, row, 0), np.where(on_grid, column, 0)]
        return inside

    @cached_property
    def grid(self) -> Grid:
        """The pixels, numbered, with their neighbour pairs."""
        return Grid(self.mask)

    @cached_property
    def stroke_index(self) -> Ints:
        """Pixel number of each stroke pixel, shape (s,)."""
        row, column = self.stroke_pixels.T
        number: Ints = self.grid.number[row, column]
        return number

    @cached_property
    def target(self) -> Floats:
        """Theta in the gauge's own range: [-pi/4, 3 pi/4) for `box`, [0, pi) for `strokes`; shape (s,)."""
        if self.gauge == "strokes":
            return self.theta
        # 3 pi/4 has lost some digits.
        beyond = self.theta >= 3 * QUARTER - _SLACK
        return np.where(beyond, np.maximum(self.theta - np.pi, -QUARTER), self.theta)

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
    def p_min(self) -> Ints:
        """Least useful jump of each pair, shape (m,): floor(-2 d_hi / pi)."""
        d_hi = self.alpha_upper[self.grid.first] - self.alpha_lower[self.grid.second]
        return np.floor(-2 * d_hi / np.pi + _SLACK).astype(np.int32)

    @cached_property
    def p_max(self) -> Ints:
        """Greatest useful jump of each pair, shape (m,): ceil(-2 d_lo / pi)."""
        d_lo = self.alpha_lower[self.grid.first] - self.alpha_upper[self.grid.second]
        return np.ceil(-2 * d_lo / np.pi - _SLACK).astype(np.int32)

    def with_gauge(self, gauge: Gauge) -> Instance:
        """The same instance under another gauge."""
        return replace(self, gauge=gauge)

    def with_weights(self, w_strokes: float | None = None, w_beta: float | None = None) -> Instance:
        """The same instance under other weights; None leaves a weight as it is. Raises InstanceError."""
        given = {"w_strokes": w_strokes, "w_beta": w_beta}
        changed: dict[str, Any] = {name: value for name, value in given.items() if value is not None}
        return replace(self, **changed) if changed else self

    def turned(self) -> Instance:
        """The instance of the sketch turned by a quarter counter-clockwise."""
        row, column = self.stroke_pixels.T
        pixels = np.stack([self.mask.shape[1] - 1 - column, row], axis=1)
        return self._moved(np.rot90(self.mask), pixels, self.theta + HALF)

    def mirrored(self) -> Instance:
        """The instance of the sketch mirrored left to right."""
        row, column = self.stroke_pixels.T
        pixels = np.stack([row, self.mask.shape[1] - 1 - column], axis=1)
        return self._moved(self.mask[:, ::-1], pixels, np.pi - self.theta)

    def transposed(self) -> Instance:
        """The instance mirrored at the line from top left to bottom right: rows and columns exchanged."""
        return self._moved(self.mask.T, self.stroke_pixels[:, ::-1], -HALF - self.theta)

    def _moved(self, mask: Bools, pixels: Ints, theta: Floats) -> Instance:
        order = np.lexsort((pixels[:, 1], pixels[:, 0]))
        return replace(
            self, mask=mask, stroke_pixels=pixels[order], theta=theta[order], w=self.w[order], reading=None
        )

    @property
    def summary(self) -> str:
        """Name, grid, pixels, strokes, parts of the mask, gauge, and weights that are not the defaults."""
        grid = self.grid
        parts = f" in {grid.parts} separate parts" if grid.parts > 1 else ""
        return (
            f"{self.name}: {grid.width} x {grid.height}, {grid.size} pixels{parts}, "
            f"{len(self.theta)} with strokes, gauge {self.gauge}{self._other_weights}"
        )

    @property
    def _other_weights(self) -> str:
        names = [name for name in ("w_strokes", "w_beta") if getattr(self, name) != getattr(Instance, name)]
        return "".join(f", {name} {getattr(self, name):g}" for name in names)

    @cached_property
    def sha256(self) -> str:
        """64 hexadecimal digits that stand for the whole content; equal for equal instances only."""
        digest = hashlib.sha256(b"crossfield-instance 1\n")
        for text in (self.name, self.gauge, self.source):
            digest.update(text.encode() + b"\0")
        scalars = np.array(
            [*self.mask.shape, self.w_strokes, self.w_beta, self.pixel_size, *self.origin], dtype="<f8"
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
