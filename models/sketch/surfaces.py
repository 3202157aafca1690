"""Instances with a known answer: curved surfaces, projected, with their exact curvature lines.

Each surface is parametrised by its lines of curvature, s = const and t = const, turned in space and viewed
along -z. x runs to the right, y up, z towards the viewer.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np

from ..arguments import check_choice
from ..errors import InputError
from ..instance.angles import arctangent, cosine, sine, transform_vectors, vector_length, wrap
from ..instance.domain import Bools, Floats
from ..instance.instance import SKEW_WEIGHT, STROKE_WEIGHT, Gauge, Instance
from .cover import LEAST_WEIGHT, Frame, box_around, cover_by_segments, fit_frame
from .outline import largest_part
from .read import DEFAULT_SIZE, check_size

_NEWTON: Final = 12
_SEEDS: Final = 120  # lattice of starting points per side
_SAMPLES: Final = 600  # points along a drawn line
_BISECTIONS: Final = 12

_Chart = Callable[[Floats, Floats], Floats]
_Profile = Callable[[Floats], Floats]


@dataclass(frozen=True)
class CurvaturePatch:
    """A patch of a surface, parametrised by its curvature lines and turned towards the viewer.

    position, along_s, along_t: the point and its derivatives by s and t, before turning, shape (..., 3).
    share: intended part of the pixels with strokes.
    """

    position: _Chart
    along_s: _Chart
    along_t: _Chart
    s_range: tuple[float, float]
    t_range: tuple[float, float]
    turn: Floats
    share: float

    def point(self, s: Floats, t: Floats) -> Floats:
        """Points of the turned surface, shape (..., 3)."""
        return transform_vectors(self.position(s, t), self.turn)

    def tangents(self, s: Floats, t: Floats) -> tuple[Floats, Floats]:
        """Derivatives of the turned surface by s and by t, shape (..., 3) each."""
        return transform_vectors(self.along_s(s, t), self.turn), transform_vectors(
            self.along_t(s, t), self.turn
        )


@dataclass(frozen=True, eq=False)
class AnalyticInstance:
    """An instance with the exact line angles of both projected curvature lines, and the surface itself.

    At the centre of each pixel of the grid: u_angle, v_angle: float (n,) in [0, pi) radians,
    counter-clockwise with y up; normals: unit vectors towards the viewer, (n, 3); heights: z in pixels, (n,).
    segments: the lines whose pixels are strokes, (m, 2, 2), in the units of `origin`, y down.
    """

    instance: Instance
    u_angle: Floats
    v_angle: Floats
    normals: Floats
    heights: Floats
    segments: Floats


def rotation_by(tilt: float, spin: float) -> Floats:
    """The rotation by `tilt` about x, the top away, then by `spin` about z (degrees)."""
    a, b = np.radians([-tilt, spin])
    about_x = np.array([[1, 0, 0], [0, cosine(a), -sine(a)], [0, sine(a), cosine(a)]])
    about_z = np.array([[cosine(b), -sine(b), 0], [sine(b), cosine(b), 0], [0, 0, 1]])
    return transform_vectors(about_x.T, about_z).T


def _vectors(x: Floats, y: Floats, z: Floats) -> Floats:
    return np.stack(np.broadcast_arrays(x, y, z), axis=-1)


def _surface_of_revolution(
    profile: tuple[_Profile, _Profile],
    slopes: tuple[_Profile, _Profile],
    t_range: tuple[float, float],
    cut: float,
    *,
    turn: tuple[float, float] = (-30, 15),
    share: float = 0.25,
) -> CurvaturePatch:
    """The front, up to `cut` radians from the sides, of a profile (radius, y) revolved about the y axis."""
    (radius, y), (widening, rise) = profile, slopes
    return CurvaturePatch(
        position=lambda s, t: _vectors(radius(t) * cosine(s), y(t), radius(t) * sine(s)),
        along_s=lambda s, t: _vectors(-radius(t) * sine(s), 0 * t, radius(t) * cosine(s)),
        along_t=lambda s, t: _vectors(widening(t) * cosine(s), rise(t), widening(t) * sine(s)),
        s_range=(cut, np.pi - cut),
        t_range=t_range,
        turn=rotation_by(*turn),
        share=share,
    )


def _ellipsoid(long: float, deep: float, short: float) -> CurvaturePatch:
    """The front of an ellipsoid with semi-axes long > deep > short along x, z and y."""
    # Curvature lines are intersections with confocal quadrics. The roots m in [deep^2, long^2] and n in
    # [short^2, deep^2] of x^2 / (long^2 - m) + z^2 / (deep^2 - m) + y^2 / (short^2 - m) = 1 are constant on
    # them: m = long^2 - (long^2 - deep^2) cos^2 s and n = deep^2 - (deep^2 - short^2) sin^2 t.
    k = (long**2 - deep**2) / (long**2 - short**2)

    def wide(t: Floats) -> Floats:
        return vector_length(sine(t), np.sqrt(k) * cosine(t))

    def high(s: Floats) -> Floats:
        return vector_length(sine(s), np.sqrt(1 - k) * cosine(s))

    return CurvaturePatch(
        position=lambda s, t: _vectors(
            long * cosine(s) * wide(t), short * cosine(t) * high(s), deep * sine(s) * sine(t)
        ),
        along_s=lambda s, t: _vectors(
            -long * sine(s) * wide(t),
            short * cosine(t) * k * sine(s) * cosine(s) / high(s),
            deep * cosine(s) * sine(t),
        ),
        along_t=lambda s, t: _vectors(
            long * cosine(s) * (1 - k) * sine(t) * cosine(t) / wide(t),
            -short * sine(t) * high(s),
            deep * sine(s) * cosine(t),
        ),
        s_range=(0.6, np.pi - 0.6),
        t_range=(0.9, np.pi - 0.9),
        turn=rotation_by(20, 20),
        share=0.25,
    )


_TUBE: Final = 0.45  # radius of the torus's tube; its centre line has radius 1
_WAVE: Final = 0.6  # height of the wave

SURFACES: Final[dict[str, CurvaturePatch]] = {
    "tilted_cylinder": _surface_of_revolution(
        (lambda t: 1 + 0 * t, lambda t: t),
        (lambda t: 0 * t, lambda t: 1 + 0 * t),
        (-1.3, 1.3),
        0.45,
        turn=(35, 20),
        share=1 / 3,
    ),
    "torus_patch": CurvaturePatch(
        position=lambda s, t: _vectors(
            (1 + _TUBE * cosine(t)) * cosine(s), (1 + _TUBE * cosine(t)) * sine(s), _TUBE * sine(t)
        ),
        along_s=lambda s, t: _vectors(
            -(1 + _TUBE * cosine(t)) * sine(s), (1 + _TUBE * cosine(t)) * cosine(s), 0 * s
        ),
        along_t=lambda s, t: _vectors(
            -_TUBE * sine(t) * cosine(s), -_TUBE * sine(t) * sine(s), _TUBE * cosine(t)
        ),
        s_range=(0.5, np.pi - 0.4),
        t_range=(0.7, np.pi - 0.3),
        turn=rotation_by(30, -10),
        share=0.2,
    ),
    "wave_sheet": CurvaturePatch(
        position=lambda s, t: _vectors(s, t, _WAVE * sine(s)),
        along_s=lambda s, t: _vectors(1 + 0 * s, 0 * t, _WAVE * cosine(s)),
        along_t=lambda s, t: _vectors(0 * s, 1 + 0 * t, 0 * s),
        s_range=(-1.5 * np.pi, 1.5 * np.pi),
        t_range=(-4.0, 4.0),
        turn=rotation_by(50, 25),
        share=0.2,
    ),
    "cone": _surface_of_revolution(
        (lambda t: 0.9 - 0.3 * t, lambda t: t),
        (lambda t: -0.3 + 0 * t, lambda t: 1 + 0 * t),
        (-1.3, 1.3),
        0.45,
    ),
    "vase": _surface_of_revolution(
        (lambda t: 1 + 0.2 * sine(2 * t), lambda t: t),
        (lambda t: 0.4 * cosine(2 * t), lambda t: 1 + 0 * t),
        (-1.5, 1.5),
        0.65,
    ),
    "spheroid": _surface_of_revolution(
        (cosine, lambda t: 1.5 * sine(t)), (lambda t: -sine(t), lambda t: 1.5 * cosine(t)), (-0.7, 0.7), 0.75
    ),
    "ellipsoid": _ellipsoid(1.5, 1.2, 1.0),
}
"""The surfaces by name. Cylinder, wave and cone are developable; the last one has no symmetry of rotation."""


def analytic(
    name: str,
    size: int = DEFAULT_SIZE,
    *,
    gauge: Gauge = "strokes",
    stroke_weight: float = STROKE_WEIGHT,
    skew_weight: float = SKEW_WEIGHT,
) -> AnalyticInstance:
    """Instance of a computed surface, with its exact answer.

    A pixel belongs to the mask if its centre lies on the largest connected part of the patch. Strokes are
    evenly parametrised curvature lines of both families. Their number brings the share of stroke pixels as
    close as possible to the surface's `share`. Their theta is exact at the pixel's centre, and their w that
    of drawn strokes.

    Parameters
    ----------
    name
        Name of a sample of the kind `analytic`; `crossfield list` lists them.
    size
        Pixels on the longer side of the grid, 1 to 4096.
    gauge
        Window of alpha, as in `Instance`.
    stroke_weight, skew_weight
        Weights that mean the same on every grid, as in `Instance.with_weights`.

    Returns
    -------
    AnalyticInstance
        The instance, and the exact angles of both lines at every pixel.

    Raises
    ------
    InputError
        For an unknown name, and for a size out of range.
    InstanceError
        For a weight out of range.

    """
    check_choice("surface", name, SURFACES)
    check_size(size)
    surface = SURFACES[name]
    frame = _frame_patch(surface, size)
    s, t, mask = _find_parameters(surface, frame)
    tangents = surface.tangents(s, t)
    u_angle, v_angle = (wrap(arctangent(d[:, 1], d[:, 0]), 0.0, np.pi) for d in tangents)
    weight, on_u, segments = _choose_strokes(surface, frame, mask)
    stroke = weight >= LEAST_WEIGHT
    instance = Instance.on_pixels(
        name=name,
        mask=mask,
        stroke_pixels=np.argwhere(stroke).astype(np.int32),
        theta=np.where(on_u, u_angle, v_angle)[stroke[mask]],
        w=np.minimum(weight[stroke], 1.0),
        gauge=gauge,
        source=f"curvature lines of {name}, orthographic",
        pixel_size=frame.pixel,
        origin=(frame.x, frame.y),
    )
    return AnalyticInstance(
        instance.with_weights(stroke_weight=stroke_weight, skew_weight=skew_weight),
        u_angle,
        v_angle,
        normals=_normals_towards_viewer(*tangents),
        heights=surface.point(s, t)[:, 2] / frame.pixel,
        segments=segments,
    )


def _normals_towards_viewer(first: Floats, second: Floats) -> Floats:
    """The unit normals (n, 3) of tangent planes, z above 0."""
    normal = np.cross(first, second)
    x, y, z = normal.T
    return normal * (np.where(z < 0, -1.0, 1.0) / vector_length(vector_length(x, y), z))[:, None]


def _frame_patch(surface: CurvaturePatch, size: int) -> Frame:
    s, t = np.meshgrid(np.linspace(*surface.s_range, 400), np.linspace(*surface.t_range, 400))
    return fit_frame(box_around(surface.point(s, t)[..., :2] * (1, -1)), size, margin=False)


def _find_parameters(surface: CurvaturePatch, frame: Frame) -> tuple[Floats, Floats, Bools]:
    """Parameters s, t (n,) of the pixels whose centre is on the patch, and the mask of these pixels."""
    row, column = np.indices(frame.shape).reshape(2, -1)
    wanted = np.stack([frame.x + (column + 0.5) * frame.pixel, -frame.y - (row + 0.5) * frame.pixel], axis=-1)
    s, t = _invert_projection(surface, wanted)
    miss = vector_length(*(surface.point(s, t)[:, :2] - wanted).T)
    on_patch = miss < 1e-9
    for value, ends in ((s, surface.s_range), (t, surface.t_range)):
        on_patch &= (value >= ends[0] - 1e-9) & (value <= ends[1] + 1e-9)
    if not on_patch.any():
        raise InputError("no pixel centre lies on the surface; choose a larger size")
    mask = largest_part(on_patch.reshape(frame.shape))  # tips may touch the rest at corners only
    return s[mask.ravel()], t[mask.ravel()], mask


def _invert_projection(surface: CurvaturePatch, wanted: Floats) -> tuple[Floats, Floats]:
    """Parameters whose projection is `wanted` (n, 2), by Newton's method from a near lattice point."""
    from scipy.spatial import cKDTree

    lattice = np.meshgrid(np.linspace(*surface.s_range, _SEEDS), np.linspace(*surface.t_range, _SEEDS))
    s0, t0 = (axis.ravel() for axis in lattice)
    nearest = cKDTree(surface.point(s0, t0)[:, :2]).query(wanted)[1]
    s, t = s0[nearest], t0[nearest]
    for _ in range(_NEWTON):
        error = wanted - surface.point(s, t)[:, :2]
        (ax, ay), (bx, by) = (d[:, :2].T for d in surface.tangents(s, t))
        area = ax * by - ay * bx
        # Away from the patch the projection may fold; such pixels only have to stay finite.
        area = np.where(np.abs(area) < 1e-3, np.copysign(1e-3, area), area)
        s = s + (by * error[:, 0] - bx * error[:, 1]) / area
        t = t + (ax * error[:, 1] - ay * error[:, 0]) / area
        s, t = (
            np.clip(value, ends[0] - 0.5, ends[1] + 0.5)
            for value, ends in ((s, surface.s_range), (t, surface.t_range))
        )
    return s, t


