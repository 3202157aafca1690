"""An instance: the data of a sketch that formulations need. Frozen and validated."""

from __future__ import annotations

import hashlib
import re
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Final, Literal, get_args

import numpy as np

from ..arguments import boolean_array, check_choice, check_flag, float_array, whole_numbers
from ..errors import DomainError, InstanceError, NoStrokeError
from ..previews import Pictured
from .angles import HALF, MOST_ANGLE, QUARTER, SLACK, wrap
from .cycles import Cycles, find_cycles
from .domain import Bools, Floats, Ints
from .grid import Grid
from .indices import PrescribedRings, prescribe_rings, sort_indices
from .mesh import Mesh
from .terms import PairTerms, StrokeTerms

Gauge = Literal["strokes", "box"]
GAUGES: Final[tuple[Gauge, ...]] = get_args(Gauge)

_FLAT = 1e-8  # directions closer than this to the horizontal or to 45 degrees are these
_DECIMALS = 12  # of theta and w
_FINE = 1e-3  # reliabilities up to here would lose digits that count

MOST_WEIGHT: Final = 1e6  # greatest weight of a term of the energy
NAME = re.compile(r"[a-z][a-z0-9_]{0,31}")
"""Instance names that instance libraries allow: at most 32 lower-case letters, digits and `_`."""
STROKE_WEIGHT: Final = 20.0  # see docs/evidence.md
SKEW_WEIGHT: Final = 1e-6
# On a finer grid the smoothness keeps its value, strokes have more pixels, and areas the square of that.
_POWERS: Final = {"stroke": 1, "skew": 2}
_NOT_TEXT = re.compile(r"[\x00-\x1f\x7f\ud800-\udfff]")  # would break a comment line, or have no UTF-8


@dataclass(frozen=True)
class Reading:
    """How an instance was read from a drawing or a mesh; not part of its content, files or hash.

    page: x, y, width and height of the page in the drawing's units, y down, None without one. warnings:
    possible misreadings, one line each. edges: directed edges of a mesh with a stroke, (k,).
    """

    page: tuple[float, float, float, float] | None
    warnings: tuple[str, ...] = ()
    edges: Ints | None = None


def name_from_text(text: str, what: str = "sketch") -> str:
    """An instance name made from any text, at most 32 long; runs of other characters become `_`.

    what: first word where the text has no letter to begin with.
    """
    name = re.sub(r"[^a-z0-9]+", "_", text.lower()).strip("_")
    return (name if re.match(r"[a-z]", name) else f"{what}_{name}".strip("_"))[:32].rstrip("_")


def round_to_digits(value: float) -> float:
    """The number to 12 significant digits, equal on processors that differ in the last digit."""
    return float(f"{value:.12g}") + 0.0  # no -0.0


def _check_weight(name: str, value: float, most: float = MOST_WEIGHT, where: str = "") -> None:
    if not 0 <= value <= most:
        raise InstanceError(f"{name} is {value}; it must be between 0 and {most:g}{where}")


