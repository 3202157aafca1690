"""The gallery, docs/gallery.md: a thumbnail of every sample (`python docs/make.py gallery`)."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import crossfield as cf
from crossfield.export.pictures.mesh_view import draw_mesh
from crossfield.models.samples.samples import samples
from crossfield.models.sketch.samples import SAMPLES
from crossfield.models.smooth.bend import surface_field

DOCS: Final = Path(__file__).resolve().parent
DRAWINGS: Final = DOCS.parent / "tests" / "data" / "drawings"
SIZE: Final = 48
OTHERS: Final = ("dark-table.jpg", "hachure.svg", "ruled.svg")
"""Drawings of other programs, with pictures of their own."""
TITLES: Final = {
    "sketch": "Sketches",
    "analytic": "Computed surfaces",
    "mesh": "Meshes",
    "drawing": "Drawings of other programs",
}
SHORT: Final = """\
Use the name of a sample in place of a sketch or mesh: `crossfield shade mouse --size 48 -o out`
computes the surface of a drawing, and `crossfield solve cube --method search -o out` the field of a mesh. The
pictures show drawing, field and surface, or mesh and field."""


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
        return surface_field(instance)


def entries() -> list[Entry]:
    """All samples, and some drawings of other programs."""
    drawn = [name for name, entry in SAMPLES.items() if entry.kind == "sketch"]
    built_in = [
        Entry(entry.name, entry.kind, entry.description, entry.name if entry.name in drawn else None)
        for entry in samples()
    ]
    rows = {row["file"]: row for row in tomllib.loads((DRAWINGS / "drawings.toml").read_text())["drawing"]}
    return built_in + [
        Entry(name, "drawing", f"{rows[name]['shows']} ({rows[name]['program']})", DRAWINGS / name)
        for name in OTHERS
    ]


def write_page() -> None:
    """Write docs/gallery.md and its thumbnails."""
    import diagrams

    parts = ["# Gallery", SHORT]
    for kind, title in TITLES.items():
        lines = []
        for entry in (entry for entry in entries() if entry.kind == kind):
            path = DOCS / "pictures" / f"{Path(entry.name).stem}.png"
            if kind == "mesh":
                field, side = entry.field, 230.0
                shown = [draw_mesh(subject, side) for subject in (field.instance, field)]
                diagrams.save_thumbnail([diagrams.page_of([mark], side, side) for mark in shown], path, 64)
            else:
                diagrams.draw_thumbnail(entry.field, entry.drawing, path)
            first = entry.description.partition(";")[0]
            description = f"{first[0].upper()}{first[1:]}."
            lines.append(f"- ![{entry.name}](pictures/{path.name})\n\n  **`{entry.name}`** {description}")
        parts += [f"## {title}", "\n".join(lines)]
    (DOCS / "gallery.md").write_text("\n\n".join(parts) + "\n")
