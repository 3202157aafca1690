"""The folder of a surface: pictures, heights, a report, and a mesh (.obj) with a quad for each pixel.

All pictures show the page of the drawing, so they lie on it as layers; without a page they show the grid. In
the mesh, x runs to the right, y up, z towards the viewer, all in pixels of the grid; the lower left corner of
the grid is at x = y = 0. Texture coordinates cover the pictures.
"""

from __future__ import annotations

import io
import json
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ...models.instance.domain import Floats
from ...models.instance.instance import Instance
from ...models.storage import replace_results, write_bytes
from ...models.surface.surface import Surface
from ...models.surface.trust import describe_support, right_angle_deviation
from ...models.written_files import check_targets
from ..formats.registry import program_version
from ..pictures.layers import strokes_sheet
from ..pictures.svg import encode_png, render_sheet
from ..pictures.underlay import Underlay, read_underlay
from ..shading.colours import UPPER_LEFT, Lamp, colour_normals, shade_by_light, to_eight_bit
from ..shading.raster import Box, Outline, Raster, View, grid_box, raster, view_of_box
from .outline import find_outline

NORMALS: Final = "normals.png"
SHADED: Final = "shaded.png"
DRAWING: Final = "drawing.png"
MATERIALS: Final = "surface.mtl"
REPORT: Final = "surface.json"
FILES: Final = {
    NORMALS: "normals as colours, as in OpenGL: red to the right, green up",
    SHADED: "in the light of a lamp",
    "overlay.png": "in the light of a lamp, with the strokes",
    "heights.npy": "heights at the corners of pixels",
    "surface.obj": "mesh with texture coordinates and normals",
    MATERIALS: "its material",
    DRAWING: "the strokes on paper, its texture",
    REPORT: "where the pictures lie, what supports the surface, and what is open",
}
"""The files of a surface, and the content of each."""
_PAPER: Final = (0.93, 0.91, 0.88)
_MATERIAL: Final = "drawing"
_MTL: Final = f"newmtl {_MATERIAL}\nKa 0 0 0\nKd 1 1 1\nKs 0 0 0\nillum 1\nmap_Kd {DRAWING}\n"
_ENCODING: Final = (
    "red, green, blue = round(255 (n + 1) / 2) of the unit normal n: red to the right, green up (OpenGL; for "
    "DirectX invert green), blue towards the viewer; numbers, not colours, so no colour profile applies"
)
_BAND: Final = 1 << 16  # pixels of a picture that are painted together: they fit into the processor's cache
_RIM: Final = 4.0  # pixels beyond the outline with colours, so that programs can scale a picture
_WALK: Final = [2, 3, 1, 0]  # corners of a pixel counter-clockwise, from the lower left


