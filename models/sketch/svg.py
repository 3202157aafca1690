"""Reader of SVG drawings: the strokes that their picture shows, as cubic Beziers.

A drawing passes five steps. defusedxml parses it and refuses entities. `cascade.py` finds the style of every
element. The walk below replaces each `use` by what it shows and places the outline of every painted shape,
which `path_data.py` reads. `visible.py` lets resvg draw the result, and keeps of each stroke what the picture
shows, in the colour that it shows. Where pen strokes are filled outlines, their picture is thinned.
Pictures and `use` of other files are never loaded, text, dashes, markers and filters are ignored, and the
work is bounded by the limits of `input_limits`.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Any, Final
from xml.etree.ElementTree import Element, ParseError, SubElement

import numpy as np

from ..errors import InputError, NoStrokeError, shortened
from ..input_limits import (
    MAX_CURVES,
    MAX_DATA,
    MAX_DEPTH,
    MAX_ELEMENTS,
    MAX_TAGS,
    MAX_TRANSFORM,
    MAX_USES,
)
from ..instance.angles import transform_vectors, vector_length
from ..instance.domain import Bools, Floats, Ints
from .cascade import UNSHOWN, Cascade, background_of, cascade_of
from .colour import PAPER, is_red
from .cover import Box, box_around
from .curves import Curves, flatten, lines_as_cubics, run_numbers
from .labels import LabelMatcher, colour_label, labels_of
from .meetings import GRID, find_meetings, resample
from .path_data import SHAPES, path_data, shape_curves, too_many_curves
from .svg_effort import choose_side
from .svg_elements import (
    GROUP,
    HREFS,
    SVG,
    chosen_attributes,
    length_of,
    name_of,
    number_of,
    tag_of,
)
from .svg_page import (
    GREATEST,
    UNPAGED,
    DrawingPage,
    fit_view,
    frame_drawing,
    page_of,
    view_box,
    window_around,
)
from .thinning import join_ways, smooth_way, trace_shape
from .visible import PaintedShape, Seen, choose_paper, opaque_colour, picture_of, restyle, see_strokes

_CONTAINERS: Final = frozenset({"g", "a", "svg", "switch"})
_INHERITED: Final = (
    "stroke",
    "fill",
    "visibility",
    "color",
    "stroke-width",
    "stroke-opacity",
    "fill-opacity",
    "fill-rule",
)
_START: Final = {"stroke": "none", "fill": "#000000", "visibility": "visible", "color": "#000000"}
_MOVES: Final = ("transform", "transform-origin")
_SERVERS: Final = ("linearGradient", "radialGradient", "pattern")
_REFERENCE: Final = re.compile(r"url\(\s*['\"]?#([^'\")]*)['\"]?\s*\)\s*(.*)")
_SIDES: Final = {"left": "0%", "top": "0%", "center": "50%", "right": "100%", "bottom": "100%"}
_WIDEST: Final = 0.05  # greatest width of a filled stroke as a share of the drawing: others are areas
_LONG: Final = 10.0  # least half perimeter of a filled stroke in its widths
_PAINTED: Final = 0.1  # least length of traced strokes, as a share of the length of others
_FAR: Final = 1000.0  # sides of the page: coordinates beyond it are too large for a renderer
_FINEST: Final = 1e-5  # of the page: least width of a stroke that is seen
_FAINT: Final = 0.24  # of the strength of others: less than half as dark, or a quarter as wide
_WEAK: Final = 0.48  # the same for lines that are surely no part of the object
_STRONG: Final = 0.1  # of the length of lines: part that is stronger than what others are compared with
_MOST: Final = 0.5  # the same for curvature lines, which may be finer than few bold ones
_ASIDE: Final = 0.06  # of its chord: distance of a straight line from it, also of one drawn by hand
_ROUNDING: Final = 1e-9  # of its length: distance from a straight line of points that are on it
_CORNER: Final = 0.02  # of the sides of the box of other lines: distance from a corner of it
_MOST_STOPS: Final = 100  # stops of a gradient that count
_MOST_BODIES: Final = 1000  # larger areas with which an area is compared


@dataclass(frozen=True)
class _Place:
    """An element to visit, and what it takes from those around it.

    size: width and height to which percentages refer. copied: what `use` elements around it show. depth:
    number of elements around it. chosen: whether it, or an element around it, has a chosen label.
    """

    element: Element
    style: Mapping[str, str]
    matrix: Any
    size: tuple[float, float]
    copied: tuple[Element, ...] = ()
    depth: int = 0
    chosen: bool = False


def read_svg(data: bytes, labels: Sequence[str] = ()) -> Curves:
    """Read the visible strokes of an SVG drawing in the units of its viewBox. Raises InputError.

    The last drawing is kept, because pictures of a field show the one that it was read from. Its arrays
    cannot be changed. labels: of the curvature lines, as `label_of` returns them; none: colours decide.
    """
    return _read_svg(data, tuple(labels))


@lru_cache(maxsize=1)
def _read_svg(data: bytes, labels: tuple[str, ...]) -> Curves:
    matcher = LabelMatcher(frozenset(labels)) if labels else None
    root = _parse_xml(data)
    if tag_of(root) != "svg":
        tag = root.tag.split("}")[-1][:30]
        raise InputError(f"its root element is <{tag}>, not <svg>; expected an SVG drawing")
    page = page_of(root)
    cascade = cascade_of("".join(element.itertext()) for element in root.iter() if tag_of(element) == "style")
    styles = cascade.declare(root)
    background = background_of(styles[root])
    walk = _ElementWalk(_put_styles(root, styles), matcher)
    painted = list(walk.shapes(root, page))
    unread = _list_unread(cascade, walk)
    shapes = _leave_out_areas(painted, page, matcher, background or "#ffffff")
    pens = _find_filled_strokes([shape for shape in painted if len(shape.points)])
    if not pens and not sum(len(shape.points) for shape in shapes):
        areas, texts = len(painted), sum(tag_of(element) == "text" for element in root.iter())
        causes = [f"it has areas without a stroke, {areas} in all"] if areas else []
        causes += [f"it has text, {texts} in all; convert it to paths"] if texts else []
        reason = "; ".join([*unread, *causes]) or "it has no visible path, line or shape; export it again"
        raise NoStrokeError(f"draws no stroke: {reason}")
    window = page.window if page else window_around(painted)
    side = choose_side(root, window, painted)
    framed = frame_drawing(root, page, window, side)
    if max(walk.reach, *map(abs, window[:2])) > _FAR * max(window[2:]):
        framed = frame_drawing(_flatten(painted, window), None, (0.0, 0.0, *window[2:]), side)
    if pens:
        strokes = [shape for shape in painted if shape.element in pens or shape.is_stroked]
        ground = np.array(opaque_colour(background or choose_paper(strokes)))
        difference = np.abs(picture_of(framed) / 255 - ground).max(axis=2)
        _paint_strokes(painted, _plain_colours(painted, walk), pens, page, matcher, ground=ground)
        curves = _trace_strokes(framed, page, window, unread, difference, has_choice=matcher is not None)
    else:
        is_line = np.array([_is_curvature_line(shape, matcher) for shape in shapes])
        seen, notes = see_strokes(framed, window, shapes, background or choose_paper(shapes), is_line=is_line)
        curves = _join_strokes(shapes, seen, page, matcher, (*notes, *unread))
    for values in (curves.points, curves.curve, curves.red, curves.chosen, curves.faint):
        if values is not None:
            values.setflags(write=False)
    return curves


def _flatten(shapes: Sequence[PaintedShape], window: Box) -> Element:
    """The shapes alone, without clips and masks, from the origin of a window on.

    Renderers compute in single precision, which is too coarse far away.
    """
    root = Element(SVG + "svg")
    for shape in shapes:
        scale = shape.scale or 1.0
        data = path_data((shape.points - window[:2]) / scale)
        style = ";".join(f"{key}:{value}" for key, value in shape.style.items())
        shape.element.tag = SVG + "path"
        shape.element.attrib = {"d": data, "transform": f"scale({scale!r})", "style": style}
        root.append(shape.element)
    return root


def _find_filled_strokes(shapes: Sequence[PaintedShape]) -> set[Element]:
    """The elements that are only filled, and as long and thin as strokes; none if they are few."""
    if not shapes:
        return set()
    left, top, right, bottom = box_around(np.concatenate([shape.points for shape in shapes]))
    widest = _WIDEST * max(right - left, bottom - top)
    pens, painted, drawn = set(), 0.0, 0.0
    for shape in shapes:
        length = float(vector_length(*(shape.points[:, 3] - shape.points[:, 0]).T).sum())
        if shape.is_stroked:
            drawn += length
        elif 0 < 2 * _area_of(shape) <= min(widest, length / 2 / _LONG) * length:
            pens.add(shape.element)
            painted += length / 2
    return pens if painted > _PAINTED * drawn else set()


def _area_of(shape: PaintedShape) -> float:
    """The area of a filled shape. By the even-odd rule, its largest loop surrounds the others."""
    loop = run_numbers(shape.points, np.zeros(len(shape.points), dtype=np.int32))
    (x, y), (u, v) = shape.points[:, 0].T, shape.points[:, 3].T
    areas = np.bincount(loop, (x * v - u * y) / 2)
    if shape.style.get("fill-rule") == "evenodd":
        return float(2 * np.abs(areas).max() - np.abs(areas).sum())
    return float(abs(areas.sum()))


def _paint_strokes(
    shapes: Sequence[PaintedShape],
    colours: Sequence[Floats],
    pens: set[Element],
    page: DrawingPage | None,
    matcher: LabelMatcher | None,
    *,
    ground: Floats,
) -> None:
    """Paint strokes black, or red where they are curvature lines; white where as pale as the ground."""
    any_line = False
    for shape, colour in zip(shapes, colours, strict=True):
        is_line = bool(is_red(colour))
        if matcher is not None:
            labels = [f"colour={shape.paint[:7]}"] if shape.paint.startswith("#") else []
            is_line = matcher.matches(labels) or shape.chosen
        is_pen = shape.element in pens
        if not (is_pen or shape.is_stroked) and _covers_page(shape, page):
            ground = colour
        is_pale = np.abs(colour - ground).max() <= PAPER
        any_line |= is_line and (is_pen or shape.is_stroked)
        ink = "#fff" if is_pale else "#f00" if is_line else "#000"
        stroke = f";stroke:{ink}" if shape.is_stroked else ""
        fill = f";fill:{ink if is_pen else '#fff'}" if shape.is_filled else ""
        restyle(shape, shape.element.get("style", "") + stroke + fill)
    if matcher is not None:
        matcher.check(any_stroke=any_line)


def _plain_colours(shapes: Sequence[PaintedShape], walk: _ElementWalk) -> list[Floats]:
    """Red, green and blue in [0, 1] of the paint of each shape; of a gradient, the mean of its stops."""
    colours = {
        paint: _mean_of_stops(walk.named[paint[5:-1]], walk)
        if paint.startswith("url(#")
        else np.array(opaque_colour(paint[:7]))
        for paint in {shape.paint for shape in shapes}
    }
    return [colours[shape.paint] for shape in shapes]


def _mean_of_stops(server: Element, walk: _ElementWalk) -> Floats:
    """The mean colour of a gradient, whose stops another one may have; not numbers without stops."""
    linked: Element | None = server
    for _ in range(MAX_DEPTH):
        if linked is None:
            break
        if stops := [child for child in linked[:_MOST_STOPS] if tag_of(child) == "stop"]:
            colours = [opaque_colour(walk.styles[stop].get("stop-color", "#000000")[:7]) for stop in stops]
            return np.asarray(np.mean(colours, axis=0))
        linked = walk.linked(linked)
    return np.full(3, np.nan)


def _trace_strokes(
    root: Element,
    page: DrawingPage | None,
    window: Box,
    notes: tuple[str, ...],
    difference: Floats,
    *,
    has_choice: bool,
) -> Curves:
    """The middle lines of the strokes in the picture of a drawing with painted strokes.

    difference: of the picture's pixels [h, w] from their ground, before strokes were painted, in [0, 1].
    """
    picture = picture_of(root)
    # Black, red and white, paler where a stroke or its layer is translucent.
    is_ink, is_red = picture[..., 1] < 255 * (1 - PAPER), picture[..., 0] > picture[..., 1]
    traced = [trace_shape(is_ink & (is_red == red), trim=True) for red in (False, True)]
    if not any(traced):
        raise InputError("shows no stroke: its filled strokes are hidden")
    pen = max(1.0, is_ink.sum() / sum(len(way) for ways in traced for way in ways))
    ways = [(way, red) for red, ways in enumerate(traced) if ways for way in join_ways(ways, pen, is_ink)]
    pixel = np.array(window[2:]) / picture.shape[1::-1]
    lines = [window[:2] + pixel * (smooth_way(way) + 0.5) for way, _ in ways]
    cubics = [lines_as_cubics(line[:-1], line[1:]) for line in lines]
    number = np.repeat(np.arange(len(ways), dtype=np.int32), [len(part) for part in cubics])
    strength = np.array([np.median(difference[tuple(way.T)]) ** 2 for way, _ in ways])
    red, points = np.array([is_line for _, is_line in ways], dtype=bool)[number], np.concatenate(cubics)
    chosen = red if has_choice else None
    curves = Curves(points, number, red, page.box if page else None, chosen, notes)
    return _mark_faint(curves, [number], strength[number])


def _leave_out_areas(
    shapes: list[PaintedShape], page: DrawingPage | None, matcher: LabelMatcher | None, background: str
) -> list[PaintedShape]:
    """The shapes without lines for those that are only filled.

    Areas show where the body ends if no stroke does: where all strokes are curvature lines, the outlines of
    the outer areas count as strokes.
    """
    kept = [shape if shape.is_stroked else replace(shape, points=shape.points[:0]) for shape in shapes]
    grounds = [shape.paint for shape in shapes if shape.is_filled and _covers_page(shape, page)]
    paper = np.array(opaque_colour(grounds[-1] if grounds else background))
    areas = [
        number
        for number, shape in enumerate(shapes)
        if not (shape.is_stroked or _is_straight(shape) or _is_ground(shape, page, paper))
    ]
    if areas and all(_is_curvature_line(shape, matcher) for shape in kept if len(shape.points)):
        for number in _find_silhouettes(shapes, areas):
            kept[number] = shapes[number]
    return kept


def _find_silhouettes(shapes: Sequence[PaintedShape], areas: Sequence[int]) -> list[int]:
    """The numbers of the areas that are not in the box of a larger one: the outline of the drawing."""
    corners = np.reshape([box_around(shapes[number].points) for number in areas], (-1, 2, 2))
    low, high = corners.swapaxes(0, 1)
    outer: list[int] = []
    for place in np.argsort(-np.prod(high - low, axis=1), kind="stable").tolist():
        around = outer[:_MOST_BODIES]
        is_within = (low[around] <= low[place]) & (high[around] >= high[place])
        if not is_within.all(axis=1).any():
            outer.append(place)
    return [areas[place] for place in outer]


def _is_straight(shape: PaintedShape) -> bool:
    """Whether all points of a shape are on one straight line, so that its fill shows nothing."""
    way = (shape.points - shape.points[:1, :1]).reshape(-1, 2)
    if not len(way):
        return True
    x, y = way[vector_length(*way.T).argmax()]
    return bool((np.abs(way @ (y, -x)) <= _ROUNDING * (x * x + y * y)).all())


def _is_ground(shape: PaintedShape, page: DrawingPage | None, paper: Floats) -> bool:
    """Whether a filled shape is the ground of a drawing: as pale as the paper, or as large as the page."""
    rgb = np.array(opaque_colour(shape.paint[:7]))
    opacity = int(shape.paint[7:], 16) / 255 if shape.paint[7:] and not np.isnan(rgb).any() else 1.0
    return bool(opacity * np.abs(paper - rgb).max() < PAPER) or _covers_page(shape, page)


def _covers_page(shape: PaintedShape, page: DrawingPage | None) -> bool:
    if page is None or not len(shape.points):
        return False
    (low, high), start = np.reshape(box_around(shape.points), (2, 2)), np.array(page.window[:2])
    end, room = start + page.window[2:], 1e-3 * max(page.window[2:])
    return bool((low <= start + room).all() and (high >= end - room).all())


def _is_curvature_line(shape: PaintedShape, matcher: LabelMatcher | None) -> bool:
    """Whether the label or the paint of a shape makes it a curvature line."""
    if matcher is not None:
        return shape.chosen or f"colour={shape.paint}" in matcher.wanted
    return bool(is_red(np.array(opaque_colour(shape.paint))))


def _join_strokes(
    shapes: Sequence[PaintedShape],
    seen: Seen,
    page: DrawingPage | None,
    matcher: LabelMatcher | None,
    notes: tuple[str, ...],
) -> Curves:
    """The curves of what is seen of the shapes, with colours and choices. Raises InputError."""
    if not len(seen.points):
        raise InputError(f"shows no stroke: {'; '.join(notes) or 'all have the colour of the paper'}")
    chosen = None
    if matcher is not None:
        taken = np.array([shape.chosen for shape in shapes])
        for number in np.unique(seen.shape):
            taken[number] |= matcher.matches([colour_label(seen.colour[number].tolist())])
        chosen = taken[seen.shape]
        matcher.check(any_stroke=bool(chosen.any()))
    red, run = is_red(seen.colour)[seen.shape], run_numbers(seen.points, seen.shape)
    curves = Curves(seen.points, run, red, page.box if page else None, chosen, notes)
    # An element has several lines, or dashes of one.
    return _mark_faint(curves, [seen.line, seen.shape], seen.strength[seen.shape])


def _mark_faint(curves: Curves, lines: Sequence[Ints], strength: Floats) -> Curves:
    """The curves with those marked as faint that are much paler or thinner than others, and not chosen.

    Weak ones, which may be a third as wide, have to be surely no part of the object: curvature lines go on
    across them, or, where all are curvature lines, they are straight, and begin and end outside of the others
    or in corners of their box.

    lines: number of the line of each cubic, ascending; several if what is a line is open.
    """
    points, is_line = curves.points, curves.line
    length = vector_length(*np.moveaxis(np.diff(points, axis=1), -1, 0)).sum(axis=1)

    def is_below(kind: Bools, ratio: float, part: float) -> Bools:
        order = np.argsort(-np.where(kind, strength, np.nan), kind="stable")  # not numbers are last
        ahead = np.cumsum(np.where(kind & np.isfinite(strength), length, 0.0)[order])
        return np.asarray(strength <= ratio * strength[order[np.searchsorted(ahead, part * ahead[-1])]])

    weak = is_below(is_line, _WEAK, _MOST)
    if not is_line.all():
        cuts = ~is_line & weak
        faint = (is_line & is_below(is_line, _FAINT, _STRONG)) | (cuts & is_below(~is_line, _FAINT, _STRONG))
        faint |= _are_crossed(points, lines[0], cuts, is_line)
    else:
        weak |= is_below(is_line, _FAINT, _STRONG)
        low, high = np.reshape(box_around(points[~weak]), (2, 2))
        faint = weak & np.any([_leave_box(points, number, low, high) for number in lines], axis=0)
    return replace(curves, faint=faint if curves.chosen is None else faint & ~curves.chosen)


def _leave_box(points: Floats, number: Ints, low: Floats, high: Floats) -> Bools:
    """Which cubics (k,) are of straight lines that begin and end outside of a box, or in its corners."""
    _, first, line = np.unique(number, return_index=True, return_inverse=True)
    last = np.append(first[1:], len(number)) - 1
    ends = np.stack([points[first, 0], points[last, 3]], axis=1)
    way = ends[:, 1] - ends[:, 0]
    beside = points - ends[line, :1]
    across = np.abs(way[line, :1] * beside[..., 1] - way[line, 1:] * beside[..., 0]).max(axis=1)
    is_straight = np.maximum.reduceat(across, first) <= _ASIDE * (way**2).sum(axis=1)
    is_straight &= way.any(axis=1)
    room = _CORNER * (high - low)
    is_corner = ((ends < low + room) | (ends > high - room)).all(axis=2)
    is_outside = ((ends < low) | (ends > high)).any(axis=2) | is_corner
    return np.asarray((is_straight & is_outside.all(axis=1))[line])


def _are_crossed(points: Floats, number: Ints, weak: Bools, is_line: Bools) -> Bools:
    """Which cubics (k,) are of weak lines across which curvature lines go on."""
    if not weak.any():
        return weak
    pixel = float(np.ptp(points.reshape(-1, 2), axis=0).max()) / GRID
    kept = weak | is_line
    segments, owner = flatten(points[kept], pixel / 10)
    pairs = find_meetings(*resample(segments / pixel, number[kept][owner]), most_ends=0)[0]
    is_weak = np.isin(pairs, number[weak])
    return np.isin(number, pairs[is_weak & ~is_weak[:, ::-1]]) & weak


def _list_unread(cascade: Cascade, walk: _ElementWalk) -> tuple[str, ...]:
    """Notes on the pictures, faults, colours and transforms of a drawing that were not read."""
    pictures = [
        name_of(element)
        for element, style in walk.styles.items()
        if tag_of(element) == "image" and style.get("display") != "none"
    ]
    colours, transforms = (
        [f"{shortened(text, 40)!r} of {name_of(element)}" for element, text in texts.items()]
        for texts in (cascade.unread, walk.unused)
    )
    notes = (
        (pictures, "picture", "left out", "give a picture as a file of its own to trace it"),
        (walk.faults, "shape", "faulty and left out from the fault on", "export the drawing again"),
        (cascade.skipped, "style rule", "not read", "write its styles into the elements"),
        (colours, "colour", "not understood", "write #rrggbb"),
        (transforms, "transform", "not understood", "apply it in the drawing program"),
    )
    return tuple(
        f"{len(found)} {noun}{' is' if len(found) == 1 else 's are'} {what}, first {found[0]}; {remedy}"
        for found, noun, what, remedy in notes
        if found
    )


def _parse_xml(data: bytes) -> Element:
    from defusedxml.common import DefusedXmlException
    from defusedxml.ElementTree import fromstring

    if data.count(b"<") + data.count(b"=") > MAX_TAGS:
        raise InputError(f"has more than {MAX_TAGS} tags and attributes; simplify the drawing")
    try:
        root: Element = fromstring(data, forbid_dtd=False, forbid_entities=True, forbid_external=True)
    except DefusedXmlException as error:
        raise InputError("declares XML entities, which are unsafe; save it as plain SVG") from error
    except (ParseError, ValueError, LookupError, RecursionError) as error:
        raise InputError(f"is not well-formed XML: {error}; save the drawing again") from error
    for element in root.iter():
        if "}" not in element.tag:  # a drawing without a namespace
            element.tag = SVG + element.tag
    return root


def _put_styles(root: Element, styles: dict[Element, dict[str, str]]) -> dict[Element, dict[str, str]]:
    """Put the styles into the attribute `style` of each element in place of style sheets; returns them."""
    characters = 0
    for element in root.iter():
        characters += sum(len(element.get(key, "")) for key in ("d", "points", "style", "transform"))
        if characters > MAX_DATA:
            raise InputError(
                f"has more than {MAX_DATA} characters of paths, styles and transforms; simplify the drawing"
            )
        for key in [name for name in element.attrib if name == "style" or UNSHOWN.match(name)]:
            del element.attrib[key]
        style = styles[element]
        element.attrib.update((key, style[key]) for key in _MOVES if key in style)
        if text := ";".join(f"{key}:{value}" for key, value in style.items() if key not in _MOVES):
            element.set("style", text)
        for child in list(element):
            if tag_of(child) in ("style", "script", "filter", "image"):
                element.remove(child)
    return styles


@dataclass(eq=False)
class _ElementWalk:
    """A walk through a drawing.

    styles: of every element, without what it inherits. faults: of shapes, with their names. unused: an
    element and its transform, for each that is not understood. finest: least width that is seen. reach: the
    greatest coordinate in units of the page. named: elements by their ids.
    """

    styles: dict[Element, dict[str, str]]
    matcher: LabelMatcher | None
    unused: dict[Element, str] = field(default_factory=dict)
    outlines: dict[Any, Floats] = field(default_factory=dict)
    faults: list[str] = field(default_factory=list)
    named: dict[str, Element] = field(default_factory=dict)
    visited: int = 0
    used: int = 0
    curves: int = 0
    finest: float = 0.0
    reach: float = 0.0

    def shapes(self, root: Element, page: DrawingPage | None) -> Iterator[PaintedShape]:
        """Every painted shape in drawing order. Replaces each `use` by a group of what it shows."""
        from svgelements import Matrix

        self.named = {element.get("id", ""): element for element in reversed(list(root.iter()))}
        view, box = (page.view, page.box) if page else (UNPAGED, UNPAGED)
        self.finest = _FINEST * max(box[2:]) if page else 0.0
        stack = [_Place(root, _START, Matrix.scale(box[2] / view[2], box[3] / view[3]), view[2:])]
        while stack:
            place = self._apply_style(stack.pop())
            tag, element = tag_of(place.element), place.element
            self.visited += 1
            if self.visited > MAX_ELEMENTS:
                raise InputError(f"draws more than {MAX_ELEMENTS} elements; simplify the drawing")
            if place.depth > MAX_DEPTH:
                raise InputError(
                    f"has elements nested more than {MAX_DEPTH} deep, counting <use>; ungroup them"
                )
            if place.style.get("display") == "none" or number_of(place.style.get("opacity")) == 0:
                continue
            if tag in SHAPES:
                yield from self._painted_shape(place)
                continue
            if tag == "use":
                place = self._expand_use(place)
            elif tag not in _CONTAINERS:
                continue
            elif tag == "svg" and element is not root:
                place = _inner_view(place)
            inner = replace(place, depth=place.depth + 1)
            stack += [replace(inner, element=child) for child in reversed(element)]

    def _apply_style(self, place: _Place) -> _Place:
        """The place with the element's own style, transform and labels applied."""
        element = place.element
        own = self.styles[element]
        inherited = {key: place.style[key] for key in _INHERITED if key in place.style}
        style = inherited | {key: value for key, value in own.items() if value != "inherit"}
        matrix, transform = place.matrix, self._own_transform(element, place.size)
        if transform is not None:
            matrix = transform * matrix
            terms = (getattr(transform, key) for key in "abcdef")
            element.set("transform", f"matrix({' '.join(f'{term:.12g}' for term in terms)})")
            element.attrib.pop("transform-origin", None)
        taken = self.matcher is not None and self.matcher.matches(labels_of(tag_of(element), element.attrib))
        return replace(place, style=style, matrix=matrix, chosen=taken or place.chosen)

    def _own_transform(self, element: Element, size: tuple[float, float]) -> Any:
        """The matrix of an element's own transform, about its origin; None without one. Raises InputError.

        As in browsers, a transform that cannot be read moves nothing; it is added to `unused`.
        """
        from svgelements import Matrix

        style = self.styles[element]
        text = style.get("transform", element.get("transform", ""))
        if not text or text == "none":
            return None
        if len(text) > MAX_TRANSFORM:
            raise InputError(
                f"{name_of(element)}: its transform has more than {MAX_TRANSFORM} characters; simplify it"
            )
        try:
            matrix = Matrix(text)
        except (ValueError, TypeError, IndexError, AttributeError, ArithmeticError):
            self.unused[element] = text
            element.attrib.pop("transform", None)
            return None
        if origin := style.get("transform-origin", ""):
            words = [*origin.lower().split(), "center"][:2]
            if words[0] in ("top", "bottom") or words[1] in ("left", "right"):
                words.reverse()
            sides = (_SIDES.get(word, word) for word in words)
            x, y = (length_of(side, 0.0, whole) for side, whole in zip(sides, size, strict=True))
            matrix = Matrix.translate(-x, -y) * matrix * Matrix.translate(x, y)
        return matrix

    def linked(self, element: Element) -> Element | None:
        """The element of the drawing to which another one refers; None for those of other files."""
        link = next((element.get(key, "") for key in HREFS if key in element.attrib), "")
        return self.named.get(link[1:]) if link.startswith("#") else None

    def _expand_use(self, place: _Place) -> _Place:
        """The place of a `use` that became a group of what it shows: nothing of another file or of itself."""
        self.used += 1
        if self.used > MAX_USES:
            raise InputError(f"draws more than {MAX_USES} <use> elements; expand them in the drawing program")
        element, style = place.element, self.styles[place.element]
        target = self.linked(element)
        x, y = (
            length_of(element.get(key, ""), 0.0, side) for key, side in zip("xy", place.size, strict=True)
        )
        sides, kept = (chosen_attributes(element, keys) for keys in (("width", "height"), GROUP))
        element.clear()
        element.tag, element.attrib = SVG + "g", kept
        if target is None or target in place.copied:
            return place
        copy = deepcopy(target)
        self.styles.update(
            (new, self.styles[old]) for new, old in zip(copy.iter(), target.iter(), strict=True)
        )
        if tag_of(target) in ("symbol", "svg"):
            copy.tag = SVG + "svg"
            copy.attrib = {"width": "100%", "height": "100%"} | copy.attrib | sides
        moved = SubElement(element, SVG + "g", {"transform": f"translate({x!r} {y!r})"})
        self.styles[moved] = {}
        moved.append(copy)
        self.styles[element] = style
        return replace(place, copied=(*place.copied, target))

    def _painted_shape(self, place: _Place) -> Iterator[PaintedShape]:
        """The shape of an element, if it is painted."""
        style = place.style
        stroke, fill = (_paint(style, kind, self.named) for kind in ("stroke", "fill"))
        if style["visibility"] in ("hidden", "collapse") or not (stroke or fill):
            return
        scale = float(np.sqrt(abs(place.matrix.determinant)))
        width = length_of(style.get("stroke-width", "1"), 1.0, float(np.hypot(*place.size) / np.sqrt(2)))
        fixed = style.get("vector-effect") == "non-scaling-stroke"
        width *= 1.0 if fixed else scale
        if stroke and width < self.finest:
            self.faults.append(f"{name_of(place.element)}: its stroke is too thin to be seen")
            return
        yield PaintedShape(
            place.element,
            name_of(place.element),
            self._place_shape(place, scale),
            stroke or fill or "",
            {key: style[key] for key in _INHERITED if key in style},
            width=width if stroke else 0.0,
            scale=scale,
            is_stroked=bool(stroke),
            is_filled=bool(fill),
            chosen=place.chosen,
        )

    def _place_shape(self, place: _Place, scale: float) -> Floats:
        """Control points (k, 4, 2) of a shape in the units of the result; scale: of its own units there."""
        attributes, tag = place.element.attrib, tag_of(place.element)
        key = (
            tag,
            place.size,
            *((name, text) for name, text in attributes.items() if name not in ("id", "style")),
        )
        if key not in self.outlines:
            self.outlines[key], fault = shape_curves(tag, attributes, place.size)
            if fault:
                self.faults.append(f"{name_of(place.element)}: {fault}")
        points, m = self.outlines[key], place.matrix
        self.curves += len(points)
        if self.curves > MAX_CURVES:
            raise too_many_curves()
        with np.errstate(over="ignore", invalid="ignore"):
            turn, shift = np.array([[m.a, m.c], [m.b, m.d]], dtype=float), np.array([m.e, m.f], dtype=float)
            placed: Floats = transform_vectors(points, turn) + shift
        if not (np.abs(placed) <= GREATEST).all():
            self.faults.append(
                f"{name_of(place.element)}: a coordinate is not a finite number below {GREATEST:g}"
            )
            return placed[:0]
        self.reach = max(self.reach, scale * float(np.abs(points).max(initial=0.0)))
        return np.asarray(placed[(placed != placed[:, :1]).any(axis=(1, 2))])


