"""The folder of a surface: pictures, heights, a report, and a mesh (.obj) with a quad for each pixel.

x runs to the right, y up, z towards the viewer, all in pixels; the lower left corner of the grid is at
x = y = 0. Texture coordinates cover the grid.
"""

from __future__ import annotations

import io
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ...models.arguments import check_arguments
from ...models.field.triangles import vertices_of
from ...models.instance.domain import Floats
from ...models.instance.instance import Instance
from ...models.storage import make_folder, write_bytes
from ...models.surface.surface import Surface
from ...models.surface.trust import right_angle_deviation
from ..formats.registry import program_version
from ..pictures.canvas import render_sheet
from ..pictures.draw import fixed_settings
from ..pictures.layers import strokes_sheet
from ..pictures.underlay import Underlay, read_underlay
from ..shading.colours import UPPER_LEFT, Light, matcap, normal_map, shade_by_light, to_eight_bit
from ..shading.raster import choose_scale, raster

SHADED: Final = "shaded.png"
DRAWING: Final = "drawing.png"
MATERIALS: Final = "surface.mtl"
REPORT: Final = "surface.json"
FILES: Final = {
    "normals.png": "normals as colours, a texel a pixel",
    SHADED: "in the light of a lamp",
    "matcap.png": "in the material of a glazed ball",
    "overlay.png": "in the light of a lamp, with the strokes",
    "heights.npy": "heights at the corners of pixels",
    "surface.obj": "mesh with texture coordinates and normals",
    MATERIALS: "its material",
    DRAWING: "the strokes on paper, its texture",
    REPORT: "facts, doubts and freedom",
}
"""The files of a surface, and the content of each."""
_PAPER: Final = (0.93, 0.91, 0.88)
_MATERIAL: Final = "drawing"
_MTL: Final = f"newmtl {_MATERIAL}\nKa 0 0 0\nKd 1 1 1\nKs 0 0 0\nillum 1\nmap_Kd {DRAWING}\n"
_WALK: Final = [2, 3, 1, 0]  # corners of a pixel counter-clockwise, from the lower left


@check_arguments
def write_surface(
    surface: Surface,
    folder: str | Path,
    *,
    drawing: str | Path | Underlay | None = None,
    light: Light = UPPER_LEFT,
    scale: int | None = None,
    about: Mapping[str, Any] | None = None,
) -> Path:
    """Write a surface as pictures, heights, a mesh and a report. Equal surfaces give equal bytes.

    Every file is complete or absent, and the report is written last.

    Parameters
    ----------
    surface
        The surface.
    folder
        Folder to write to; created if it does not exist.
    drawing
        File or sample from which the instance was read, for the strokes; None shows a short line at each
        stroke pixel.
    light
        Position of the lamp.
    scale
        Pixels of a picture per pixel of the grid. None: 1 in the normal map, and in other pictures enough for
        about 1000 on the longer side.
    about
        Facts for the report on how the surface was made.

    Returns
    -------
    Path
        The folder.

    Raises
    ------
    InputError
        For a drawing that is unreadable or does not match the instance, and for a scale out of range.
    OutputError
        If a file cannot be written.

    """
    if drawing is not None and not isinstance(drawing, Underlay):
        drawing = read_underlay(drawing, on=surface.instance)
    fine = choose_scale(surface.instance, scale)
    folder = make_folder(folder)
    (folder / REPORT).unlink(missing_ok=True)
    normals = raster(surface.instance, surface.normals, fine)
    shaded, ink = shade_by_light(normals, light), draw_strokes(surface.instance, drawing, fine)
    paper = np.broadcast_to((*_PAPER, 1.0), ink.shape)
    pictures = {
        "normals.png": normal_map(surface.instance, surface.normals, scale or 1),
        SHADED: to_eight_bit(shaded),
        "matcap.png": to_eight_bit(matcap(normals)),
        "overlay.png": to_eight_bit(lay_over(ink, shaded)),
        DRAWING: to_eight_bit(lay_over(ink, paper)[..., :3]),
    }
    for name, picture in pictures.items():
        write_bytes(folder / name, encode_png(picture))
    heights = io.BytesIO()
    np.save(heights, surface.heights, allow_pickle=False)
    write_bytes(folder / "heights.npy", heights.getvalue())
    write_bytes(folder / MATERIALS, _MTL.encode())
    write_bytes(folder / "surface.obj", to_obj(surface, MATERIALS))
    document = surface_document(surface, about) | {"files": FILES}
    write_bytes(folder / REPORT, (json.dumps(document, indent=1, allow_nan=False) + "\n").encode())
    return folder


def write_shaded(surface: Surface, path: str | Path) -> Path:
    """Write a PNG of the surface in the light of a lamp, and return its path. Raises OutputError."""
    return write_bytes(
        path, encode_png(to_eight_bit(shade_by_light(raster(surface.instance, surface.normals))))
    )


def encode_png(picture: NDArray[np.uint8]) -> bytes:
    """A picture (h, w, 3 or 4) of red, green, blue and optional opacity as PNG."""
    from PIL import Image

    stream = io.BytesIO()
    Image.fromarray(picture).save(stream, "PNG")
    return stream.getvalue()


def draw_strokes(instance: Instance, drawing: Underlay | None, scale: int) -> Floats:
    """Red, green, blue and opacity (h, w, 4) in [0, 1] of the strokes of the drawing, or of the instance."""
    height, width = (side * scale for side in instance.mask.shape)
    with fixed_settings():
        drawn: Floats = render_sheet(strokes_sheet(instance, drawing), width, height) / 255.0
    return drawn


def lay_over(above: Floats, below: Floats) -> Floats:
    """One picture (h, w, 4) laid over another, both with opacity as fourth value."""
    front, back = above[..., 3:], below[..., 3:] * (1 - above[..., 3:])
    opacity = front + back
    colour = (front * above[..., :3] + back * below[..., :3]) / np.maximum(opacity, 1e-9)
    return np.concatenate([colour, opacity], axis=-1)


def surface_document(surface: Surface, about: Mapping[str, Any] | None = None) -> dict[str, Any]:
    """The report of a surface as JSON. about: how it was made, for instance the method of its field."""
    instance = surface.instance
    return {
        "format": "crossfield-surface",
        "version": 1,
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
        **(about or {}),
        **surface_facts(surface),
    }


def surface_facts(surface: Surface) -> dict[str, Any]:
    """Doubts about a surface, its freedom, and measurements in pixels and degrees."""
    off = np.degrees(right_angle_deviation(surface.field, surface.heights))
    slant = np.degrees(np.arccos(np.clip(surface.normals[:, 2], -1.0, 1.0)))
    numbers = {
        "confidence_mean": surface.confidence.mean(),
        "confidence_least_tenth": np.percentile(surface.confidence, 10),
        "right_angle_error_mean_degrees": off.mean(),
        "right_angle_error_90_percent_degrees": np.percentile(off, 90),
        "slant_mean_degrees": slant.mean(),
        "slant_most_degrees": slant.max(),
        "height_range_pixels": np.ptp(surface.corners),
    }
    return {
        "doubts": list(surface.doubts),
        "freedom": list(surface.freedom),
        **{name: round(float(value), 4) for name, value in numbers.items()},
    }


def to_obj(surface: Surface, materials: str) -> bytes:
    """The mesh as text. materials: name of the .mtl file in its folder."""
    instance = surface.instance
    places, corners = vertices_of(instance.grid)
    height, width = instance.mask.shape
    row, column = places.T
    points = np.column_stack([column, height - row, surface.heights[row, column]])
    texture = np.column_stack([column / width, 1 - row / height])
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