def write_surface(
    surface: Surface,
    folder: str | Path,
    *,
    drawing: str | Path | Underlay | None = None,
    light: Lamp = UPPER_LEFT,
    side: int | None = None,
    about: Mapping[str, Any] | None = None,
    force: bool = False,
) -> Path:
    """Write a surface as pictures, heights, a mesh and a report. Return the folder.

    Equal surfaces give equal bytes. All files appear together at the end.

    Parameters
    ----------
    surface
        The surface.
    folder
        Folder to write to; created if it does not exist.
    drawing
        File or sample from which the instance was read, for its page and strokes. None: the page that was
        stated when the instance was read, and a short line at each stroke pixel.
    light
        Direction of the lamp in radians: azimuth, counter-clockwise from the right, and elevation above the
        plane of the drawing, 0 to pi/2; upper left by default.
    side
        Pixels on the longer side of the pictures. None: those of a drawing that is a picture, else about
        1024.
    about
        Facts for the report on how the surface was made.
    force
        Whether to replace files that crossfield has not written or that have changed since. The drawing is
        never replaced.

    Raises
    ------
    InputError
        For a drawing that is unreadable or does not match the instance, and for a side or lamp out of range.
    OutputError
        If a file cannot be written, or if others are in the way.

    """
    reads = [drawing] if isinstance(drawing, str | Path) else []
    check_targets(Path(folder), FILES, reads=reads, force=force)
    if drawing is not None and not isinstance(drawing, Underlay):
        drawing = read_underlay(drawing, on=surface.instance)
    view = choose_view(surface.instance, drawing, side)
    normals, shaded = paint_surface(
        surface, drawing, view, colour_normals, lambda part: shade_by_light(part, light)
    )
    ink = draw_strokes(surface.instance, drawing, view)
    paper = np.full_like(ink, to_eight_bit(np.array([*_PAPER, 1.0])))
    pictures = {
        NORMALS: normals,
        SHADED: shaded,
        "overlay.png": lay_over(ink, shaded),
        DRAWING: lay_over(ink, paper)[..., :3],
    }
    document = surface_document(surface, view, about) | {"files": FILES}
    heights = io.BytesIO()
    np.save(heights, surface.heights, allow_pickle=False)
    contents = {name: encode_png(picture) for name, picture in pictures.items()} | {
        "heights.npy": heights.getvalue(),
        MATERIALS: _MTL.encode(),
        "surface.obj": to_obj(surface, MATERIALS, view.box),
        REPORT: (json.dumps(document, indent=1, allow_nan=False) + "\n").encode(),
    }
    with replace_results(folder, contents, reads=reads, force=force) as new:
        for name, content in contents.items():
            (new.path / name).write_bytes(content)
    return Path(folder)


def write_layers(surface: Surface, folder: Path, drawing: Underlay | None = None) -> None:
    """Write normal map and shaded picture, to lie on the drawing as layers. Raises OutputError."""
    view = choose_view(surface.instance, drawing)
    pictures = paint_surface(surface, drawing, view, colour_normals, shade_by_light)
    for name, picture in zip((NORMALS, SHADED), pictures, strict=True):
        write_bytes(folder / name, encode_png(picture))


def choose_view(instance: Instance, drawing: Underlay | None = None, side: int | None = None) -> View:
    """The page of the drawing, or the grid if there is none. Raises InputError.

    side: pixels on the longer side; by default those of a bitmap, and SIDE for other drawings.
    """
    if drawing is not None:
        page = drawing.declared
        if drawing.ink is not None and side is None:
            side = round(max(drawing.page[2:]))
    else:
        page = instance.reading.page if instance.reading else None
    return view_of_box(page or grid_box(instance), side)


def paint_surface(
    surface: Surface, drawing: Underlay | None, view: View, *colours: Callable[[Raster], Floats]
) -> list[NDArray[np.uint8]]:
    """A picture of the surface, uint8 (h, w, 4), for each way to colour its normals.

    It ends at the outline that is drawn, or at that of the mask. Colours continue for some pixels beyond it.
    """
    outline = find_outline(surface.instance, drawing) if drawing else None
    pictures = [np.zeros((view.height, view.width, 4), dtype=np.uint8) for _ in colours]
    for rows, part in raster_surface(surface, outline, view):
        near = part.depth > -_RIM
        seen = Raster(part.normals[near], part.depth[near])
        for picture, colour in zip(pictures, colours, strict=True):
            picture[rows][near] = to_eight_bit(colour(seen))
    return pictures


