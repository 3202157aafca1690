"""The strokes that a picture of a drawing shows.

resvg draws the picture, without fonts, files and links. A stroke counts where the colour at its centre line
differs from the ground, which is the picture without strokes. So what is clipped, masked, covered, erased or
off the page does not count, and white lines on a dark page do. Where colours do not tell which stroke a pixel
shows, a second picture, with a flat colour for each shape, tells which one is in front.
"""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final
from xml.etree.ElementTree import Element, tostring

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError, shortened
from ..instance.domain import Bools, Floats, Ints
from .colour import PAPER
from .cover import Box, Indices
from .curves import cut_cubics, evaluate_cubics, run_numbers

RENDERED_SIDE: Final = 1024  # pixels on the longer side of the pictures
_LEAST_WIDTH: Final = 3.0  # pixels; thinner strokes are widened, so that each has pixels at its centre line
_STEP: Final = 1.5  # pixels between two samples of a centre line
_MOST_SAMPLES: Final = 4_000_000
_SAME: Final = 0.03  # greatest difference of equal colours in a channel
_CROSSING: Final = 12.0  # widths of the shape in front: a line that is covered for longer does not cross it
_MEETING: Final = 3.0  # the same for the covered end of a line
_GLITCH: Final = 3.0  # pixels: a shorter gap is one of rasterization
_WORTH_A_NOTE: Final = 0.05  # of the length of a shape
_HIDDEN, _VISIBLE, _CROSSED = 0, 1, 2


@dataclass(frozen=True, eq=False)
class PaintedShape:
    """A painted shape of a drawing.

    points: (k, 4, 2), control points of its centre line in the units of the page, none for an area. paint: of
    its stroke, or else of its fill, as #rrggbb, #rrggbbaa or url(#id). style: with what it inherits. width:
    of its stroke in units of the page. scale: units of the page per unit of the element. chosen: whether it
    has a chosen label.
    """

    element: Element
    name: str
    points: Floats
    paint: str
    style: Mapping[str, str]
    width: float
    scale: float
    is_stroked: bool
    is_filled: bool
    chosen: bool

    @property
    def is_ground(self) -> bool:
        """Whether its fill is an area, and so belongs to the ground of the strokes."""
        return self.is_filled and (self.is_stroked or not len(self.points))


@dataclass(frozen=True, eq=False)
class Seen:
    """The visible parts of n shapes.

    points: (m, 4, 2), control points, in the order of the shapes. shape, line: (m,), number of the shape, and
    of the unbroken line among all shapes, of which each is a part. colour: (n, 3), red, green, blue in
    [0, 1]. strength: (n,), of the lines of a shape, the square of their difference from the ground, in
    [0, 1], times their width; not a number for an area.
    """

    points: Floats
    shape: Ints
    line: Ints
    colour: Floats
    strength: Floats


@dataclass(frozen=True, eq=False)
class _LineSamples:
    """Points on the centre lines of shapes, in the order of the lines.

    shape, cubic, run: (s,), numbers of the shape, of its cubic among all, and of the unbroken run. start,
    end: (s,), parameters on the cubic between which a sample stands. place: (s, 2), in units of the page.
    pixels: (3, s), number of the picture's pixel there and to both sides; -1 off the page. length: (s,), in
    pixels. width: (n,), of the stroke of each shape in pixels, widened.
    """

    shape: Indices
    cubic: Indices
    run: Ints
    start: Floats
    end: Floats
    place: Floats
    pixels: Indices
    length: Floats
    width: Floats


