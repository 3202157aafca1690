"""From a drawing to an instance: drawing, frame, covers, mask, instance, each from those before it.

Strokes drawn in red are curvature lines when a sketch has red strokes and others; the others then cut the
field, so their pixels leave the mask. In a sketch of one colour all strokes are curvature lines
(docs/mathematics.md, 1). Labels can choose others.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Final, Literal, get_args

import numpy as np

from ..arguments import check_choice
from ..errors import InputError, NoStrokeError, naming, printable
from ..instance.angles import line_of
from ..instance.domain import Bools
from ..instance.instance import SKEW_WEIGHT, STROKE_WEIGHT, Gauge, Instance, Reading, name_from_text
from .bitmap import Bitmap, read_white_pixels
from .cover import LEAST_WEIGHT, Box, Cover, Covers, Frame, block_means, fit_frame
from .curves import Curves
from .doubts import (
    describe_crowding,
    describe_loose_strokes,
    describe_open_drawing,
    describe_overshot_parts,
)
from .drawing_file import Drawing, parse_drawing, read_file
from .labels import label_of
from .outline import find_inside, find_overshoots, find_strokes_along_outline, keep_parts_with_strokes
from .parallels import describe_lines_across, leave_out_non_edges

DEFAULT_SIZE: Final = 24  # few enough pixels to try every formulation
MAX_SIZE: Final = 4096

Silhouette = Literal["none", "outer"]


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
    with R below 1/2 as at crossings, have no direction. `reading.warnings` of the instance are doubts about
    the drawing.

    Parameters
    ----------
    path
        The sketch.
    size
        Pixels on the longer side of the grid, 1 to 4096.
    mask
        Picture that is white where the field is wanted, of the size of the bitmap or page; for a straightened
        photograph, of the size of the photograph or of its sheet. The grid is then the white part, with the
        pixels that are white over half of their area. By default the grid is the drawing with a margin of
        4 %, and the mask its inside; an open drawing has the whole rectangle.
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
    check_choice("silhouette", silhouette, get_args(Silhouette))
    labels = tuple(map(label_of, curvature))
    data = read_file(path)
    try:
        with naming(path):
            drawing = parse_drawing(data, path.suffix, size, labels=labels, view=view)
            white = None
            if mask is not None:
                with naming(mask):
                    white = read_mask(read_file(Path(mask)), drawing)
            instance = instance_of_drawing(
                drawing,
                size,
                white=white,
                name=name or name_from_text(path.stem),
                source=path.name,
                gauge=gauge,
                silhouette=silhouette,
                view=view,
            )
    except MemoryError as error:
        raise InputError("needs more memory than there is; choose a smaller size", file=path) from error
    return instance.with_weights(stroke_weight=stroke_weight, skew_weight=skew_weight)


def instance_of_drawing(
    drawing: Drawing,
    size: int,
    *,
    name: str,
    source: str,
    white: Bools | None = None,
    gauge: Gauge = "strokes",
    silhouette: Silhouette = "none",
    view: str | None = None,
) -> Instance:
    """The instance of a drawing with the coefficients of the paper. Raises InputError.

    white: the picture from `read_mask`; without it the mask is the inside of the drawing.
    """
    if isinstance(drawing, Curves):
        drawing = leave_out_non_edges(drawing)
    if white is None:
        frame = fit_frame(drawing.box, size, margin=True)
        covers = drawing.covers(frame)
        mask, reading = find_mask(drawing, covers, frame)
        if silhouette == "outer":
            covers, mask = drop_silhouette(covers, mask)
    else:
        assert drawing.page is not None  # as `read_mask` checked
        frame, region = frame_around_white(white, drawing.page, size)
        covers = drawing.covers(frame)
        mask = region & ~covers.cuts
        doubts = filter(None, [describe_crowding(covers.filled, mask, frame)])
        reading = Reading(drawing.page, (*drawing.notes, *doubts))
        if silhouette == "outer":
            covers = drop_outline_directions(covers, region)
    return instance_of_mask(
        frame, covers.lines, mask, reading, name=name, source=source, gauge=gauge, view=view
    )


def frame_around_white(white: Bools, page: Box, size: int) -> tuple[Frame, Bools]:
    """The grid round the white part of a page, and which pixels are white over half of their area or more."""
    x, y, width, height = page
    across, down = width / white.shape[1], height / white.shape[0]
    high, wide = (np.nonzero(white.any(axis=axis))[0] for axis in (1, 0))
    left, right = x + across * wide[0], x + across * (wide[-1] + 1)
    top, bottom = y + down * high[0], y + down * (high[-1] + 1)
    frame = fit_frame((left, top, right, bottom), size, margin=False)
    rows, columns = frame.edges
    share = block_means(white.astype(np.float32), (rows - y) / down, (columns - x) / across)
    return frame, share >= 0.5 - 1e-6


def find_mask(drawing: Drawing, covers: Covers, frame: Frame) -> tuple[Bools, Reading]:
    """The inside of the outline without the strokes that cut, and doubts about it."""
    walls = covers.walls
    if not walls.any():
        raise NoStrokeError("no stroke is left on so coarse a grid; choose a larger size")
    region = find_inside(walls)
    inner, weight = region & ~covers.cuts, covers.lines.weight
    mask = reached = keep_parts_with_strokes(inner, weight)
    if isinstance(drawing, Curves) and covers.pixels:
        overshoots = find_overshoots(drawing, covers.pixels, inner, frame)
        mask = keep_parts_with_strokes(inner, np.where(overshoots, 0.0, weight))
    if not mask.any():
        raise NoStrokeError(
            "its outline leaves no room for a curvature line on so coarse a grid; choose a larger size"
        )
    doubts = (
        describe_open_drawing(region),
        describe_lines_across(drawing, region, frame) if isinstance(drawing, Curves) else None,
        describe_overshot_parts(reached & ~mask, frame),
        describe_loose_strokes(walls, region, frame),
        describe_crowding(covers.filled, mask, frame),
    )
    return mask, Reading(drawing.page, (*drawing.notes, *filter(None, doubts)))


def drop_silhouette(covers: Covers, mask: Bools) -> tuple[Covers, Bools]:
    """The covers without directions along the outline of a mask, and its parts with other strokes."""
    covers = drop_outline_directions(covers, mask | covers.cuts)
    mask = keep_parts_with_strokes(mask, covers.lines.weight)
    if not mask.any():
        raise InputError("every stroke runs along the outline; choose the silhouette none")
    return covers, mask


def drop_outline_directions(covers: Covers, region: Bools) -> Covers:
    """The covers without directions of curvature lines along the border of a region."""
    lines = covers.lines
    along = find_strokes_along_outline(region, lines.direction, covers.stroke_width)
    return replace(covers, lines=Cover(lines.amount, np.where(along[..., None], 0.0, lines.direction)))


def instance_of_mask(
    frame: Frame,
    lines: Cover,
    mask: Bools,
    reading: Reading,
    *,
    name: str,
    source: str,
    gauge: Gauge = "strokes",
    view: str | None = None,
) -> Instance:
    """The instance of a mask whose pixels have the directions of these curvature lines."""
    weight = lines.weight
    stroke = mask & (weight >= LEAST_WEIGHT)
    if not stroke.any():
        raise NoStrokeError("no stroke lies inside the mask; draw a curvature line there or move the mask")
    return Instance.on_pixels(
        name=name,
        mask=mask,
        stroke_pixels=np.argwhere(stroke).astype(np.int32),
        theta=line_of(lines.direction[stroke]),
        w=np.minimum(weight[stroke], 1.0),
        gauge=gauge,
        source=printable(source),
        view=view,
        pixel_size=frame.pixel,
        origin=(frame.x, frame.y),
        reading=reading,
    )


def read_mask(data: bytes, drawing: Drawing) -> Bools:
    """The white part of a mask picture, which must have the size of the page. Raises InputError.

    A mask of the size of a photograph is straightened as its sheet was.
    """
    white, page = read_white_pixels(data), drawing.page
    sheet = drawing.sheet if isinstance(drawing, Bitmap) else None
    if sheet is not None and sheet.size is not None and white.shape[::-1] == sheet.picture:
        white = sheet.straighten(255 * white.astype(np.uint8)[..., None], 1)[..., 0] >= 128
    if page is None:
        raise InputError("cannot be placed: the sketch has neither a viewBox nor a width and height; add one")
    size, wanted = white.shape[::-1], (round(page[2]), round(page[3]))
    if size != wanted:
        raise InputError(
            f"the mask has {size[0]} x {size[1]} pixels, but the sketch {wanted[0]} x {wanted[1]}; "
            "make them equal"
        )
    if not white.any():
        raise InputError("the mask is black all over; paint the region to solve white")
    return white


def check_size(size: int) -> None:
    """Raise InputError if a grid cannot have that many pixels on its longer side."""
    if not 1 <= size <= MAX_SIZE:
        raise InputError(f"size is {size}; choose 1 to {MAX_SIZE} pixels for the longer side")