def raster_surface(surface: Surface, outline: Outline | None, view: View) -> Iterator[tuple[slice, Raster]]:
    """The picture of a surface in bands: their rows, and their normals and depth.

    outline: from `find_outline` for a surface with a drawing, None for one without.
    """
    band = max(1, _BAND // view.width)
    for top in range(0, view.height, band):
        rows = slice(top, top + band)
        yield rows, raster(surface.instance, surface.normals, view, rows, outline)


def lay_over(above: NDArray[np.uint8], below: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """One picture (h, w, 4) laid over another, both with opacity as fourth value."""
    from PIL import Image

    return np.asarray(Image.alpha_composite(Image.fromarray(below), Image.fromarray(above)))


def draw_strokes(instance: Instance, drawing: Underlay | None, view: View) -> NDArray[np.uint8]:
    """Red, green, blue and opacity, uint8 (h, w, 4), of the strokes of the drawing, or of the instance."""
    return render_sheet(strokes_sheet(instance, view.box, drawing), view.width, view.height)


def surface_document(surface: Surface, view: View, about: Mapping[str, Any] | None = None) -> dict[str, Any]:
    """The report of a surface as JSON.

    view: of its pictures. about: how it was made, for instance the method of its field.
    """
    instance = surface.instance
    on_grid = view.box == grid_box(instance)
    return {
        "format": "crossfield-surface",
        "version": 2,
        "generator": program_version(),
        "instance": {
            "name": instance.name,
            "source": instance.source,
            "sha256": instance.sha256,
            "height": instance.grid.height,
            "width": instance.grid.width,
            "pixels": instance.grid.size,
            "pixel_size": instance.pixel_size,
            "origin": list(instance.origin),
        },
        "pictures": {
            "show": "the grid, as the page is unknown: give the drawing"
            if on_grid
            else "the page of the drawing",
            "page": [round(value, 6) for value in view.box],
            "width": view.width,
            "height": view.height,
            "pixel_size": [float(f"{value:.9g}") for value in view.pixel],
            "normals": _ENCODING,
        },
        **(about or {}),
        **surface_facts(surface),
    }


def surface_facts(surface: Surface) -> dict[str, Any]:
    """The support of a surface, what is open, and measurements in pixels and degrees."""
    off = np.degrees(right_angle_deviation(surface.field, surface.heights))
    slant = np.degrees(np.arccos(np.clip(surface.normals[:, 2], -1.0, 1.0)))
    numbers = {
        "right_angle_error_mean_degrees": off.mean(),
        "right_angle_error_90_percent_degrees": np.percentile(off, 90),
        "slant_mean_degrees": slant.mean(),
        "slant_most_degrees": slant.max(),
        "height_range_pixels": np.ptp(surface.corners),
    }
    return {
        "interrupted": surface.interrupted,
        "support": describe_support(surface.field, np.radians(off)),
        "freedom": [choice.document() for choice in surface.freedom],
        **{name: round(float(value), 4) for name, value in numbers.items()},
    }


def to_obj(surface: Surface, materials: str, box: Box) -> bytes:
    """The mesh as text. materials: name of the .mtl file in its folder. box: what its texture shows."""
    instance = surface.instance
    places, corners = instance.grid.vertices
    row, column = places.T
    points = np.column_stack([column, instance.grid.height - row, surface.heights[row, column]])
    steps = instance.pixel_size * places[:, ::-1] + instance.origin
    texture = (steps - box[:2]) / box[2:] * (1, -1) + (0, 1)
    normals = np.zeros((len(places), 3))
    np.add.at(normals, corners, surface.normals[:, None, :])
    faces = corners[:, _WALK] + 1
    return "".join(
        [
            f"# {instance.name}: quad k is pixel k = 1, 2, ... of the mask, row by row; y up, z to you\n",
            f"mtllib {materials}\n",
            _obj_lines("v", points),
            _obj_lines("vt", texture),
            _obj_lines("vn", normals / np.linalg.norm(normals, axis=1, keepdims=True)),
            f"usemtl {_MATERIAL}\ns 1\n",
            *("f " + " ".join(f"{k}/{k}/{k}" for k in face) + "\n" for face in faces.tolist()),
        ]
    ).encode()


def _obj_lines(lead: str, table: np.ndarray[Any, Any]) -> str:
    form = lead + " {:.6f}" * table.shape[1] + "\n"
    return "".join(form.format(*row) for row in (np.round(table, 6) + 0.0).tolist())