def see_strokes(
    root: Element, window: Box, shapes: Sequence[PaintedShape], paper: str, *, is_line: Bools
) -> tuple[Seen, tuple[str, ...]]:
    """The visible parts of shapes, and notes on the strokes that are left out. Raises InputError.

    root: the drawing, framed by the window: x, y, width and height. Its shapes get other styles. paper: the
    colour behind it, as #rrggbb. is_line: which shapes are curvature lines.
    """
    pixel = max(window[2:]) / max(int(root.attrib[side]) for side in ("width", "height"))
    samples = _sample_lines(shapes, window, pixel)
    styles = [shape.element.get("style", "") for shape in shapes]
    for shape, style in zip(shapes, styles, strict=True):
        restyle(shape, style + _widened(shape, pixel))
    shown, ground = picture_of(root, paper), None
    if any(shape.is_ground for shape in shapes):
        for shape, style in zip(shapes, styles, strict=True):
            restyle(shape, style + ";stroke:none" + ("" if shape.is_ground else ";fill:none"))
        ground = picture_of(root, paper)
    paints = np.array([opaque_colour(shape.paint) for shape in shapes])
    expected = paints[samples.shape]

    def look(pixel: Indices) -> tuple[Floats, Floats, Bools, Bools]:
        """Colours at pixels, how far they are from the ground, where they differ, and where they fit."""
        colour = np.where(pixel[:, None] >= 0, _at(shown, pixel, paper), np.nan)
        difference = np.abs(colour - _at(ground, pixel, paper)).max(axis=1)
        contrast = difference > PAPER
        return colour, difference, contrast, contrast & (np.abs(colour - expected).max(axis=1) <= _SAME)

    colour, difference, contrast, own = look(samples.pixels[0])
    notes: tuple[str, ...] = ()
    visible, front = own, 2 * samples.shape
    if not own.all():
        fronts = _find_fronts(root, shapes, styles, samples, pixel)
        place = np.zeros(len(own), dtype=np.intp)
        for side in (1, 2):  # of what is clipped or covered along its centre line
            place[~contrast & look(samples.pixels[side])[2] & (fronts[side] == 2 * samples.shape)] = side
        number = np.arange(len(own))
        front = fronts[place, number]
        colour, difference, contrast, own = look(samples.pixels[place, number])
        visible = _decide(samples, front, is_line, contrast=contrast, own=own)
        # A stroke in the colour of its ground is none, and needs no note.
        notes = _describe_hidden(samples, shapes, ~visible & (front != 2 * samples.shape))
    colour[~_shows_colour(samples, visible & contrast, front, own)] = np.nan
    return _collect(samples, shapes, visible, np.column_stack([colour, difference]), paints), notes


def _shows_colour(samples: _LineSamples, visible: Bools, front: Indices, own: Bools) -> Bools:
    """Which samples (s,) show the colour of their shape: in front, or else below clear areas and masks."""
    in_front = visible & (own | (front == 2 * samples.shape))
    has_some = np.bincount(samples.shape, in_front) > 0
    return np.asarray(in_front | (visible & ~has_some[samples.shape] & ((front < 0) | (front % 2 == 1))))


def restyle(shape: PaintedShape, style: str) -> None:
    """Give a shape another style. resvg drops one that begins with a semicolon."""
    shape.element.set("style", style.lstrip(";"))


def _widened(shape: PaintedShape, pixel: float) -> str:
    """The style that gives a shape a stroke of its paint, wide enough for its centre line to have pixels."""
    if not len(shape.points):
        return ""
    width = max(shape.width * shape.is_stroked, _LEAST_WIDTH * pixel)
    width = width / shape.scale if shape.scale > 0 else width
    opacity = "" if shape.is_stroked else ";stroke-opacity:1"
    return f";stroke:{shape.paint};stroke-width:{width:.6g};vector-effect:none{opacity}"


def opaque_colour(paint: str) -> tuple[float, float, float]:
    """Red, green and blue in [0, 1] of an opaque colour; not numbers for other paints."""
    if len(paint) != 7 or not paint.startswith("#"):
        return np.nan, np.nan, np.nan
    red, green, blue = (int(paint[place : place + 2], 16) / 255 for place in (1, 3, 5))
    return red, green, blue


def choose_paper(lines: Sequence[PaintedShape]) -> str:
    """Black if most lines are as light as white paper and no area lies behind them, else white.

    Light lines that are much wider than the others are those of an eraser.
    """
    drawn = [line for line in lines if len(line.points)]
    if not drawn or any(line.is_ground for line in lines):
        return "#ffffff"
    light = np.array([1 - min(opaque_colour(line.paint[:7])) < PAPER for line in drawn])
    length = np.array([np.hypot(*np.diff(line.points, axis=1).T).sum() for line in drawn])
    width = np.array([line.width for line in drawn])
    if length @ light <= length.sum() / 2:
        return "#ffffff"
    return "#000000" if light.all() or np.median(width[light]) <= 2 * np.median(width[~light]) else "#ffffff"


def picture_of(root: Element, paper: str = "#ffffff") -> NDArray[np.uint8]:
    """The picture of a framed drawing on paper, uint8 [h, w, 3], not antialiased. Raises InputError."""
    import resvg_py
    from PIL import Image

    try:
        data = resvg_py.svg_to_bytes(
            svg_string=tostring(root, encoding="unicode"),
            background=paper,
            skip_system_fonts=True,
            shape_rendering="crisp_edges",
        )
    except BaseException as error:
        if isinstance(error, ValueError) or type(error).__name__ == "PanicException":  # of resvg's own code
            raise InputError(f"cannot be drawn: {shortened(error)}; export it again") from error
        raise
    return np.asarray(Image.open(io.BytesIO(bytes(data))).convert("RGB"))