@dataclass(frozen=True, eq=False)
class Instance(Pictured):
    """Points with directions of strokes on some of them, and the weights of the energy.

    It is frozen and validated. Rounding, which is idempotent, makes instances and their hashes equal on
    processors that differ in the last digit. See docs/mathematics.md, 1 and 4. `Instance.on_pixels` and
    `Instance.on_faces` make one from positions.

    Parameters
    ----------
    name
        At most 32 lower-case letters, digits and underscores, a letter first.
    domain
        The pixels of a sketch or the faces of a mesh.
    stroke_index
        Number of each point with a stroke, int (s,), ascending, each once.
    theta
        Stroke directions, float (s,), in radians counter-clockwise from the x axis of the point's frame (of
        a pixel: to the right, y up). Stored modulo pi, rounded to 12 decimals, and as 0 or pi/4 within 1e-8
        of them, because readers of files drop such small costs and ends of windows.
    w
        Reliability of each direction, float (s,), in (0, 1]; above 1e-3 rounded to 12 decimals.
    stroke_coefficient, skew_coefficient
        Coefficients w_strokes and w_beta of the energy per point, 0 to 1e6. `with_weights` takes weights that
        mean the same on every grid.
    gauge
        Window of length pi/2 that contains alpha: `strokes` (exact), or `box` as printed in (1).
    orthogonal
        Whether all crosses have right angles: beta is 0 and no variable.
    pair_weights
        Weight of the smoothness of each pair, (m,), above 0 and up to 1e6; None where all are 1.
    indices
        Vertices, as files of singularities number them, and four times the index that each must have, int
        (k, 2); None where crosses may have any. Only for orthogonal crosses under the gauge `strokes`.
    source
        Origin of the sketch or mesh, one line of text.
    view
        Viewpoint from which a drawing in space was seen, as in `read_sketch`; None without a choice.
    reading
        Messages from the reader of its drawing, such as warnings; None for other origins.

    Raises
    ------
    NoStrokeError
        For a mask without pixels, and for pixels without a stroke.
    MeshError
        For a mesh that is no oriented manifold of triangles.
    InstanceError
        For a value that breaks a rule.

    """

    name: str
    domain: Grid | Mesh
    stroke_index: Ints
    theta: Floats
    w: Floats
    stroke_coefficient: float = 1.0
    skew_coefficient: float = 1e-6
    gauge: Gauge = "strokes"
    orthogonal: bool = False
    pair_weights: Floats | None = None
    indices: Ints | None = None
    source: str = ""
    view: str | None = None
    reading: Reading | None = None

    @classmethod
    def on_pixels(
        cls,
        name: str,
        mask: Any,
        stroke_pixels: Any,
        theta: Any,
        w: Any,
        *,
        pixel_size: float = 1.0,
        origin: tuple[float, float] = (0.0, 0.0),
        **more: Any,
    ) -> Instance:
        """Return an instance on the pixels of a sketch. Raises as `Instance`.

        Parameters
        ----------
        name, theta, w, more
            As in `Instance`.
        mask
            Pixels to solve for, bool (height, width), row 0 at the top.
        stroke_pixels
            Row and column of each stroke pixel, int (s, 2), inside the mask, sorted, each once.
        pixel_size
            Side of a pixel in units of the sketch, 1e-100 to 1e100, rounded to 12 digits.
        origin
            Sketch coordinates (x, y) of the top left corner of pixel [0, 0], y down, rounded to 12 digits.

        """
        corner = float_array(origin, "origin", InstanceError)
        if corner.shape != (2,):
            raise InstanceError(f"origin has shape {corner.shape}; give two numbers, x and y")
        place = round_to_digits(corner[0]), round_to_digits(corner[1])
        grid = Grid(_read_only(boolean_array(mask)), round_to_digits(pixel_size), place)
        grid.check()
        pixels = whole_numbers(stroke_pixels, "stroke_pixels")
        return cls(name, grid, grid.numbers_of(pixels), theta, w, **more)

    @classmethod
    def on_faces(cls, name: str, mesh: Mesh, stroke_faces: Any, theta: Any, w: Any, **more: Any) -> Instance:
        """Return an instance on the faces of a mesh; `orthogonal` unless `more` says otherwise.

        stroke_faces: number of each face with a stroke, int (s,), ascending, each once; there may be none.
        The others are as in `Instance`, and so are the errors.
        """
        return cls(name, mesh, stroke_faces, theta, w, **({"orthogonal": True} | more))

    def __post_init__(self) -> None:
        """Store read-only copies in the documented types, then check every rule."""
        if not isinstance(self.domain, Grid | Mesh):
            raise InstanceError("domain is neither a Grid nor a Mesh")
        self._freeze("stroke_index", whole_numbers(self.stroke_index, "stroke_index"))
        for name in ("theta", "w"):
            self._freeze(name, float_array(getattr(self, name), name, InstanceError))
        if self.pair_weights is not None:
            self._freeze("pair_weights", float_array(self.pair_weights, "pair_weights", InstanceError))
        for name in ("stroke_coefficient", "skew_coefficient"):
            object.__setattr__(self, name, float(getattr(self, name)))
        check_flag("orthogonal", self.orthogonal, InstanceError)
        object.__setattr__(self, "orthogonal", bool(self.orthogonal))
        self._check_scalars()
        self.domain.check()
        self._check_strokes()
        self._check_pair_weights()
        self._check_indices()
        theta = np.round(wrap(self.theta, 0.0, np.pi), _DECIMALS)
        theta = np.where((theta < _FLAT) | (theta > np.pi - _FLAT), 0.0, theta)
        self._freeze("theta", np.where(np.abs(theta - QUARTER) < _FLAT, QUARTER, theta))
        self._freeze("w", np.where(self.w > _FINE, np.round(self.w, _DECIMALS), self.w))

    def __repr__(self) -> str:
        return f"<Instance {self.summary}>"

    def _freeze(self, name: str, value: Any) -> None:
        object.__setattr__(self, name, _read_only(value.copy()))

    def _check_scalars(self) -> None:
        if not NAME.fullmatch(self.name):
            raise InstanceError(
                f"the name {self.name[:40]!r} is not allowed; use a lower-case letter, "
                "then at most 31 lower-case letters, digits and underscores"
            )
        check_choice("gauge", self.gauge, GAUGES, InstanceError)
        for name in ("stroke_coefficient", "skew_coefficient"):
            _check_weight(name, getattr(self, name))
        for name, text in (("source", self.source), ("view", self.view or "")):
            if _NOT_TEXT.search(text):
                raise InstanceError(f"{name} holds a line break or a control character; give one line")

    def _check_strokes(self) -> None:
        if self.stroke_index.size == 0 and isinstance(self.domain, Grid):
            raise NoStrokeError("no stroke lies inside the mask; move the mask or draw a curvature line")
        count = len(self.stroke_index)
        if self.stroke_index.ndim != 1 or self.theta.shape != (count,) or self.w.shape != (count,):
            sizes = f"{self.theta.size} and {self.w.size}"
            raise InstanceError(
                f"{count} stroke {self.domain.kind}s need as many theta and w, but there are {sizes}"
            )
        beyond = (self.stroke_index < 0) | (self.stroke_index >= self.domain.size)
        if beyond.any():
            raise InstanceError(f"there is no {self.domain.kind} {self.stroke_index[beyond][0]} for a stroke")
        for label, wrong in (
            ("theta is not a finite number", ~np.isfinite(self.theta)),
            (f"theta is beyond {MOST_ANGLE:g} radians", ~(np.abs(self.theta) <= MOST_ANGLE)),
            ("w is not in (0, 1]", ~((self.w > 0) & (self.w <= 1))),
            ("is out of order or listed twice; sort them", np.diff(self.stroke_index, prepend=-1) <= 0),
        ):
            if wrong.any():
                place = self.domain.place(self.stroke_index[np.argmax(wrong)])
                raise InstanceError(f"stroke {place}: {label} ({int(wrong.sum())} in all)")

    def _check_pair_weights(self) -> None:
        weights = self.pair_weights
        if weights is None:
            return
        if weights.shape != self.domain.first.shape:
            raise InstanceError(
                f"pair_weights has shape {weights.shape}; give one for each of {len(self.domain.first)} pairs"
            )
        wrong = ~((weights > 0) & (weights <= MOST_WEIGHT))
        if wrong.any():
            raise InstanceError(
                f"the weight of pair {int(np.argmax(wrong))} is {weights[wrong][0]}; "
                f"it must be above 0 and at most {MOST_WEIGHT:g}"
            )

    def _check_indices(self) -> None:
        object.__setattr__(self, "indices", sort_indices(self.indices))
        if self.indices is not None and not (self.orthogonal and self.gauge == "strokes"):
            raise InstanceError(
                "indices are prescribed for orthogonal crosses under the gauge strokes only; make the "
                "instance orthogonal, or leave indices out"
            )
        self.prescribed_rings  # noqa: B018 - raises for indices that no field has

    @property
    def grid(self) -> Grid:
        """The pixels, numbered, with their neighbour pairs. Raises DomainError for an instance on a mesh."""
        if isinstance(self.domain, Grid):
            return self.domain
        raise DomainError(
            f"{self.name} is on the faces of a mesh, and this works on pixels only; give an instance of a "
            "sketch (docs/architecture.md lists what takes which)"
        )

    @property
    def mesh(self) -> Mesh:
        """The mesh. Raises DomainError for an instance on pixels."""
        if isinstance(self.domain, Mesh):
            return self.domain
        raise DomainError(
            f"{self.name} is on the pixels of a sketch, and this works on meshes only; give an instance of "
            "a mesh (docs/architecture.md lists what takes which)"
        )

    @property
    def mask(self) -> Bools:
        """The pixels to solve for, shape [height, width]."""
        return self.grid.mask

    @property
    def pixel_size(self) -> float:
        """Side of a pixel in units of the sketch."""
        return self.grid.pixel_size

    @property
    def origin(self) -> tuple[float, float]:
        """Sketch coordinates (x, y) of the top left corner of pixel [0, 0], y downwards."""
        return self.grid.origin

    @cached_property
    def stroke_pixels(self) -> Ints:
        """Row and column of each stroke pixel, shape (s, 2)."""
        pixels: Ints = _read_only(self.grid.places(self.stroke_index))
        return pixels

    @cached_property
    def target(self) -> Floats:
        """Theta in the gauge's own range: [-pi/4, 3 pi/4) for `box`, [0, pi) for `strokes`; shape (s,)."""
        if self.gauge == "strokes":
            return self.theta
        # 3 pi/4 has lost some digits.
        beyond = self.theta >= 3 * QUARTER - SLACK
        return np.where(beyond, np.maximum(self.theta - np.pi, -QUARTER), self.theta)

    @cached_property
    def pair_terms(self) -> PairTerms:
        """The residuals of all pairs of neighbours."""
        return PairTerms(self.domain.first, self.domain.second, self.domain.kappa, self.pair_weights)

    @cached_property
    def stroke_terms(self) -> StrokeTerms:
        """The residuals of all strokes."""
        return StrokeTerms(self.stroke_index, self.target, self.stroke_coefficient * self.w)

    @property
    def point_weight(self) -> Floats:
        """Sum of the weights w_strokes w of the strokes at each point, 0 without a stroke; shape (n,)."""
        return self.stroke_terms.at_points(self.stroke_terms.weight, self.domain.size)

    @cached_property
    def cycles(self) -> Cycles:
        """A basis of the cycles of pairs and strokes, along which alone jumps matter."""
        rings = self.prescribed_rings
        return find_cycles(self.domain, self.stroke_index, None if rings is None else rings.number)

    @cached_property
    def prescribed_rings(self) -> PrescribedRings | None:
        """The rings of vertices with prescribed indices; None without any."""
        return None if self.indices is None else prescribe_rings(self.domain, self.indices)

    @cached_property
    def alpha_lower(self) -> Floats:
        """Lower end of each point's window of alpha, shape (n,). The upper end is pi/2 above."""
        lower = np.zeros(self.domain.size)
        if self.gauge == "strokes":
            lower[self.stroke_index] = self.target - QUARTER
        return lower

    @cached_property
    def alpha_upper(self) -> Floats:
        """Upper end of each point's window of alpha, shape (n,)."""
        upper = np.full(self.domain.size, HALF)
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
            stroke_weight 24 / side and skew_weight (24 / side)^2, and at most 1e6 too. None keeps a weight.

        Raises
        ------
        InstanceError
            For a weight out of the range on this grid.

        """
        changed: dict[str, Any] = {}
        for term, weight in (("stroke", stroke_weight), ("skew", skew_weight)):
            if weight is not None:
                power, side = _POWERS[term], self.domain.side
                most = MOST_WEIGHT * min(side**power / self.domain.reference**power, 1.0)
                where = f" on a grid of {side} pixels" if most < MOST_WEIGHT else ""
                _check_weight(f"{term}_weight", weight, most, where)
                coefficient = weight * self.domain.reference**power / side**power
                changed[f"{term}_coefficient"] = min(coefficient, MOST_WEIGHT)
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
        side, power = self.domain.side, _POWERS[term]
        coefficient: float = getattr(self, f"{term}_coefficient")
        return round_to_digits(coefficient * side**power / self.domain.reference**power)

    def facts(self) -> dict[str, Any]:
        """Name, origin, sizes and weights, as reports list them."""
        return {
            "name": self.name,
            "source": self.source,
            "gauge": self.gauge,
            "sha256": self.sha256,
            **self.domain.facts,
            f"stroke_{self.domain.kind}s": len(self.theta),
            "w_strokes": self.stroke_coefficient,
            "w_beta": self.skew_coefficient,
            "stroke_weight": self.stroke_weight,
            "skew_weight": self.skew_weight,
        }

    @property
    def summary(self) -> str:
        """Name, domain, strokes, gauge, right angles, weights unless they are defaults, and indices."""
        parts = [f"{self.name}: {self.domain.summary}", f"{len(self.theta)} with strokes, gauge {self.gauge}"]
        parts += ["orthogonal"] * self.orthogonal
        for term, usual in (("stroke", STROKE_WEIGHT), ("skew", SKEW_WEIGHT)):
            coefficient, weight = f"{term}_coefficient", self._weight(term)
            if weight != usual and getattr(self, coefficient) != getattr(Instance, coefficient):
                parts.append(f"{term} weight {weight:g}")
        parts += [] if self.indices is None else [f"prescribed indices: {len(self.indices)}"]
        return ", ".join(parts)

    @cached_property
    def sha256(self) -> str:
        """64 hexadecimal digits of the whole content; equal only for equal instances."""
        digest = hashlib.sha256(b"crossfield-instance 1\n")
        for text in (self.name, self.gauge, self.source, self.view):
            if text is not None:
                digest.update(text.encode() + b"\0")
        size, numbers, arrays = self.domain.content()
        scalars = np.array([*size, self.stroke_coefficient, self.skew_coefficient, *numbers], dtype="<f8")
        strokes = self.domain.places(self.stroke_index).astype("<i4")
        for array in (scalars, *arrays, strokes, self.theta.astype("<f8"), self.w.astype("<f8")):
            digest.update(array.tobytes())
        if self.orthogonal:
            digest.update(b"orthogonal\n")
        if self.pair_weights is not None:
            digest.update(self.pair_weights.astype("<f8").tobytes())
        if self.indices is not None:
            digest.update(b"indices\n" + self.indices.astype("<i4").tobytes())
        return digest.hexdigest()


def _read_only(array: np.ndarray[Any, Any]) -> Any:
    array.setflags(write=False)
    return array
