"""Files of a drawing to take home, by the writers that the commands use."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Final

from ...models.arguments import check_choice
from ...models.errors import InputError
from ...models.field.file import write_field
from ...models.instance.file import write_instance
from ...models.storage import temporary_folder
from ..bundle.problem_files import write_all
from ..pictures.draw import draw
from ..surfaces.files import NORMALS, SHADED, write_layers, write_surface
from .document import Document, Stroke
from .session import compute_field, compute_surface, read_drawn, underlay_of

_EPOCH: Final = (1980, 1, 1, 0, 0, 0)  # of files in an archive: same drawing, same bytes
_COLOURS: Final = {"line": "red", "cut": "black"}


@dataclass(frozen=True)
class Download:
    """An entry of the menu: its text, and the function that writes files of a document into a folder."""

    title: str
    write: Callable[[Document, Path, str, str], Any]


def drawing_svg(document: Document) -> bytes:
    """The visible strokes as SVG, as wide as their weight, in red for curvature lines and black for cuts."""
    x, y, width, height = (f"{value:.12g}" for value in document.sheet)
    thick = max(document.page[2:]) / 400
    paths = [_stroke_svg(document.strokes[number], thick) for number in document.visible]
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" '
        f'viewBox="{x} {y} {width} {height}" fill="none" stroke-width="{thick:.4g}">'
    )
    return "\n".join([head, *paths, "</svg>", ""]).encode()


def _stroke_svg(stroke: Stroke, thick: float) -> str:
    points = " ".join(f"{value:.12g}" for value in stroke.points.ravel())
    share = 0.3 + 0.7 * stroke.weight  # of its width at full pressure, as in templates/studio/drawing.js
    width = f' stroke-width="{thick * share:.4g}"' if share < 1 else ""
    return f'<polyline stroke="{_COLOURS[stroke.mark]}"{width} points="{points}"/>'


def _write_layers(document: Document, folder: Path, *_: str) -> None:
    field = compute_field(document)[1]
    draw(field, folder / f"{document.name}.layers.svg", underlay=underlay_of(document, field.instance))


def _write_surface(document: Document, folder: Path, *_: str) -> None:
    lifted = compute_surface(document, compute_field(document)[1])
    write_surface(lifted, folder, drawing=underlay_of(document, lifted.instance))


def _write_picture(document: Document, folder: Path, *_: str, name: str) -> None:
    lifted = compute_surface(document, compute_field(document)[1])
    with temporary_folder() as temporary:
        write_layers(lifted, temporary, underlay_of(document, lifted.instance))
        (temporary / name).replace(folder / f"{document.name}.{name}")


def _write_solver_files(document: Document, folder: Path, formulation: str, form: str) -> None:
    drawn, field = compute_field(document)
    manifests = write_all(drawn.instance, folder, formulations=[formulation], formats=[form], start=field)
    for reason in manifests[0].document["refused"].values():
        raise InputError(reason)


DOWNLOADS: Final = {
    "drawing": Download(
        "Drawing (SVG)",
        lambda document, folder, *_: (folder / f"{document.name}.svg").write_bytes(drawing_svg(document)),
    ),
    "layers": Download("Field in layers (SVG)", _write_layers),
    "overview": Download(
        "Overview (PNG)",
        lambda document, folder, *_: draw(
            compute_field(document)[1], folder / f"{document.name}.png", kind="overview"
        ),
    ),
    "normals": Download("Normal map (PNG)", partial(_write_picture, name=NORMALS)),
    "shaded": Download("Shaded surface (PNG)", partial(_write_picture, name=SHADED)),
    "surface": Download("Surface (OBJ, heights, pictures)", _write_surface),
    "field": Download(
        "Field (NPZ)",
        lambda document, folder, *_: write_field(
            compute_field(document)[1], folder / f"{document.name}.field.npz"
        ),
    ),
    "instance": Download(
        "Instance (JSON)",
        lambda document, folder, *_: write_instance(
            read_drawn(document).instance, folder / f"{document.name}.json"
        ),
    ),
    "solver": Download("Solver files", _write_solver_files),
}
"""The entries of the menu by name."""


def download(data: bytes, kind: str, formulation: str = "", form: str = "") -> tuple[str, bytes]:
    """Name and content of the file of an entry; several files are one archive. Raises InputError."""
    check_choice("download", kind, DOWNLOADS)
    document = Document.from_bytes(data)
    with temporary_folder() as folder:
        DOWNLOADS[kind].write(document, folder, formulation, form)
        files = sorted(path for path in folder.rglob("[!.]*") if path.is_file())
        if len(files) == 1:
            return files[0].name, files[0].read_bytes()
        return f"{document.name}.{kind}.zip", _pack_files(files, folder)


def _pack_files(files: list[Path], folder: Path) -> bytes:
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
        for path in files:
            entry = zipfile.ZipInfo(path.relative_to(folder).as_posix(), _EPOCH)
            archive.writestr(entry, path.read_bytes(), zipfile.ZIP_DEFLATED)
    return stream.getvalue()