def _at(picture: NDArray[np.uint8] | None, pixel: Indices, paper: str) -> Floats:
    """Colours (s, 3) in [0, 1] at pixels (s,); paper without a picture."""
    if picture is None:
        return np.tile(opaque_colour(paper), (len(pixel), 1))
    return np.asarray(picture.reshape(-1, 3)[pixel] / 255.0)


def _sample_lines(shapes: Sequence[PaintedShape], window: Box, pixel: float) -> _LineSamples:
    """Samples of the centre lines of all shapes, at least two on each cubic."""
    points = np.concatenate([shape.points for shape in shapes])
    number = np.repeat(np.arange(len(shapes)), [len(shape.points) for shape in shapes])
    length = np.hypot(*np.moveaxis(np.diff(points, axis=1), -1, 0)).sum(axis=1) / pixel
    step = max(_STEP, float(length.sum()) / _MOST_SAMPLES)
    count = np.ceil(length / step).clip(2, _MOST_SAMPLES).astype(np.intp)
    cubic = np.repeat(np.arange(len(points)), count)
    place = np.arange(len(cubic)) - np.repeat(np.cumsum(count) - count, count)
    start, end = place / count[cubic], (place + 1) / count[cubic]
    at = evaluate_cubics(points[cubic], (start + end) / 2)
    ways = np.where(np.diff(cubic) == 0, np.hypot(*np.diff(at, axis=0).T), 0.0) / pixel
    ways = np.r_[0.0, ways, 0.0]
    wide, high = (max(1, round(side / pixel)) for side in window[2:])
    place = (at - window[:2]) / np.array(window[2:]) * (wide, high)
    way = evaluate_cubics(points[cubic], end) - evaluate_cubics(points[cubic], start)
    width = np.maximum([shape.width / pixel for shape in shapes], _LEAST_WIDTH)
    quarter = width[number[cubic]] / 4
    aside = way[:, ::-1] * (-1, 1) * (quarter / np.maximum(np.hypot(*way.T), 1e-300))[:, None]
    pixels = []
    for spot in (place, place + aside, place - aside):
        # A line on the edge of the page shows half of its width.
        is_shown = ((spot >= -0.5) & (spot <= (wide + 0.5, high + 0.5))).all(axis=1)
        column, row = spot.clip(0, (wide - 0.5, high - 0.5)).astype(np.intp).T
        pixels.append(np.where(is_shown, row * wide + column, -1))
    return _LineSamples(
        number[cubic],
        cubic,
        run_numbers(points, number.astype(np.int32))[cubic],
        start,
        end,
        at,
        np.stack(pixels),
        (ways[:-1] + ways[1:]) / 2,
        width,
    )


def _find_fronts(
    root: Element, shapes: Sequence[PaintedShape], styles: Sequence[str], samples: _LineSamples, pixel: float
) -> Indices:
    """The number of the paint in front (3, s) at the pixels of each sample.

    Number 2 n is the line of shape n, and 2 n + 1 the area that it fills. -1 is paper, -2 a mixture.
    """
    for number, (shape, style) in enumerate(zip(shapes, styles, strict=True)):
        line, area = (f"#{_flat_colour(2 * number + part):06x}" for part in (0, int(shape.is_ground)))
        flat = ";opacity:1;stroke-opacity:1;fill-opacity:1"
        flat += f";stroke:{line}" if len(shape.points) else ""
        flat += f";fill:{area}" if shape.is_filled else ""
        restyle(shape, style + _widened(shape, pixel) + flat)
    _make_opaque(root)
    picture = picture_of(root).reshape(-1, 3)
    known = {_flat_colour(number): number for number in range(2 * len(shapes))} | {0xFFFFFF: -1}
    codes = picture[samples.pixels] @ np.array([1 << 16, 1 << 8, 1])
    codes, inverse = np.unique(codes, return_inverse=True)
    front = np.array([known.get(code, -2) for code in codes.tolist()])[inverse.reshape(samples.pixels.shape)]
    return np.where(samples.pixels < 0, -1, front)


def _flat_colour(number: int) -> int:
    """A colour of its own for each number, far from those of its neighbours, and never white."""
    return (number * 7_368_787 + 1) % 16_777_213


