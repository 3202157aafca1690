"""From a sketch to an instance: SVG, bitmap, .scap or .curves, with or without a mask.

Strokes drawn in red are curvature lines when a sketch has red strokes and others; the others then cut the
field, so their pixels leave the mask. In a sketch of one colour all strokes are curvature lines
(docs/mathematics.md, 1). A Choice overrides this.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Final

import numpy as np

from ..arguments import checked_arguments
from ..errors import InputError, NoStrokeError, naming
from ..input_limits import MAX_BYTES
from ..instance.angles import line_of
from ..instance.grid import Bools, Floats, Ints
from ..instance.instance import SKEW_WEIGHT, STROKE_WEIGHT, Gauge, Instance, Reading
from ..memory import available_memory
from ..storage import read_bytes
from .bitmap import Picture, read_picture, read_white
from .bridges import closing, curve_ends, opened
from .choice import AS_DRAWN, Choice, Kind, Silhouette
from .cover import Cover, Frame, block_means, cover_by_segments, fit_frame
from .curves import Curves, bounding_box, flatten
from .outline import along_outline, boundless, boxed, crowded, inside_outline, off_page, parts_with, unbounded
from .pen_strokes import SPATIAL, read_curves, read_scap
from .svg import read_svg

DEFAULT_SIZE: Final = 24  # few enough pixels to try every formulation
MAX_SIZE: Final = 4096
BYTES_PER_PIXEL: Final = 5000  # while its problem is written
LEAST_WEIGHT: Final = 0.1  # stroke pixels with a smaller w have no direction: grazed corners, crossings
CUT: Final = 0.5 - 1e-9  # least length at which another stroke cuts a pixel out; more would leave gaps
_PICTURES: Final = {
    ".png": rb"\x89PNG",
    ".jpg": rb"\xff\xd8\xff",
    ".webp": rb"RIFF",
    ".tif": rb"II\*\0|MM\0\*",
    ".bmp": rb"BM",
    ".gif": rb"GIF8",
    ".pnm": rb"P[1-6]\s",
}
"""First bytes of pictures, by the suffix of their files."""
_PICTURE: Final = re.compile(b"|".join(_PICTURES.values()), re.DOTALL)

_FLATNESS: Final = 0.02  # of a pixel

Edit = Callable[[Bools, Cover, Cover, Reading, Frame], Bools]
"""A change of a mask, given the covers by curvature lines and by other strokes, the reading and the frame."""


@dataclass(frozen=True, eq=False)
class _Sketch:
    """Attributes of every kind of sketch, in its own units with y down.

    box: left, top, right, bottom of the strokes; page: x, y, width, height. covers: by curvature lines and by
    other strokes. ends: points and ways out (n, 2, 2). stroke_width: as drawn in a picture, 0 for curves.
    """

    box: tuple[float, float, float, float]
    page: tuple[float, float, float, float] | None
    covers: Callable[[Frame], tuple[Cover, Cover]]
    ends: Callable[[], Floats]
    stroke_width: float = 0.0


@checked_arguments
def read_sketch(
    path: str | Path,
    *,
    size: int = DEFAULT_SIZE,
    mask: str | Path | None = None,
    gauge: Gauge = "strokes",
    name: str | None = None,
    stroke_weight: float = STROKE_WEIGHT,
    skew_weight: float = SKEW_WEIGHT,
    silhouette: Silhouette = "none",
    curvature: Iterable[str] = (),
    view: str | None = None,
) -> Instance:
    """Read a sketch as an instance: an SVG drawing, a bitmap, a .scap or a .curves file, detected by content.

    Directions within a pixel are averaged by the double angle. The reliability w is min(1, length in the
    pixel / pixel side) R, where R is the length of the mean double-angle vector. Pixels with a small w, or
    with R below 1/2 as at crossings, have no direction.

    Parameters
    ----------
    path
        The sketch.
    size
        Pixels on the longer side of the grid, 1 to 4096.
    mask
        Picture that is white where the field is wanted, of the size of the bitmap or page. The grid is then
        the white part, and a pixel belongs to it from half of its area on. By default the grid is the drawing
        with a margin of 4 %, and the mask its inside; an open drawing has the whole rectangle.
    gauge
        Window of alpha, as in `Instance`.
    name
        Name of the instance; by default made from the file name.
    stroke_weight, skew_weight
        Weights that mean the same on every grid, as in `Instance.with_weights`.
    silhouette
        With `outer`, curvature lines along the outline have no direction.
    curvature
        Labels of the strokes that are curvature lines, such as `colour=red`, `class=flow`, `id=group2`,
        `layer=Flow` (SVG) or `cluster=3` (.scap). The others cut the field.
    view
        Viewpoint of a .curves file: `front`, `side`, `top`, or azimuth and elevation in degrees, as in
        `30,25`.

    Returns
    -------
    Instance
        The instance. Its `reading.warnings` are doubts about the drawing.

    Raises
    ------
    InputError
        For a file that cannot be used, and for an option out of range.
    NoStrokeError
        If no stroke or no pixel is left on the grid.
    InstanceError
        For a weight out of range.

    """
    path = Path(path)
    check_size(size)
    choice = Choice(silhouette, tuple(curvature), view)
    with_mask = None if mask is None else Path(mask)
    data = bytes_of(path)
    try:
        with naming(path):
            name = name or name_from(path.stem)
            read = instance_of(
                data, size=size, mask=with_mask, gauge=gauge, name=name, source=path.name, choice=choice
            )
    except MemoryError as error:
        raise InputError("needs more memory than there is; choose a smaller size", file=path) from error
    return read.with_weights(stroke_weight=stroke_weight, skew_weight=skew_weight)


def instance_of(
    data: bytes | Curves,
    *,
    size: int,
    name: str,
    source: str,
    mask: Path | None = None,
    gauge: Gauge = "strokes",
    choice: Choice = AS_DRAWN,
    edit: Edit | None = None,
) -> Instance:
    """Read the instance of curves, or of a file's bytes, with the default weights.

    edit: changes the mask that was found. Raises InputError.
    """
    sketch = _sketch_of(data, size, Path(source).suffix.lower(), choice)
    if mask is None:
        frame, given = _framed(sketch.box, size, margin=True), None
    else:
        with naming(mask):
            frame, given = _mask_on_grid(read_white(bytes_of(mask)), sketch.page, size)
    lines, others = sketch.covers(frame)
    solve, found = _solve_mask(lines, others, given, sketch, frame)
    if edit is not None:
        solve = edit(solve, lines, others, found, frame) & (others.amount < CUT)
    weight = np.where(solve, lines.weight, 0.0)
    if choice.silhouette == "outer":
        region = solve | (others.amount >= CUT) if given is None else given
        weight[along_outline(region, lines.direction, sketch.stroke_width / frame.pixel)] = 0.0
        if not (held := _held(weight)).any() and given is None:
            raise InputError("every stroke runs along the outline; choose the silhouette none")
        solve = parts_with(solve, held) if given is None else solve
    stroke = solve & (weight >= LEAST_WEIGHT)
    if not stroke.any():
        raise NoStrokeError("no stroke lies inside the mask; draw a curvature line there or move the mask")
    return Instance(
        name=name,
        mask=solve,
        stroke_pixels=np.argwhere(stroke).astype(np.int32),
        theta=line_of(lines.direction[stroke]),
        w=np.minimum(weight[stroke], 1.0),
        gauge=gauge,
        source=choice.source(source),
        pixel_size=frame.pixel,
        origin=(frame.x, frame.y),
        reading=found,
    ).with_weights(stroke_weight=STROKE_WEIGHT, skew_weight=SKEW_WEIGHT)


def name_from(text: str) -> str:
    """An instance name made from any text, at most 32 long; runs of other characters become `_`."""
    name = re.sub(r"[^a-z0-9]+", "_", text.lower()).strip("_")
    return (name if re.match(r"[a-z]", name) else f"sketch_{name}".strip("_"))[:32].rstrip("_")


def check_memory(pixels: int, available: int | None) -> None:
    """Raise InputError if a grid needs more bytes than available (None: unknown)."""
    needed = pixels * BYTES_PER_PIXEL
    if available is not None and needed > available:
        raise InputError(
            f"a grid of {pixels} pixels needs about {needed / 1e9:.1f} GB to be written, "
            f"but {available / 1e9:.1f} GB are free; choose a smaller size"
        )


def check_size(size: int) -> None:
    """Raise InputError if a grid cannot have that many pixels on its longer side."""
    if not 1 <= size <= MAX_SIZE:
        raise InputError(f"size is {size}; choose 1 to {MAX_SIZE} pixels for the longer side")


def bytes_of(path: Path) -> bytes:
    """Read a regular file of acceptable length, at least one byte."""
    if path.exists() and not path.is_file():
        raise InputError("is not a file; give a sketch as SVG, picture, .scap or .curves", file=path)
    data = read_bytes(path, MAX_BYTES, "simplify the sketch")
    if not data:
        raise InputError("is empty; save the sketch again", file=path)
    return data


def curves_in(data: bytes, suffix: str, choice: Choice = AS_DRAWN) -> Curves | None:
    """The curves of a vector sketch, None for a picture. Raises InputError."""
    kind = kind_of(data, suffix)
    choice.check(kind)
    if kind == "curves":
        return read_curves(data, choice.view)
    return None if kind == "picture" else (read_svg if kind == "svg" else read_scap)(data, choice.chooser)


def kind_of(data: bytes, suffix: str) -> Kind:
    """Kind of a sketch, by its content first and the suffix of its file second. Raises InputError."""
    start = data[:512].lstrip(b"\xef\xbb\xbf \t\r\n")
    if data[:2] == b"\x1f\x8b":
        raise InputError("is compressed; unpack it first (gunzip) and give the SVG itself")
    drawn = _PICTURE.match(data) is None
    if SPATIAL.match(start) or (suffix == ".curves" and drawn and not start.startswith(b"<")):
        return "curves"
    if start.startswith(b"<") or data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return "svg"
    if re.match(rb"#\s*[\d.]", start) or (suffix == ".scap" and drawn):
        return "scap"
    return "svg" if suffix == ".svg" and drawn else "picture"


def suffix_of_picture(data: bytes) -> str:
    """Suffix of a picture by its content; Netpbm's for unknown content."""
    return next((suffix for suffix, start in _PICTURES.items() if re.match(start, data)), ".pnm")