def _paint(style: Mapping[str, str], kind: str, named: Mapping[str, Element]) -> str | None:
    """The stroke or fill as #rrggbb, #rrggbbaa or url(#id); None if it paints nothing."""
    widths = ("stroke-opacity", "stroke-width") if kind == "stroke" else ("fill-opacity",)
    if any(number_of(style.get(name)) == 0 for name in widths):
        return None
    paint = style[kind]
    if reference := _REFERENCE.match(paint):
        server = named.get(reference[1])
        if server is not None and tag_of(server) in _SERVERS:
            return f"url(#{reference[1]})"
        paint = reference[2] or "none"
    paint = style["color"] if paint == "currentColor" else paint
    is_clear = len(paint) == 9 and paint.endswith("00")
    return paint if paint.startswith("#") and not is_clear else None


def _inner_view(place: _Place) -> _Place:
    """The place inside an inner svg: its viewBox fitted into its width and height."""
    from svgelements import Matrix

    element = place.element
    keys, defaults = ("x", "y", "width", "height"), (0.0, 0.0, *place.size)
    x, y, wide, high = (
        length_of(element.get(key, ""), default, side)
        for key, default, side in zip(keys, defaults, place.size * 2, strict=True)
    )
    view = view_box(element)
    if view is None:
        return replace(place, matrix=Matrix.translate(x, y) * place.matrix, size=(wide, high))
    across, down, right, below = fit_view(view, wide, high, element.get("preserveAspectRatio", ""))
    matrix = Matrix.translate(-view[0], -view[1]) * Matrix.scale(across, down)
    matrix *= Matrix.translate(x + right, y + below) * place.matrix
    return replace(place, matrix=matrix, size=view[2:])