def _make_opaque(root: Element) -> None:
    """Make groups opaque, except in masks, whose colours decide what they show."""
    stack = [root]
    while stack:
        element = stack.pop()
        if element.tag.rpartition("}")[2] not in ("mask", "clipPath", "pattern"):
            style = element.get("style", "")
            if "opacity" in style:
                element.set("style", style + ";opacity:1")
            stack += element


def _decide(samples: _LineSamples, front: Indices, is_line: Bools, *, contrast: Bools, own: Bools) -> Bools:
    """Which samples (s,) are visible."""
    is_crossed = contrast & ~own & (front >= 0) & (front % 2 == 0) & (front != 2 * samples.shape)
    state = np.where(is_crossed, _CROSSED, np.where(contrast, _VISIBLE, _HIDDEN))
    limit = np.where(is_crossed, _MEETING * samples.width[front.clip(0) // 2], _GLITCH)
    # A curvature line goes on below a line that cuts the field, as where both run along a silhouette.
    limit[is_crossed & is_line[samples.shape] & ~is_line[front.clip(0) // 2]] = np.inf
    starts = np.flatnonzero((np.diff(samples.run, prepend=-1) != 0) | (np.diff(state, prepend=-1) != 0))
    length = np.add.reduceat(samples.length, starts)
    part, run = state[starts], samples.run[starts]
    beside = [
        np.where(np.roll(run, step) == run, np.roll(part, step), _HIDDEN) == _VISIBLE for step in (1, -1)
    ]
    limit = np.maximum.reduceat(limit, starts)
    is_crossing = (part == _CROSSED) & beside[0] & beside[1] & (length <= _CROSSING / _MEETING * limit)
    visible = (part == _VISIBLE) | is_crossing | ((length <= limit) & (beside[0] | beside[1]))
    return np.repeat(visible, np.diff([*starts, len(state)]))


def _describe_hidden(samples: _LineSamples, shapes: Sequence[PaintedShape], lost: Bools) -> tuple[str, ...]:
    """A note on the shapes of which more than a small part, samples (s,), is hidden."""
    whole = np.bincount(samples.shape, samples.length, len(shapes))
    share = np.bincount(samples.shape[lost], samples.length[lost], len(shapes)) / np.maximum(whole, 1e-9)
    left_out = np.flatnonzero(share > _WORTH_A_NOTE)
    if not len(left_out):
        return ()
    first = samples.place[np.flatnonzero(lost & (samples.shape == left_out[0]))[0]]
    count = f"{len(left_out)} strokes are" if len(left_out) > 1 else "1 stroke is"
    partly = "" if (share[left_out] > 1 - _WORTH_A_NOTE).all() else ", wholly or in part"
    place = f"{shapes[left_out[0]].name} round ({first[0]:.4g}, {first[1]:.4g})"
    return (f"{count} hidden{partly}, first {place}: left out, as the picture does not show it there",)


def _collect(
    samples: _LineSamples, shapes: Sequence[PaintedShape], visible: Bools, colour: Floats, paints: Floats
) -> Seen:
    """The visible parts of all shapes, whole cubics unchanged.

    colour: (s, 4), red, green, blue, nan where another's, and their difference from the ground. paints: the
    colours (n, 3) of the shapes' paints, which are theirs unless the picture shows others.
    """
    points = np.concatenate([shape.points for shape in shapes])
    before = np.r_[False, visible[:-1] & (np.diff(samples.cubic) == 0)]
    after = np.r_[before[1:] & visible[1:], False]
    starts, ends = np.flatnonzero(visible & ~before), np.flatnonzero(visible & ~after)
    parts = cut_cubics(points[samples.cubic[starts]], samples.start[starts], samples.end[ends])
    rgb, strength = paints.copy(), np.full(len(shapes), np.nan)
    is_shown = np.isfinite(colour[:, 0])
    shown, owner = colour[is_shown], samples.shape[is_shown]
    edges = np.searchsorted(owner, np.arange(len(shapes) + 1))
    for number in np.unique(owner):
        *median, difference = np.median(shown[edges[number] : edges[number + 1]], axis=0)
        if shapes[number].is_stroked:
            strength[number] = difference**2 * shapes[number].width
        if not (np.abs(median - rgb[number]) <= _SAME).all():
            rgb[number] = median
    numbers = samples.shape[starts].astype(np.int32)
    return Seen(parts, numbers, samples.run[starts], np.nan_to_num(rgb), strength)