def _choose_strokes(surface: CurvaturePatch, frame: Frame, mask: Bools) -> tuple[Floats, Bools, Floats]:
    """Weight [height, width] of drawn lines; which pixels (n,) have one of family u; and the segments."""
    near, far = 1.0, float(max(frame.shape))
    candidates = []
    for _ in range(_BISECTIONS):  # of the spacing, by ratio
        middle = float(np.sqrt(near * far))
        u_lines, v_lines = _lines_at_spacing(surface, frame, middle)
        both = cover_by_segments(np.concatenate([u_lines, v_lines]), frame)
        weight = np.where(mask, both.weight, 0.0)
        share = float((weight >= LEAST_WEIGHT).sum() / mask.sum())
        near, far = (middle, far) if share > surface.share else (near, middle)
        candidates.append((abs(share - surface.share), weight, u_lines, v_lines))
    _, weight, u_lines, v_lines = min(candidates, key=lambda candidate: candidate[0])
    of_u, of_v = (cover_by_segments(lines, frame).amount for lines in (u_lines, v_lines))
    return weight, (of_u >= of_v)[mask], np.concatenate([u_lines, v_lines])


def _lines_at_spacing(surface: CurvaturePatch, frame: Frame, spacing: float) -> tuple[Floats, Floats]:
    """Segments (m, 2, 2), y down, of at least one line t = const (family u) and s = const (family v)."""
    middle_s, middle_t = np.mean(surface.s_range), np.mean(surface.t_range)
    along_s, along_t = np.linspace(*surface.s_range, _SAMPLES), np.linspace(*surface.t_range, _SAMPLES)
    middle_lines = ((along_s, np.full(_SAMPLES, middle_t)), (np.full(_SAMPLES, middle_s), along_t))
    wide, high = (
        float(vector_length(*np.diff(surface.point(*line)[:, :2], axis=0).T).sum()) / frame.pixel
        for line in middle_lines
    )
    at_t = _spread_evenly(surface.t_range, high / spacing)
    at_s = _spread_evenly(surface.s_range, wide / spacing)
    u = _polyline_segments(surface, *np.broadcast_arrays(along_s[None], at_t[:, None]))
    v = _polyline_segments(surface, *np.broadcast_arrays(at_s[:, None], along_t[None]))
    return u, v


def _spread_evenly(ends: tuple[float, float], count: float) -> Floats:
    """Middles of about `count` equal parts of an interval."""
    number = max(1, round(count))
    return ends[0] + (np.arange(number) + 0.5) * (ends[1] - ends[0]) / number


def _polyline_segments(surface: CurvaturePatch, s: Floats, t: Floats) -> Floats:
    points = surface.point(s, t)[..., :2] * (1, -1)
    return np.stack([points[:, :-1], points[:, 1:]], axis=2).reshape(-1, 2, 2)