def _sketch_of(data: bytes | Curves, size: int, suffix: str, choice: Choice) -> _Sketch:
    curves = data if isinstance(data, Curves) else curves_in(data, suffix, choice)
    if curves is not None:
        return _of_curves(curves)
    assert isinstance(data, bytes)
    return _of_picture(read_picture(data, size))


def _of_picture(picture: Picture) -> _Sketch:
    page = (0.0, 0.0, picture.width, picture.height)
    width = picture.stroke_width * picture.reduced
    return _Sketch(picture.box, page, picture.covers, picture.ends, stroke_width=width)


def _of_curves(curves: Curves) -> _Sketch:
    def covers(frame: Frame) -> tuple[Cover, Cover]:
        segments, _, line = segments_of(curves, frame)
        return cover_by_segments(segments[line], frame), cover_by_segments(segments[~line], frame)

    ends = partial(curve_ends, curves.points)
    return _Sketch(bounding_box(curves.points), curves.canvas, covers, ends)


def segments_of(curves: Curves, frame: Frame) -> tuple[Floats, Ints, Bools]:
    """Segments (m, 2, 2), the number (m,) of each segment's curve, and which (m,) are curvature lines."""
    segments, owner = flatten(curves.points, _FLATNESS * frame.pixel)
    return segments, curves.curve[owner], curves.line[owner]


