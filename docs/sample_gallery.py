"""The gallery, docs/gallery.md: a thumbnail of every sample, and an archive of its files.

`python docs/make.py gallery` writes page and thumbnails. As a Sphinx extension, this module makes the
archives, and adds a link to each below its thumbnail.
"""

from __future__ import annotations

import io
import tempfile
import tomllib
import zipfile
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import crossfield as cf
from crossfield.export.pictures.draw import fixed_settings
from crossfield.export.pictures.mesh_view import draw_mesh
from crossfield.models.sketch.samples import SAMPLES
from crossfield.models.smooth.polyvector import HOLDS
from matplotlib.figure import Figure
from PIL import Image

if TYPE_CHECKING:
    from docutils.nodes import document
    from sphinx.application import Sphinx

DOCS: Final = Path(__file__).resolve().parent
DRAWINGS: Final = DOCS.parent / "tests" / "data" / "drawings"
SIZE: Final = 48
SIDE: Final = 600
"""Pixels of the longer side of the layers in an archive."""
OTHERS: Final = ("dark-table.jpg", "hachure.svg", "ruled.svg")
"""Drawings of other programs, with pictures of their own."""
TITLES: Final = {
    "sketch": "Sketches",
    "analytic": "Computed surfaces",
    "mesh": "Meshes",
    "drawing": "Drawings of other programs",
}
SHORT: Final = """Use the name of a sample in place of a sketch or mesh:

- `crossfield solve mouse --size 48 --method bend -o out` makes the field of a drawing or computed surface,
  and `crossfield shade out/mouse.bend.field.npz -o out` the surface;
- `crossfield solve cube --method search -o out` makes the field of a mesh.

On the site, *Files* holds the field, the surface and the layers. [Drawings of many programs](drawings.md)
has more drawings."""


@dataclass(frozen=True)
class Entry:
    """A thumbnail: its name, heading and description. drawing: the file or sample that is drawn, or None."""

    name: str
    kind: str
    description: str
    drawing: str | Path | None = None

    @property
    def field(self) -> cf.CrossField:
        """The field of the thumbnail."""
        if self.kind == "mesh":
            return cf.search(cf.sample(self.name), rounds=3).field
        instance = (
            cf.read_sketch(self.drawing, size=SIZE)
            if isinstance(self.drawing, Path)
            else cf.sample(self.name, SIZE)
        )
        return cf.bend_field(cf.polyvector_field(instance, hold=max(HOLDS)))


def entries() -> list[Entry]:
    """All samples, and some drawings of other programs."""
    drawn = [name for name, entry in SAMPLES.items() if entry.kind == "sketch"]
    samples = [
        Entry(entry.name, entry.kind, entry.description, entry.name if entry.name in drawn else None)
        for entry in cf.samples()
    ]
    rows = {row["file"]: row for row in tomllib.loads((DRAWINGS / "drawings.toml").read_text())["drawing"]}
    return samples + [
        Entry(name, "drawing", f"{rows[name]['shows']} ({rows[name]['program']})", DRAWINGS / name)
        for name in OTHERS
    ]


def write_page() -> None:
    """Write docs/gallery.md and its thumbnails."""
    import diagrams
    from make import generated_line

    parts = ["# Gallery", generated_line("python docs/make.py gallery"), SHORT]
    for kind, title in TITLES.items():
        lines = []
        for entry in (entry for entry in entries() if entry.kind == kind):
            path = DOCS / "pictures" / f"{Path(entry.name).stem}.png"
            if kind == "mesh":
                draw_mesh_thumbnail(entry.field, path)
            else:
                diagrams.draw_thumbnail(entry.field, entry.drawing, path)
            description = f"{entry.description[0].upper()}{entry.description[1:]}."
            lines.append(f"- ![{entry.name}](pictures/{path.name})\n\n  **`{entry.name}`** {description}")
        parts += [f"## {title}", "\n".join(lines)]
    (DOCS / "gallery.md").write_text("\n\n".join(parts) + "\n")


def draw_mesh_thumbnail(field: cf.CrossField, path: Path) -> None:
    """Draw the strokes of a mesh, and its field, as a PNG."""
    with fixed_settings():
        figure = Figure(figsize=(6.4, 3.2), facecolor="white")
        for left, subject in ((0.0, field.instance), (0.5, field)):
            draw_mesh(figure.add_axes((left, 0.0, 0.5, 1.0)), subject)
        stream = io.BytesIO()
        figure.savefig(stream, dpi=110, metadata={"Software": None})
    with Image.open(stream) as picture:
        picture.convert("RGB").quantize(64, dither=Image.Dither.NONE).save(path, optimize=True)


def archive(entry: Entry) -> bytes:
    """A ZIP with the field, and the surface and layers of a drawing."""
    field = entry.field
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        cf.write_field(field, folder / "field.npz")
        if entry.kind == "mesh":
            cf.write_field(field, folder / "field.vtk")
        else:
            cf.write_surface(cf.surface(field), folder, drawing=entry.drawing, side=SIDE)
            cf.draw(field, folder / "overlay.svg", underlay=entry.drawing)
        stream = io.BytesIO()
        with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as files:
            for path in sorted(folder.glob("[!.]*")):
                files.writestr(zipfile.ZipInfo(path.name), path.read_bytes(), zipfile.ZIP_DEFLATED)
    return stream.getvalue()


def link_archives(_: Sphinx, doctree: document, name: str) -> None:
    """Add a link to its archive to the text below each thumbnail."""
    from docutils.nodes import Text, image, list_item, reference

    if name == "gallery":
        cards = [item for item in doctree.findall(list_item) if any(item.findall(image))]
        for entry, item in zip(entries(), cards, strict=True):
            next(item.findall(image))["loading"] = "lazy"
            item[-1] += [Text(" "), reference("", "Files", refuri=f"gallery/{entry.name}.zip")]


def write_archives(app: Sphinx, problem: Exception | None) -> None:
    """Write the archives of a site that was built."""
    folder = Path(app.outdir) / "gallery"
    if problem is None and app.builder.name == "html":
        folder.mkdir(exist_ok=True)
        for entry in entries():
            if not (path := folder / f"{entry.name}.zip").exists():
                path.write_bytes(archive(entry))


def setup(app: Sphinx) -> dict[str, Any]:
    """Add links and archives."""
    app.connect("doctree-resolved", link_archives)
    app.connect("build-finished", write_archives)
    return {"parallel_read_safe": True}