def _framed(box: tuple[float, float, float, float], size: int, *, margin: bool) -> Frame:
    if max(box[2] - box[0], box[3] - box[1]) <= 0:
        raise InputError("draws no stroke: everything is one point")
    frame = fit_frame(box, size, margin=margin)
    check_memory(frame.height * frame.width, available_memory())
    return frame


def _mask_on_grid(
    white: Bools, page: tuple[float, float, float, float] | None, size: int
) -> tuple[Frame, Bools]:
    """The frame round the white part of a mask picture, and the mask on it."""
    if page is None:
        raise InputError("cannot be placed: the sketch has neither a viewBox nor a width and height; add one")
    x, y, width, height = page
    wanted = (round(width), round(height))
    if white.shape[::-1] != wanted:
        given = f"{white.shape[1]} x {white.shape[0]} pixels"
        raise InputError(f"the mask has {given}, but the sketch {wanted[0]} x {wanted[1]}; make them equal")
    if not white.any():
        raise InputError("the mask is black all over; paint the region to solve white")
    across, down = width / wanted[0], height / wanted[1]
    high, wide = (np.nonzero(white.any(axis=axis))[0] for axis in (1, 0))
    left, right = x + across * wide[0], x + across * (wide[-1] + 1)
    top, bottom = y + down * high[0], y + down * (high[-1] + 1)
    frame = _framed((left, top, right, bottom), size, margin=False)
    rows, columns = frame.edges
    share = block_means(white.astype(np.float32), (rows - y) / down, (columns - x) / across)
    return frame, share >= 0.5 - 1e-6


def _solve_mask(
    lines: Cover, others: Cover, given: Bools | None, sketch: _Sketch, frame: Frame
) -> tuple[Bools, Reading]:
    """The mask or the inside of the bridged outline, without pixels of other strokes, and warnings."""
    cut = others.amount >= CUT
    filled = lines.amount + others.amount >= CUT
    if given is not None:
        solve = given & ~cut
        return solve, Reading(sketch.page, crowded(filled, solve, frame))
    walls = (lines.amount >= LEAST_WEIGHT) | cut
    if not walls.any():
        raise NoStrokeError("no stroke is left on so coarse a grid; choose a larger size")
    closed, openings = closing(walls, sketch.ends(), frame)
    region = inside_outline(closed)
    solve = parts_with(region & ~cut, _held(lines.weight))
    if not solve.any():
        raise NoStrokeError(
            "its outline leaves no room for a curvature line on so coarse a grid; choose a larger size"
        )
    warnings = (
        *opened(openings),
        *boundless(region),
        *unbounded(closed, region, frame),
        *boxed(closed, region, lines.joined(others)),
        *crowded(filled, solve, frame),
        *off_page(solve, frame, sketch.page),
    )
    gaps = tuple(((a, b), (c, d)) for (a, b), (c, d) in openings.tolist())
    return solve, Reading(sketch.page, warnings, gaps)


def _held(weight: Floats) -> Floats:
    """The weights of pixels with a direction, 0 elsewhere."""
    return np.where(weight >= LEAST_WEIGHT, weight, 0.0)
